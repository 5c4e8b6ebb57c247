//! Parallel removal of vertices for a view (Odaker, Kranzlmueller and Volkert, WSCG 2016; with the rule of their paper of 2015 as an
//! option). Many vertices go at once, each to a neighbour, without a word between them; a few such iterations leave a coarse mesh whose
//! vertices are some of the input's.
//!
//! Every decision is made in integers, by flags that have one owner or that whoever likes may set: the mesh is the same for any number
//! of threads and on a GPU. What the paper leaves open is settled so:
//! - A move holds if no triangle turns over whichever of the other moves are carried out: [`Guard::Veto`] looks at all triangles with
//!   several movers and calls off the dearest.
//! - Then each vertex looks at the triangles it would have. Where they are no sheet any more, or the boundary would have come or gone,
//!   the dearest of the moves round it is called off, until all is well: a manifold stays one.
//! - Vertices round which the surface is no manifold to begin with, or which have more than 255 triangles, stay with all round them.

mod curvature;
mod frame;
mod guaranteed;
mod integer;
mod propose;
mod snapshot;
mod veto;
mod view;
mod workers;

#[cfg(feature = "gpu")]
pub(crate) use frame::{Patience, Settled, Steps, iterate};
pub use view::{Sight, View};

use super::rings::Rings;
use super::working::{LeftOut, Working};
use crate::error::{Error, Result};
use crate::mesh::{IndexedMesh, Lattice, lattice};
use guaranteed::Bent;
use integer::{LATTICE_BITS, Point};
use snapshot::{Fan, Shape};

/// Which vertices are candidates, and where they may go.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rule {
    /// Beside one that stays, and to one that stays.
    Of2015,
    /// Beside one that stays or an auxiliary one, and to any that is no candidate.
    #[default]
    Of2016,
}

/// What keeps moves of one iteration from each other's way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Guard {
    /// Those that do not go together are called off: most vertices an iteration.
    #[default]
    Veto,
    /// None is made that could be in another's way, whatever that does, as in the papers; some are so for ever.
    Blind,
    /// Of neighbours the cheapest goes: many iterations, less far from the input.
    Independent,
}

/// How vertices are removed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// Which are candidates.
    pub rule: Rule,
    /// What keeps them apart.
    pub guard: Guard,
    /// Threads; 0: as many as there are processors.
    pub threads: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self { rule: Rule::default(), guard: Guard::default(), threads: 1 }
    }
}

/// What happened in an iteration.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Iteration {
    /// Vertices that were to be removed.
    pub candidates: usize,
    /// Those that found a neighbour to go to.
    pub proposed: usize,
    /// Those that went.
    pub removed: usize,
}

/// A mesh for a view.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Simplified {
    /// With the numbers of the surface's vertices, in the order of its triangles.
    pub triangles: Vec<[u32; 3]>,
    /// What happened, to the last iteration in which something went, or could not.
    pub iterations: Vec<Iteration>,
}

/// A mesh that is made ready once, for any number of views.
#[derive(Debug)]
pub struct Surface {
    positions: Vec<[f64; 3]>,
    points: Vec<Point>,
    lattice: Lattice,
    scale: f64,
    triangles: Vec<[u32; 3]>,
    rings: Rings,
    guaranteed: Vec<bool>,
    auxiliary: Vec<bool>,
    boundary: Vec<bool>,
    /// Those round which nothing moves.
    locked: Vec<bool>,
    left_out: LeftOut,
}

