//! Which triangle covers each removed vertex, and how far off: the level's error is tracked while simplifying. What vertices do not tell,
//! the edges' paths do.

use super::bodies::Bodies;
use super::fours::Fours;
use super::frame::Places;
use super::paths::Paths;
use crate::mesh::distance::point_triangle_distance_squared;
use crate::mesh::{CornerTable, Triangle, Vertex};
use bitvec::vec::BitVec;
use glam::DVec3;

/// The removed vertices, in a list for each triangle of the mesh as it stands.
#[derive(Debug)]
pub struct Covering {
    first: Vec<u32>,
    next: Vec<u32>,
    /// A third of the area round each vertex of the input.
    weights: Vec<f32>,
    /// Squared distance of each vertex from the triangle that covers it; 0 for those of the mesh.
    distances: Vec<f32>,
    /// Weights times squared distances of the vertices of components that are left out.
    missing: f64,
    /// The squared size of the largest of these components.
    largest_missing: f64,
    /// The vertices that [`Traces`] tell of.
    picked: BitVec,
    /// Where the edges run on the input.
    pub paths: Paths,
    /// Room for the triangles of one star.
    patches: Vec<Patch>,
}

/// How far a level and the input are apart, in the input's units; but for the input's residue, which levels do not have. A component that a
/// level lacks counts with its size, the diagonal of its bounding box.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LevelError {
    /// Largest distance of a point of either surface from the other one: a bound before the level's vertices are moved to the lattice,
    /// and the largest move. Where the bound would decide on the level's, it is measured at points, to some percent.
    pub max: f64,
    /// Root of the mean squared distance of the input's vertices from the level, of those on the boundary from the level's boundary, each
    /// weighted by the area round it; moves to the lattice count as they are expected.
    pub rms: f64,
}

/// By what it is told how far a level is off once its vertices have moved.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Traces {
    /// Some of the input's vertices, the same ones at each level, each before the corners of the triangle that covers it: three times itself
    /// where it is one of the level's.
    pub probes: Fours,
    /// For each probe its squared distance from the level's boundary, in steps of the lattice, where it is on the input's, else 0; none where
    /// all are 0.
    pub outline: Vec<f32>,
    /// The removed vertices that are farther off than a part of the largest distance, each before the triangle that covers it.
    pub vertices: Fours,
    /// So the edges: their ends, the vertices on their left and on their right ([`Vertex::NONE`] at the boundary).
    pub edges: Fours,
    /// How far off each of these edges is at most, in steps of the lattice.
    pub distances: Vec<f32>,
    /// The largest distance, in steps of the lattice.
    pub most: f64,
    /// That of what is in neither list, at most; rounding included.
    pub left_out: f64,
    /// What components that are missing make of the mean squared distance, in the square of the input's units.
    pub missing: f64,
    /// The size of the largest of them, in steps of the lattice: as far off it counts, however the level's vertices move.
    pub largest_missing: f64,
}

const NONE: u32 = u32::MAX;

impl Covering {
    /// Nothing is removed yet.
    pub fn new(table: &CornerTable, places: &Places, bodies: Bodies) -> Self {
        let count = places.positions.len();
        let mut weights = vec![0.0; count];
        for t in table.triangles() {
            let [a, b, c] = table.triangle(t).map(|v| places.at(v));
            let third = ((b - a).cross(c - a).length() / 6.0) as f32;
            for v in table.triangle(t) {
                weights[v.index()] += third;
            }
        }
        Self {
            first: vec![NONE; table.slots()],
            next: vec![NONE; count],
            weights,
            distances: vec![0.0; count],
            missing: 0.0,
            largest_missing: 0.0,
            picked: picked(count),
            paths: Paths::new(table, bodies),
            patches: Vec::new(),
        }
    }

    /// The triangles that there are will be numbered anew, in order.
    pub fn compact(&mut self, table: &CornerTable) {
        self.paths.compact(table);
        for (k, t) in table.triangles().enumerate() {
            self.first[k] = self.first[t.index()];
        }
        self.first.truncate(table.triangle_count());
        self.first.shrink_to_fit();
    }

    /// Takes the vertices off a triangle that is about to be rewritten.
    pub fn take(&mut self, t: Triangle, out: &mut Vec<Vertex>) {
        let mut at = std::mem::replace(&mut self.first[t.index()], NONE);
        while at != NONE {
            out.push(Vertex(at));
            at = self.next[at as usize];
        }
    }

