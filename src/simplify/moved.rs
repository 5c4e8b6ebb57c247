//! How far a level is off once its vertices have moved.
//!
//! The moved level has the paths and the covering of the one before: what was mapped to a triangle, an edge or a vertex still is. So it is
//! as far off as the removed vertices from their triangles, the paths from their edges, and the vertices from where they were. Only what
//! was far off, or has moved far, is looked at again.

use super::covering::Traces;
use super::frame::{Frame, Places};
use super::paths::Paths;
use crate::mesh::distance::point_triangle_distance_squared;
use crate::mesh::{CornerTable, Lattice, Vertex};

/// The input, and how far moved levels are from it; all in steps of the lattice.
#[derive(Debug)]
pub struct Moved {
    paths: Paths,
    positions: Vec<[f64; 3]>,
    frame: Frame,
}

impl Moved {
    /// The input, its vertices on the lattice.
    pub fn new(input: CornerTable, positions: &[[i32; 3]], bits: u32) -> Self {
        let lattice = Lattice { origin: [0.0; 3], step: 1.0, bits };
        Self {
            paths: Paths::of(input),
            positions: positions.iter().map(|p| p.map(f64::from)).collect(),
            frame: Frame::new(&lattice),
        }
    }

    /// The largest distance of either surface from the other one, given that none of the level's vertices has moved farther than
    /// `farthest`; `moved` is where they are.
    pub fn error(&mut self, traces: &Traces, moved: &[[i32; 3]], farthest: f64) -> f64 {
        // Nothing is known of what has no numbers.
        if farthest == 0.0 || traces.most == 0.0 {
            return traces.most;
        }
        let step = self.frame.step();
        let places = Places { positions: &self.positions, frame: self.frame };
        let at = |v: Vertex| self.frame.inside(moved[v.index()].map(f64::from));
        // What is not among the traces is at most so far off.
        let rounding = 0.75f64.sqrt();
        let mut most = (farthest * step).powi(2);
        for &(v, corners) in &traces.vertices {
            let [a, b, c] = corners.map(at);
            most = most.max(point_triangle_distance_squared(places.at(v), a, b, c));
        }
        let mut most = most as f32;
        let apart = |v: Vertex| places.at(v).distance(at(v));
        let bound = |&(corners, distance): &([Vertex; 4], f32)| {
            let [a, b, ..] = corners;
            ((f64::from(distance) * step + apart(a).max(apart(b))) as f32, corners)
        };
        let mut edges: Vec<_> = traces.edges.iter().map(bound).collect();
        edges.sort_unstable_by(|x, y| y.0.total_cmp(&x.0));
        let mut told = 0.0f32;
        for (bound, corners) in edges {
            if bound <= most.sqrt() * NEARLY {
                told = told.max(bound);
                break;
            }
            // Vertices of the boundary stay, and so do its edges.
            let squared = match corners {
                [.., Vertex::NONE] => bound * bound,
                _ => self.paths.of_moved(&places, corners, corners.map(at), most),
            };
            most = most.max(squared);
        }
        let found = f64::from(most.sqrt().max(told)) / step + rounding;
        found.max(0.5 * traces.most + farthest).min(traces.most + farthest)
    }
}

/// How much more a distance may be than what is known to be met, for it to be told without a closer look.
const NEARLY: f32 = 1.025;
