//! Levels as JSON.

use serde::Serialize;

use crate::container::{AttributeEntry, AttributeError, Contents, ResourceEntry};
use crate::store::Version;

/// What a client wants to know of a version before it asks for atoms (spec §12.3).
#[derive(Debug, Serialize)]
pub struct Table {
    kind: &'static str,
    name: String,
    version: String,
    bytes: u64,
    head_bytes: u64,
    vertices: u32,
    triangles: u32,
    origin: [f64; 3],
    far_corner: [f64; 3],
    bits: u32,
    atoms: usize,
    attributes: Vec<Attribute>,
    scene: Option<usize>,
    resources: Vec<Resource>,
    residue_bytes: u64,
    attribute_bytes: u64,
    correction_bytes: u64,
    order_bytes: u64,
    metadata_bytes: u64,
    levels: Vec<Row>,
}

/// An attribute as the table tells of it.
#[derive(Debug, Serialize)]
struct Attribute {
    title: String,
    semantic: &'static str,
    set: u32,
    domain: &'static str,
    components: usize,
    stored: &'static str,
    bits: Option<u32>,
    birth: u32,
    rms_error: f64,
}

/// A resource, and where to find it.
#[derive(Debug, Serialize)]
struct Resource {
    kind: &'static str,
    level: u32,
    offset: u64,
    bytes: u64,
    atoms: [usize; 2],
}

#[derive(Debug, Serialize)]
struct Row {
    level: u32,
    vertices: u32,
    triangles: u32,
    precision: u32,
    max_error: f64,
    rms_error: f64,
    attribute_errors: Vec<Error>,
    offset: u64,
    bytes: u64,
    atoms: [usize; 2],
    prefix_bytes: u64,
    keyframe: Option<Place>,
}

/// How far an attribute of a level is off.
#[derive(Debug, Serialize)]
struct Error {
    title: String,
    error: f64,
    high: Option<f64>,
}

#[derive(Debug, Serialize)]
struct Place {
    offset: u64,
    bytes: u64,
}

impl Table {
    /// As JSON; the numbers in it are finite and its keys are text, so that nothing can go wrong.
    pub fn text(&self) -> Vec<u8> {
        serde_json::to_vec(self).unwrap_or_default()
    }

    /// The table of contents of the mesh of this name, in this version.
    pub fn new(name: String, version: &Version, contents: &Contents) -> Self {
        let header = &contents.header;
        let length = |atoms| {
            let bytes = contents.bytes(atoms);
            bytes.end - bytes.start
        };
        Self {
            kind: "mesh",
            name,
            version: version.tag.clone(),
            bytes: version.bytes,
            head_bytes: header.table_end(),
            vertices: header.vertices,
            triangles: header.triangles,
            origin: header.lattice.origin,
            far_corner: header.far_corner(),
            bits: header.lattice.bits,
            atoms: contents.atoms.len(),
            attributes: contents.attributes.iter().map(Attribute::new).collect(),
            scene: contents.scene(),
            resources: contents.resources.iter().map(|entry| Resource::new(contents, entry)).collect(),
            residue_bytes: length(contents.residue()),
            attribute_bytes: length(contents.attribute_atoms(0)),
            correction_bytes: length(contents.correction()),
            order_bytes: length(contents.order()),
            metadata_bytes: length(contents.metadata()),
            levels: (0..header.level_count).rev().filter_map(|j| Row::new(contents, j)).collect(),
        }
    }
}

impl Attribute {
    fn new(attribute: &AttributeEntry) -> Self {
        Self {
            title: attribute.title(),
            semantic: attribute.semantic.name(),
            set: attribute.set,
            domain: attribute.domain.name(),
            components: attribute.components,
            stored: attribute.stored.name(),
            bits: attribute.bits(),
            birth: attribute.birth,
            rms_error: attribute.error,
        }
    }
}

impl Resource {
    fn new(contents: &Contents, entry: &ResourceEntry) -> Self {
        Self {
            kind: entry.kind.name(),
            level: entry.place,
            offset: contents.bytes(entry.atoms.clone()).start,
            bytes: entry.bytes,
            atoms: [entry.atoms.start, entry.atoms.end],
        }
    }
}

impl Error {
    fn new(contents: &Contents, &AttributeError { attribute, error, high }: &AttributeError) -> Option<Self> {
        let title = contents.attributes.get(attribute)?.title();
        Some(Self { title, error, high })
    }
}

impl Row {
    fn new(contents: &Contents, j: u32) -> Option<Self> {
        let level = contents.level(j)?;
        let atoms = contents.steps(j);
        let place = |atoms| {
            let bytes = contents.bytes(atoms);
            Place { offset: bytes.start, bytes: bytes.end - bytes.start }
        };
        let Place { offset, bytes } = place(atoms.clone());
        Some(Self {
            level: j,
            vertices: level.vertices,
            triangles: level.triangles,
            precision: level.precision,
            max_error: level.max_error,
            rms_error: level.rms_error,
            attribute_errors: level
                .attributes
                .iter()
                .filter_map(|error| Error::new(contents, error))
                .collect(),
            offset,
            bytes,
            atoms: [atoms.start, atoms.end],
            prefix_bytes: contents.bytes(contents.prefix(j)).end,
            keyframe: contents.keyframe(j).map(place),
        })
    }
}