    /// The component of a vertex is left out, and is so large, squared: as far off the vertex counts.
    pub fn miss(&mut self, v: Vertex, squared: f64) {
        self.distances[v.index()] = squared as f32;
        self.missing += f64::from(self.weights[v.index()]) * squared;
        self.largest_missing = self.largest_missing.max(squared);
    }

    /// The largest squared distance known of a triangle whose vertices have been taken off: of these and of the edges' paths.
    pub fn known(&self, t: Triangle, vertices: &[Vertex]) -> f32 {
        vertices.iter().map(|v| self.distances[v.index()]).fold(self.paths.known(t), f32::max)
    }

    /// Puts each vertex on one of some neighbouring triangles: the one it is led to across edges that it lies beyond, or the nearest
    /// where it comes to lie much farther off than before.
    pub fn put(&mut self, table: &CornerTable, places: &Places, vertices: &[Vertex], triangles: &[Triangle]) {
        let mut patches = std::mem::take(&mut self.patches);
        let few = vertices.len() <= FEW;
        patches.extend(
            triangles.iter().map(|&t| Patch::new(table, places, t, if few { &[] } else { triangles })),
        );
        let mut at = 0;
        for &v in vertices {
            let p = places.at(v);
            for _ in 0..if few { 0 } else { patches.len() } {
                match patches[at].way(p) {
                    Some(on) => at = on,
                    None => break,
                }
            }
            let mut squared = patches[at].distance_squared(p);
            if few || squared > FARTHER * f64::from(self.distances[v.index()]) {
                // Much farther than it was: led astray on a fold, perhaps.
                let start = at;
                for (k, patch) in patches.iter().enumerate().filter(|&(k, _)| k != start) {
                    let other = patch.distance_squared(p);
                    if other < squared {
                        (squared, at) = (other, k);
                    }
                }
            }
            self.distances[v.index()] = squared as f32;
            let t = triangles[at];
            self.next[v.index()] = self.first[t.index()];
            self.first[t.index()] = v.0;
        }
        patches.clear();
        self.patches = patches;
    }

    /// What is known of the level as it stands, of which [`Covering::error`] has just told `error`.
    pub fn traces(&self, table: &CornerTable, places: &Places, error: &LevelError) -> Traces {
        let most = error.max / places.frame.length(places.frame.step());
        if !most.is_finite() {
            return Traces::default();
        }
        let rounding = 0.75f64.sqrt();
        let squared = |share: f64| ((share * most - rounding).max(0.0) * places.frame.step()).powi(2) as f32;
        let least = squared(SHARES[0]);
        let before = |v: Vertex, [a, b, c]: [Vertex; 3]| [v, a, b, c];
        let (mut probes, mut vertices) = (Vec::new(), Vec::new());
        for t in table.triangles() {
            let mut at = self.first[t.index()];
            while at != NONE {
                if self.distances[at as usize] > least {
                    vertices.push(before(Vertex(at), table.triangle(t)));
                }
                if self.picked[at as usize] {
                    probes.push(before(Vertex(at), table.triangle(t)));
                }
                at = self.next[at as usize];
            }
        }
        let picked = self.picked.iter_ones().map(|v| Vertex(v as u32));
        let there = picked.filter(|&v| v.index() < table.vertex_slots() && table.corner_of(v).is_some());
        probes.extend(there.map(|v| [v; 4]));
        let edges = self.paths.edges(table).filter(|&(_, squared)| squared > least).map(|(c, squared)| {
            let (a, b) = table.edge(c);
            let o = table.opposite(c);
            let right = if o.is_some() { table.vertex(o) } else { Vertex::NONE };
            ([a, b, table.vertex(c), right], squared)
        });
        let mut edges: Vec<_> = edges.collect();
        let mut left_out = SHARES[0] * most;
        if vertices.len() + edges.len() > FEW_TRACES.max(self.weights.len() / TRACES) {
            let least = squared(SHARES[1]);
            left_out = SHARES[1] * most;
            vertices.retain(|[v, ..]| self.distances[v.index()] > least);
            edges.retain(|&(_, squared)| squared > least);
        }
        let steps = |squared: f32| (f64::from(squared).sqrt() / places.frame.step()).min(most) as f32;
        let distances = edges.iter().map(|&(_, squared)| steps(squared)).collect();
        let edges: Vec<_> = edges.into_iter().map(|(edge, _)| edge).collect();
        let outline = self.outline_of(&probes, places);
        // All levels' are kept until the last one is there.
        let [probes, vertices, edges] = [probes, vertices, edges].map(Fours::from);
        let unit = places.frame.length(1.0);
        let total: f64 = self.weights.iter().map(|&weight| f64::from(weight)).sum();
        let missing = if total > 0.0 { self.missing / total * unit * unit } else { 0.0 };
        let largest_missing = self.largest_missing.sqrt() / places.frame.step();
        let left_out = left_out.max(rounding);
        Traces { probes, outline, vertices, edges, distances, most, left_out, missing, largest_missing }
    }

