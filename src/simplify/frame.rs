//! The unit cube that simplification works in: areas and volumes of coordinates like 1e30 or 1e-40 stay numbers.

use crate::mesh::{Lattice, Vertex};
use glam::DVec3;

/// Moves and scales the lattice's cube to the unit cube.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    lattice: Lattice,
    side: f64,
    scale: f64,
}

impl Frame {
    /// The frame of a lattice; one without extent is only moved.
    pub fn new(lattice: &Lattice) -> Self {
        let side = lattice.step * f64::from(lattice.max_coordinate());
        let side = if side > 0.0 && side.is_finite() && (1.0 / side).is_finite() { side } else { 1.0 };
        Self { lattice: *lattice, side, scale: 1.0 / side }
    }

    /// A position of the input, in the unit cube.
    #[inline]
    pub fn inside(&self, p: [f64; 3]) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|k| (p[k] - self.lattice.origin[k]) * self.scale))
    }

    /// The lattice's step, in the unit cube.
    pub fn step(&self) -> f64 {
        self.lattice.step * self.scale
    }

    /// A length of the unit cube in the input's units.
    pub fn length(&self, length: f64) -> f64 {
        length * self.side
    }
}

/// Input positions, as numbers or in steps of a lattice, seen in the unit cube.
#[derive(Clone, Copy, Debug)]
pub struct Places<'a, T = f64> {
    /// In the input's units.
    pub positions: &'a [[T; 3]],
    /// The cube.
    pub frame: Frame,
}

impl<T: Copy + Into<f64>> Places<'_, T> {
    /// Where a vertex lies, in the unit cube.
    #[inline]
    pub fn at(&self, v: Vertex) -> DVec3 {
        self.frame.inside(self.positions[v.index()].map(Into::into))
    }
}
