//! Primitives whose numbers are integers (KHR_mesh_quantization): positions on the file's own lattice, which a node below each node that shows the
//! mesh puts back in their place; normals, tangents and texture coordinates as fractions of 16 bits.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use super::accessor::Shape;
use super::carried::EXTENSION;
use super::composed::items;
use super::notes::{QUANTIZATION, shortened};
use super::pack::name_extension;
use super::scene::INSTANCING;
use super::shaped::Shaper;
use crate::mesh::Lattice;
use crate::mesh::attributes::{Stored, Values};

/// Where the integers of a mesh's positions lie: origin + step times them are its coordinates times 2^exponent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Grid {
    origin: [f64; 3],
    step: f64,
    exponent: i32,
}

/// Finds the meshes that can be of integers, and has their nodes say so.
pub(super) struct Quantiser {
    /// Half-way points are points of it, too: vertices of coarse coordinates lie there.
    origin: [f64; 3],
    step: f64,
    /// Why no mesh can be, if so.
    never: Option<String>,
    /// By mesh, why it cannot be.
    unfit: BTreeMap<usize, &'static str>,
    shown: Vec<bool>,
    grids: BTreeMap<usize, Grid>,
    remarks: Vec<String>,
}

impl Quantiser {
    /// For a mesh of a scene on a lattice.
    pub(super) fn new(lattice: &Lattice, json: &Value) -> Self {
        let list = |key: &str| json[key].as_array().map_or(&[][..], Vec::as_slice);
        let mut unfit = BTreeMap::new();
        let mut shown = vec![false; list("meshes").len()];
        for node in list("nodes") {
            let Some(mesh) = node["mesh"].as_u64().map(|mesh| mesh as usize) else { continue };
            shown.get_mut(mesh).into_iter().for_each(|shown| *shown = true);
            if node.get("skin").is_some() {
                unfit.insert(mesh, "it has a skin");
            } else if node["extensions"].get(INSTANCING).is_some() {
                unfit.insert(mesh, "it has instances");
            }
        }
        let is_deep = |material: &Value| material["extensions"].get("KHR_materials_volume").is_some();
        let materials = list("materials");
        for (m, mesh) in list("meshes").iter().enumerate() {
            for primitive in mesh["primitives"].as_array().into_iter().flatten() {
                let told = &primitive["extensions"][EXTENSION];
                let material = primitive["material"].as_u64().and_then(|k| materials.get(k as usize));
                let why = match () {
                    _ if told.get("part").is_none() => "it has points or lines",
                    _ if told.get("targets").is_some() => "it has morph targets",
                    _ if material.is_some_and(is_deep) => "its material has a thickness",
                    _ => continue,
                };
                unfit.entry(m).or_insert(why);
            }
        }
        let never = (lattice.bits > MOST_BITS || lattice.step <= 0.0)
            .then(|| format!("the lattice has {} bits, and {MOST_BITS} are the most", lattice.bits));
        let (grids, remarks) = Default::default();
        Self { origin: lattice.origin, step: lattice.step / 2.0, never, unfit, shown, grids, remarks }
    }

    /// The grid of a mesh, if it can be of integers.
    pub(super) fn grid(&mut self, number: usize, mesh: &Value, shaper: &Shaper<'_>) -> Option<Grid> {
        if self.never.is_some() {
            return None;
        }
        match self.found(number, mesh, shaper) {
            Ok(grid) => {
                self.grids.insert(number, grid);
                Some(grid)
            }
            Err(why) => {
                let name =
                    mesh["name"].as_str().map_or(String::new(), |name| format!(" ({})", shortened(name)));
                self.remarks.push(format!("mesh {number}{name} stays in floating-point numbers: {why}"));
                None
            }
        }
    }

