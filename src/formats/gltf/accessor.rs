//! Accessors (glTF 2.0, §3.6.2): numbers in views of buffers, close together or not, with some replaced.

use super::document::Document;
use super::json::At;
use crate::error::Result;
use crate::limits::MAX_ELEMENTS;
use crate::mesh::attributes::{Stored, Values};

/// How the numbers of an accessor are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Shape {
    pub stored: Stored,
    /// Whether integers stand for fractions.
    pub normalised: bool,
    /// Numbers an element.
    pub components: usize,
}

impl Shape {
    /// The shape that an object tells as an accessor does. Matrices whose columns would have to be padded are of binary32 numbers.
    ///
    /// # Errors
    /// Where it tells none.
    pub(super) fn told(at: &At<'_>) -> Result<Self> {
        let stored = component_type(at)?;
        let (rows, columns) = rows_and_columns(at)?;
        let normalised = at.key("normalized").is_some_and(|at| at.value == true) && !stored.is_float();
        let components = rows * columns;
        if columns > 1 && !(rows * size(stored)).is_multiple_of(4) {
            return Ok(Self { stored: Stored::F32, normalised: false, components });
        }
        Ok(Self { stored, normalised, components })
    }
}

/// What an accessor's JSON says.
pub(super) struct Accessor<'d> {
    document: &'d Document<'d>,
    at: At<'d>,
    pub shape: Shape,
    pub count: usize,
    layout: Layout,
}

/// Where an element has its numbers.
#[derive(Clone, Copy)]
struct Layout {
    /// Numbers a column; a vector is one.
    rows: usize,
    /// Bytes from one column of a matrix to the next.
    column: usize,
    /// Bytes of an element, but for what pads its last column.
    element: usize,
    /// Bytes from one element to the next, where they are close together.
    stride: usize,
}

impl<'d> Accessor<'d> {
    /// The accessor that a number names.
    ///
    /// # Errors
    /// Where there is none, or its type is not one of glTF's.
    pub(super) fn new(document: &'d Document<'d>, number: &At<'_>) -> Result<Self> {
        let at = document.named("accessors", number)?;
        let stored = component_type(&at)?;
        let (rows, columns) = rows_and_columns(&at)?;
        let size = size(stored);
        // Columns of matrices begin at multiples of four bytes.
        let column = if columns == 1 { rows * size } else { (rows * size).next_multiple_of(4) };
        let normalised = at.key("normalized").is_some_and(|at| at.value == true) && !stored.is_float();
        let count = at.needed("count")?;
        let number = count.number()?;
        if number == 0 || number > MAX_ELEMENTS as usize {
            return Err(count.fault(format!("{number} elements, allowed 1 to {MAX_ELEMENTS}")));
        }
        let layout =
            Layout { rows, column, element: (columns - 1) * column + rows * size, stride: columns * column };
        Ok(Self {
            document,
            at,
            shape: Shape { stored, normalised, components: rows * columns },
            count: number,
            layout,
        })
    }

    /// A fault of it.
    pub(super) fn fault(&self, what: impl std::fmt::Display) -> crate::error::Error {
        self.at.fault(what)
    }

    /// All of its numbers, as they are stored.
    ///
    /// # Errors
    /// Where they lie outside of their buffer; [`Error::Limit`](crate::Error::Limit) where they are too many.
    pub(super) fn values(&self) -> Result<Values> {
        self.document.take(self.count, self.shape.components * size(self.shape.stored))?;
        Ok(match self.shape.stored {
            Stored::U8 => Values::U8(self.collect(u8::from_le_bytes)?),
            Stored::I8 => Values::I8(self.collect(i8::from_le_bytes)?),
            Stored::U16 => Values::U16(self.collect(u16::from_le_bytes)?),
            Stored::I16 => Values::I16(self.collect(i16::from_le_bytes)?),
            Stored::U32 => Values::U32(self.collect(u32::from_le_bytes)?),
            Stored::I32 => Values::I32(self.collect(i32::from_le_bytes)?),
            Stored::F32 => Values::F32(self.collect(f32::from_le_bytes)?),
            Stored::F64 => Values::F64(self.collect(f64::from_le_bytes)?),
        })
    }

    fn collect<T: Copy + Default, const N: usize>(&self, from: fn([u8; N]) -> T) -> Result<Vec<T>> {
        let components = self.shape.components;
        let mut list = match self.at.key("bufferView") {
            Some(view) => {
                let mut list = Vec::with_capacity(self.count * components);
                self.elements(&self.at, &view, self.count, &mut list, from)?;
                list
            }
            None => vec![T::default(); self.count * components],
        };
        if let Some(sparse) = self.at.key("sparse") {
            let places = self.places(&sparse)?;
            let values = sparse.needed("values")?;
            let mut replacing = Vec::with_capacity(places.len() * components);
            self.elements(&values, &values.needed("bufferView")?, places.len(), &mut replacing, from)?;
            for (place, values) in places.into_iter().zip(replacing.chunks_exact(components)) {
                list[place * components..][..components].copy_from_slice(values);
            }
        }
        Ok(list)
    }

