//! Adaptive clustering by an octree, for any triangles whatever: a cell's vertices become one where one vertex is near to all of the
//! planes round them, or else the cell is cut. Two vertices of a cell that no edges within it join do not become one.
//!
//! Decided once for all errors: a tree of the sets of vertices that hold together in the cells of each depth, each with its error and its
//! best place. A limit on the error cuts the tree; so many triangles are found by bisection.
//!
//! Beyond cutting in eight, which large cells are: a cell is halved, across the side along which its triangles turn most, as their normals
//! tell (Shaffer and Garland 2001 cut so, by any plane). So sets are long where the surface is bent one way alone, and have all sizes and not each fourth.

use super::cluster::{BoundaryEdge, boundary_edges, merge, surviving};
use super::quadric::{Form, Quadric, Weights};
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
    let tree = Tree::grow(working, faces, options, ticker)?;
    let mut errors: Vec<f64> = tree.nodes.iter().map(|node| node.error).filter(|e| e.is_finite()).collect();
    errors.sort_unstable_by(f64::total_cmp);
    errors.dedup();
    // The first error that leaves few enough, or the last. No limit leaves a triangle within one of the smallest sets.
    let apart = tree.apart(&working.triangles);
    let few = errors.partition_point(|&most| tree.leaves_more(most, faces, &apart));
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
    /// The same, but no more than that of any set that it is in: a limit below it parts this one.
    least: f64,
    place: [f64; 3],
    /// How often its cell has been halved along each axis, and along which of them it is to be cut next.
    cuts: [u32; 3],
    axes: [bool; 3],
    /// Its parts.
    parts: u32,
    /// Whether there is no need to part it.
    is_settled: bool,
}

impl Node {
    fn cuts_of_parts(&self) -> [u32; 3] {
        std::array::from_fn(|k| self.cuts[k] + u32::from(self.axes[k]))
    }
}

struct Tree {
    /// Parents before their parts.
    nodes: Vec<Node>,
    /// For each vertex the smallest set that it is in.
    leaves: Vec<u32>,
    /// Sets that are in no other.
    roots: usize,
}

impl Tree {
    /// Parts sets until no limit that leaves at least `faces` triangles could part another one.
    fn grow(working: &mut Working, faces: usize, options: &Options, ticker: &mut Ticker) -> Result<Self> {
        let boundary = boundary_edges(working);
        let (min, max) = lattice::bounds(working.positions.iter().copied()).unwrap_or_default();
        let longest = (0..3).map(|k| max[k] - min[k]).fold(0.0, f64::max);
        let scale = if longest > 0.0 { f64::from(1 << DEPTH) / longest } else { 0.0 };
        let path = |p: &[f64; 3]| -> [u32; 3] {
            std::array::from_fn(|k| (((p[k] - min[k]) * scale) as u32).min((1 << DEPTH) - 1))
        };
        let paths: Vec<[u32; 3]> = working.positions.iter().map(path).collect();
        let triangles = (0..working.triangles.len() as u32).collect();
        let mut planes = Planes { working, boundary, origin: min, options, longest, triangles };
        let vertices = paths.len();
        let mut tree = Self { nodes: Vec::new(), leaves: vec![u32::MAX; vertices], roots: 0 };
        let mut is_top = true;
        while is_top && vertices > 0 || !planes.triangles.is_empty() {
            ticker.tell(planes.working.living)?;
            let first = tree.nodes.len() as u32;
            let labels = tree.parts(&planes, &paths, is_top);
            let are_few = tree.nodes.len() < faces / FEW;
            planes.solve(&mut tree.nodes[first as usize..], &labels, are_few);
            for (leaf, &label) in tree.leaves.iter_mut().zip(&labels).filter(|(_, label)| **label != NO_SET) {
                *leaf = first + label;
            }
            if is_top {
                tree.roots = tree.nodes.len();
            }
            tree.settle(first as usize, is_top, faces, &planes.working.triangles);
            is_top = false;
            let Self { nodes, leaves, .. } = &tree;
            let has_more = |v: u32| !nodes[leaves[v as usize] as usize].is_settled;
            let Planes { triangles, boundary, working, .. } = &mut planes;
            triangles.retain(|&t| working.triangles[t as usize].into_iter().any(has_more));
            boundary.retain(|edge| edge.ends.into_iter().any(has_more));
        }
        Ok(tree)
    }

