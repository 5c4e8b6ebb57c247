//! What level 0 lacks of the input: the residue, and where it is asked for the correction and the order. All of it is
//! named by places in the walk of level 0.

use super::residue::{Named, turned};
use super::{Options, grids};
use crate::codec::correction::Correction;
use crate::codec::grid::Real;
use crate::codec::residue::{Extra, ResidueCounts, ResidueError, Whole};
use crate::codec::walk::Walk;
use crate::error::{Error, Result};
use crate::mesh::topology::Conditioned;
use crate::mesh::{IndexedMesh, Lattice, Vertex};
use crate::refine::ProgressiveMesh;

/// The payloads of level 0; those that are not wanted are empty.
#[derive(Debug, Default)]
pub struct Payloads {
    /// The residue.
    pub residue: Vec<u8>,
    /// What it holds.
    pub counts: ResidueCounts,
    /// The correction.
    pub correction: Vec<u8>,
}

/// What is kept of the input until level 0 is there.
#[derive(Debug)]
pub struct Finish<'a> {
    input: &'a IndexedMesh,
    exact: Option<Real>,
    /// Whether vertices that are the same have zeros of other signs.
    zeros_differ: bool,
    /// The triangles of the conditioned table, where they will be needed.
    triangles: Vec<[Vertex; 3]>,
}

impl<'a> Finish<'a> {
    /// Keeps what it takes.
    pub fn new(input: &'a IndexedMesh, conditioned: &Conditioned, options: &Options) -> Self {
        let same = &conditioned.origins.same;
        let zeros_differ =
            options.exact.is_some() && (0..same.len()).any(|v| other_signs(input, v, same[v] as usize) != 0);
        let mut triangles = Vec::new();
        if zeros_differ {
            triangles = conditioned.table.triangles().map(|t| conditioned.table.triangle(t)).collect();
        }
        Self { input, exact: options.exact, zeros_differ, triangles }
    }

    /// Writes what belongs to level 0, `mesh`, whose vertices have the numbers of the conditioned table.
    ///
    /// # Errors
    /// [`Error::Parameter`] where a part has a number that cannot be written.
    pub fn payloads(
        &mut self,
        conditioned: &mut Conditioned,
        mesh: &ProgressiveMesh,
        lattice: &Lattice,
    ) -> Result<Payloads> {
        let walk = Walk::new(&mesh.table, &mesh.roots);
        let named = Named::new(conditioned, mesh, &walk, lattice);
        let mut payloads = Payloads { counts: named.residue.counts(), ..Payloads::default() };
        let cannot = |e: ResidueError| Error::Parameter(e.to_string());
        if !named.residue.is_empty() {
            payloads.residue = named.residue.encode(mesh).map_err(cannot)?;
        }
        let Some(real) = self.exact else { return Ok(payloads) };
        let whole = named.residue.whole(mesh, &walk);
        let vertices = named.vertices(conditioned, &whole);
        let correction = self.correction(real, conditioned, &named, &whole, &vertices, lattice);
        payloads.correction = correction.encode(&whole, lattice).map_err(cannot)?;
        Ok(payloads)
    }

    fn correction(
        &self,
        real: Real,
        conditioned: &Conditioned,
        named: &Named,
        whole: &Whole,
        vertices: &[u32],
        lattice: &Lattice,
    ) -> Correction {
        let mut positions = vec![[0.0; 3]; whole.vertices.len()];
        for (v, &first) in conditioned.origins.same.iter().enumerate() {
            if first as usize == v {
                positions[vertices[v] as usize] = self.input.positions[v];
            }
        }
        let near = || whole.vertices.iter().zip(&positions).filter(|(v, _)| matches!(v, Extra::Lattice(_)));
        let step = near().count().div_ceil(SAMPLES).max(1);
        let grids = std::array::from_fn(|k| {
            let samples = near().step_by(step).map(|(v, x)| (x[k], v.position(lattice)[k]));
            grids::choose(&samples.collect::<Vec<_>>(), lattice.step * 0.5, real)
        });
        let mut correction = Correction { real, grids, positions, ..Correction::default() };
        if self.zeros_differ {
            self.copies(&mut correction, conditioned, named, whole, vertices);
        }
        correction
    }

    /// Copies of vertices of which corners have other zeros.
    fn copies(
        &self,
        correction: &mut Correction,
        conditioned: &Conditioned,
        named: &Named,
        whole: &Whole,
        vertices: &[u32],
    ) {
        let same = &conditioned.origins.same;
        let signs = |v: u32| other_signs(self.input, v as usize, same[v as usize] as usize);
        let copy_of = |v: u32| (signs(v) != 0).then(|| (vertices[v as usize], signs(v)));
        let corners = || {
            let input = self.input_triangles(conditioned, named, whole, vertices);
            input.into_iter().enumerate().flat_map(|(t, (from, turn))| {
                let corners = self.input.triangles[from as usize];
                (0..3).map(move |k| (3 * t as u32 + k, corners[(k + 3 - turn) as usize % 3]))
            })
        };
        correction.copies = corners().filter_map(|(_, v)| copy_of(v)).collect();
        correction.copies.sort_unstable();
        correction.copies.dedup();
        let place = |copy| correction.copies.binary_search(&copy).ok().map(|place| place as u32);
        correction.corners = corners().filter_map(|(c, v)| Some((c, copy_of(v).and_then(place)?))).collect();
    }

    /// For each triangle of the whole that of the input, and at which of its corners, 0 to 2, that begins.
    fn input_triangles(
        &self,
        conditioned: &Conditioned,
        named: &Named,
        whole: &Whole,
        vertices: &[u32],
    ) -> Vec<(u32, u32)> {
        let in_table = &conditioned.origins.in_table;
        let mut sorted: Vec<([Vertex; 3], u32)> = self
            .triangles
            .iter()
            .zip(in_table.iter_ones())
            .map(|(&t, from)| (turned(t), from as u32))
            .collect();
        sorted.sort_unstable();
        let further: Vec<u32> = in_table.iter_zeros().map(|from| from as u32).collect();
        let in_walk = named.triangles.iter().enumerate().map(|(k, &t)| {
            let place = sorted.binary_search_by(|(other, _)| other.cmp(&turned(t)));
            let from = sorted[place.expect("level 0 has the triangles of the table")].1;
            let first = vertices[self.input.triangles[from as usize][0] as usize];
            let turn = whole.triangles[k].iter().position(|&v| v == first);
            (from, turn.expect("they have the same vertices") as u32)
        });
        in_walk.chain(named.further.iter().map(|&k| (further[k as usize], 0))).collect()
    }
}

/// The axes, as bits, on which two vertices in one place have zeros of different signs.
fn other_signs(mesh: &IndexedMesh, v: usize, w: usize) -> u8 {
    let (v, w) = (mesh.positions[v], mesh.positions[w]);
    (0..3).fold(0, |axes, k| axes | u8::from(v[k].to_bits() != w[k].to_bits()) << k)
}

/// Coordinates of an axis by which its grids are chosen, at most.
const SAMPLES: usize = 4096;
