//! The mesh of a scene that stays one: every mesh once, in coordinates of its own times a power of two, over each other; each primitive that
//! no other is equal to is a part (spec §14.2).

use std::collections::{BTreeMap, HashMap};

use bitvec::vec::BitVec;

use super::accessor::Accessor;
use super::canonical::{Canonical, Numbers};
use super::column::{Column, Survey};
use super::document::Document;
use super::exponent;
use super::flatten::{limit, part_name};
use super::json::{At, fault};
use super::notes::{Notes, shortened};
use super::primitive::{self, POSITION, Primitive, Stored, Stream};
use super::scene::Scene;
use super::transform::Matrix;
use crate::error::Result;
use crate::formats::gather::{self, Gathered, MOST};
use crate::mesh::IndexedMesh;
use crate::mesh::attributes::Semantic;

/// A scene's mesh, and which of its parts primitives are.
pub(super) struct Layout {
    pub mesh: IndexedMesh,
    pub parts: Parts,
    /// What the mesh has not, in words for the user.
    pub left_out: Vec<String>,
}

/// Which parts primitives are, by the numbers of a mesh and of a primitive in it. Others have no triangles.
pub(super) type Parts = BTreeMap<(usize, usize), Part>;

/// Which part of the mesh a primitive is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Part {
    pub number: u32,
    /// The mesh has its coordinates times two to the power of this.
    pub exponent: i32,
}

/// Lays out the meshes of a document that shows a scene.
///
/// # Errors
/// At the pointer where the document is at fault; [`Error::Limit`](crate::Error::Limit).
pub(super) fn lay_out<'d>(document: &'d Document<'d>, scene: &Scene, notes: &mut Notes) -> Result<Layout> {
    let meshes = document.root().list("meshes")?;
    let columns = Columns::new(document, &meshes)?;
    let mut growing = Growing::new(document, columns);
    for (number, mesh) in meshes.iter().enumerate() {
        let stored = Stored::read(document, mesh, true, notes)?;
        let mut body = None;
        for primitive in &stored.primitives {
            let part = growing.place(mesh, &stored, primitive, &mut body)?;
            growing.placed.insert((number, primitive.number), part);
        }
    }
    notes.unused_vertices = growing.used.values().map(|used| used.count_zeros()).sum();
    let exponents = growing.scale(&exponent::of_meshes(&scene.instances, meshes.len()));
    let parts = growing.placed.iter().map(|(&at, &number)| {
        let exponent = exponents[growing.body_of[number as usize]];
        (at, Part { number, exponent })
    });
    let parts = parts.collect();
    let (mesh, left_out) = growing.finish();
    Ok(Layout { mesh, parts, left_out })
}

/// What an attribute of the mesh is called that a morph target has.
pub(super) fn of_target(target: usize, name: &str) -> String {
    format!("TARGET{target}_{name}")
}

/// Attributes that grow, by name.
struct Columns {
    list: Vec<Column>,
    places: HashMap<String, usize>,
    /// What there are too many of.
    left_out: Vec<String>,
}

impl Columns {
    /// What attributes there are, of the types that hold them all.
    fn new<'d>(document: &'d Document<'d>, meshes: &[At<'d>]) -> Result<Self> {
        let mut found: HashMap<String, Survey> = HashMap::new();
        for mesh in meshes {
            for primitive in mesh.list("primitives")? {
                if !primitive::topology(&primitive)?.is_surface() {
                    continue;
                }
                let mut see = |name: String, number: &At<'d>| -> Result<()> {
                    document.take(1, BYTES_A_NAME)?;
                    let shape = Accessor::new(document, number)?.shape;
                    found.entry(name).or_default().see(shape, false);
                    Ok(())
                };
                for (name, number) in primitive.object("attributes")? {
                    if name != POSITION {
                        see(name.to_owned(), &number)?;
                    }
                }
                for (t, target) in primitive.list("targets")?.iter().enumerate() {
                    target
                        .members()?
                        .iter()
                        .try_for_each(|(name, number)| see(of_target(t, name), number))?;
                }
            }
        }
        let mut list: Vec<Column> =
            found.into_iter().map(|(name, survey)| Column::new(&name, survey)).collect();
        list.sort_by(|x, y| x.key(&x.name).cmp(&y.key(&y.name)));
        let too_long = list.extract_if(.., |column| column.name.len() > MOST_BYTES);
        let mut left_out: Vec<String> = too_long.map(|column| column.name).collect();
        // Parts are an attribute, too.
        left_out.extend(list.drain(list.len().min(MOST - 1)..).map(|column| column.name));
        let places = list.iter().enumerate().map(|(k, column)| (column.name.clone(), k)).collect();
        Ok(Self { list, places, left_out })
    }
}

/// A mesh that grows.
struct Growing<'d> {
    document: &'d Document<'d>,
    positions: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
    /// The part of each triangle.
    parts: Vec<u32>,
    /// Of each part its name, and its body.
    names: Vec<String>,
    body_of: Vec<usize>,
    /// The first vertex of each body.
    bodies: Vec<u32>,
    columns: Columns,
    /// Parts by their content.
    known: HashMap<Vec<u8>, u32>,
    /// Parts by where they are.
    placed: BTreeMap<(usize, usize), u32>,
    numbers: Numbers,
    /// Which vertices of accessors triangles have.
    used: HashMap<usize, BitVec>,
}

impl<'d> Growing<'d> {
    fn new(document: &'d Document<'d>, columns: Columns) -> Self {
        let (positions, triangles, parts, names, body_of, bodies) = Default::default();
        let (known, placed, numbers, used) = Default::default();
        Self {
            document,
            positions,
            triangles,
            parts,
            names,
            body_of,
            bodies,
            columns,
            known,
            placed,
            numbers,
            used,
        }
    }