    fn found(&self, number: usize, mesh: &Value, shaper: &Shaper<'_>) -> Result<Grid, &'static str> {
        if let Some(why) = self.unfit.get(&number) {
            return Err(why);
        }
        if !self.shown.get(number).is_some_and(|shown| *shown) {
            return Err("no node shows it");
        }
        let mut exponent = None;
        for primitive in mesh["primitives"].as_array().into_iter().flatten() {
            let told = &primitive["extensions"][EXTENSION];
            let own = told["exponent"].as_i64().unwrap_or(0) as i32;
            if *exponent.get_or_insert(own) != own {
                return Err("its parts are of several lattices");
            }
            let part = told["part"].as_u64().and_then(|part| u32::try_from(part).ok()).unwrap_or(u32::MAX);
            let is_on = |x: f64, k: usize| {
                let q = (x - self.origin[k]) / self.step;
                (-NEAR..f64::from(u16::MAX) + NEAR).contains(&q) && (q - q.round()).abs() < NEAR
            };
            if !shaper.places_of(part).all(|p| (0..3).all(|k| is_on(p[k], k))) {
                return Err("its vertices are not on the lattice");
            }
        }
        let exponent = exponent.ok_or("it has no primitives")?;
        Ok(Grid { origin: self.origin, step: self.step, exponent })
    }

    /// Has the nodes put meshes in their places; tells which are as they were.
    pub(super) fn finish(self, json: &mut Value) -> Vec<String> {
        if let Some(why) = self.never {
            return vec![format!("all stays in floating-point numbers: {why}")];
        }
        let mut next = items(json, "nodes").len();
        let mut below = Vec::new();
        for node in items(json, "nodes") {
            let number = node.get("mesh").and_then(Value::as_u64);
            let Some(grid) = number.and_then(|mesh| self.grids.get(&(mesh as usize))) else { continue };
            let Some(node) = node.as_object_mut() else { continue };
            node.shift_remove("mesh");
            let children = node.entry("children").or_insert_with(|| json!([]));
            let Some(children) = children.as_array_mut() else { continue };
            // First, so that meshes are shown in the order in which they were.
            children.insert(0, next.into());
            next += 1;
            let factor = f64::from(-grid.exponent).exp2();
            let scale = [grid.step * factor; 3];
            below.push(json!({
                "mesh": number,
                "translation": grid.origin.map(|x| x * factor),
                "scale": scale,
            }));
        }
        if !below.is_empty() {
            if let Some(nodes) = json.get_mut("nodes").and_then(Value::as_array_mut) {
                nodes.extend(below);
            }
            json.as_object_mut().into_iter().for_each(|root| name_extension(root, QUANTIZATION));
        }
        self.remarks
    }
}

impl Grid {
    /// Positions, as the document has them, by their numbers on the grid.
    pub(super) fn positions(&self, places: &[[f64; 3]], exponent: i32) -> (Shape, Values) {
        let factor = f64::from(exponent).exp2();
        let number = |(k, &x): (usize, &f64)| {
            ((x * factor - self.origin[k % 3]) / self.step).round().clamp(0.0, f64::from(u16::MAX)) as u16
        };
        let numbers = places.as_flattened().iter().enumerate().map(number).collect();
        (Shape { stored: Stored::U16, normalised: false, components: 3 }, Values::U16(numbers))
    }
}

/// Numbers of an attribute as fractions of 16 bits, where these tell them nearly as well and glTF allows it.
pub(super) fn narrowed(name: &str, shape: Shape, values: &Values) -> Option<(Shape, Values)> {
    let Values::F32(list) = values else { return None };
    match name {
        "NORMAL" | "TANGENT" => {
            let one = f32::from(i16::MAX);
            let numbers = list.iter().map(|x| (x.clamp(-1.0, 1.0) * one).round() as i16).collect();
            Some((Shape { stored: Stored::I16, normalised: true, ..shape }, Values::I16(numbers)))
        }
        _ if name.starts_with("TEXCOORD_") && list.iter().all(|x| (0.0..=1.0).contains(x)) => {
            let one = f32::from(u16::MAX);
            let numbers = list.iter().map(|x| (x * one).round() as u16).collect();
            Some((Shape { stored: Stored::U16, normalised: true, ..shape }, Values::U16(numbers)))
        }
        _ => None,
    }
}

/// Bits of a lattice of which half steps are integers of 16 bits.
const MOST_BITS: u32 = 15;
/// How far off a point of the grid what is taken for it may be, in steps.
const NEAR: f64 = 1.0 / 64.0;
