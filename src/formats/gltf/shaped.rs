//! Primitives of a scene, made of parts of its mesh: coordinates of their own, numbers of the types that the scene's JSON tells (spec §14).

use std::collections::HashMap;
use std::io;

use serde_json::{Map, Value};

use super::accessor::Shape;
use super::composed::invalid;
use super::geometry::{Column, Geometry};
use super::json::At;
use super::layout::of_target;
use super::pack::Pack;
use super::primitive::POSITION;
use super::quantised::{self, Grid};
use super::weights;
use crate::formats::write::finite;
use crate::mesh::IndexedMesh;
use crate::mesh::attributes::{Attribute, Domain, Semantic, Stored, Values};

/// Makes primitives of a mesh.
pub(super) struct Shaper<'a> {
    mesh: &'a IndexedMesh,
    /// Whether numbers are the source's own, in which nothing is to be mended.
    is_exact: bool,
    columns: Vec<Column<'a>>,
    /// The columns by what glTF calls them.
    places: HashMap<String, usize>,
    /// The triangles of each part.
    parts: HashMap<u32, Vec<u32>>,
    /// What has been made of which extension.
    known: HashMap<String, Shown>,
}

/// What a primitive names.
#[derive(Clone)]
pub(super) struct Shown {
    pub attributes: Value,
    pub indices: usize,
    pub targets: Option<Value>,
}

/// An attribute of a primitive, or of one of its targets.
struct Wanted<'v> {
    name: &'v str,
    target: Option<usize>,
    shape: Shape,
    /// The column that has it; none where it is not there.
    column: Option<usize>,
}

impl<'a> Shaper<'a> {
    /// # Errors
    /// As [`Pack::take`].
    pub(super) fn new(mesh: &'a IndexedMesh, is_exact: bool, pack: &mut Pack) -> io::Result<Self> {
        let of_corners = |attribute: &&Attribute| attribute.domain == Domain::Corner;
        for attribute in mesh.attributes.iter().filter(of_corners) {
            pack.take(attribute.count(), BYTES_A_VALUE + size_of::<u64>() * attribute.components)?;
        }
        pack.take(mesh.triangles.len(), 2 * size_of::<u32>())?;
        let columns: Vec<Column> = mesh.attributes.iter().filter(of_corners).map(Column::new).collect();
        let places = columns.iter().enumerate().map(|(k, column)| (called(column.attribute), k)).collect();
        let mut parts: HashMap<u32, Vec<u32>> = HashMap::new();
        let of_triangles = mesh.attributes.iter().find(|attribute| attribute.semantic == Semantic::Part);
        for t in 0..mesh.triangles.len() {
            let part =
                of_triangles.and_then(|parts| Some(parts.values.number(parts.components * parts.at(t, 0)?)));
            parts.entry(part.unwrap_or(0.0) as u32).or_default().push(t as u32);
        }
        Ok(Self { mesh, is_exact, columns, places, parts, known: HashMap::new() })
    }