    /// Tells the new sets, from `first` on, what limits part them, and which of all sets no limit needs to part: where one leaves too many
    /// triangles as it is, those that it does not part. Which that may be is guessed by the number of sets, which is a half of that of triangles
    /// where these hang together, and more than that where most are alone.
    fn settle(&mut self, first: usize, is_top: bool, faces: usize, triangles: &[[u32; 3]]) {
        for number in first..self.nodes.len() {
            let Node { parent, error, .. } = self.nodes[number];
            let above = if is_top { f64::INFINITY } else { self.nodes[parent as usize].least };
            self.nodes[number].least = error.min(above);
        }
        let parted = self.nodes.iter().filter(|node| node.parts > 1);
        let mut parted: Vec<(f64, u32)> = parted.map(|node| (node.least, node.parts - 1)).collect();
        parted.sort_unstable_by(|x, y| y.0.total_cmp(&x.0));
        // The limit that parts so many sets.
        let limit = |most: f64| {
            let mut count = self.roots;
            let enough = parted.iter().find(|(_, more)| {
                count += *more as usize;
                count as f64 > most
            });
            enough.map(|(limit, _)| *limit).filter(|limit| limit.is_finite())
        };
        let mut apart = Vec::new();
        for guess in GUESSES {
            let Some(limit) = limit(guess * faces as f64) else { continue };
            if apart.is_empty() {
                apart = self.apart(triangles);
            }
            if self.leaves_more(limit, faces, &apart) {
                self.nodes
                    .iter_mut()
                    .filter(|node| node.least <= limit)
                    .for_each(|node| node.is_settled = true);
                return;
            }
        }
    }

    /// The triangles whose vertices are in three of the smallest sets, by these.
    fn apart(&self, triangles: &[[u32; 3]]) -> Vec<[u32; 3]> {
        let sets = triangles.iter().map(|triangle| triangle.map(|v| self.leaves[v as usize]));
        sets.filter(|[a, b, c]| a != b && b != c && c != a).collect()
    }

    /// Whether a limit leaves more than so many of the triangles that are `apart`.
    fn leaves_more(&self, most: f64, faces: usize, apart: &[[u32; 3]]) -> bool {
        let clusters = self.cut(most);
        surviving(apart, |set| clusters[set as usize]) > faces
    }

