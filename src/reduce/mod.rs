//! Mesh to coarser mesh: discrete levels of detail, without a history, whose vertices need not be those of the input.
//!
//! [`Method::Hqms`] is the default: contracts edges in linear time, nearer to the input than a full queue is. It and its peers take any
//! triangles; where these are no manifold, vertices stay, or the topology is left free.

mod choices;
mod cluster;
mod collapse;
mod fit;
mod incremental;
pub mod morph;
mod octree;
mod parents;
mod pipeline;
mod quadric;
mod queue;
pub mod removal;
mod rings;
mod selection;
mod star;
pub mod texture;
mod uniform;
mod wedges;
mod working;

pub use collapse::Topology;
pub use parents::NO_VERTEX;
pub use quadric::Weights;
pub use working::LeftOut;

use crate::error::{Error, Result};
use crate::mesh::IndexedMesh;
use working::Working;

/// How a mesh is made coarser.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Method {
    /// Passes of contractions that a small heap picks (Chen and others 2004, 2006); linear time.
    #[default]
    Hqms,
    /// The cheapest of all edges, by a queue (Garland and Heckbert 1997).
    Qslim,
    /// The cheapest of a few random edges (Wu and Kobbelt 2002).
    Mca,
    /// Clusters of vertices in the cells of an octree, whatever the triangles; what comes of it may be no manifold.
    Octree,
    /// Clusters of vertices in the cells of a grid (Rossignac and Borrel 1993); what comes of it may be no manifold.
    Uniform,
}

/// Where the vertex of a cell of [`Method::Uniform`] goes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Representative {
    /// To where its planes cost least (Lindstrom 2000), or else to the centre.
    #[default]
    Quadric,
    /// To the centre of its vertices, weighted with the area round them.
    Centre,
}

/// Which vertices take no further part in a pass of [`Method::Hqms`] once an edge has been contracted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Strategy {
    /// Its two ends: about a half of the vertices can go in a pass.
    #[default]
    One,
    /// These and the two vertices opposite to the edge: about a quarter.
    Two,
    /// All round its two ends: about a tenth.
    Three,
}

/// A paper whose algorithm is followed word for word, without a check of topology or normals, for comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Edition {
    /// At most 19 triangles round a vertex; the optimum wherever it is.
    Of2004,
    /// Vertices of the boundary go along it; the optimum within the ball over the edge.
    Of2006,
}

/// How to make a mesh coarser.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Which way.
    pub method: Method,
    /// What may become of the topology.
    pub topology: Topology,
    /// How much each plane counts.
    pub weights: Weights,
    /// Whether every vertex of the boundary stays in its place.
    pub lock_boundary: bool,
    /// [`Method::Hqms`]: which vertices of a pass wait for the next.
    pub strategy: Strategy,
    /// [`Method::Hqms`]: contractions from which the cheapest is picked, at least 1; 512 by default.
    pub heap: usize,
    /// [`Method::Hqms`]: the share of vertices that may be proposed in a pass, above 0; 1 and more: all; 0.5 by default. Below 1, passes near
    /// the end propose half of it and those before a fifth more.
    pub cap: f64,
    /// [`Method::Hqms`]: as a paper has it; topology, weights and cap are then its own.
    pub edition: Option<Edition>,
    /// [`Method::Mca`]: random edges that are compared, at least 1; 8 by default.
    pub choices: u32,
    /// [`Method::Mca`]: seed of the random edges.
    pub seed: u64,
    /// [`Method::Uniform`]: where vertices go.
    pub representative: Representative,
    /// [`Method::Octree`]: whether vertices stay apart round which some triangle looks away from the others.
    pub strict_normals: bool,
    /// [`Method::Octree`]: whether the error counts how far old vertices are off the new triangles, too.
    pub both_errors: bool,
    /// [`Method::Octree`]: whether cells are cut in eight at once, as the paper has it, and not halved where their triangles turn most.
    pub eighths: bool,
    /// Whether the attributes count and are kept, where there are any; not so by an edition.
    pub attributes: bool,
    /// Whether to tell which vertex stands for which.
    pub parents: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            method: Method::default(),
            topology: Topology::default(),
            weights: Weights::default(),
            lock_boundary: false,
            strategy: Strategy::default(),
            heap: 512,
            cap: 0.5,
            edition: None,
            choices: 8,
            seed: 0,
            representative: Representative::default(),
            strict_normals: false,
            both_errors: false,
            eighths: false,
            attributes: true,
            parents: false,
        }
    }
}