    /// Which elements are replaced.
    fn places(&self, sparse: &At<'d>) -> Result<Vec<usize>> {
        let count = sparse.needed("count")?;
        let number = count.number()?;
        if number > self.count {
            return Err(count.fault(format!("{number} elements of {} are replaced", self.count)));
        }
        self.document.take(number, size_of::<usize>() + self.shape.components * size(self.shape.stored))?;
        let indices = sparse.needed("indices")?;
        let view = self.document.view(&indices.needed("bufferView")?)?;
        let stored = component_type(&indices)?;
        let size = size(stored);
        let offset = indices.count("byteOffset")?.unwrap_or(0);
        let bytes = number.checked_mul(size).and_then(|length| view.bytes.get(offset..)?.get(..length));
        let bytes = bytes.ok_or_else(|| {
            indices.fault(format!("{number} indices from byte {offset} of a view of {}", view.bytes.len()))
        })?;
        let index = |bytes: &[u8]| bytes.iter().rev().fold(0usize, |index, &b| index << 8 | usize::from(b));
        let places: Vec<usize> = bytes.chunks_exact(size).map(index).collect();
        match places.iter().position(|&place| place >= self.count) {
            _ if !matches!(stored, Stored::U8 | Stored::U16 | Stored::U32) => {
                Err(indices.fault(format!("indices of type {}", stored.name())))
            }
            Some(k) => Err(indices.fault(format!("index {k} names element {} of {}", places[k], self.count))),
            None => Ok(places),
        }
    }

    /// Whether its numbers are all there.
    ///
    /// # Errors
    /// As [`Accessor::values`].
    pub(super) fn check(&self) -> Result<()> {
        if let Some(view) = self.at.key("bufferView") {
            self.stretch(&self.at, &view, self.count)?;
        }
        if let Some(sparse) = self.at.key("sparse") {
            let (count, values) = (self.places(&sparse)?.len(), sparse.needed("values")?);
            self.stretch(&values, &values.needed("bufferView")?, count)?;
        }
        Ok(())
    }

    /// Appends the numbers of so many elements of a view. `at` says where in it they begin.
    fn elements<T, const N: usize>(
        &self,
        at: &At<'_>,
        view: &At<'_>,
        count: usize,
        list: &mut Vec<T>,
        from: fn([u8; N]) -> T,
    ) -> Result<()> {
        let Layout { rows, column, .. } = self.layout;
        let (bytes, stride) = self.stretch(at, view, count)?;
        for element in bytes.chunks(stride) {
            for k in 0..self.shape.components {
                let at = k / rows * column + k % rows * N;
                let number = element.get(at..).and_then(|rest| rest.first_chunk());
                list.extend(number.copied().map(from));
            }
        }
        Ok(())
    }

    /// The bytes of so many elements of a view, and how many are from one to the next. `at` says where in it they begin.
    fn stretch(&self, at: &At<'_>, view: &At<'_>, count: usize) -> Result<(&'d [u8], usize)> {
        let Layout { element, stride, .. } = self.layout;
        let view = self.document.view(view)?;
        let stride = view.stride.unwrap_or(stride);
        let offset = at.count("byteOffset")?.unwrap_or(0);
        if stride < element {
            return Err(at.fault(format!("elements of {element} bytes, {stride} apart")));
        }
        let length =
            (count.saturating_sub(1)).checked_mul(stride).and_then(|length| length.checked_add(element));
        let bytes = length.and_then(|length| view.bytes.get(offset..)?.get(..length));
        bytes.filter(|_| count > 0).map(|bytes| (bytes, stride)).ok_or_else(|| {
            let there = view.bytes.len();
            at.fault(format!(
                "{count} elements of {element} bytes, {stride} apart, from byte {offset} of a view of {there}"
            ))
        })
    }
}

fn component_type(at: &At<'_>) -> Result<Stored> {
    let code = at.needed("componentType")?;
    let number = code.number()?;
    let known = COMPONENT_TYPES.iter().find(|(other, _)| *other == number);
    known.map(|(_, stored)| *stored).ok_or_else(|| code.fault(format!("{number} is no component type")))
}

fn rows_and_columns(at: &At<'_>) -> Result<(usize, usize)> {
    let kind = at.needed("type")?;
    let known = TYPES.iter().find(|(name, ..)| kind.value.as_str() == Some(*name));
    known
        .map(|&(_, rows, columns)| (rows, columns))
        .ok_or_else(|| kind.fault(format!("{} is no type", kind.value)))
}

/// Bytes of a number.
pub(super) fn size(stored: Stored) -> usize {
    match stored {
        Stored::U8 | Stored::I8 => 1,
        Stored::U16 | Stored::I16 => 2,
        Stored::U32 | Stored::I32 | Stored::F32 => 4,
        Stored::F64 => 8,
    }
}

/// The code of a component type.
pub(super) fn code(stored: Stored) -> usize {
    COMPONENT_TYPES.iter().find(|(_, other)| *other == stored).map_or(0, |(code, _)| *code)
}

/// The name of the type of so many numbers, if there is one; a vector, not a matrix, of four.
pub(super) fn type_of(components: usize) -> Option<&'static str> {
    let of = |(_, rows, columns): &&(&str, usize, usize)| {
        rows * columns == components && !(*rows == 2 && *columns == 2)
    };
    TYPES.iter().find(of).map(|(name, ..)| *name)
}

/// Names, rows, columns.
const TYPES: [(&str, usize, usize); 7] = [
    ("SCALAR", 1, 1),
    ("VEC2", 2, 1),
    ("VEC3", 3, 1),
    ("VEC4", 4, 1),
    ("MAT2", 2, 2),
    ("MAT3", 3, 3),
    ("MAT4", 4, 4),
];

/// Those of WebGL; glTF has the first six of them, extensions the others.
const COMPONENT_TYPES: [(usize, Stored); 8] = [
    (5120, Stored::I8),
    (5121, Stored::U8),
    (5122, Stored::I16),
    (5123, Stored::U16),
    (5125, Stored::U32),
    (5126, Stored::F32),
    (5124, Stored::I32),
    (5130, Stored::F64),
];
