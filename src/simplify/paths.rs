//! Where the edges of a level run on the input: for each a path there from one end to the other, and how far apart the two are.
//!
//! On each straight piece of a path the distance from the edge is convex, so it is largest at a knot; and as the path leads from end to
//! end, the points of the edge nearest to it are all of the edge. So the farthest knot bounds both how far the edge is from the input and
//! how far the path is from the level. The paths cut the input into one piece for each triangle of the level; a piece is mapped to its
//! triangle, straight between the knots, which go to the edges, and the vertices, which go to the nearest point. The largest distance is
//! one of a knot or of a vertex, and as nothing of the triangle is left out, it holds both ways (as with the mappings of Cohen, Manocha,
//! Olano: Simplifying Polygonal Models Using Successive Mappings, 1997). The vertices are the covering's business.
//!
//! At the boundary the path is the input's boundary; elsewhere it is the cut of the input with the plane through the edge and the level's
//! normal. Such a path may be a detour, and there may be none: what is to be the largest distance of all is measured at points instead.

use super::frame::Places;
use super::nearest::farthest_of_triangle;
use crate::mesh::distance::point_segment_distance_squared;
use crate::mesh::{Corner, CornerMap, CornerTable, Triangle, Vertex};
use glam::DVec3;

/// The paths of a level's edges.
#[derive(Debug)]
pub struct Paths {
    input: CornerTable,
    /// By corner, for the edge opposite, both sides alike: the squared distance of its path's farthest knot. Where the path has not been
    /// followed, a bound of it, negative; at the boundary NaN.
    farthest: CornerMap<f32>,
    /// For each vertex of the input's boundary its squared distance from the edge of the level whose path it is on; 0 for others.
    outline: Vec<f32>,
    /// Vertices on or beside the last path.
    met: Vec<Vertex>,
}

impl Paths {
    /// Nothing is removed yet: each edge is its path.
    pub fn new(input: &CornerTable) -> Self {
        Self {
            input: input.clone(),
            farthest: CornerMap::new(0.0, input.slots()),
            outline: vec![0.0; input.vertex_slots()],
            met: Vec::new(),
        }
    }

    /// The largest squared distance of the edges of a triangle, or a bound of it. It is one of a star, which may be gone.
    pub fn known(&self, t: Triangle) -> f32 {
        self.farthest.0[t.index()].into_iter().map(f32::abs).fold(0.0, f32::max)
    }

    /// The triangles that are left of the level, in order, are now numbered as in this list.
    pub fn compact(&mut self, there: &[Triangle]) {
        for (k, t) in there.iter().enumerate() {
            self.farthest.0[k] = self.farthest.0[t.index()];
        }
        self.farthest.0.truncate(there.len());
        self.farthest.0.shrink_to_fit();
    }

    /// Some triangles are new, and so are the edges between them, whose squared distance is at most `bound` by their ends.
    pub fn renew(
        &mut self,
        table: &CornerTable,
        triangles: &[Triangle],
        mut bound: impl FnMut(Vertex, Vertex) -> f32,
    ) {
        for t in triangles {
            self.farthest.0[t.index()] = [f32::NAN; 3];
        }
        for c in triangles.iter().flat_map(|t| t.corners()) {
            // The edges to other triangles are as they were. At the boundary a path is followed again: it costs little.
            let beyond = table.opposite(c);
            if beyond.is_some() {
                let known = self.farthest[beyond];
                let (a, b) = table.edge(c);
                self.farthest[c] = if known.is_nan() { -bound(a, b) } else { known };
            }
        }
    }

    /// The largest squared distance between the level and the input, both ways, where that of vertices alone is `most`.
    pub fn farthest(&mut self, table: &CornerTable, places: &Places, mut most: f32) -> f32 {
        let (mut far, mut unknown) = (Vec::new(), Vec::new());
        for c in table.triangles().flat_map(|t| t.corners()) {
            let beyond = table.opposite(c);
            if beyond.is_some() && beyond < c {
                continue;
            }
            let mut squared = self.farthest[c];
            if squared.is_nan() {
                squared = self.follow(table, places, c);
            }
            if squared > most {
                far.push((squared, c));
            } else if -squared > most {
                unknown.push((-squared, c));
            }
        }
        // The farther some edges are known to be, the fewer others have to be followed.
        most = self.closely(table, places, far, most);
        let (mut far, mut told) = (Vec::new(), 0.0f32);
        for (bound, c) in unknown {
            if bound > most * NEARLY {
                let squared = self.follow(table, places, c);
                if squared > most {
                    far.push((squared, c));
                }
            } else {
                told = told.max(bound);
            }
        }
        self.closely(table, places, far, most).max(told)
    }

