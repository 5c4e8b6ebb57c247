//! Meshes as they are stored: the triangles and the numbers of their primitives (glTF 2.0, §3.7.2).

use std::collections::HashMap;

use super::accessor::{Accessor, Shape};
use super::document::Document;
use super::draco;
use super::json::At;
use super::notes::Notes;
use crate::error::Result;
use crate::mesh::attributes::Values;

/// Numbers of vertices.
pub(super) struct Stream {
    pub shape: Shape,
    pub values: Values,
    /// The number of the accessor that has them, if they are not compressed.
    pub accessor: Option<usize>,
}

impl Stream {
    /// How many vertices have numbers.
    pub(super) fn count(&self) -> usize {
        self.values.len() / self.shape.components
    }
}

/// A primitive of triangles.
pub(super) struct Primitive<'d> {
    /// Its number in its mesh.
    pub number: usize,
    /// By the vertices of its streams.
    pub triangles: Vec<[u32; 3]>,
    /// The mesh's streams that it has positions and attributes of, these by name.
    pub positions: usize,
    pub attributes: Vec<(&'d str, usize)>,
    /// The same of its morph targets, where they are wanted.
    pub targets: Vec<Vec<(&'d str, usize)>>,
}

impl<'d> Primitive<'d> {
    /// All of its streams: which target they are of, from 1 on, or 0, and their names.
    pub(super) fn streams(&self) -> impl Iterator<Item = (usize, &'d str, usize)> + '_ {
        let own = [(0, POSITION, self.positions)].into_iter();
        let own = own.chain(self.attributes.iter().map(|&(name, stream)| (0, name, stream)));
        let targets = self.targets.iter().zip(1..);
        own.chain(targets.flat_map(|(list, t)| list.iter().map(move |&(name, stream)| (t, name, stream))))
    }
}

/// A mesh whose primitives share what they have in common.
#[derive(Default)]
pub(super) struct Stored<'d> {
    pub streams: Vec<Stream>,
    pub primitives: Vec<Primitive<'d>>,
}

/// Whether a primitive is one of triangles.
///
/// # Errors
/// Where its mode is none.
pub(super) fn topology(primitive: &At<'_>) -> Result<Topology> {
    let Some(mode) = primitive.key("mode") else { return Ok(Topology::Triangles) };
    match mode.number()? {
        0 => Ok(Topology::Points),
        1..=3 => Ok(Topology::Lines),
        4 => Ok(Topology::Triangles),
        5 => Ok(Topology::Strip),
        6 => Ok(Topology::Fan),
        other => Err(mode.fault(format!("{other} is no mode"))),
    }
}

/// What the vertices of a primitive are joined to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Topology {
    Points,
    Lines,
    Triangles,
    Strip,
    Fan,
}

impl Topology {
    /// Whether it makes triangles.
    pub(super) fn is_surface(self) -> bool {
        !matches!(self, Self::Points | Self::Lines)
    }
}

