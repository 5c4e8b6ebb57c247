//! One mesh of all that a scene shows.

use std::collections::{BTreeMap, HashMap};

use super::accessor::Accessor;
use super::column::{self, Column};
use super::document::Document;
use super::json::{At, fault};
use super::notes::Notes;
use super::primitive::{self, POSITION, Primitive, Stored, Topology};
use super::scene::{Instance, Scene};
use crate::error::{Error, Result};
use crate::formats::gather::{self, Gathered};
use crate::limits::MAX_ELEMENTS;
use crate::mesh::IndexedMesh;
use crate::mesh::attributes::Semantic;

/// A scene as one mesh.
pub(super) struct Flattened {
    pub mesh: IndexedMesh,
    /// What was left out of it, in words for the user.
    pub left_out: Vec<String>,
    /// The number of the material of each part, if it has one.
    pub materials: Vec<Option<usize>>,
}

/// The mesh of a scene, by meshes, then by their instances, then by primitives.
///
/// # Errors
/// At the pointer where the document is at fault; [`Error::Limit`].
pub(super) fn flatten<'d>(document: &'d Document<'d>, scene: &Scene, notes: &mut Notes) -> Result<Flattened> {
    let meshes = document.root().list("meshes")?;
    let shown: Vec<&[Instance]> = scene.instances.chunk_by(|a, b| a.mesh == b.mesh).collect();
    let mut flat = Flat::new(document, columns(document, &meshes, &shown)?);
    for column in flat.columns.values() {
        notes.retyped.extend(column.retyped());
    }
    for instances in shown {
        let Some(mesh) = instances.first().and_then(|instance| meshes.get(instance.mesh)) else { continue };
        let stored = Stored::read(document, mesh, false, notes)?;
        let parts = stored
            .primitives
            .iter()
            .map(|primitive| flat.part(mesh, primitive))
            .collect::<Result<Vec<_>>>()?;
        for (k, instance) in instances.iter().enumerate() {
            flat.add(mesh, &stored, &parts, instance, k)?;
        }
        flat.columns.values_mut().for_each(Column::end_of_mesh);
    }
    Ok(flat.finish())
}

/// What attributes there are, of the types that hold them all.
fn columns<'d>(
    document: &'d Document<'d>,
    meshes: &[At<'d>],
    shown: &[&[Instance]],
) -> Result<BTreeMap<column::Key<'d>, Column>> {
    let mut found: BTreeMap<&'d str, column::Survey> = BTreeMap::new();
    for instances in shown {
        let Some(mesh) = instances.first().and_then(|instance| meshes.get(instance.mesh)) else { continue };
        let turned = instances.iter().any(|instance| !instance.world.keeps_directions());
        for primitive in mesh.list("primitives")? {
            if matches!(primitive::topology(&primitive)?, Topology::Points | Topology::Lines) {
                continue;
            }
            for (name, number) in primitive.object("attributes")?.iter().filter(|(name, _)| *name != POSITION)
            {
                let shape = Accessor::new(document, number)?.shape;
                found.entry(name).or_default().see(shape, turned);
            }
        }
    }
    let column = |(name, survey): (&'d str, column::Survey)| {
        let column = Column::new(name, survey);
        (column.key(name), column)
    };
    Ok(found.into_iter().map(column).collect())
}

/// A mesh that grows.
struct Flat<'d> {
    document: &'d Document<'d>,
    positions: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
    /// The part of each triangle.
    parts: Vec<u32>,
    names: Vec<String>,
    materials: Vec<Option<usize>>,
    named: bool,
    columns: BTreeMap<column::Key<'d>, Column>,
}

impl<'d> Flat<'d> {
    fn new(document: &'d Document<'d>, columns: BTreeMap<column::Key<'d>, Column>) -> Self {
        let (positions, triangles, parts, names, materials) = Default::default();
        Self { document, positions, triangles, parts, names, materials, named: false, columns }
    }

    /// A new part.
    fn part(&mut self, mesh: &At<'d>, primitive: &Primitive<'d>) -> Result<u32> {
        let (lines, named) = part_name(self.document, mesh, primitive)?;
        self.named |= named;
        self.document.take(lines.len(), 1)?;
        self.names.push(lines);
        let own = mesh.list("primitives")?.into_iter().nth(primitive.number);
        let material = own.and_then(|own| own.key("material"));
        self.materials.push(material.map(|material| material.number()).transpose()?);
        Ok(self.names.len() as u32 - 1)
    }