    /// The largest squared distance, at least `most`, given those of paths, which may be too large.
    fn closely(
        &mut self,
        table: &CornerTable,
        places: &Places,
        mut far: Vec<(f32, Corner)>,
        mut most: f32,
    ) -> f32 {
        far.sort_unstable_by(|x, y| y.0.total_cmp(&x.0));
        for (squared, c) in far {
            if squared <= most * NEARLY {
                // So little more, if at all, that it may as well be told.
                return squared.max(most);
            }
            let measured = squared.min(self.measure(table, places, c, most));
            self.set(table, c, measured);
            most = most.max(measured);
        }
        most
    }

    fn set(&mut self, table: &CornerTable, c: Corner, squared: f32) {
        self.farthest[c] = squared;
        let beyond = table.opposite(c);
        if beyond.is_some() {
            self.farthest[beyond] = squared;
        }
    }

    /// Squared distances of the vertices of the input's boundary from the boundary of the level last measured.
    pub fn outline(&self) -> &[f32] {
        &self.outline
    }

    /// Follows the path of the edge opposite `c`: its largest squared distance.
    fn follow(&mut self, table: &CornerTable, places: &Places, c: Corner) -> f32 {
        self.met.clear();
        let (a, b) = table.edge(c);
        let squared = if table.opposite(c).is_none() {
            self.along(places, a, b)
        } else {
            // The ends are on the input, so no point of the edge is farther from it than half of it.
            let half = (0.25 * places.at(a).distance_squared(places.at(b))) as f32;
            self.across(table, places, c).map_or(half, |squared| half.min(squared))
        };
        self.set(table, c, squared);
        squared
    }

    /// How far the triangles at an edge are from the input, measured at points.
    fn measure(&mut self, table: &CornerTable, places: &Places, c: Corner, most: f32) -> f32 {
        // Once more, for the vertices near by.
        self.follow(table, places, c);
        let sides = [c, table.opposite(c)].into_iter().filter(|side| side.is_some());
        let of_side = |side: Corner| {
            farthest_of_triangle(&self.input, places, table.triangle(side.triangle()), &self.met, most)
        };
        sides.map(of_side).fold(0.0, f32::max)
    }

    /// Along the input's boundary: the largest squared distance from the edge between the ends.
    fn along(&mut self, places: &Places, from: Vertex, to: Vertex) -> f32 {
        let (a, b) = (places.at(from), places.at(to));
        let mut farthest = 0.0f32;
        let mut at = from;
        loop {
            // From the first corner of a vertex at the boundary, its boundary edge leads on.
            at = self.input.vertex(self.input.corner_of(at).next());
            if at == to || at == from {
                return farthest;
            }
            let squared = point_segment_distance_squared(places.at(at), a, b) as f32;
            self.outline[at.index()] = squared;
            self.met.push(at);
            farthest = farthest.max(squared);
        }
    }

    /// Across the input's edges, in the plane of the edge opposite `c` and the mean normal of its triangles.
    fn across(&mut self, table: &CornerTable, places: &Places, c: Corner) -> Option<f32> {
        let normal = |c: Corner| {
            let [x, y, z] = table.triangle(c.triangle()).map(|v| places.at(v));
            (y - x).cross(z - x).normalize_or_zero()
        };
        let normal = normal(c) + normal(table.opposite(c));
        let (a, b) = table.edge(c);
        let there = self.cut(places, a, b, normal);
        there.or_else(|| self.cut(places, b, a, normal))
    }