    /// The vertices of a part's triangles, in the coordinates of the mesh.
    pub(super) fn places_of(&self, part: u32) -> impl Iterator<Item = [f64; 3]> + '_ {
        let triangles = self.parts.get(&part).map_or(&[][..], Vec::as_slice);
        let corners = triangles.iter().flat_map(|&t| self.mesh.triangles[t as usize]);
        corners.map(|v| self.mesh.positions[v as usize])
    }

    /// The accessors of what an extension at a pointer names. Of a part of which no triangle is there comes one without extent, `near` a
    /// place that is in the same coordinates. On a `grid` numbers are integers where these tell them.
    ///
    /// # Errors
    /// [`io::ErrorKind::InvalidInput`] where it is at fault.
    pub(super) fn primitive(
        &mut self,
        pack: &mut Pack,
        extension: &Value,
        at: &str,
        near: &mut Option<[f64; 3]>,
        grid: Option<&Grid>,
    ) -> io::Result<Shown> {
        let key = format!("{extension}{}", if grid.is_some() { "q" } else { "" });
        pack.take(key.len(), 2)?;
        if let Some(shown) = self.known.get(&key) {
            return Ok(shown.clone());
        }
        let at = At { value: extension, pointer: at.to_owned() };
        let told = |e: crate::Error| invalid(e.to_string());
        let part = at.needed("part").and_then(|part| part.number()).map_err(told)?;
        let exponent = extension.get("exponent").map_or(Some(0), Value::as_i64);
        let Some(exponent) = exponent.filter(|k| k.unsigned_abs() <= MOST_EXPONENT) else {
            return Err(invalid(format!("{}/exponent: not a whole number of -60 to 60", at.pointer)));
        };
        let wanted = self.wanted(&at).map_err(told)?;
        let (position, others) =
            wanted.split_first().ok_or_else(|| invalid(format!("{}: no {POSITION}", at.pointer)))?;
        let own: Vec<&Column> = others.iter().filter_map(|one| Some(&self.columns[one.column?])).collect();
        let triangles = u32::try_from(part).ok().and_then(|part| self.parts.get(&part));
        // What tells vertices apart, and the lists of their values.
        pack.take(3 * triangles.map_or(0, Vec::len), BYTES_A_CORNER + BYTES_A_COLUMN * own.len())?;
        let factor = (-exponent as f64).exp2();
        let (mut geometry, places) = match triangles {
            Some(triangles) => {
                let geometry = Geometry::new(self.mesh, triangles, &own);
                let places: Vec<[f64; 3]> = geometry
                    .vertices
                    .iter()
                    .map(|&v| self.mesh.positions[v as usize].map(|x| x * factor))
                    .collect();
                *near = places.first().copied();
                (geometry, places)
            }
            None => (Geometry::point(own.len()), vec![near.unwrap_or_default()]),
        };
        let bytes = |one: &Wanted| one.shape.components * super::accessor::size(one.shape.stored).max(4);
        // As numbers, and in the buffer.
        pack.take(places.len(), 2 * wanted.iter().filter(|one| !is_zero(one)).map(bytes).sum::<usize>())?;
        let mut of_columns = std::mem::take(&mut geometry.values).into_iter();
        let mut values = Vec::with_capacity(others.len());
        for one in others {
            let absent = absent(one);
            values.push(match one.column {
                Some(column) => {
                    let list = of_columns.next().unwrap_or_default();
                    self.columns[column].values(&list, one.shape, absent)
                }
                None if is_zero(one) => Values::new(one.shape.stored),
                None => constant(one.shape, absent, places.len()),
            });
        }
        if !self.is_exact {
            let is_weights = |one: &Wanted| one.target.is_none() && one.name.starts_with("WEIGHTS_");
            let mut sets: Vec<_> = others
                .iter()
                .zip(&mut values)
                .filter(|(one, _)| is_weights(one))
                .map(|(one, v)| (one.shape, v))
                .collect();
            weights::normalise(&mut sets);
        }
        let mut attributes = Map::new();
        let mut targets: Vec<Map<String, Value>> = vec![Map::new(); at.list("targets").map_err(told)?.len()];
        let of_grid = grid.filter(|_| position.shape.stored == Stored::F32);
        let (shape, numbers) = match of_grid {
            Some(grid) => grid.positions(&places, exponent as i32),
            None => (position.shape, positions(&places, position.shape)?),
        };
        attributes.insert(POSITION.to_owned(), pack.vertices(shape, &numbers, true).into());
        for (one, values) in others.iter().zip(&values) {
            let bounded = one.name == POSITION;
            let number =
                match (is_zero(one), grid.and_then(|_| quantised::narrowed(one.name, one.shape, values))) {
                    (true, _) => pack.zeros(one.shape, places.len(), bounded),
                    (false, Some((shape, values))) => pack.vertices(shape, &values, bounded),
                    (false, None) => pack.vertices(one.shape, values, bounded),
                };
            let members = one.target.and_then(|t| targets.get_mut(t)).unwrap_or(&mut attributes);
            members.insert(one.name.to_owned(), number.into());
        }
        if pack.bytes.len() > u32::MAX as usize {
            return Err(invalid("a binary glTF file has at most 2^32 - 1 bytes".to_owned()));
        }
        let indices = pack.indices(&geometry.indices);
        let targets = (!targets.is_empty()).then(|| targets.into_iter().map(Value::Object).collect());
        let shown = Shown { attributes: attributes.into(), indices, targets };
        self.known.insert(key, shown.clone());
        Ok(shown)
    }

    /// What a primitive has, its positions first; without what is not there and can be missed.
    fn wanted<'v>(&self, at: &At<'v>) -> crate::error::Result<Vec<Wanted<'v>>> {
        let mut wanted = Vec::new();
        for (name, at) in at.object("attributes")? {
            let column = self.places.get(name).copied();
            let is_needed = ["TEXCOORD_", "JOINTS_", "WEIGHTS_"].iter().any(|begin| name.starts_with(begin));
            let is_there = column.is_some() && (name != "TANGENT" || self.places.contains_key("NORMAL"));
            let one = Wanted { name, target: None, shape: Shape::told(&at)?, column };
            if name == POSITION {
                wanted.insert(0, Wanted { column: None, ..one });
            } else if is_there || is_needed {
                wanted.push(one);
            }
        }
        if wanted.first().is_none_or(|first| first.name != POSITION || first.shape.components != 3) {
            return Err(at.fault("no positions of three numbers"));
        }
        for (t, target) in at.list("targets")?.iter().enumerate() {
            for (name, at) in target.members()? {
                let column = self.places.get(&of_target(t, name)).copied();
                wanted.push(Wanted { name, target: Some(t), shape: Shape::told(&at)?, column });
            }
        }
        Ok(wanted)
    }
}