    /// A mesh once more, in the place of an instance.
    fn add(
        &mut self,
        mesh: &At<'d>,
        stored: &Stored<'d>,
        parts: &[u32],
        instance: &Instance,
        number: usize,
    ) -> Result<()> {
        let turned = instance.world.mirrors();
        let mut begins = HashMap::new();
        for (primitive, &part) in stored.primitives.iter().zip(parts) {
            let begin = match begins.get(&primitive.positions) {
                Some(&begin) => begin,
                None => self.add_vertices(mesh, stored, primitive, instance)?,
            };
            begins.insert(primitive.positions, begin);
            let count = primitive.triangles.len();
            limit("triangles", self.triangles.len() + count)?;
            self.document.take(count, (4 + self.columns.len()) * size_of::<[u32; 3]>())?;
            let first = self.triangles.len();
            let corners: Vec<[u32; 3]> = primitive
                .triangles
                .iter()
                .map(|&[a, b, c]| if turned { [a, c, b] } else { [a, b, c] })
                .collect();
            self.triangles.extend(corners.iter().map(|t| t.map(|v| begin + v)));
            self.parts.extend(std::iter::repeat_n(part, count));
            for column in self.columns.values_mut() {
                let own = primitive.attributes.iter().find(|(name, _)| *name == column.name);
                let Some(&(_, stream)) = own else { continue };
                let values = &stored.streams[stream];
                column.add(self.document, (stream, number), values, &instance.world, first, &corners)?;
            }
        }
        Ok(())
    }

    /// The vertices of a primitive in the place of an instance; returns the first of them.
    fn add_vertices(
        &mut self,
        mesh: &At<'d>,
        stored: &Stored<'d>,
        primitive: &Primitive<'d>,
        instance: &Instance,
    ) -> Result<u32> {
        let stream = &stored.streams[primitive.positions];
        let (begin, count) = (self.positions.len(), stream.count());
        limit("vertices", begin + count)?;
        self.document.take(count, size_of::<[f64; 3]>())?;
        for v in 0..count {
            let place = [0, 1, 2].map(|k| stream.values.fraction(3 * v + k, stream.shape.normalised));
            let point = instance.world.point(place);
            if let Some(k) = place.iter().position(|x| !x.is_finite()) {
                let axis = ["x", "y", "z"][k];
                let pointer =
                    format!("{}/primitives/{}/attributes/{POSITION}", mesh.pointer, primitive.number);
                return Err(fault(&pointer, format!("{axis} of vertex {v} is {}", place[k])));
            }
            if !point.iter().all(|x| x.is_finite()) {
                let node = format!("/nodes/{}", instance.node);
                return Err(super::json::fault(
                    &node,
                    format!("it takes vertex {v} of {} to {point:?}", mesh.pointer),
                ));
            }
            self.positions.push(point);
        }
        Ok(begin as u32)
    }

    fn finish(self) -> Flattened {
        let mut gathered = Gathered::default();
        // One nameless part says nothing.
        let part_names = if self.named || self.names.len() > 1 {
            gathered.keep(gather::numbers(Semantic::Part, self.parts), "parts");
            self.names
        } else {
            Vec::new()
        };
        for (_, column) in self.columns {
            let name = column.name.clone();
            gathered.keep(column.finish(self.triangles.len()), &name);
        }
        let mesh =
            gathered.mesh(IndexedMesh { part_names, ..IndexedMesh::new(self.positions, self.triangles) });
        Flattened { mesh, left_out: gathered.dropped, materials: self.materials }
    }
}

/// What a part is called, by the names that its mesh and its material have, or else by their numbers; and whether one has a name.
pub(super) fn part_name(
    document: &Document<'_>,
    mesh: &At<'_>,
    primitive: &Primitive<'_>,
) -> Result<(String, bool)> {
    let called = |at: &At<'_>, what: &str| -> Result<(String, bool)> {
        let name = at.text("name")?.filter(|name| !name.trim().is_empty());
        let number = at.pointer.rsplit('/').next().unwrap_or_default();
        let in_line = name.map(|name| name.split_whitespace().collect::<Vec<_>>().join(" "));
        Ok((in_line.unwrap_or_else(|| format!("{what} {number}")), name.is_some()))
    };
    let primitives = mesh.list("primitives")?;
    let (name, mut is_named) = called(mesh, "mesh")?;
    let mut lines = vec![format!("o {name}")];
    if primitives.len() > 1 {
        lines.push(format!("g primitive {}", primitive.number));
    }
    if let Some(number) = primitives.get(primitive.number).and_then(|primitive| primitive.key("material")) {
        let (name, named) = called(&document.named("materials", &number)?, "material")?;
        lines.push(format!("usemtl {name}"));
        is_named |= named;
    }
    Ok((lines.join("\n"), is_named))
}

pub(super) fn limit(what: &'static str, count: usize) -> Result<()> {
    let (needed, allowed) = (count as u64, u64::from(MAX_ELEMENTS));
    if needed > allowed { Err(Error::Limit { what, needed, allowed }) } else { Ok(()) }
}
