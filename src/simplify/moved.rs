//! How far a level is off once its vertices have moved.
//!
//! The moved level has the paths and the covering of the one before: what was mapped to a triangle, an edge or a vertex still is. So it is
//! as far off as the removed vertices from their triangles, the paths from their edges, and the vertices from where they were. Only what
//! was far off, or has moved far, is looked at again.

use super::bodies::Bodies;
use super::covering::Traces;
use super::frame::{Frame, Places};
use super::paths::Paths;
use crate::mesh::distance::point_triangle_distance_squared;
use crate::mesh::{CornerTable, Lattice, Vertex};
use glam::DVec3;

/// The input, and how far moved levels are from it; all in steps of the lattice.
#[derive(Debug)]
pub struct Moved<'a> {
    paths: Paths,
    places: Places<'a, i32>,
}

impl<'a> Moved<'a> {
    /// The input, its vertices on the lattice.
    pub fn new(input: CornerTable, bodies: Bodies, positions: &'a [[i32; 3]], bits: u32) -> Self {
        let lattice = Lattice { origin: [0.0; 3], step: 1.0, bits };
        Self { paths: Paths::of(input, bodies), places: Places { positions, frame: Frame::new(&lattice) } }
    }

    /// The largest distance of either surface from the other one, given that none of the level's vertices has moved farther than
    /// `farthest`; `moved` is where they are.
    pub fn error(&mut self, traces: &Traces, moved: &[[i32; 3]], farthest: f64) -> f64 {
        // Nothing is known of what has no numbers.
        if farthest == 0.0 || traces.most == 0.0 {
            return traces.most;
        }
        let (paths, places) = (&mut self.paths, self.places);
        let step = places.frame.step();
        let at = |v: Vertex| places.frame.inside(moved[v.index()].map(f64::from));
        // What is not among the traces is at most so far off.
        let rounding = 0.75f64.sqrt();
        let mut most = (farthest * step).powi(2);
        for [v, a, b, c] in traces.vertices.iter() {
            let [a, b, c] = [a, b, c].map(at);
            most = most.max(point_triangle_distance_squared(places.at(v), a, b, c));
        }
        let mut most = most as f32;
        let apart = |v: Vertex| places.at(v).distance(at(v));
        let bound = |(corners, &distance): ([Vertex; 4], &f32)| {
            let [a, b, ..] = corners;
            ((f64::from(distance) * step + apart(a).max(apart(b))) as f32, corners)
        };
        // What is hardly farther than something else may as well be told.
        let enough = most.sqrt() * NEARLY;
        let mut told = 0.0f32;
        let mut edges: Vec<_> = traces.edges.iter().zip(&traces.distances).map(bound).collect();
        edges.retain(|&(bound, _)| {
            told = told.max(if bound <= enough { bound } else { 0.0 });
            bound > enough
        });
        edges.sort_unstable_by(|x, y| y.0.total_cmp(&x.0));
        for (bound, corners) in edges {
            if bound <= most.sqrt() * NEARLY {
                told = told.max(bound);
                break;
            }
            let moved = corners.map(|v| if v == Vertex::NONE { DVec3::NAN } else { at(v) });
            let squared = paths.of_moved(&places, corners, moved, most);
            most = most.max(squared.min(bound * bound));
        }
        let found = f64::from(most.sqrt().max(told)) / step + rounding;
        found.max(traces.left_out + farthest).min(traces.most + farthest).max(traces.largest_missing)
    }
}

/// How much more a distance may be than what is known to be met, for it to be told without a closer look.
const NEARLY: f32 = 1.025;

#[cfg(test)]
mod tests {
    use super::super::fours::Fours;
    use super::*;

