//! Adaptive clustering by an octree, for any triangles whatever: a cell's vertices become one where one vertex is near to all of the
//! planes round them, or else the cell is cut in eight. Two vertices of a cell that no edges within it join do not become one.
//!
//! Decided once for all errors: a tree of the sets of vertices that hold together in the cells of each depth, each with its error and its
//! best place. A limit on the error cuts the tree; so many triangles are found by bisection.

use super::cluster::{BoundaryEdge, boundary_edges, merge, surviving};
use super::quadric::{Form, Quadric};
use super::star::relative;
use super::working::Working;
use super::{Options, Pass, Ticker};
use crate::error::Result;
use crate::mesh::lattice;
use glam::DVec3;

/// Clusters with the least error that leaves at most `faces` triangles.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(super) fn run(
    working: &mut Working,
    faces: usize,
    options: &Options,
    ticker: &mut Ticker,
) -> Result<Vec<Pass>> {
    let (vertices, triangles) = (working.positions.len(), working.living);
    if triangles <= faces {
        return Ok(Vec::new());
    }
    let tree = Tree::grow(working, options, ticker)?;
    let mut errors: Vec<f64> = tree.nodes.iter().map(|node| node.error).filter(|e| e.is_finite()).collect();
    errors.sort_unstable_by(f64::total_cmp);
    errors.dedup();
    // The first error that leaves few enough, or the last.
    let few = errors.partition_point(|&most| {
        let clusters = tree.cut(most);
        surviving(&working.triangles, |v| clusters[tree.leaves[v as usize] as usize]) > faces
    });
    let clusters = tree.cut(errors.get(few).or(errors.last()).copied().unwrap_or(0.0));
    // Numbered anew, those that there are.
    let mut names = vec![u32::MAX; tree.nodes.len()];
    let mut places = Vec::new();
    let map: Vec<u32> = tree.leaves.iter().map(|&leaf| clusters[leaf as usize]).collect();
    for &cluster in &map {
        if names[cluster as usize] == u32::MAX {
            names[cluster as usize] = places.len() as u32;
            places.push(tree.nodes[cluster as usize].place);
        }
    }
    let contractions = vertices - places.len();
    merge(working, |v| names[map[v as usize] as usize], places);
    Ok(vec![Pass { vertices, triangles, contractions }])
}

/// A set of vertices in a cell that edges within the cell join.
struct Node {
    /// The set that it is a part of; itself at the top.
    parent: u32,
    /// The sum of squared distances of its place from its planes; infinite where it must be parted.
    error: f64,
    place: [f64; 3],
}

struct Tree {
    /// Parents before their parts.
    nodes: Vec<Node>,
    /// For each vertex the smallest set that it is in.
    leaves: Vec<u32>,
}

impl Tree {
    fn grow(working: &mut Working, options: &Options, ticker: &mut Ticker) -> Result<Self> {
        let boundary = boundary_edges(working);
        let (min, max) = lattice::bounds(working.positions.iter().copied()).unwrap_or_default();
        let longest = (0..3).map(|k| max[k] - min[k]).fold(0.0, f64::max);
        let scale = if longest > 0.0 { f64::from(1 << DEPTH) / longest } else { 0.0 };
        let path = |p: &[f64; 3]| -> [u32; 3] {
            std::array::from_fn(|k| (((p[k] - min[k]) * scale) as u32).min((1 << DEPTH) - 1))
        };
        let paths: Vec<[u32; 3]> = working.positions.iter().map(path).collect();
        let planes = Planes { working, boundary, origin: min, options };
        let vertices = paths.len();
        let mut tree = Self { nodes: Vec::new(), leaves: vec![u32::MAX; vertices] };
        // Sets at the depth before, and parts of them.
        let mut depth = 0;
        let mut alive = vertices > 0;
        while alive {
            ticker.tell(planes.working.living)?;
            let octant = |v: u32| match depth {
                0 => [0; 3],
                _ => paths[v as usize].map(|x| x >> (DEPTH - depth) & 1),
            };
            let first = tree.nodes.len() as u32;
            let labels = tree.parts(&planes, octant, depth == 0);
            let size = longest / f64::from(1 << depth);
            let sizes = planes.solve(&mut tree.nodes[first as usize..], &labels, size);
            // A vertex alone is as small as it can be; and at the last depth all are.
            alive = false;
            for (v, label) in labels.iter().enumerate() {
                if let Some(label) = *label {
                    tree.leaves[v] = first + label;
                    alive |= sizes[label as usize] > 1;
                }
            }
            if depth == DEPTH {
                alive = false;
                tree.nodes[first as usize..].iter_mut().for_each(|node| node.error = 0.0);
            }
            tree.settled(first, &sizes);
            depth += 1;
        }
        Ok(tree)
    }