    /// Parts the sets that are not settled by the halves of their cells and by what holds together in them. Returns for each vertex the number
    /// of its part, or [`NO_SET`].
    fn parts(&mut self, planes: &Planes, paths: &[[u32; 3]], is_top: bool) -> Vec<u32> {
        // Set and half.
        let cell = |(&leaf, path): (&u32, &[u32; 3])| {
            let Some(Node { cuts, axes, .. }) = self.nodes.get(leaf as usize) else { return 0 };
            let bit = |k: usize| if axes[k] { path[k] >> (DEPTH - 1 - cuts[k]) & 1 } else { 0 };
            u64::from(leaf) << 3 | u64::from(bit(0) | bit(1) << 1 | bit(2) << 2)
        };
        let cells: Vec<u64> = self.leaves.iter().zip(paths).map(cell).collect();
        let vertices = self.leaves.len();
        let mut sets: Vec<u32> = (0..vertices as u32).collect();
        let find = |sets: &mut Vec<u32>, mut v: u32| {
            while sets[v as usize] != v {
                sets[v as usize] = sets[sets[v as usize] as usize];
                v = sets[v as usize];
            }
            v
        };
        for &t in &planes.triangles {
            let [a, b, c] = planes.working.triangles[t as usize];
            let [at_a, at_b, at_c] = [a, b, c].map(|v| cells[v as usize]);
            let mut join = |a: u32, b: u32| {
                let [x, y] = [a, b].map(|v| find(&mut sets, v));
                sets[x.max(y) as usize] = x.min(y);
            };
            if at_a == at_b {
                join(a, b);
            }
            if at_b == at_c {
                join(b, c);
            } else if at_c == at_a {
                join(c, a);
            }
        }
        let first = self.nodes.len() as u32;
        let mut labels = vec![NO_SET; vertices];
        for v in 0..vertices as u32 {
            let parent = self.leaves[v as usize];
            if !is_top && self.nodes[parent as usize].is_settled {
                continue;
            }
            let root = find(&mut sets, v);
            if root == v {
                let number = self.nodes.len() as u32;
                labels[v as usize] = number - first;
                let mut cuts = [0; 3];
                if let Some(above) = self.nodes.get_mut(parent as usize) {
                    above.parts += 1;
                    cuts = above.cuts_of_parts();
                }
                self.nodes.push(Node {
                    parent: if is_top { number } else { parent },
                    error: 0.0,
                    least: 0.0,
                    place: planes.working.positions[v as usize],
                    cuts,
                    axes: [false; 3],
                    parts: 0,
                    is_settled: false,
                });
            } else {
                labels[v as usize] = labels[root as usize];
            }
        }
        labels
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
    /// The side of the whole.
    longest: f64,
    /// Triangles with a vertex in a set that is not settled.
    triangles: Vec<u32>,
}

/// How the triangles of a set turn.
#[derive(Clone, Copy, Default)]
struct Turning {
    /// What their planes count in all; the sum of that times the normals, and times the squares of their coordinates.
    weight: f64,
    normals: DVec3,
    squares: DVec3,
    /// The corners of the box round its vertices.
    box_of: [DVec3; 2],
}

impl Turning {
    /// The axis along which they turn most, as far as it is to be halved; of those that do not turn the longest.
    fn axis(&self, cuts: [u32; 3]) -> Option<usize> {
        let extent = self.box_of[1] - self.box_of[0];
        let spread = self.squares - self.normals * self.normals / self.weight.max(f64::MIN_POSITIVE);
        let bend = (spread * extent * extent).to_array();
        let extent = extent.to_array();
        let halves = (0..3).filter(|&k| cuts[k] < DEPTH && extent[k] > 0.0);
        halves.max_by(|&i, &j| bend[i].total_cmp(&bend[j]).then(extent[i].total_cmp(&extent[j])))
    }
}

impl Planes<'_> {
    /// Finds place and error of each set from the planes of the triangles with a vertex in it, each once, and of the boundary's edges, and how
    /// its cell is to be cut: in eight where sets `are_few`.
    fn solve(&self, nodes: &mut [Node], labels: &[u32], are_few: bool) {
        let mut turning =
            vec![
                Turning { box_of: [DVec3::INFINITY, DVec3::NEG_INFINITY], ..Turning::default() };
                nodes.len()
            ];
        let mut sizes = vec![0; nodes.len()];
        let mut centres = vec![DVec3::ZERO; nodes.len()];
        for (v, &label) in labels.iter().enumerate().filter(|(_, label)| **label != NO_SET) {
            sizes[label as usize] += 1;
            let at = self.at(v as u32);
            centres[label as usize] += at;
            let [low, high] = &mut turning[label as usize].box_of;
            (*low, *high) = (low.min(at), high.max(at));
        }
        // Cells that are halved may be a thousand times as long as wide, with all their vertices in one plane.
        let size = |(node, turning): (&Node, &Turning)| match (self.options.eighths, turning.box_of) {
            (true, _) => self.longest / f64::from(1u32 << node.cuts[0]),
            (false, [low, high]) => (high - low).max_element().max(0.0),
        };
        let cell: Vec<f64> = nodes.iter().zip(&turning).map(size).collect();
        let mut sums = vec![Quadric::default(); nodes.len()];
        for &t in &self.triangles {
            let triangle = &self.working.triangles[t as usize];
            let [a, b, c] = triangle.map(|v| self.at(v));
            let cross = (b - a).cross(c - a);
            let mut form = Form::default();
            form.add_triangle(cross, self.options.weights);
            let plane = Quadric::through(form, a);
            // What is as long as the plane counts.
            let normal = match self.options.weights {
                Weights::Area => cross * 0.5,
                Weights::Unit => cross.normalize_or_zero(),
            };
            let length = normal.length();
            let squares = normal * normal / length.max(f64::MIN_POSITIVE);
            for label in distinct(triangle.map(|v| labels[v as usize])) {
                sums[label as usize] += plane;
                if !self.options.eighths {
                    let turning = &mut turning[label as usize];
                    turning.weight += length;
                    turning.normals += normal;
                    turning.squares += squares;
                }
            }
        }
        for edge in &self.boundary {
            let [a, b] = edge.ends.map(|v| self.at(v));
            let mut form = Form::default();
            form.add_boundary(b - a, edge.cross, self.options.weights);
            let plane = Quadric::through(form, a);
            let [x, y] = edge.ends.map(|v| labels[v as usize]);
            distinct([x, y, NO_SET]).for_each(|label| sums[label as usize] += plane);
        }
        let sums = match self.options.both_errors {
            true => self.with_moved_planes(sums, &centres, &sizes, labels, &cell),
            false => sums,
        };
        let mut best: Vec<(f64, DVec3)> = Vec::with_capacity(nodes.len());
        let mut is_solved = vec![true; nodes.len()];
        for (k, sum) in sums.iter().enumerate() {
            let centre = centres[k] / f64::from(sizes[k].max(1));
            let optimum = optimum(sum, centre, cell[k]);
            is_solved[k] = optimum.is_some();
            let place = centre + optimum.unwrap_or_default();
            best.push((sum.at(place), place));
        }
        // Without an optimum the best of all vertices and the centre.
        let unsolved = |label: u32| label != NO_SET && !is_solved[label as usize];
        for (v, &label) in labels.iter().enumerate().filter(|(_, label)| unsolved(**label)) {
            let label = label as usize;
            let at = self.at(v as u32);
            let cost = sums[label].at(at);
            if cost < best[label].0 {
                best[label] = (cost, at);
            }
        }
        for (k, (node, (error, place))) in nodes.iter_mut().zip(best).enumerate() {
            let axis = turning[k].axis(node.cuts);
            let extent = (turning[k].box_of[1] - turning[k].box_of[0]).to_array();
            let can = |k: usize| node.cuts[k] < DEPTH && extent[k] > 0.0;
            node.axes = std::array::from_fn(|k| Some(k) == axis || are_few && can(k));
            // A vertex alone has no error, and what is in one place has none worth a part.
            node.is_settled = sizes[k] == 1 || axis.is_none();
            if sizes[k] > 1 {
                node.error = error;
                node.place = std::array::from_fn(|k| place[k] + self.origin[k]);
            }
            if self.options.eighths {
                node.axes = [true; 3];
                node.is_settled |= node.cuts[0] >= DEPTH;
            }
        }
        if self.options.strict_normals {
            self.part_opposed(nodes, labels);
        }
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
        labels: &[u32],
        cell: &[f64],
    ) -> Vec<Quadric> {
        let mut sums = planes.clone();
        for _ in 0..ROUNDS {
            let place = |(k, sum): (usize, &Quadric)| {
                let centre = centres[k] / f64::from(sizes[k].max(1));
                centre + optimum(sum, centre, cell[k]).unwrap_or_default()
            };
            let places: Vec<DVec3> = sums.iter().enumerate().map(place).collect();
            sums.clone_from(&planes);
            for &t in &self.triangles {
                let triangle = self.working.triangles[t as usize];
                let at = triangle.map(|v| self.at(v));
                let set = triangle.map(|v| labels[v as usize]);
                for k in 0..3 {
                    let label = set[k];
                    if label == NO_SET || set[(k + 1) % 3] == label || set[(k + 2) % 3] == label {
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
    fn part_opposed(&self, nodes: &mut [Node], labels: &[u32]) {
        let cross = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|v| self.at(v));
            (b - a).cross(c - a)
        };
        let sets = |triangle: &[u32; 3]| {
            triangle.map(|v| labels[v as usize]).into_iter().filter(|&label| label != NO_SET)
        };
        let mut sums = vec![DVec3::ZERO; nodes.len()];
        let triangles = || self.triangles.iter().map(|&t| &self.working.triangles[t as usize]);
        for triangle in triangles() {
            let cross = cross(triangle);
            sets(triangle).for_each(|label| sums[label as usize] += cross);
        }
        for triangle in triangles() {
            let cross = cross(triangle);
            for label in sets(triangle) {
                let node = &mut nodes[label as usize];
                if sums[label as usize].dot(cross) < 0.0 && !node.is_settled {
                    node.error = f64::INFINITY;
                }
            }
        }
    }

    fn at(&self, v: u32) -> DVec3 {
        relative(self.working.positions[v as usize], self.origin)
    }
}

/// Each of these once, but [`NO_SET`].
fn distinct([x, y, z]: [u32; 3]) -> impl Iterator<Item = u32> {
    let each = [(x, true), (y, y != x), (z, z != x && z != y)];
    each.into_iter().filter(|&(label, is_new)| is_new && label != NO_SET).map(|(label, _)| label)
}

/// Where a sum is least, relative to a set's centre, unless that is outside: farther than a cell and a quarter, or where cells are halved than
/// the longest side of the vertices' box and a quarter.
fn optimum(sum: &Quadric, centre: DVec3, size: f64) -> Option<DVec3> {
    sum.optimum(centre, SINGULAR).filter(|d| d.abs().max_element() <= 1.25 * size)
}

/// While there is no set for so many triangles that are to be left, cells are cut in eight: hardly one of these sets is left whole, and each cut
/// looks at all triangles.
const FEW: usize = 64;
/// The number of no set.
const NO_SET: u32 = u32::MAX;
/// Sets for each triangle that is to be left, from which on a limit may be found that leaves too many.
const GUESSES: [f64; 5] = [0.55, 0.7, 1.0, 1.5, 3.5];
/// Rounds of the second error: some sets go round in circles.
const ROUNDS: usize = 3;
/// A triangle that shrinks to nothing counts so many times its plane, at most.
const MOST_RATIO: f64 = 100.0;
/// How often cells are halved along each axis, at most.
const DEPTH: u32 = 21;
/// As of contractions, but stricter: sets are larger than stars.
const SINGULAR: f64 = 1e-4;
