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

use super::bodies::Bodies;
use super::frame::Places;
use super::nearest::{Near, farthest_of_triangle};
use crate::mesh::distance::point_segment_distance_squared;
use crate::mesh::{Corner, CornerMap, CornerTable, Triangle, Vertex};
use glam::DVec3;

/// The paths of a level's edges.
#[derive(Debug)]
pub struct Paths {
    pub input: CornerTable,
    /// Which of its vertices are of which body.
    bodies: Bodies,
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
    pub fn new(input: &CornerTable, bodies: Bodies) -> Self {
        let farthest = CornerMap::new(0.0, input.slots());
        Self { farthest, outline: vec![0.0; input.vertex_slots()], ..Self::of(input.clone(), bodies) }
    }

    /// Those of an input, of which nothing is known.
    pub fn of(input: CornerTable, bodies: Bodies) -> Self {
        Self { input, bodies, farthest: CornerMap::default(), outline: Vec::new(), met: Vec::new() }
    }

    /// The largest squared distance of the edges of a triangle, or a bound of it. It is one of a star, which may be gone.
    pub fn known(&self, t: Triangle) -> f32 {
        self.farthest.0[t.index()].into_iter().map(f32::abs).fold(0.0, f32::max)
    }

    /// The triangles that there are of the level will be numbered anew, in order.
    pub fn compact(&mut self, table: &CornerTable) {
        for (k, t) in table.triangles().enumerate() {
            self.farthest.0[k] = self.farthest.0[t.index()];
        }
        self.farthest.0.truncate(table.triangle_count());
        self.farthest.0.shrink_to_fit();
    }