impl<'d> Stored<'d> {
    /// Reads the triangles of a mesh, and its morph targets, if they are wanted.
    ///
    /// # Errors
    /// At the pointer where something is out of range, missing, or not of its type.
    pub(super) fn read(
        document: &'d Document<'d>,
        mesh: &At<'d>,
        with_targets: bool,
        notes: &mut Notes,
    ) -> Result<Self> {
        let (mut stored, mut known) = (Self::default(), HashMap::new());
        for (number, at) in mesh.list("primitives")?.iter().enumerate() {
            let topology = topology(at)?;
            if !topology.is_surface() {
                continue;
            }
            let mut packed = draco::Packed::of(document, at)?;
            let mut stream = |name: &str, accessor: &At<'d>| -> Result<usize> {
                let next = stored.streams.len();
                let packed = packed.as_mut().filter(|_| !name.is_empty());
                let (key, stream) = match packed.and_then(|packed| packed.stream(name, accessor)) {
                    Some(stream) => (None, stream?),
                    None => {
                        let key = accessor.number()?;
                        if let Some(&stream) = known.get(&key) {
                            return Ok(stream);
                        }
                        let accessor = Accessor::new(document, accessor)?;
                        let (shape, values) = (accessor.shape, accessor.values()?);
                        (Some(key), Stream { shape, values, accessor: Some(key) })
                    }
                };
                known.extend(key.map(|key| (key, next)));
                stored.streams.push(stream);
                Ok(next)
            };
            let listed = at.needed("attributes")?;
            let position = listed.needed(POSITION)?;
            let positions = stream(POSITION, &position)?;
            let mut attributes = Vec::new();
            for (name, accessor) in at.object("attributes")?.iter().filter(|(name, _)| *name != POSITION) {
                attributes.push((*name, stream(name, accessor)?));
            }
            let mut targets = Vec::new();
            for target in if with_targets { at.list("targets")? } else { Vec::new() } {
                let members = target.members()?.into_iter();
                // What is compressed has names of its own.
                let members = members.map(|(name, accessor)| Ok((name, stream("", &accessor)?)));
                targets.push(members.collect::<Result<Vec<_>>>()?);
            }
            let of = |stream: usize| &stored.streams[stream];
            let vertices = of(positions).count();
            if of(positions).shape.components != 3 {
                return Err(
                    position.fault(format!("positions of {} numbers, not 3", of(positions).shape.components))
                );
            }
            for &(name, stream) in attributes.iter().chain(targets.iter().flatten()) {
                let count = of(stream).count();
                if count != vertices {
                    return Err(listed.fault(format!("{name} of {count} vertices, {POSITION} of {vertices}")));
                }
            }
            let triangles = match packed {
                Some(packed) => packed.triangles,
                None => triangles(document, at, topology, vertices, notes)?,
            };
            if let Some(&v) = triangles.as_flattened().iter().find(|&&v| v as usize >= vertices) {
                return Err(
                    at.fault(format!("vertex index {v} is out of range: there are {vertices} vertices"))
                );
            }
            if !triangles.is_empty() {
                stored.primitives.push(Primitive { number, triangles, positions, attributes, targets });
            }
        }
        Ok(stored)
    }
}

/// The triangles of a primitive, by its indices, or without them by its vertices in order.
fn triangles(
    document: &Document<'_>,
    at: &At<'_>,
    topology: Topology,
    vertices: usize,
    notes: &mut Notes,
) -> Result<Vec<[u32; 3]>> {
    let indices = match at.key("indices") {
        Some(number) => {
            let accessor = Accessor::new(document, &number)?;
            let indices = match accessor.values()? {
                _ if accessor.shape.components != 1 => None,
                Values::U8(list) => Some(list.into_iter().map(u32::from).collect()),
                Values::U16(list) => Some(list.into_iter().map(u32::from).collect()),
                Values::U32(list) => Some(list),
                _ => None,
            };
            let indices: Vec<u32> =
                indices.ok_or_else(|| accessor.fault("not a list of indices by its type"))?;
            if let Some(k) = indices.iter().position(|&v| v as usize >= vertices) {
                let v = indices[k];
                return Err(accessor.fault(format!("index {k} names vertex {v}, there are {vertices}")));
            }
            indices
        }
        None => (0..vertices as u32).collect(),
    };
    // Indices again, and triangles of them: strips have one an index.
    document.take(indices.len(), 4 * size_of::<u32>())?;
    Ok(match topology {
        Topology::Strip => {
            let triangle =
                |(k, w): (usize, &[u32])| if k % 2 == 0 { [w[0], w[1], w[2]] } else { [w[0], w[2], w[1]] };
            indices.windows(3).enumerate().map(triangle).collect()
        }
        Topology::Fan => match indices.split_first() {
            Some((&first, rest)) => rest.windows(2).map(|w| [w[0], w[1], first]).collect(),
            None => Vec::new(),
        },
        _ => {
            let (triangles, left) = indices.as_chunks::<3>();
            notes.left_over += left.len();
            triangles.to_vec()
        }
    })
}

pub(super) const POSITION: &str = "POSITION";