/// What came of a mesh.
#[derive(Clone, Debug, Default)]
pub struct Reduced {
    /// Positions, triangles and attributes; every vertex is in a triangle.
    pub mesh: IndexedMesh,
    /// For each vertex of the input the number of the one that stands for it, or [`NO_VERTEX`]; empty where that was not wanted.
    ///
    /// Each triangle of the result is one of the input's with these in the places of its vertices.
    pub parents: Vec<u32>,
    /// What was of no use from the start.
    pub left_out: LeftOut,
    /// What each pass over the mesh did.
    pub passes: Vec<Pass>,
}

/// A pass over all vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pass {
    /// Vertices before it.
    pub vertices: usize,
    /// Triangles before it.
    pub triangles: usize,
    /// Vertices that it removed.
    pub contractions: usize,
}

/// Makes a mesh coarser, to at most `faces` triangles if that can be, with its attributes: seams between parts, charts of texture
/// coordinates, colours and creases of normals stay, and so much shape is given for values that are nearer to those there were. `progress` is told the triangles removed and those to remove, and says whether to go on.
///
/// # Errors
/// [`Error::Parameter`] where a triangle names a vertex that does not exist or whose coordinates are no finite numbers, an attribute is not of
/// these triangles, or an option is out of its range; [`Error::Limit`] for more than 2^32 / 3 triangles; [`Error::Cancelled`] where `progress` said so.
pub fn reduce(
    mesh: &IndexedMesh,
    faces: usize,
    options: &Options,
    progress: &mut dyn FnMut(u64, u64) -> bool,
) -> Result<Reduced> {
    if options.heap == 0 {
        return Err(Error::Parameter("a heap has room for one contraction at least".to_owned()));
    }
    if options.cap.is_nan() || options.cap <= 0.0 {
        return Err(Error::Parameter(format!("the cap is {}, it must be above 0", options.cap)));
    }
    if options.choices == 0 {
        return Err(Error::Parameter("one choice at least is to be made".to_owned()));
    }
    let with_attributes = options.attributes && options.edition.is_none() && !mesh.attributes.is_empty();
    if with_attributes {
        mesh.attributes.iter().try_for_each(|a| a.check(mesh.triangles.len())).map_err(Error::Parameter)?;
    }
    let (mut working, left_out) = Working::new(mesh, with_attributes, options.parents)?;
    let mut ticker = Ticker { start: working.living, faces, progress };
    ticker.tell(working.living)?;
    let passes = match options.method {
        Method::Hqms => pipeline::run(&mut working, faces, options, &mut ticker)?,
        Method::Qslim => queue::run(&mut working, faces, options, &mut ticker)?,
        Method::Mca => choices::run(&mut working, faces, options, &mut ticker)?,
        Method::Octree => octree::run(&mut working, faces, options, &mut ticker)?,
        Method::Uniform => uniform::run(&mut working, faces, options, &mut ticker)?,
    };
    let (mesh, parents) = working.into_mesh(mesh);
    Ok(Reduced { mesh, parents, left_out, passes })
}

/// Tells of the progress.
struct Ticker<'a> {
    start: usize,
    faces: usize,
    progress: &'a mut dyn FnMut(u64, u64) -> bool,
}

impl Ticker<'_> {
    /// `living` triangles are left.
    fn tell(&mut self, living: usize) -> Result<()> {
        let [done, total] = [living, self.faces].map(|left| self.start.saturating_sub(left) as u64);
        if (self.progress)(done.min(total), total) { Ok(()) } else { Err(Error::Cancelled) }
    }
}

#[cfg(test)]
mod tests;
