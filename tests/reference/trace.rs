//! What a level pass asks, reckons and reads, to be compared with the tables of §5.7.

use super::contexts;
use super::coordinates::Coordinate;
use super::position::{Frame, Mean, Slope};
use super::vector::Vector;
use super::walk::Edge;

#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    Split(Edge, contexts::Split, bool),
    /// Of p→q before r.
    Flip(Edge, usize, contexts::Flip, bool),
    /// Of a triangle from its corner in the walk.
    Face([usize; 3], bool),
    Attach(Edge, bool),
    /// a, b and c.
    Axes([f32; 3]),
    Coordinate(Coordinate),
    Placed(Box<Placed>),
}

/// The vertex of a split, once it has been learnt from.
#[derive(Clone, Debug, PartialEq)]
pub struct Placed {
    pub frame: Frame,
    /// D.
    pub deviations: [f32; 3],
    /// S.
    pub shifts: [f32; 2],
    pub expected: Vector,
    /// E.
    pub errors: [f32; 3],
    pub means: [Mean; 3],
    pub slopes: [Slope; 2],
}
