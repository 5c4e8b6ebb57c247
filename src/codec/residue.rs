//! The residue: what no manifold can hold, and how cut places are sewn together (spec §8). Level 0 only.
//!
//! Vertices and triangles are named by their place in the walk of level 0, so that replay and keyframe serve alike.

use super::walk::Walk;
use crate::entropy::{Bit, BitCoder, CodingError, NumberModel, RangeDecoder};
use crate::limits::Budget;
use crate::mesh::{IndexedMesh, Lattice};
use crate::refine::ProgressiveMesh;
use bitvec::vec::BitVec;
use std::collections::HashMap;

/// A vertex in no triangle of level 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Extra {
    /// On the lattice, perhaps outside the cube; coordinates between -2^30 and 2^30, both excluded, so that differences are 32-bit numbers.
    Lattice([i32; 3]),
    /// Further away: the position itself.
    Exact([f64; 3]),
}

/// What level 0 lacks of the input.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Residue {
    /// For each triangle in walk order whether the input had it the other way round; empty where none was.
    pub flipped: BitVec,
    /// For each vertex in walk order the group of vertices it is sewn to, `u32::MAX` for none; empty where there are none.
    /// Groups are numbered by their first vertex.
    pub groups: Vec<u32>,
    /// Vertices in no triangle of level 0: those on the lattice first.
    pub extras: Vec<Extra>,
    /// Further triangles: a place in the walk, or the number of vertices plus a place among the extras.
    pub triangles: Vec<[u32; 3]>,
}

/// How much a residue holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ResidueCounts {
    /// Further triangles.
    pub triangles: usize,
    /// Groups of vertices sewn together.
    pub groups: usize,
    /// Vertices in those groups.
    pub grouped_vertices: usize,
    /// Triangles that the input had the other way round.
    pub reversed_triangles: usize,
    /// Further vertices.
    pub extra_vertices: usize,
}

/// Largest magnitude of a lattice coordinate outside the cube.
pub const MAX_OUTSIDE: i32 = Lattice::MAX_OUTSIDE;
const NONE: u32 = u32::MAX;

