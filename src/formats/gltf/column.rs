//! Attributes of several primitives as one: of a type that loses nothing of any, with no value where a primitive has none.

use std::collections::HashMap;

use super::accessor::{self, Shape};
use super::document::Document;
use super::primitive::Stream;
use super::transform::{Matrix, unit};
use crate::error::{Error, Result};
use crate::limits::MAX_ELEMENTS;
use crate::mesh::attributes::{Attribute, NO_VALUE, Semantic, Stored, Values};

/// The types that an attribute has in the primitives of a scene.
#[derive(Default)]
pub(super) struct Survey {
    /// In the order in which they were seen.
    shapes: Vec<Shape>,
    /// Whether nodes turn some of it.
    turned: bool,
}

impl Survey {
    pub(super) fn see(&mut self, shape: Shape, turned: bool) {
        self.turned |= turned;
        if !self.shapes.contains(&shape) {
            self.shapes.push(shape);
        }
    }
}

/// What columns are sorted by.
pub(super) type Key<'d> = (Semantic, u32, &'d str);

/// An attribute that grows.
pub(super) struct Column {
    /// As the glTF calls it.
    pub name: String,
    semantic: Semantic,
    set: u32,
    shape: Shape,
    seen: Vec<Shape>,
    values: Values,
    corners: Vec<u32>,
    /// Where the values begin of what has been added of the present mesh: by stream, and by instance if it turns them.
    begins: HashMap<(usize, Option<usize>), u32>,
}

impl Column {
    pub(super) fn new(name: &str, survey: Survey) -> Self {
        let components = survey.shapes.iter().map(|shape| shape.components).max().unwrap_or(1);
        let (semantic, set) = semantic(name, components);
        let turned = survey.turned && matches!(semantic, Semantic::Normal | Semantic::Tangent);
        // What is turned is no fraction of integers any more.
        let binary32 = turned.then_some((Stored::F32, false));
        let types = survey.shapes.iter().map(|shape| (shape.stored, shape.normalised)).chain(binary32);
        let (stored, normalised) = types.reduce(widest).unwrap_or((Stored::F32, false));
        Self {
            name: name.to_owned(),
            semantic,
            set,
            shape: Shape { stored, normalised, components },
            seen: survey.shapes,
            values: Values::new(stored),
            corners: Vec::new(),
            begins: HashMap::new(),
        }
    }

    pub(super) fn key<'d>(&self, name: &'d str) -> Key<'d> {
        (self.semantic, self.set, name)
    }

    /// Says of what types it was, if that was not one.
    pub(super) fn retyped(&self) -> Option<String> {
        let told = |shape: &Shape| {
            let normalised = if shape.normalised { " normalised" } else { "" };
            format!("{} {}{normalised}", shape.components, shape.stored.name())
        };
        let seen: Vec<String> = self.seen.iter().map(told).collect();
        let name = super::notes::shortened(&self.name);
        (seen.len() > 1)
            .then(|| format!("types of {name} ({}; all are {} now)", seen.join(", "), told(&self.shape)))
    }

    /// The values of a primitive's vertices, which `from` tells from others of the mesh, at the corners of triangles.
    pub(super) fn add(
        &mut self,
        document: &Document<'_>,
        from: (usize, usize),
        stream: &Stream,
        world: &Matrix,
        first: usize,
        corners: &[[u32; 3]],
    ) -> Result<()> {
        let turns =
            matches!(self.semantic, Semantic::Normal | Semantic::Tangent) && !world.keeps_directions();
        let key = (from.0, turns.then_some(from.1));
        let begin = match self.begins.get(&key) {
            Some(&begin) => begin,
            None => {
                document.take(stream.count(), self.shape.components * accessor::size(self.shape.stored))?;
                let begin = self.append(stream, turns.then_some(world))?;
                self.begins.insert(key, begin);
                begin
            }
        };
        self.corners.resize(3 * first, NO_VALUE);
        self.corners.extend(corners.as_flattened().iter().map(|v| begin + v));
        Ok(())
    }

    /// What is added from now on is of another mesh.
    pub(super) fn end_of_mesh(&mut self) {
        self.begins.clear();
    }

    fn append(&mut self, stream: &Stream, world: Option<&Matrix>) -> Result<u32> {
        let (has, needed) = (stream.shape.components, self.shape.components);
        let begin = self.values.len() / needed;
        let (count, allowed) = ((begin + stream.count()) as u64, u64::from(MAX_ELEMENTS));
        if count > allowed {
            return Err(Error::Limit { what: "values of an attribute", needed: count, allowed });
        }
        let number = |at: usize| stream.values.fraction(at, stream.shape.normalised);
        for v in 0..stream.count() {
            if let (Some(world), 3..) = (world, has) {
                let direction = [0, 1, 2].map(|k| number(has * v + k));
                let turned = if self.semantic == Semantic::Normal {
                    world.normal(direction)
                } else {
                    world.direction(direction)
                };
                unit(turned).into_iter().for_each(|x| self.values.push(x));
                // The bitangent is mirrored, too, but not the cross product that it is made from.
                let side = if world.mirrors() { -1.0 } else { 1.0 };
                (3..has).for_each(|k| self.values.push(side * number(has * v + k)));
            } else {
                (has * v..has * (v + 1)).for_each(|at| self.convert(stream, at));
            }
            for k in has..needed {
                // What has no alpha is opaque (glTF 2.0, §3.9.2).
                let one = self.shape.stored.one().filter(|_| self.shape.normalised).unwrap_or(1.0);
                self.values.push(if self.semantic == Semantic::Color && k == 3 { one } else { 0.0 });
            }
        }
        Ok(begin as u32)
    }

    /// A number as it is stored here.
    fn convert(&mut self, stream: &Stream, at: usize) {
        let (from, to) = (stream.shape, self.shape);
        if (from.stored, from.normalised) == (to.stored, to.normalised) {
            self.values.push_bits(stream.values.bits(at));
        } else if let (true, Some(one), Some(most)) = (to.normalised, from.stored.one(), to.stored.one()) {
            // 257 for 8 bits in 16.
            self.values.push(stream.values.number(at) * (most / one));
        } else {
            self.values.push(stream.values.fraction(at, from.normalised));
        }
    }

    /// The attribute of so many triangles.
    pub(super) fn finish(mut self, triangles: usize) -> Attribute {
        self.corners.resize(3 * triangles, NO_VALUE);
        let attribute = Attribute::new(self.semantic, self.shape.components, self.values, self.corners);
        let name = if self.semantic == Semantic::Generic { self.name } else { String::new() };
        Attribute { set: self.set, name, normalised: self.shape.normalised, ..attribute }
    }
}