    /// Parts the sets that are not settled by octants and by what holds together in them. Returns for each vertex the number of its part.
    fn parts(&mut self, planes: &Planes, octant: impl Fn(u32) -> [u32; 3], is_top: bool) -> Vec<Option<u32>> {
        let vertices = self.leaves.len();
        let mut sets: Vec<u32> = (0..vertices as u32).collect();
        let find = |sets: &mut Vec<u32>, mut v: u32| {
            while sets[v as usize] != v {
                sets[v as usize] = sets[sets[v as usize] as usize];
                v = sets[v as usize];
            }
            v
        };
        for triangle in &planes.working.triangles {
            for k in 0..3 {
                let [a, b] = [triangle[k], triangle[(k + 1) % 3]];
                if (is_top || self.leaves[a as usize] == self.leaves[b as usize]) && octant(a) == octant(b) {
                    let [x, y] = [a, b].map(|v| find(&mut sets, v));
                    sets[x.max(y) as usize] = x.min(y);
                }
            }
        }
        let first = self.nodes.len() as u32;
        let mut labels: Vec<Option<u32>> = vec![None; vertices];
        for v in 0..vertices as u32 {
            let parent = self.leaves[v as usize];
            if !is_top && self.nodes[parent as usize].error == 0.0 {
                continue;
            }
            let root = find(&mut sets, v);
            if root == v {
                let number = self.nodes.len() as u32;
                labels[v as usize] = Some(number - first);
                let parent = if is_top { number } else { parent };
                self.nodes.push(Node { parent, error: 0.0, place: planes.working.positions[v as usize] });
            } else {
                labels[v as usize] = labels[root as usize];
            }
        }
        labels
    }

    /// A vertex alone has no error.
    fn settled(&mut self, first: u32, sizes: &[u32]) {
        for (node, &size) in self.nodes[first as usize..].iter_mut().zip(sizes) {
            if size == 1 {
                node.error = 0.0;
            }
        }
    }

    /// For each set the largest one that it is in, or is, whose error is at most this; the set itself where there is none.
    fn cut(&self, most: f64) -> Vec<u32> {
        let mut clusters: Vec<u32> = Vec::with_capacity(self.nodes.len());
        for (number, node) in (0..).zip(&self.nodes) {
            let above = if node.parent == number { number } else { clusters[node.parent as usize] };
            let is_taken = above != number && self.nodes[above as usize].error <= most;
            clusters.push(if is_taken { above } else { number });
        }
        clusters
    }
}

/// What the errors are made of.
struct Planes<'a> {
    working: &'a Working,
    boundary: Vec<BoundaryEdge>,
    origin: [f64; 3],
    options: &'a Options,
}