/// Why a residue, a correction or an order cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ResidueError {
    /// The code ends early or holds an impossible number.
    #[error("{0}")]
    Coding(#[from] CodingError),
    /// A name or a coordinate is out of range.
    #[error("{0}")]
    Range(&'static str),
    /// A limit was reached.
    #[error("{0}")]
    Limit(crate::error::Error),
}

impl Residue {
    /// Whether there is nothing to say.
    pub fn is_empty(&self) -> bool {
        self.flipped.not_any()
            && self.groups.is_empty()
            && self.extras.is_empty()
            && self.triangles.is_empty()
    }

    /// Number of groups of vertices sewn together.
    pub fn group_count(&self) -> usize {
        self.groups.iter().filter(|&&g| g != NONE).max().map_or(0, |&g| g as usize + 1)
    }

    /// How much it holds.
    pub fn counts(&self) -> ResidueCounts {
        ResidueCounts {
            triangles: self.triangles.len(),
            groups: self.group_count(),
            grouped_vertices: self.groups.iter().filter(|&&g| g != NONE).count(),
            reversed_triangles: self.flipped.count_ones(),
            extra_vertices: self.extras.len(),
        }
    }

    /// Writes the residue of `mesh`, level 0.
    #[cfg(feature = "encode")]
    pub fn encode(&self, mesh: &ProgressiveMesh) -> Result<Vec<u8>, ResidueError> {
        let mut coder = crate::entropy::RangeEncoder::default();
        let mut copy = self.clone();
        let budget = &mut Budget::new(crate::limits::Limits { memory: u64::MAX, work: u64::MAX });
        copy.code(mesh, &mut coder, budget)?;
        Ok(coder.finish())
    }

    /// Reads the residue of `mesh`, level 0.
    ///
    /// # Errors
    /// [`ResidueError`]; memory grows with what has been read.
    pub fn decode(bytes: &[u8], mesh: &ProgressiveMesh, budget: &mut Budget) -> Result<Self, ResidueError> {
        let mut coder = RangeDecoder::new(bytes);
        let mut residue = Self::default();
        residue.code(mesh, &mut coder, budget)?;
        coder.finish()?;
        Ok(residue)
    }

    fn code<C: BitCoder>(
        &mut self,
        mesh: &ProgressiveMesh,
        coder: &mut C,
        budget: &mut Budget,
    ) -> Result<(), ResidueError> {
        self.code_flipped(mesh.table.triangle_count(), coder)?;
        self.code_groups(mesh, coder)?;
        self.code_extras(coder, budget)?;
        let vertices = mesh.table.corners.iter().filter(|c| c.is_some()).count();
        self.code_triangles(vertices as u32, coder, budget)
    }

    fn code_flipped<C: BitCoder>(&mut self, triangles: usize, coder: &mut C) -> Result<(), ResidueError> {
        if !coder.even(|| self.flipped.any()) {
            self.flipped.clear();
            return Ok(());
        }
        let mut models = [Bit::NEW; 2];
        let mut last = false;
        self.flipped.resize(triangles, false);
        for mut place in self.flipped.iter_mut() {
            last = coder.bit(&mut models[usize::from(last)], || *place);
            *place = last;
            coder.check()?;
        }
        Ok(())
    }

    /// A vertex of a group joins one of the groups at its position, or begins one.
    fn code_groups<C: BitCoder>(
        &mut self,
        mesh: &ProgressiveMesh,
        coder: &mut C,
    ) -> Result<(), ResidueError> {
        if !coder.even(|| !self.groups.is_empty()) {
            return Ok(());
        }
        let mut models = [Bit::NEW; 2];
        let mut choice = NumberModel::default();
        let mut at_position: HashMap<[i32; 3], Vec<u32>> = HashMap::new();
        // For each group its place among those at its position, from 1.
        let mut places = Vec::new();
        let mut last = false;
        let order = Walk::new(&mesh.table, &mesh.roots).vertices(&mesh.table);
        self.groups.resize(order.len(), NONE);
        for (group, v) in self.groups.iter_mut().zip(order) {
            last = coder.bit(&mut models[usize::from(last)], || *group != NONE);
            coder.check()?;
            if !last {
                *group = NONE;
                continue;
            }
            let here = at_position.entry(mesh.positions[v.index()]).or_default();
            let mut chosen = 0;
            if !here.is_empty() {
                chosen = choice.unsigned(coder, || places.get(*group as usize).copied().unwrap_or(0))?;
            }
            *group = match chosen {
                0 => {
                    let fresh = places.len() as u32;
                    here.push(fresh);
                    places.push(here.len() as u32);
                    fresh
                }
                k => *here
                    .get(k as usize - 1)
                    .ok_or(ResidueError::Range("there is no such group of vertices"))?,
            };
        }
        Ok(())
    }

    fn code_extras<C: BitCoder>(&mut self, coder: &mut C, budget: &mut Budget) -> Result<(), ResidueError> {
        let mut number = NumberModel::default();
        let near = self.extras.iter().take_while(|e| matches!(e, Extra::Lattice(_))).count() as u32;
        let far = self.extras.len() as u32 - near;
        let near = number.unsigned(coder, || near)?;
        let far = number.unsigned(coder, || far)?;
        let known = std::mem::take(&mut self.extras);
        let mut axes = vec![NumberModel::default(); 3];
        let mut last = [0i32; 3];
        for k in 0..near as usize {
            spend(budget, k)?;
            let truth = match known.get(k) {
                Some(Extra::Lattice(q)) => *q,
                _ => [0; 3],
            };
            for i in 0..3 {
                last[i] = last[i].wrapping_add(axes[i].signed(coder, || truth[i] - last[i])?);
            }
            if last.iter().any(|x| x.unsigned_abs() > MAX_OUTSIDE as u32) {
                return Err(ResidueError::Range("the coordinate of a further vertex is out of range"));
            }
            coder.check()?;
            self.extras.push(Extra::Lattice(last));
        }
        for k in 0..far as usize {
            spend(budget, k)?;
            let truth = match known.get(near as usize + k) {
                Some(Extra::Exact(p)) => *p,
                _ => [0.0; 3],
            };
            let position = truth.map(|x| {
                let bits = x.to_bits();
                f64::from_bits(
                    (0..64).rev().fold(0, |n, b| n << 1 | u64::from(coder.even(|| bits >> b & 1 == 1))),
                )
            });
            if position.iter().any(|x| !x.is_finite()) {
                return Err(ResidueError::Range("the coordinate of a further vertex is not finite"));
            }
            coder.check()?;
            self.extras.push(Extra::Exact(position));
        }
        Ok(())
    }

    fn code_triangles<C: BitCoder>(
        &mut self,
        vertices: u32,
        coder: &mut C,
        budget: &mut Budget,
    ) -> Result<(), ResidueError> {
        let mut number = NumberModel::default();
        let count = number.unsigned(coder, || self.triangles.len() as u32)?;
        let known = std::mem::take(&mut self.triangles);
        let names = i64::from(vertices) + self.extras.len() as i64;
        let mut models = vec![NumberModel::default(); 3];
        let mut last = 0i32;
        for k in 0..count as usize {
            spend(budget, k)?;
            let truth = known.get(k).copied().unwrap_or_default().map(|v| v as i32);
            let mut triangle = [0; 3];
            let mut from = last;
            for i in 0..3 {
                let v = from.wrapping_add(models[i].signed(coder, || truth[i] - from)?);
                if !(0..names).contains(&i64::from(v)) {
                    return Err(ResidueError::Range("a further triangle names a vertex that does not exist"));
                }
                triangle[i] = v as u32;
                from = triangle[0] as i32;
            }
            last = from;
            coder.check()?;
            self.triangles.push(triangle);
        }
        Ok(())
    }

    /// Level 0 with everything that belongs to the input: vertices of a group are one again, reversed triangles are
    /// turned back, further vertices and triangles are added.
    pub fn assemble(&self, mesh: &ProgressiveMesh, walk: &Walk, lattice: &Lattice) -> IndexedMesh {
        self.whole(mesh, walk).on_lattice(lattice)
    }

    /// As [`Residue::assemble`], vertices still as points of the lattice.
    pub fn whole(&self, mesh: &ProgressiveMesh, walk: &Walk) -> Whole {
        let order = walk.vertices(&mesh.table);
        let mut place = vec![NONE; mesh.table.vertex_slots()];
        for (k, v) in order.iter().enumerate() {
            place[v.index()] = k as u32;
        }
        let mut first = HashMap::new();
        let mut whole =
            Whole { names: Vec::with_capacity(order.len() + self.extras.len()), ..Whole::default() };
        for (k, v) in order.iter().enumerate() {
            let fresh = whole.vertices.len() as u32;
            let name = match self.groups.get(k) {
                Some(&group) if group != NONE => *first.entry(group).or_insert(fresh),
                _ => fresh,
            };
            whole.names.push(name);
            if name == fresh {
                whole.vertices.push(Extra::Lattice(mesh.positions[v.index()]));
            }
        }
        for extra in &self.extras {
            whole.names.push(whole.vertices.len() as u32);
            whole.vertices.push(*extra);
        }
        for (k, &c) in walk.triangles.iter().enumerate() {
            let mut t =
                [c, c.next(), c.prev()].map(|c| whole.names[place[mesh.table.vertex(c).index()] as usize]);
            if self.is_flipped(k) {
                t.swap(1, 2);
            }
            whole.triangles.push(t);
        }
        let further = self.triangles.iter().map(|t| t.map(|v| whole.names[v as usize]));
        whole.triangles.extend(further);
        whole
    }

    /// Whether the input had triangle `k` of the walk the other way round.
    pub fn is_flipped(&self, k: usize) -> bool {
        self.flipped.get(k).is_some_and(|flipped| *flipped)
    }
}

/// The whole of level 0 (spec §8.5).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Whole {
    /// Its vertices.
    pub vertices: Vec<Extra>,
    /// Its triangles: those of the walk, each from its corner there, then the further ones.
    pub triangles: Vec<[u32; 3]>,
    /// For each place in the walk, then for each further vertex, its number among `vertices`.
    pub names: Vec<u32>,
}

impl Whole {
    /// Its vertices in their places on the lattice.
    pub fn on_lattice(self, lattice: &Lattice) -> IndexedMesh {
        let positions = self.vertices.iter().map(|vertex| vertex.position(lattice)).collect();
        IndexedMesh::new(positions, self.triangles)
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

/// Debits the budget for some further items ahead.
pub(super) fn spend(budget: &mut Budget, k: usize) -> Result<(), ResidueError> {
    if k.is_multiple_of(1024) {
        budget.take_memory(1024, 64).map_err(ResidueError::Limit)?;
        budget.take_work(1024 * 16).map_err(ResidueError::Limit)?;
    }
    Ok(())
}