    /// The part that a primitive is, a new one where none is equal. `body` is that of its mesh, once there is one.
    fn place(
        &mut self,
        mesh: &At<'d>,
        stored: &Stored<'d>,
        primitive: &Primitive<'d>,
        body: &mut Option<usize>,
    ) -> Result<u32> {
        let positions = &stored.streams[primitive.positions];
        let count = primitive.triangles.len();
        self.document.take(positions.count(), size_of::<u32>())?;
        self.document.take(count, 2 * size_of::<[u32; 3]>())?;
        let canonical = self.numbers.canonical(&primitive.triangles, positions.count());
        if let Some(accessor) = positions.accessor {
            let used = self.used.entry(accessor).or_insert_with(|| BitVec::repeat(false, positions.count()));
            canonical.vertices.iter().for_each(|&v| used.set(v as usize, true));
        }
        self.document.take(canonical.content_bytes(primitive, stored), 1)?;
        let content = canonical.content(primitive, stored);
        if let Some(&part) = self.known.get(&content) {
            return Ok(part);
        }
        let part = self.names.len() as u32;
        self.known.insert(content, part);
        let name = part_name(self.document, mesh, primitive)?.0;
        self.document.take(name.len(), 1)?;
        self.names.push(name);
        let body = *body.get_or_insert_with(|| {
            self.bodies.push(self.positions.len() as u32);
            self.bodies.len() - 1
        });
        self.body_of.push(body);
        limit("triangles", self.triangles.len() + count)?;
        limit("vertices", self.positions.len() + canonical.vertices.len())?;
        self.document.take(count, (3 + self.columns.list.len()) * size_of::<[u32; 3]>())?;
        self.document.take(canonical.vertices.len(), size_of::<[f64; 3]>())?;
        let (begin, first) = (self.positions.len() as u32, self.triangles.len());
        for &v in &canonical.vertices {
            self.positions.push(position(mesh, primitive, positions, v as usize)?);
        }
        self.triangles.extend(canonical.triangles.iter().map(|t| t.map(|v| begin + v)));
        self.parts.extend(std::iter::repeat_n(part, count));
        self.add_attributes(&canonical, stored, primitive, first)?;
        Ok(part)
    }

    fn add_attributes(
        &mut self,
        canonical: &Canonical,
        stored: &Stored<'d>,
        primitive: &Primitive<'d>,
        first: usize,
    ) -> Result<()> {
        for (target, name, stream) in primitive.streams().skip(1) {
            let place = match target {
                0 => self.columns.places.get(name),
                t => self.columns.places.get(&of_target(t - 1, name)),
            };
            let Some(&place) = place else { continue };
            let column = &mut self.columns.list[place];
            let values = canonical.stream(&stored.streams[stream]);
            column.add(self.document, (0, 0), &values, &Matrix::IDENTITY, first, &canonical.triangles)?;
            column.end_of_mesh();
        }
        Ok(())
    }

    /// Scales the bodies, by the exponents of meshes; returns those of the bodies.
    fn scale(&mut self, of_meshes: &[i32]) -> Vec<i32> {
        let mut exponents = vec![i32::MIN; self.bodies.len()];
        for (&(mesh, _), &part) in &self.placed {
            // What several meshes have is as large as the largest shows it.
            let exponent = &mut exponents[self.body_of[part as usize]];
            *exponent = of_meshes[mesh].max(*exponent);
        }
        let ends = self.bodies.iter().skip(1).map(|&first| first as usize).chain([self.positions.len()]);
        for ((&first, end), exponent) in self.bodies.iter().zip(ends).zip(&mut exponents) {
            let body = &mut self.positions[first as usize..end];
            *exponent = exponent::that_is_exact(*exponent, body.iter());
            let factor = f64::from(*exponent).exp2();
            body.as_flattened_mut().iter_mut().for_each(|x| *x *= factor);
        }
        exponents
    }

    /// The mesh, and what was left out of it.
    fn finish(self) -> (IndexedMesh, Vec<String>) {
        if self.triangles.is_empty() {
            return (IndexedMesh::default(), vec![]);
        }
        let mut gathered = Gathered::default();
        gathered.keep(gather::numbers(Semantic::Part, self.parts), "parts");
        for column in self.columns.list {
            let name = column.name.clone();
            gathered.keep(column.finish(self.triangles.len()), &name);
        }
        let mut left_out = gathered.dropped.split_off(0);
        left_out.extend(self.columns.left_out.iter().map(|name| format!("attribute {}", shortened(name))));
        let mesh = IndexedMesh {
            part_names: self.names,
            bodies: self.bodies,
            ..IndexedMesh::new(self.positions, self.triangles)
        };
        (gathered.mesh(mesh), left_out)
    }
}

/// Where a vertex of a primitive is, in its mesh's own coordinates.
fn position(mesh: &At<'_>, primitive: &Primitive<'_>, stream: &Stream, v: usize) -> Result<[f64; 3]> {
    let place = [0, 1, 2].map(|k| stream.values.fraction(3 * v + k, stream.shape.normalised));
    match place.iter().position(|x| !x.is_finite()) {
        None => Ok(place),
        Some(k) => {
            let pointer = format!("{}/primitives/{}/attributes/{POSITION}", mesh.pointer, primitive.number);
            Err(fault(&pointer, format!("{} of vertex {v} is {}", ["x", "y", "z"][k], place[k])))
        }
    }
}

/// Most bytes of an attribute's name (spec §3.3).
const MOST_BYTES: usize = 255;
/// What it takes to know an attribute by its name, about.
const BYTES_A_NAME: usize = 128;