/// What glTF calls an attribute of a scene's mesh.
fn called(attribute: &Attribute) -> String {
    let word = match attribute.semantic {
        Semantic::Normal => return "NORMAL".to_owned(),
        Semantic::Tangent => return "TANGENT".to_owned(),
        Semantic::TexCoord => "TEXCOORD",
        Semantic::Color => "COLOR",
        Semantic::Joints => "JOINTS",
        Semantic::Weights => "WEIGHTS",
        Semantic::Part | Semantic::Generic => return attribute.name.clone(),
    };
    format!("{word}_{}", attribute.set)
}

/// What stands where there is no value, as fractions.
fn absent(one: &Wanted<'_>) -> &'static [f64] {
    match one.name {
        _ if one.target.is_some() => &[],
        "NORMAL" => &[0.0, 0.0, 1.0],
        "TANGENT" => &[1.0, 0.0, 0.0, 1.0],
        "WEIGHTS_0" => &[1.0],
        name if name.starts_with("COLOR_") => &[1.0; 4],
        _ => &[],
    }
}

/// Whether it is not there, so that all its numbers are 0.
fn is_zero(one: &Wanted<'_>) -> bool {
    one.column.is_none()
        && (one.name != POSITION || one.target.is_some())
        && absent(one).iter().all(|&x| x == 0.0)
}

fn constant(shape: Shape, numbers: &[f64], count: usize) -> Values {
    let one = if shape.normalised { shape.stored.one().unwrap_or(1.0) } else { 1.0 };
    let mut values = Values::new(shape.stored);
    for _ in 0..count {
        (0..shape.components).for_each(|k| values.push(one * numbers.get(k).copied().unwrap_or(0.0)));
    }
    values
}

/// Coordinates as a type has them, to the nearest.
fn positions(places: &[[f64; 3]], shape: Shape) -> io::Result<Values> {
    let one = if shape.normalised { shape.stored.one().unwrap_or(1.0) } else { 1.0 };
    let mut values = Values::new(shape.stored);
    for &x in places.as_flattened() {
        if shape.stored == Stored::F32 {
            finite(f64::from(x as f32), x)?;
        }
        values.push(one * x);
    }
    Ok(values)
}

const MOST_EXPONENT: u64 = 60;
/// What it takes to know a value by its bits, and a corner and its value in one more attribute by theirs.
const BYTES_A_VALUE: usize = 96;
const BYTES_A_CORNER: usize = 40;
const BYTES_A_COLUMN: usize = 32;
