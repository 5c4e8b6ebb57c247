//! The whole of level 0: the mesh with its residue (spec §8.5), which correction and order speak of.

use super::residue::Residue;
use super::walk::Tour;
use crate::entropy::CodingError;
use crate::error::{Error, FormatError};
use crate::limits::Budget;
use crate::mesh::{IndexedMesh, Lattice};
use crate::refine::ProgressiveMesh;

/// The whole of level 0.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Whole {
    /// Its vertices.
    pub vertices: Vec<Extra>,
    /// Its triangles: those of the walk, each from its corner there, then the further ones.
    pub triangles: Vec<[u32; 3]>,
    /// For each place in the walk, then for each further vertex, its number among `vertices`.
    pub names: Vec<u32>,
}

/// A vertex: in triangles of level 0 or in none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Extra {
    /// On the lattice, perhaps outside the cube; coordinates between -2^30 and 2^30, both excluded, so that differences are 32-bit numbers.
    Lattice([i32; 3]),
    /// Further away: the position itself.
    Exact([f64; 3]),
}

/// Why a residue, a correction or an order cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum WholeError {
    /// The code ends early or holds an impossible number.
    #[error("{0}")]
    Coding(#[from] CodingError),
    /// A name or a coordinate is out of range.
    #[error("{0}")]
    Range(&'static str),
    /// A limit was reached.
    #[error("{0}")]
    Limit(#[from] Error),
}

impl WholeError {
    /// As the fault of a file: of what stands at `offset`, against a section of the specification.
    pub fn at(self, offset: u64, section: &'static str) -> Error {
        match self {
            Self::Limit(limit) => limit,
            other => FormatError::new(offset, section, other.to_string()).into(),
        }
    }
}

impl Whole {
    /// Level 0 with everything that belongs to the input: vertices of a group are one again, reversed triangles are turned
    /// back, further vertices and triangles are added.
    pub fn new(mesh: &ProgressiveMesh, residue: &Residue, tour: &Tour) -> Self {
        let mut whole = Self::default();
        whole.name_vertices(mesh, residue, tour);
        let mut place = vec![0; mesh.table.vertex_slots()];
        for (k, v) in tour.vertices.iter().enumerate() {
            place[v.index()] = k as u32;
        }
        whole.triangles.reserve_exact(tour.walk.triangles.len() + residue.triangles.len());
        for (k, &c) in tour.walk.triangles.iter().enumerate() {
            let mut t =
                [c, c.next(), c.prev()].map(|c| whole.names[place[mesh.table.vertex(c).index()] as usize]);
            if residue.is_flipped(k) {
                t.swap(1, 2);
            }
            whole.triangles.push(t);
        }
        let further = residue.triangles.iter().map(|t| t.map(|v| whole.names[v as usize]));
        whole.triangles.extend(further);
        whole
    }

    fn name_vertices(&mut self, mesh: &ProgressiveMesh, residue: &Residue, tour: &Tour) {
        let most = tour.vertices.len() + residue.extras.len();
        self.names.reserve_exact(most);
        self.vertices.reserve_exact(most);
        // Groups are numbered by their first vertex.
        let mut first = Vec::with_capacity(residue.group_count());
        for (k, v) in tour.vertices.iter().enumerate() {
            let fresh = self.vertices.len() as u32;
            let group = residue.groups.get(k).map_or(u32::MAX, |&group| group) as usize;
            if group == first.len() {
                first.push(fresh);
            }
            let name = first.get(group).copied().unwrap_or(fresh);
            self.names.push(name);
            if name == fresh {
                self.vertices.push(Extra::Lattice(mesh.positions[v.index()]));
            }
        }
        for extra in &residue.extras {
            self.names.push(self.vertices.len() as u32);
            self.vertices.push(*extra);
        }
    }

    /// Bytes that it takes to make one.
    pub fn bytes(mesh: &ProgressiveMesh, residue: &Residue) -> usize {
        let vertices = mesh.table.vertex_slots();
        let names = vertices + residue.extras.len();
        let triangles = mesh.table.triangle_count() + residue.triangles.len();
        // Places and first vertices of groups are as many as vertices, at most.
        names * (size_of::<Extra>() + 4) + vertices * (4 + 4) + triangles * 12
    }

    /// Where its vertices are.
    pub fn positions(&self, lattice: &Lattice) -> Vec<[f64; 3]> {
        self.vertices.iter().map(|vertex| vertex.position(lattice)).collect()
    }

    /// Its vertices in their places on the lattice.
    pub fn on_lattice(self, lattice: &Lattice) -> IndexedMesh {
        IndexedMesh::new(self.positions(lattice), self.triangles)
    }
}

impl Extra {
    /// Where it is.
    pub fn position(&self, lattice: &Lattice) -> [f64; 3] {
        match *self {
            Self::Lattice(q) => lattice.position(q),
            Self::Exact(p) => p,
        }
    }
}

/// Debits the budget for some further items ahead, at item `k`.
pub(super) fn spend(budget: &mut Budget, k: usize) -> Result<(), WholeError> {
    if k.is_multiple_of(AHEAD) {
        budget.take_memory(AHEAD, BYTES_AN_ITEM)?;
        budget.take_work(AHEAD as u64 * WORK_AN_ITEM)?;
    }
    Ok(())
}

/// Items that the budget is debited for at a time.
const AHEAD: usize = 1024;
/// What an item takes: 32 bytes, in a list that has just been copied to one twice as long.
const BYTES_AN_ITEM: usize = 96;
/// Units of work for one.
const WORK_AN_ITEM: u64 = 16;