impl Planes<'_> {
    /// Finds place and error of each set from the planes of the triangles with a vertex in it, each once, and of the boundary's edges.
    /// Returns how many vertices each has.
    fn solve(&self, nodes: &mut [Node], labels: &[Option<u32>], size: f64) -> Vec<u32> {
        let mut sizes = vec![0; nodes.len()];
        let mut centres = vec![DVec3::ZERO; nodes.len()];
        for (v, label) in labels.iter().enumerate() {
            if let Some(label) = *label {
                sizes[label as usize] += 1;
                centres[label as usize] += self.at(v as u32);
            }
        }
        let mut sums = vec![Quadric::default(); nodes.len()];
        let add = |sums: &mut [Quadric], vertices: &[u32], form: Form, point: DVec3| {
            let plane = Quadric::through(form, point);
            for (k, &v) in vertices.iter().enumerate() {
                let label = labels[v as usize];
                if let Some(label) = label
                    && vertices[..k].iter().all(|&before| labels[before as usize] != Some(label))
                {
                    sums[label as usize] += plane;
                }
            }
        };
        for triangle in &self.working.triangles {
            let [a, b, c] = triangle.map(|v| self.at(v));
            let mut form = Form::default();
            form.add_triangle((b - a).cross(c - a), self.options.weights);
            add(&mut sums, triangle, form, a);
        }
        for edge in &self.boundary {
            let [a, b] = edge.ends.map(|v| self.at(v));
            let mut form = Form::default();
            form.add_boundary(b - a, edge.cross, self.options.weights);
            add(&mut sums, &edge.ends, form, a);
        }
        let sums = match self.options.both_errors {
            true => self.with_moved_planes(sums, &centres, &sizes, labels, size),
            false => sums,
        };
        let mut best: Vec<(f64, DVec3)> = Vec::with_capacity(nodes.len());
        let mut is_solved = vec![true; nodes.len()];
        for (k, sum) in sums.iter().enumerate() {
            let centre = centres[k] / f64::from(sizes[k].max(1));
            let optimum = optimum(sum, centre, size);
            is_solved[k] = optimum.is_some();
            let place = centre + optimum.unwrap_or_default();
            best.push((sum.at(place), place));
        }
        // Without an optimum the best of all vertices and the centre.
        for (v, label) in labels.iter().enumerate() {
            let Some(label) = label.map(|label| label as usize).filter(|&label| !is_solved[label]) else {
                continue;
            };
            let at = self.at(v as u32);
            let cost = sums[label].at(at);
            if cost < best[label].0 {
                best[label] = (cost, at);
            }
        }
        for ((node, (error, place)), &size) in nodes.iter_mut().zip(best).zip(&sizes) {
            if size > 1 {
                // No error at all would be taken for a vertex alone.
                node.error = error.max(f64::MIN_POSITIVE);
                node.place = std::array::from_fn(|k| place[k] + self.origin[k]);
            }
        }
        if self.options.strict_normals {
            self.part_opposed(nodes, labels);
        }
        sizes
    }

    /// Adds what the old vertices are off the new triangles, which hang on the place: from three rounds (the second error, iterated).
    ///
    /// Of a triangle with one corner `v` in the set, which moves to `p`, the squared distance of `v` from the new plane is that of `p` from the old one times
    /// the square of the old area over the new one.
    fn with_moved_planes(
        &self,
        planes: Vec<Quadric>,
        centres: &[DVec3],
        sizes: &[u32],
        labels: &[Option<u32>],
        size: f64,
    ) -> Vec<Quadric> {
        let mut sums = planes.clone();
        for _ in 0..ROUNDS {
            let place = |(k, sum): (usize, &Quadric)| {
                let centre = centres[k] / f64::from(sizes[k].max(1));
                centre + optimum(sum, centre, size).unwrap_or_default()
            };
            let places: Vec<DVec3> = sums.iter().enumerate().map(place).collect();
            sums.clone_from(&planes);
            for triangle in &self.working.triangles {
                let at = triangle.map(|v| self.at(v));
                let set = triangle.map(|v| labels[v as usize]);
                for k in 0..3 {
                    let Some(label) = set[k] else { continue };
                    if set[(k + 1) % 3] == set[k] || set[(k + 2) % 3] == set[k] {
                        continue;
                    }
                    let [a, b] = [at[(k + 1) % 3], at[(k + 2) % 3]];
                    let normal = |p: DVec3| (a - p).cross(b - p);
                    let (old, new) = (normal(at[k]), normal(places[label as usize]));
                    let ratio = (old.length_squared() / new.length_squared()).min(MOST_RATIO);
                    if ratio.is_finite() {
                        let mut form = Form::default();
                        form.add_triangle(old, self.options.weights);
                        sums[label as usize] += Quadric::through(form.scaled(ratio), at[k]);
                    }
                }
            }
        }
        sums
    }

    /// Sets round which some triangle looks away from the others are to be parted, whatever their error.
    fn part_opposed(&self, nodes: &mut [Node], labels: &[Option<u32>]) {
        let cross = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|v| self.at(v));
            (b - a).cross(c - a)
        };
        let mut sums = vec![DVec3::ZERO; nodes.len()];
        let triangles = &self.working.triangles;
        for triangle in triangles {
            let cross = cross(triangle);
            triangle
                .iter()
                .filter_map(|&v| labels[v as usize])
                .for_each(|label| sums[label as usize] += cross);
        }
        for triangle in triangles {
            let cross = cross(triangle);
            for label in triangle.iter().filter_map(|&v| labels[v as usize]) {
                let node = &mut nodes[label as usize];
                if sums[label as usize].dot(cross) < 0.0 && node.error > 0.0 {
                    node.error = f64::INFINITY;
                }
            }
        }
    }

    fn at(&self, v: u32) -> DVec3 {
        relative(self.working.positions[v as usize], self.origin)
    }
}

/// Where a sum is least, relative to a set's centre, unless that is outside: farther than a cell and a quarter.
fn optimum(sum: &Quadric, centre: DVec3, size: f64) -> Option<DVec3> {
    sum.optimum(centre, SINGULAR).filter(|d| d.abs().max_element() <= 1.25 * size)
}

/// Rounds of the second error: some sets go round in circles.
const ROUNDS: usize = 3;
/// A triangle that shrinks to nothing counts so many times its plane, at most.
const MOST_RATIO: f64 = 100.0;
/// How often cells are halved, at most.
const DEPTH: u32 = 21;
/// As of contractions, but stricter: sets are larger than stars.
const SINGULAR: f64 = 1e-4;