/// What an attribute is by its name (glTF 2.0, §3.7.2.1), and which of several.
fn semantic(name: &str, components: usize) -> (Semantic, u32) {
    let (word, number) = name.rsplit_once('_').unwrap_or((name, ""));
    // `TEXCOORD_01` and `TEXCOORD_+1` are names of their own.
    let set = number.parse().ok().filter(|set: &u32| set.to_string() == number);
    match (name, word, set) {
        ("NORMAL", ..) if components == 3 => (Semantic::Normal, 0),
        ("TANGENT", ..) if components == 4 => (Semantic::Tangent, 0),
        (_, "TEXCOORD", Some(set)) if components == 2 => (Semantic::TexCoord, set),
        (_, "COLOR", Some(set)) if matches!(components, 3 | 4) => (Semantic::Color, set),
        (_, "JOINTS", Some(set)) if components == 4 => (Semantic::Joints, set),
        (_, "WEIGHTS", Some(set)) if components == 4 => (Semantic::Weights, set),
        _ => (Semantic::Generic, 0),
    }
}

/// The narrowest type that tells all numbers of two types apart, and whether its integers stand for fractions.
fn widest(one: (Stored, bool), other: (Stored, bool)) -> (Stored, bool) {
    let range = |stored: Stored| match stored {
        Stored::U8 => Some([0, i64::from(u8::MAX)]),
        Stored::I8 => Some([i64::from(i8::MIN), i64::from(i8::MAX)]),
        Stored::U16 => Some([0, i64::from(u16::MAX)]),
        Stored::I16 => Some([i64::from(i16::MIN), i64::from(i16::MAX)]),
        Stored::U32 => Some([0, i64::from(u32::MAX)]),
        Stored::I32 => Some([i64::from(i32::MIN), i64::from(i32::MAX)]),
        Stored::F32 | Stored::F64 => None,
    };
    let wide = |(stored, _): (Stored, bool)| matches!(stored, Stored::U32 | Stored::I32 | Stored::F64);
    match (range(one.0), range(other.0)) {
        _ if one == other => one,
        (Some([a, b]), Some([c, d])) if !one.1 && !other.1 => {
            let holds = |stored: &Stored| range(*stored).is_some_and(|[e, f]| e <= a.min(c) && f >= b.max(d));
            let all = [Stored::U8, Stored::I8, Stored::U16, Stored::I16, Stored::U32, Stored::I32];
            (all.into_iter().find(holds).unwrap_or(Stored::F64), false)
        }
        // n / 255 is 257 n / 65,535.
        (Some([0, _]), Some([0, _])) if one.1 && other.1 && !wide(one) && !wide(other) => (Stored::U16, true),
        // Fractions of 16 bits are further apart than binary32 numbers are.
        _ if wide(one) || wide(other) => (Stored::F64, false),
        _ => (Stored::F32, false),
    }
}
