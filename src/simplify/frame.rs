//! The unit cube that simplification works in: areas and volumes of coordinates like 1e30 or 1e-40 stay numbers.

use crate::mesh::Lattice;
use glam::DVec3;

/// Moves and scales the lattice's cube to the unit cube.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    lattice: Lattice,
    side: f64,
}

impl Frame {
    /// The frame of a lattice; one without extent is only moved.
    pub fn new(lattice: &Lattice) -> Self {
        let side = lattice.step * f64::from(lattice.max_coordinate());
        Self { lattice: *lattice, side: if side > 0.0 && side.is_finite() { side } else { 1.0 } }
    }

    /// A position of the input, in the unit cube.
    pub fn inside(&self, p: [f64; 3]) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|k| (p[k] - self.lattice.origin[k]) / self.side))
    }

    /// The lattice point nearest to a point of the unit cube, in the unit cube.
    pub fn on_lattice(&self, p: DVec3) -> DVec3 {
        let max = f64::from(self.lattice.max_coordinate());
        if self.lattice.step > 0.0 { (p * max).round() / max } else { DVec3::ZERO }
    }

    /// A length of the unit cube in the input's units.
    pub fn length(&self, length: f64) -> f64 {
        length * self.side
    }
}