    /// A pyramid of height 300 on a square of side 1000, of which the level has the square, cut from corner 0 to corner 2.
    fn pyramid() -> (CornerTable, Traces, Vec<[i32; 3]>) {
        let positions = vec![[0, 0, 500], [1000, 0, 500], [1000, 1000, 500], [0, 1000, 500], [500, 500, 800]];
        let sides = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]];
        let input = CornerTable::from_triangles(5, &sides).unwrap();
        let [a, b, c, d, tip] = [0, 1, 2, 3, 4].map(Vertex);
        let traces = Traces {
            vertices: vec![[tip, a, b, c]].into(),
            edges: vec![[a, c, d, b]].into(),
            distances: vec![300.0],
            most: 300.0 + 0.75f64.sqrt(),
            left_out: 150.0,
            ..Traces::default()
        };
        (input, traces, positions)
    }

    fn error(up: i32, change: impl Fn(&mut Traces)) -> f64 {
        let (input, mut traces, finest) = pyramid();
        let mut moved = Moved::new(input, Bodies::default(), &finest, 10);
        let mut positions = finest.clone();
        change(&mut traces);
        for corner in [0, 2] {
            positions[corner][2] += up;
        }
        moved.error(&traces, &positions, f64::from(up.abs())) - 0.75f64.sqrt()
    }

    /// The tip's distance from the level: the cut is a ridge below it that rises, or a valley that sinks.
    fn of_tip(up: i32) -> f64 {
        let (height, up) = (f64::from(300 - up), f64::from(up));
        let half = 500.0 * 2f64.sqrt();
        if up > 0.0 { height } else { height * half / half.hypot(up) }
    }

    #[test]
    fn a_move_towards_the_input_is_no_loss() {
        for up in [0, 50, -50, -90] {
            let (found, far) = (error(up, |_| ()), of_tip(up));
            assert!((-0.01..0.025 * far).contains(&(found - far)), "{up}: {found} for {far}");
        }
        // What is nearer than 150 is not among the traces, so that more cannot be told.
        let found = error(120, |_| ());
        assert!((found - 270.0).abs() < 1.0, "{found}");
    }

    /// Vertices count without edges, and edges without vertices.
    #[test]
    fn both_kinds_of_traces_count() {
        for up in [50, -50] {
            let found = error(up, |traces| traces.edges = Fours::default());
            assert!((found - of_tip(up)).abs() < 0.01, "{up}: {found}");
            // The middle of the cut is nearest to the pyramid's sides, square to them.
            let found = error(up, |traces| traces.vertices = Fours::default());
            let far = f64::from(300 - up) * 500.0 / 500f64.hypot(300.0);
            assert!((found - far).abs() < 0.02, "{up}: {found} for {far}");
            // Without either, what may have been left out.
            let found = error(up, |traces| (traces.vertices, traces.edges) = Default::default());
            assert!((found - 200.0).abs() < 1.0, "{up}: {found}");
        }
    }

    /// Where the way round is long, the edge is no farther off than it was and one of its ends has moved.
    #[test]
    fn a_detour_does_not_count() {
        for end in [0, 2] {
            let (input, mut traces, finest) = pyramid();
            let mut moved = Moved::new(input, Bodies::default(), &finest, 10);
            let mut positions = finest.clone();
            traces.vertices = Fours::default();
            // Of the edge 40 are known: the way over the tip is not believed.
            traces.distances[0] = 40.0;
            (traces.most, traces.left_out) = (200.0, 20.0);
            positions[end][2] -= 10;
            let found = moved.error(&traces, &positions, 10.0) - 0.75f64.sqrt();
            assert!((found - 50.0).abs() < 0.01, "{end}: {found}");
        }
    }

    /// A vertex that has moved is as far off as it has moved, whatever else is near.
    #[test]
    fn moves_count_themselves() {
        let found = error(30, |traces| *traces = Traces { most: 1.0, ..Traces::default() });
        // No more than it was and has moved, rounding included once.
        assert!((found + 0.75f64.sqrt() - 30.866).abs() < 0.01, "{found}");
    }
}