impl Surface {
    /// Picks the vertices that always stay, no two of which are nearer to each other than `spacing` edges, 1 to 255, and the auxiliary
    /// ones. What else the mesh has than positions and triangles is not looked at.
    ///
    /// # Errors
    /// [`Error::Parameter`] where a triangle names a vertex that does not exist or whose coordinates are no finite numbers, or for a
    /// spacing out of its range; [`Error::Limit`] for more than 2^32 / 3 triangles.
    pub fn new(mesh: &IndexedMesh, spacing: u32) -> Result<Self> {
        let Some(spacing) = u8::try_from(spacing).ok().filter(|&spacing| spacing > 0) else {
            return Err(Error::Parameter(format!("a spacing of {spacing} edges: 1 to 255 can be")));
        };
        let (mut working, left_out) = Working::new(mesh, false, false)?;
        let scale = working.scale();
        let (positions, triangles) = (working.positions, working.triangles);
        let (min, max) = lattice::bounds(positions.iter().copied()).unwrap_or_default();
        let lattice = Lattice::over(min, max, LATTICE_BITS);
        let points: Vec<Point> = positions.iter().map(|&p| lattice.quantise(p)).collect();
        let mut rings = std::mem::take(&mut working.rings);
        rings.rebuild(points.len(), &triangles);
        let curvature: Vec<f64> = {
            let mut wings = Vec::new();
            let all = 0..points.len() as u32;
            all.map(|v| curvature::curvature(v, &points, &triangles, &rings, &mut wings)).collect()
        };
        let bent = Bent { triangles: &triangles, rings: &rings, curvature: &curvature };
        let guaranteed = bent.guaranteed(spacing);
        let auxiliary = bent.auxiliary(&guaranteed);
        let mut fan = Fan::default();
        let shapes: Vec<Option<Shape>> = (0..points.len() as u32)
            .map(|v| {
                fan.gather_wings(v, &triangles, &rings);
                fan.shape()
            })
            .collect();
        let boundary = shapes.iter().map(|shape| *shape == Some(Shape::Open)).collect();
        let mut locked: Vec<bool> = shapes.iter().map(Option::is_none).collect();
        for triangle in triangles.iter().filter(|t| t.iter().any(|&v| shapes[v as usize].is_none())) {
            triangle.iter().for_each(|&v| locked[v as usize] = true);
        }
        Ok(Self {
            positions,
            points,
            lattice,
            scale,
            triangles,
            rings,
            guaranteed,
            auxiliary,
            boundary,
            locked,
            left_out,
        })
    }

    /// Removes vertices until no more can go: those whose error the view does not see, or, without a view, all that need not stay.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a view out of range; [`Error::Io`] where the system has no threads.
    pub fn simplify(&self, view: Option<&View>, options: Options) -> Result<Simplified> {
        let sight = view.map(|view| view.on(self)).transpose()?;
        frame::run(self, sight, options)
    }

    /// The mesh of such triangles; every vertex is in one.
    pub fn mesh(&self, triangles: &[[u32; 3]]) -> IndexedMesh {
        let mut names = vec![u32::MAX; self.positions.len()];
        triangles.as_flattened().iter().for_each(|&v| names[v as usize] = 0);
        let (mut positions, back) = (Vec::new(), self.scale.recip());
        for (name, position) in names.iter_mut().zip(&self.positions).filter(|(name, _)| **name == 0) {
            *name = positions.len() as u32;
            positions.push(position.map(|x| x * back));
        }
        IndexedMesh::new(positions, triangles.iter().map(|t| t.map(|v| names[v as usize])).collect())
    }

    /// Its triangles.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// For each vertex where its triangles begin, and for the last one where they end; then the triangles round each.
    #[cfg(feature = "gpu")]
    pub(crate) fn rings(&self) -> (&[u32], &[u32]) {
        (&self.rings.starts, &self.rings.triangles)
    }

    /// Its vertices on the lattice on which all is decided, of 20 bits a coordinate.
    pub fn points(&self) -> &[[i32; 3]] {
        &self.points
    }

    /// Flags of the vertices that always stay.
    pub fn guaranteed(&self) -> &[bool] {
        &self.guaranteed
    }

    /// Flags of the auxiliary vertices.
    pub fn auxiliary(&self) -> &[bool] {
        &self.auxiliary
    }

    /// Flags of the vertices on the boundary.
    pub fn boundary(&self) -> &[bool] {
        &self.boundary
    }

    /// Flags of the vertices that stay since the surface is no manifold there, or which have very many triangles, and of those beside
    /// them.
    pub fn locked(&self) -> &[bool] {
        &self.locked
    }

    /// What was of no use from the start.
    pub fn left_out(&self) -> LeftOut {
        self.left_out
    }
}

#[cfg(test)]
mod tests;