    /// From one vertex straight to another; `None` where the way ends at the boundary or leads elsewhere.
    fn cut(&mut self, places: &Places, from: Vertex, to: Vertex, normal: DVec3) -> Option<f32> {
        let (a, b) = (places.at(from), places.at(to));
        let along = b - a;
        let across = along.cross(normal);
        let input = &self.input;
        // A vertex seen from the first end, and on which side of the plane it is.
        let seen = |c: Corner| {
            let p = places.at(input.vertex(c)) - a;
            (p, p.dot(across))
        };
        // Where the plane meets an edge with an end on either side.
        let knot =
            |(p, p_side): (DVec3, f64), (q, q_side): (DVec3, f64)| p.lerp(q, p_side / (p_side - q_side));
        // It leaves the first star where that is most nearly towards the other end.
        let mut best = None;
        let mut most = 0.0;
        let first = input.corner_of(from);
        let mut p = seen(first.next());
        for c in input.fan(from).take(FAN) {
            if input.vertex(c.next()) == to || input.vertex(c.prev()) == to {
                return Some(0.0);
            }
            let q = seen(c.prev());
            if (p.1 > 0.0) != (q.1 > 0.0) {
                let knot = knot(p, q);
                let towards = knot.dot(along) / knot.length();
                if towards > most {
                    (most, best) = (towards, Some((c, p, q)));
                }
            }
            p = q;
        }
        let (mut c, mut p, mut q) = best?;
        let length_squared = along.length_squared();
        let mut farthest = 0.0f64;
        for _ in 0..STEPS {
            let at = knot(p, q);
            self.met.push(input.vertex(c.next()));
            if !(-length_squared..2.0 * length_squared).contains(&at.dot(along)) {
                return None;
            }
            farthest = farthest.max(point_segment_distance_squared(at, DVec3::ZERO, along));
            let beyond = input.opposite(c);
            if beyond.is_none() {
                return None;
            }
            if input.vertex(beyond) == to {
                return Some(farthest as f32);
            }
            // Beyond the edge from p to q its ends follow the apex the other way round.
            let apex = seen(beyond);
            (c, p, q) = if (apex.1 > 0.0) == (p.1 > 0.0) {
                (beyond.prev(), apex, q)
            } else {
                (beyond.next(), p, apex)
            };
        }
        None
    }
}

/// How much more a squared distance may be than what is known to be met, for it to be told without a closer look.
const NEARLY: f32 = 1.05;
/// Triangles looked at round the first end of a path.
const FAN: usize = 256;
/// Edges of the input that a path crosses at most.
const STEPS: usize = 1000;

#[cfg(test)]
mod tests {
    use super::super::frame::Frame;
    use super::*;
    use crate::mesh::Lattice;

    /// The level of some triangles over an input of as many, all of whose edges inside are new. The lattice is the unit cube, so what is
    /// measured is in the unit of the positions.
    fn farthest(
        positions: &[[f64; 3]],
        input: &[[u32; 3]],
        level: &[[u32; 3]],
        bound: f32,
    ) -> (f32, Vec<f32>) {
        let table = |triangles: &[[u32; 3]]| CornerTable::from_triangles(positions.len(), triangles).unwrap();
        let (input, level) = (table(input), table(level));
        let lattice = Lattice { origin: [0.0; 3], step: 1.0 / 1023.0, bits: 10 };
        let places = Places { positions, frame: Frame::new(&lattice) };
        let mut paths = Paths::new(&input);
        let triangles: Vec<_> = level.triangles().collect();
        paths.renew(&level, &triangles, |_, _| bound * bound);
        let farthest = paths.farthest(&level, &places, 0.0).sqrt();
        (farthest, paths.outline().iter().map(|squared| squared.sqrt()).collect())
    }

    /// A square with two opposite corners up by a fifth: its diagonals cross in the middle, a fifth apart, although all vertices stay.
    const SKEW: [[f64; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.2], [1.0, 1.0, 0.0], [0.0, 1.0, 0.2]];

    #[test]
    fn a_flip_is_as_far_off_as_its_diagonals() {
        let (found, _) = farthest(&SKEW, &[[0, 1, 2], [0, 2, 3]], &[[0, 1, 3], [1, 2, 3]], f32::INFINITY);
        assert!((found - 0.2).abs() < 0.01, "{found}");
        let (same, _) = farthest(&SKEW, &[[0, 1, 2], [0, 2, 3]], &[[0, 1, 2], [0, 2, 3]], f32::INFINITY);
        assert_eq!(same, 0.0);
    }

    /// Where nothing else is known the path is followed, and a bound of nothing is believed.
    #[test]
    fn a_bound_saves_the_way() {
        let (found, _) = farthest(&SKEW, &[[0, 1, 2], [0, 2, 3]], &[[0, 1, 3], [1, 2, 3]], 0.0);
        assert_eq!(found, 0.0);
    }

    /// Vertex 4 is a notch of depth a tenth in the side from 0 to 1; the level closes it.
    #[test]
    fn a_notch_counts_by_its_depth() {
        let positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.5, 0.1, 0.0]];
        let input = [[0, 4, 3], [4, 2, 3], [4, 1, 2]];
        let (found, outline) = farthest(&positions, &input, &[[0, 1, 2], [0, 2, 3]], f32::INFINITY);
        // The middle of the side is a tenth from the notch's bottom, but a little nearer to its slopes.
        let to_slope = 0.5 * 0.1 / 0.5f32.hypot(0.1);
        assert!((found - to_slope).abs() < 0.005, "{found} for {to_slope}");
        assert_eq!(outline[..4], [0.0; 4]);
        assert!((outline[4] - 0.1).abs() < 1e-6, "{outline:?}");
    }
}