    /// The input, and which of its vertices are of which body.
    pub fn into_parts(self) -> (CornerTable, Bodies) {
        (self.input, self.bodies)
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
        let (mut far, bound_of_vertices) = (Vec::new(), most);
        let once = |&c: &Corner| table.opposite(c).is_none() || table.opposite(c) > c;
        for c in table.triangles().flat_map(|t| t.corners()).filter(once) {
            let mut squared = self.farthest[c];
            if squared.is_nan() {
                squared = self.follow(table, places, c);
            }
            if squared > most {
                far.push((squared, c));
            }
        }
        // The farther some edges are known to be, the fewer others have to be followed.
        most = self.closely(table, places, far, most);
        let (mut far, mut told) = (Vec::new(), 0.0f32);
        // A list of these edges would be as long as all that is known of a level.
        for c in table.triangles().flat_map(|t| t.corners()).filter(once) {
            let bound = -self.farthest[c];
            if bound > most * NEARLY {
                let squared = self.follow(table, places, c);
                if squared > most {
                    far.push((squared, c));
                }
            } else if bound > bound_of_vertices {
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

    /// The edges of a level whose distances are known, each with its squared distance or a bound of it.
    pub fn edges<'a>(&'a self, table: &'a CornerTable) -> impl Iterator<Item = (Corner, f32)> + 'a {
        let once = |&c: &Corner| table.opposite(c).is_none() || table.opposite(c) > c;
        table.triangles().flat_map(|t| t.corners()).filter(once).map(|c| (c, self.farthest[c].abs()))
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
            let corners = table.triangle(side.triangle());
            let near = Near { input: &self.input, places, bodies: &self.bodies, corners, met: &self.met };
            farthest_of_triangle(&near, corners.map(|v| places.at(v)), most)
        };
        sides.map(of_side).fold(0.0, f32::max)
    }

    /// Along the input's boundary: the largest squared distance from the edge between the ends.
    fn along(&mut self, places: &Places, from: Vertex, to: Vertex) -> f32 {
        let edge = [from, to].map(|v| places.at(v));
        let mut outline = std::mem::take(&mut self.outline);
        let farthest = self.boundary(places, [from, to], edge, |at, squared| outline[at.index()] = squared);
        self.outline = outline;
        farthest
    }

    /// Along the input's boundary: the largest squared distance from an edge between two points; `told` of each vertex.
    fn boundary<T: Copy + Into<f64>>(
        &mut self,
        places: &Places<T>,
        [from, to]: [Vertex; 2],
        [a, b]: [DVec3; 2],
        mut told: impl FnMut(Vertex, f32),
    ) -> f32 {
        let mut farthest = 0.0f32;
        let mut at = from;
        loop {
            // From the first corner of a vertex at the boundary, its boundary edge leads on.
            at = self.input.vertex(self.input.corner_of(at).next());
            if at == to || at == from {
                return farthest;
            }
            let squared = point_segment_distance_squared(places.at(at), a, b) as f32;
            told(at, squared);
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
        let [p, q] = [a, b].map(|v| places.at(v));
        let there = self.cut(places, [a, b], normal, [p, q]);
        there.or_else(|| self.cut(places, [b, a], normal, [q, p]))
    }

    /// The squared distance of an edge whose ends have moved from its path on the input, or a bound of it; where that is above `most`, how
    /// far its triangles are from the input, measured at points. `corners` are its ends and the vertices on its left and on its right
    /// ([`Vertex::NONE`] at the boundary), `moved` where they are.
    pub fn of_moved<T: Copy + Into<f64>>(
        &mut self,
        places: &Places<T>,
        corners: [Vertex; 4],
        moved: [DVec3; 4],
        most: f32,
    ) -> f32 {
        let ([a, b, c, d], [p, q, r, s]) = (corners, moved);
        self.met.clear();
        let boundary = d == Vertex::NONE;
        let squared = if boundary {
            self.boundary(places, [a, b], [p, q], |_, _| ())
        } else {
            let [at_a, at_b, at_c, at_d] = corners.map(|v| places.at(v));
            let along = at_b - at_a;
            let normal =
                along.cross(at_c - at_a).normalize_or_zero() - along.cross(at_d - at_a).normalize_or_zero();
            let there = self.cut(places, [a, b], normal, [p, q]);
            there.or_else(|| self.cut(places, [b, a], normal, [q, p])).unwrap_or(f32::INFINITY)
        };
        if squared <= most {
            return squared;
        }
        let sides = [([a, b, c], [p, q, r]), ([b, a, d], [q, p, s])];
        let sides = sides.into_iter().take(if boundary { 1 } else { 2 });
        let of_side = |(corners, moved)| {
            farthest_of_triangle(
                &Near { input: &self.input, places, bodies: &self.bodies, corners, met: &self.met },
                moved,
                most,
            )
        };
        squared.min(sides.map(of_side).fold(0.0, f32::max))
    }

    /// From one vertex straight to another: how far the way is from the edge between two points. `None` where it ends at the boundary or
    /// leads elsewhere.
    fn cut<T: Copy + Into<f64>>(
        &mut self,
        places: &Places<T>,
        [from, to]: [Vertex; 2],
        normal: DVec3,
        edge: [DVec3; 2],
    ) -> Option<f32> {
        let (a, b) = (places.at(from), places.at(to));
        let along = b - a;
        let edge = edge.map(|p| p - a);
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
            farthest = farthest.max(point_segment_distance_squared(at, edge[0], edge[1]));
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
        let mut paths = Paths::new(&input, Bodies::default());
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

    /// The paths of a level whose edges inside are off by at most `bound`, as they are told.
    fn paths(
        positions: &[[f64; 3]],
        input: &[[u32; 3]],
        level: &[[u32; 3]],
        bound: f32,
    ) -> (Paths, CornerTable) {
        let table = |triangles: &[[u32; 3]]| CornerTable::from_triangles(positions.len(), triangles).unwrap();
        let (input, level) = (table(input), table(level));
        let mut paths = Paths::new(&input, Bodies::default());
        let triangles: Vec<_> = level.triangles().collect();
        paths.renew(&level, &triangles, |_, _| bound * bound);
        (paths, level)
    }

    fn in_unit_cube(positions: &[[f64; 3]]) -> Places<'_> {
        Places { positions, frame: Frame::new(&Lattice { origin: [0.0; 3], step: 1.0 / 1023.0, bits: 10 }) }
    }

    /// A bound is what is known of both triangles at the edge until it is followed, and then what was found; it is followed if it is above
    /// what is known elsewhere by more than it may, and else told.
    #[test]
    fn a_bound_stands_until_it_matters() {
        let places = in_unit_cube(&SKEW);
        for (bound, elsewhere, told) in
            [(0.25, 0.19, 0.2), (0.25, 0.244, 0.25), (0.3, 0.4, 0.4), (0.9, 0.0, 0.2)]
        {
            let (mut paths, level) = paths(&SKEW, &[[0, 1, 2], [0, 2, 3]], &[[0, 1, 3], [1, 2, 3]], bound);
            let known = |paths: &Paths| level.triangles().map(|t| paths.known(t).sqrt()).collect::<Vec<_>>();
            assert!(known(&paths).iter().all(|known| (known - bound).abs() < 1e-6));
            let found = paths.farthest(&level, &places, elsewhere * elsewhere).sqrt();
            let (followed, exact) = if bound > 1.03 * elsewhere { (told, 0.01) } else { (bound, 1e-5) };
            assert!((found - told).abs() < exact, "{bound}, {elsewhere}: {found}");
            assert!(known(&paths).iter().all(|known| (known - followed).abs() < 0.01), "{:?}", known(&paths));
        }
    }

    /// A notch counts though half as much is known elsewhere.
    #[test]
    fn the_boundary_is_looked_at() {
        let positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.5, 0.1, 0.0]];
        let (mut paths, level) =
            paths(&positions, &[[0, 4, 3], [4, 2, 3], [4, 1, 2]], &[[0, 1, 2], [0, 2, 3]], 0.0);
        let found = paths.farthest(&level, &in_unit_cube(&positions), 0.06 * 0.06).sqrt();
        assert!((found - 0.0981).abs() < 1e-3, "{found}");
    }

    /// A fan of triangles round vertex 0, then a roof of two ridges on the way to vertex 9: the knots are where the plane of the edge meets
    /// the ridges, and it leaves vertex 0 forwards.
    #[test]
    fn a_path_meets_every_edge_on_its_way() {
        let positions = [
            [0.5, 0.5, 0.0],
            [0.3, 0.2, 0.0],
            [0.1, 0.5, 0.4],
            [0.3, 0.8, 0.0],
            [0.6, 0.1, 0.05],
            [0.6, 0.9, 0.05],
            [0.7, 0.1, 0.1],
            [0.7, 0.9, 0.1],
            [0.8, 0.1, 0.02],
            [0.9, 0.5, 0.0],
        ];
        let input = [
            [0, 2, 1],
            [0, 3, 2],
            [0, 1, 4],
            [0, 5, 3],
            [0, 4, 5],
            [5, 4, 7],
            [4, 6, 7],
            [7, 6, 8],
            [7, 8, 9],
        ];
        let table = CornerTable::from_triangles(positions.len(), &input).unwrap();
        let mut paths = Paths::new(&table, Bodies::default());
        let places = in_unit_cube(&positions);
        let [from, to] = [0, 9].map(Vertex);
        let edge = [from, to].map(|v| places.at(v));
        // The ridges from 4 to 5 and from 6 to 7 have heights 0.05 and 0.1, whichever way the plane is crossed.
        for (ends, edge) in [([from, to], edge), ([to, from], [edge[1], edge[0]])] {
            paths.met.clear();
            let found = paths.cut(&places, ends, DVec3::Z, edge).unwrap().sqrt();
            assert!((found - 0.1).abs() < 1e-6, "{found}");
            assert!(paths.met.contains(&Vertex(6)) || paths.met.contains(&Vertex(7)), "{:?}", paths.met);
        }
        // Half an edge is as far as it can be; and where the edge has been moved, it is from there.
        let moved = edge.map(|p| p + DVec3::new(0.0, 0.0, 0.03));
        let found = paths.cut(&places, [from, to], DVec3::Z, moved).unwrap().sqrt();
        assert!((found - 0.07).abs() < 1e-6, "{found}");
        // Nothing leads to a vertex that is not ahead.
        assert!(paths.cut(&places, [from, Vertex(8)], DVec3::X, [edge[0]; 2]).is_none());
    }

    /// What the level's triangles lack is measured on both, from whichever side they are named.
    #[test]
    fn both_triangles_at_an_edge_are_measured() {
        // A square that is flat on one side of its diagonal and a pyramid of three sides on the other.
        let positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.3, 0.7, 0.5]];
        let input = [[0, 1, 2], [0, 2, 4], [2, 3, 4], [3, 0, 4]];
        let (mut paths, level) = paths(&positions, &input, &[[0, 1, 2], [0, 2, 3]], 0.0);
        let places = in_unit_cube(&positions);
        let c = level.find_directed_edge(Vertex(0), Vertex(2));
        let [one, other] = [c, level.opposite(c)].map(|c| paths.measure(&level, &places, c, 0.0).sqrt());
        assert!(one > 0.1 && (one - other).abs() < 1e-3, "{one} and {other}");
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
        assert!((found - to_slope).abs() < 1e-4, "{found} for {to_slope}");
        assert_eq!(outline[..4], [0.0; 4]);
        assert!((outline[4] - 0.1).abs() < 1e-6, "{outline:?}");
    }
}