    /// For each probe its squared distance from the level's boundary, in steps of the lattice; none where all are 0.
    fn outline_of(&self, probes: &[[Vertex; 4]], places: &Places) -> Vec<f32> {
        let (outline, step) = (self.paths.outline(), places.frame.step() as f32);
        let off = |[v, ..]: &[Vertex; 4]| outline[v.index()] / (step * step).max(f32::MIN_POSITIVE);
        let outline: Vec<f32> = probes.iter().map(off).collect();
        if outline.iter().all(|&squared| squared == 0.0) { Vec::new() } else { outline }
    }

    /// Of each vertex of the input a third of the area round it, the input, and which of its vertices are of which body.
    pub fn into_parts(self) -> (Vec<f32>, CornerTable, Bodies) {
        let (input, bodies) = self.paths.into_parts();
        (self.weights, input, bodies)
    }

    /// How far the level as it stands and the input are apart, the level's vertices moved to the lattice.
    pub fn error(&mut self, table: &CornerTable, places: &Places) -> LevelError {
        let most = self.distances.iter().fold(0.0f32, |most, &squared| most.max(squared));
        let max = self.paths.farthest(table, places, most);
        let (mut sum, mut total) = (0.0, 0.0);
        let outline = self.paths.outline().iter();
        for ((&squared, &outline), &weight) in self.distances.iter().zip(outline).zip(&self.weights) {
            let squared = squared.max(outline);
            sum += f64::from(weight) * f64::from(squared);
            total += f64::from(weight);
        }
        let mean = if total > 0.0 { sum / total } else { 0.0 };
        let step = places.frame.step();
        // Half the diagonal of a cell; and the variance along any direction of what is uniform in a cell.
        let (most, variance) = (0.75f64.sqrt() * step, step * step / 12.0);
        LevelError {
            max: places.frame.length(f64::from(max).sqrt() + most),
            rms: places.frame.length((mean + variance).sqrt()),
        }
    }
}

/// Some of so many vertices: by a hash, as their order may have a pattern.
fn picked(count: usize) -> BitVec {
    let every = count.div_ceil(PROBES).max(1) as u32;
    (0..count as u32).map(|v| (v.wrapping_mul(0x9e37_79b1) >> 16).is_multiple_of(every)).collect()
}

/// A triangle and the ways to its neighbours.
#[derive(Debug)]
struct Patch {
    corners: [DVec3; 3],
    /// For each corner the direction out across the edge opposite, and the place of the triangle behind it.
    ways: [(DVec3, usize); 3],
}

impl Patch {
    /// The ways are those to some of `triangles`.
    fn new(table: &CornerTable, places: &Places, t: Triangle, triangles: &[Triangle]) -> Self {
        let corners = table.triangle(t).map(|v| places.at(v));
        if triangles.is_empty() {
            return Self { corners, ways: [(DVec3::ZERO, usize::MAX); 3] };
        }
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let mut k = 0;
        let ways = t.corners().map(|c| {
            let along = corners[(k + 2) % 3] - corners[(k + 1) % 3];
            k += 1;
            let o = table.opposite(c);
            let behind = if o.is_some() { triangles.iter().position(|&u| u == o.triangle()) } else { None };
            (along.cross(normal), behind.unwrap_or(usize::MAX))
        });
        Self { corners, ways }
    }

    fn distance_squared(&self, p: DVec3) -> f64 {
        let [a, b, c] = self.corners;
        point_triangle_distance_squared(p, a, b, c)
    }

    /// The neighbour that a point lies towards, if any.
    fn way(&self, p: DVec3) -> Option<usize> {
        let beyond = |k: usize| (p - self.corners[(k + 1) % 3]).dot(self.ways[k].0) > 0.0;
        (0..3).find(|&k| self.ways[k].1 != usize::MAX && beyond(k)).map(|k| self.ways[k].1)
    }
}

/// Vertices that tell how far a level is off, about.
const PROBES: usize = 1024;

/// The part of the largest distance from which on vertices and edges are traces, and that for when they are many.
const SHARES: [f64; 2] = [0.25, 0.5];

/// So many are: of the input's vertices one in so many, or this number.
const TRACES: usize = 16;
const FEW_TRACES: usize = 4096;

/// So few vertices ask all triangles at once.
const FEW: usize = 3;

/// How much the squared distance may grow without all triangles being asked.
const FARTHER: f64 = 3.0;

#[cfg(test)]
mod tests {
    use super::super::frame::Frame;
    use super::*;
    use crate::mesh::Lattice;

    fn places(positions: &[[f64; 3]]) -> Places<'_> {
        // The unit cube: what is measured is in the unit of the positions.
        let lattice = Lattice { origin: [0.0; 3], step: 1.0 / 1023.0, bits: 10 };
        Places { positions, frame: Frame::new(&lattice) }
    }

    /// The covering of a level whose triangles are all new, of `gone` vertices.
    fn covered(
        positions: &[[f64; 3]],
        input: &[[u32; 3]],
        level: &[[u32; 3]],
        gone: &[u32],
    ) -> (Covering, CornerTable) {
        let [input, level] =
            [input, level].map(|triangles| CornerTable::from_triangles(positions.len(), triangles).unwrap());
        let places = places(positions);
        let mut covering = Covering::new(&input, &places, Bodies::default());
        let triangles: Vec<_> = level.triangles().collect();
        let gone: Vec<_> = gone.iter().map(|&v| Vertex(v)).collect();
        // Twice: the first time nothing is known of them, and all triangles are asked.
        for _ in 0..2 {
            let mut taken = Vec::new();
            triangles.iter().for_each(|&t| covering.take(t, &mut taken));
            assert!(taken.is_empty() || taken.len() == gone.len());
            covering.put(&level, &places, &gone, &triangles);
        }
        covering.paths.renew(&level, &triangles, |_, _| 0.0);
        (covering, level)
    }

    /// A pyramid of height 0.3 on a unit square, and beside it a flat triangle of area 2; the level is flat. The tip stands for a third of the
    /// pyramid's sides, all vertices together for the whole area.
    #[test]
    fn the_mean_is_weighted_by_area() {
        let positions = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.5, 0.5, 0.3],
            [5.0, 0.5, 0.0],
        ];
        let beside = [1, 5, 2];
        let input = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4], beside];
        let (mut covering, level) = covered(&positions, &input, &[[0, 1, 2], [0, 2, 3], beside], &[4]);
        let LevelError { max, rms } = covering.error(&level, &places(&positions));
        let sides = 4.0 * 0.5 * 0.5f64.hypot(0.3);
        let step = 1.0 / 1023.0;
        let mean = sides / 3.0 * 0.3 * 0.3 / (sides + 2.0) + step * step / 12.0;
        assert!((rms - mean.sqrt()).abs() < 1e-6, "{rms} instead of {}", mean.sqrt());
        assert!((max - (0.3 + 0.75f64.sqrt() * step)).abs() < 1e-6, "{max}");
    }

    /// Where nothing is gone there is still the move to the lattice: half the diagonal of a cell at most, and the spread in a cell.
    #[test]
    fn level_0_is_off_by_its_lattice() {
        let positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let (mut covering, level) = covered(&positions, &[[0, 1, 2]], &[[0, 1, 2]], &[]);
        let LevelError { max, rms } = covering.error(&level, &places(&positions));
        let step = 1.0 / 1023.0;
        assert!((max / (3f64.sqrt() / 2.0 * step) - 1.0).abs() < 1e-6, "{max}");
        assert!((rms / (step / 12f64.sqrt()) - 1.0).abs() < 1e-6, "{rms}");
    }

    /// Vertex 4 is drawn in by a tenth from the side from 0 to 1, which the level closes: it lies on the level, but not on its boundary.
    #[test]
    fn the_mean_knows_the_outline() {
        let positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.5, 0.1, 0.0]];
        let input = [[0, 4, 3], [4, 2, 3], [4, 1, 2]];
        let (mut covering, level) = covered(&positions, &input, &[[0, 1, 2], [0, 2, 3]], &[4]);
        let LevelError { rms, .. } = covering.error(&level, &places(&positions));
        // The triangles at vertex 4 have areas 1/4, 9/20 and 1/4, all there is; it stands for a third.
        assert!((rms - (0.01f64 / 3.0).sqrt()).abs() < 1e-5, "{rms}");
    }

    /// What is known of a triangle without vertices is what is known of its edges.
    #[test]
    fn edges_are_known_too() {
        let positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.2], [1.0, 1.0, 0.0], [0.0, 1.0, 0.2]];
        let (mut covering, level) =
            covered(&positions, &[[0, 1, 2], [0, 2, 3]], &[[0, 1, 3], [1, 2, 3]], &[]);
        let triangles: Vec<_> = level.triangles().collect();
        covering.paths.renew(&level, &triangles, |_, _| 0.04);
        for t in triangles {
            assert_eq!(covering.known(t, &[]), 0.04);
        }
    }

    /// High over a strip of triangles the next one is hardly farther off: the way there is not left to chance.
    #[test]
    fn the_way_leads_below() {
        let mut positions: Vec<_> = (0..42).map(|k: u32| [f64::from(k / 2), f64::from(k % 2), 0.0]).collect();
        let triangles: Vec<_> =
            (0..40).map(|k| if k % 2 == 0 { [k, k + 2, k + 1] } else { [k, k + 1, k + 2] }).collect();
        for k in 0..20 {
            positions.push([f64::from(k) + 0.3, 0.3, 20.0]);
        }
        let gone: Vec<u32> = (42..62).collect();
        let (covering, _) = covered(&positions, &triangles, &triangles, &gone);
        for &v in &gone {
            assert!((covering.distances[v as usize].sqrt() - 20.0).abs() < 1e-4, "{v}");
        }
    }

    /// A strip of a hundred triangles along x, and points over it, few or many: each is led to the triangle below it, from whichever was first.
    #[test]
    fn each_vertex_lies_on_the_triangle_below_it() {
        let corner = |k: u32| [f64::from(k / 2), f64::from(k % 2), 0.0];
        let strip: Vec<_> = (0..102).map(corner).collect();
        let triangles: Vec<_> =
            (0..100).map(|k| if k % 2 == 0 { [k, k + 2, k + 1] } else { [k, k + 1, k + 2] }).collect();
        for count in [1, 3, 4, 60] {
            let mut positions = strip.clone();
            let heights: Vec<f64> = (0..count).map(|k| 0.1 + 0.01 * f64::from(k % 7)).collect();
            // At a third of every triangle's height, in no order.
            let below: Vec<_> = (0..count).map(|k| (k * 37 + 5) % 100).collect();
            for (&t, &height) in below.iter().zip(&heights) {
                let [a, b, c] = triangles[t as usize].map(|v| positions[v as usize]);
                let middle = |k: usize| (a[k] + b[k] + c[k]) / 3.0;
                positions.push([middle(0), middle(1), height]);
            }
            let gone: Vec<u32> = (102..102 + count).collect();
            let (mut covering, level) = covered(&positions, &triangles, &triangles, &gone);
            for (&v, height) in gone.iter().zip(&heights) {
                let squared = f64::from(covering.distances[v as usize]);
                assert!((squared.sqrt() - height).abs() < 1e-6, "{v} of {count}: {}", squared.sqrt());
            }
            // What is known of a triangle is what lies on it, which is taken off once.
            for t in level.triangles() {
                let mut found = Vec::new();
                covering.take(t, &mut found);
                let expected: Vec<_> =
                    (0..count).filter(|&k| below[k as usize] as usize == t.index()).collect();
                assert_eq!(found.iter().rev().map(|v| v.0 - 102).collect::<Vec<_>>(), expected, "{t:?}");
                let highest = expected.iter().map(|&k| heights[k as usize]).fold(0.0, f64::max);
                assert!((f64::from(covering.known(t, &found)).sqrt() - highest).abs() < 1e-6);
                covering.take(t, &mut found);
                assert_eq!(found.len(), expected.len());
            }
        }
    }

    /// Two sheets, one over the other, joined at an end: a point near the lower one is not led to the upper one because the way ends there.
    #[test]
    fn a_fold_leads_nobody_astray() {
        // Along x at height 0, and back at height 1 over it.
        let positions = [
            [0.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [4.0, 0.0, 0.0],
            [4.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
            [0.0, 1.0, 1.0],
            [1.0, 0.4, 0.02],
            [2.0, 0.4, 0.98],
            [3.0, 0.4, 0.02],
            [1.5, 0.6, 0.98],
        ];
        let level = [[2, 4, 3], [4, 5, 3], [0, 2, 1], [2, 3, 1]];
        let (covering, _) = covered(&positions, &level, &level, &[6, 7, 8, 9]);
        // The upper sheet falls from height 1 at x = 0 to 0 at x = 4: its points are the nearest to what is within reach.
        for (v, most) in [(6, 0.021), (8, 0.021)] {
            assert!(covering.distances[v].sqrt() < most, "{v}: {}", covering.distances[v].sqrt());
        }
    }
}
