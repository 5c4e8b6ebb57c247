//! One buffer of all that a glTF that is written has in binary, with its views and accessors (glTF 2.0, §3.6).

use std::io;

use serde_json::{Map, Number, Value, json};

use super::accessor::{Shape, code, size, type_of};
use super::meshopt;
use crate::limits::{Budget, Limits};
use crate::mesh::attributes::{Stored, Values};

/// Buffer, views and accessors that grow.
pub(super) struct Pack {
    budget: Budget,
    /// The buffer.
    pub bytes: Vec<u8>,
    /// `bufferViews`.
    pub views: Vec<Value>,
    /// `accessors`.
    pub accessors: Vec<Value>,
    /// Views that are of vertices or of triangles' indices; nothing stands behind the first of them but others.
    elements: Vec<Elements>,
    /// The length of a second buffer, which is there compressed in the first one alone; 0 where there is none.
    unpacked: usize,
}

/// A view of elements one behind the other.
struct Elements {
    view: usize,
    begin: usize,
    mode: meshopt::Mode,
    stride: usize,
}

impl Default for Pack {
    fn default() -> Self {
        Self::new(u64::MAX)
    }
}

impl Pack {
    /// An empty one; it and all that is made for it may take so many bytes.
    pub(super) fn new(max_memory: u64) -> Self {
        let budget = Budget::new(Limits { memory: max_memory, work: u64::MAX });
        Self {
            budget,
            bytes: Vec::new(),
            views: Vec::new(),
            accessors: Vec::new(),
            elements: Vec::new(),
            unpacked: 0,
        }
    }

    /// Debits memory for `count` items of `size` bytes.
    ///
    /// # Errors
    /// [`Error::Limit`](crate::Error::Limit), within an [`io::Error`], where there is not so much left.
    pub(super) fn take(&mut self, count: usize, size: usize) -> io::Result<()> {
        self.budget.take_memory(count, size).map_err(io::Error::other)
    }

    /// Puts bytes into the buffer, and says where they begin: at a multiple of four.
    pub(super) fn put(&mut self, bytes: &[u8]) -> usize {
        self.align();
        let begin = self.bytes.len();
        self.bytes.extend_from_slice(bytes);
        begin
    }

    /// The number of a new accessor of elements one behind the other, all of `values`, for vertices. Elements begin at multiples of four
    /// bytes; one that is to be `bounded` tells its least and largest numbers.
    pub(super) fn vertices(&mut self, shape: Shape, values: &Values, bounded: bool) -> usize {
        self.align();
        let begin = self.bytes.len();
        let element = shape.components * size(shape.stored);
        let stride = element.next_multiple_of(4);
        for first in (0..values.len()).step_by(shape.components) {
            self.numbers(values, first..first + shape.components);
            self.align();
        }
        let mut view = self.view(begin, ARRAY_BUFFER);
        if stride != element {
            view["byteStride"] = stride.into();
        }
        self.elements.push(Elements {
            view: self.views.len(),
            begin,
            mode: meshopt::Mode::Attributes,
            stride,
        });
        self.views.push(view);
        let count = values.len() / shape.components;
        let accessor = json!({ "bufferView": self.views.len() - 1 });
        let bounds = bounded.then(|| bounds(shape, values));
        self.accessor(accessor, shape, count, bounds)
    }

    /// The number of a new accessor of so many elements, all of them 0.
    pub(super) fn zeros(&mut self, shape: Shape, count: usize, bounded: bool) -> usize {
        let mut one = Values::new(shape.stored);
        (0..shape.components).for_each(|_| one.push(0.0));
        let bounds = bounded.then(|| bounds(shape, &one));
        self.accessor(json!({}), shape, count, bounds)
    }

    /// The number of a new accessor of indices of triangles, in 16 bits where these are enough: the largest number of a type stands for none.
    pub(super) fn indices(&mut self, indices: &[u32]) -> usize {
        self.align();
        let begin = self.bytes.len();
        let largest = indices.iter().copied().max().unwrap_or(0);
        let stored = if largest < u32::from(u16::MAX) { Stored::U16 } else { Stored::U32 };
        match stored {
            Stored::U16 => indices.iter().for_each(|&i| self.bytes.extend((i as u16).to_le_bytes())),
            _ => indices.iter().for_each(|i| self.bytes.extend(i.to_le_bytes())),
        }
        let view = self.view(begin, ELEMENT_ARRAY_BUFFER);
        let (mode, stride) = (meshopt::Mode::Triangles, size(stored));
        self.elements.push(Elements { view: self.views.len(), begin, mode, stride });
        self.views.push(view);
        let accessor = json!({ "bufferView": self.views.len() - 1 });
        let shape = Shape { stored, normalised: false, components: 1 };
        self.accessor(accessor, shape, indices.len(), None)
    }

    fn accessor(
        &mut self,
        mut accessor: Value,
        shape: Shape,
        count: usize,
        bounds: Option<[Vec<Value>; 2]>,
    ) -> usize {
        accessor["componentType"] = code(shape.stored).into();
        accessor["count"] = count.into();
        accessor["type"] = type_of(shape.components).unwrap_or("SCALAR").into();
        if shape.normalised {
            accessor["normalized"] = true.into();
        }
        if let Some([min, max]) = bounds {
            accessor["min"] = min.into();
            accessor["max"] = max.into();
        }
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// A view of all that is behind a byte.
    fn view(&self, begin: usize, target: u32) -> Value {
        json!({ "buffer": 0, "byteOffset": begin, "byteLength": self.bytes.len() - begin, "target": target })
    }

    fn numbers(&mut self, values: &Values, numbers: std::ops::Range<usize>) {
        let size = size(values.stored());
        numbers.for_each(|at| self.bytes.extend(&values.bits(at).to_le_bytes()[..size]));
    }

    fn align(&mut self) {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
    }

    /// Compresses vertices and indices where that makes them smaller (EXT_meshopt_compression). What they unpack to is a buffer of its own,
    /// of which there are no bytes.
    ///
    /// # Errors
    /// [`Error::Limit`](crate::Error::Limit), within an [`io::Error`].
    pub(super) fn compress(&mut self, root: &mut Map<String, Value>) -> io::Result<()> {
        self.align();
        let Some(first) = self.elements.first().map(|elements| elements.begin) else { return Ok(()) };
        // Beside the bytes there are those packed, and indices as numbers.
        self.take(self.bytes.len() - first, 3)?;
        let plain = self.bytes.split_off(first);
        let mut unpacked = 0;
        for Elements { view, begin, mode, stride } in std::mem::take(&mut self.elements) {
            let length = self.views[view]["byteLength"].as_u64().map_or(0, |length| length as usize);
            let stretch = &plain[begin - first..][..length];
            let Some(packed) = mode.pack(stretch, stride).filter(|packed| packed.len() < length) else {
                self.views[view]["byteOffset"] = self.put(stretch).into();
                continue;
            };
            let extension = json!({
                "buffer": 0, "byteOffset": self.put(&packed), "byteLength": packed.len(),
                "byteStride": stride, "count": length / stride, "mode": mode.name(),
            });
            let view = &mut self.views[view];
            view["buffer"] = 1.into();
            view["byteOffset"] = unpacked.into();
            view["extensions"] = json!({ meshopt::EXTENSIONS[0]: extension });
            unpacked += length.next_multiple_of(4);
        }
        if unpacked > 0 {
            self.unpacked = unpacked;
            name_extension(root, meshopt::EXTENSIONS[0]);
        }
        Ok(())
    }

    /// Puts the lists into the root of a glTF, those that have something in them.
    pub(super) fn finish(&mut self, root: &mut Map<String, Value>) {
        self.align();
        let mut buffers =
            if self.bytes.is_empty() { vec![] } else { vec![json!({ "byteLength": self.bytes.len() })] };
        if self.unpacked > 0 {
            let extensions = json!({ meshopt::EXTENSIONS[0]: { "fallback": true } });
            buffers.push(json!({ "byteLength": self.unpacked, "extensions": extensions }));
        }
        let lists = [
            ("accessors", std::mem::take(&mut self.accessors)),
            ("bufferViews", std::mem::take(&mut self.views)),
            ("buffers", buffers),
        ];
        for (key, list) in lists {
            if list.is_empty() {
                root.remove(key);
            } else {
                root.insert(key.to_owned(), list.into());
            }
        }
    }
}

/// Has a document say that who reads it must know an extension.
pub(super) fn name_extension(root: &mut Map<String, Value>, name: &str) {
    for list in ["extensionsUsed", "extensionsRequired"] {
        let names = root.entry(list).or_insert_with(|| json!([]));
        let Some(names) = names.as_array_mut() else { continue };
        if names.iter().all(|other| other != name) {
            names.push(name.into());
        }
    }
}

/// The least and the largest number of each component.
fn bounds(shape: Shape, values: &Values) -> [Vec<Value>; 2] {
    let bound = |k: usize, beyond: fn(f64, f64) -> bool| {
        let column = (k..values.len()).step_by(shape.components).map(|at| values.number(at));
        column.reduce(|most, x| if beyond(x, most) { x } else { most }).unwrap_or(0.0)
    };
    let number = |x: f64| match shape.stored.is_float() {
        true => Number::from_f64(x).map_or(Value::Null, Value::Number),
        false => (x as i64).into(),
    };
    let of = |beyond| (0..shape.components).map(|k| number(bound(k, beyond))).collect();
    [of(|x, most| x < most), of(|x, most| x > most)]
}

const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_begin_at_multiples_of_four() {
        let mut pack = Pack { bytes: b"abc".to_vec(), ..Pack::default() };
        let shape = Shape { stored: Stored::U8, normalised: true, components: 3 };
        assert_eq!(pack.vertices(shape, &Values::U8(vec![1, 2, 3, 4, 5, 6]), true), 0);
        assert_eq!(pack.bytes, b"abc\0\x01\x02\x03\0\x04\x05\x06\0");
        let view = json!({ "buffer": 0, "byteOffset": 4, "byteLength": 8, "byteStride": 4, "target": 34962 });
        assert_eq!(pack.views, [view]);
        let accessor = json!({
            "bufferView": 0, "componentType": 5121, "normalized": true, "count": 2, "type": "VEC3",
            "min": [1, 2, 3], "max": [4, 5, 6],
        });
        assert_eq!(pack.accessors, [accessor]);
    }

    #[test]
    fn indices_take_as_few_bits_as_they_need() {
        let mut pack = Pack::default();
        pack.indices(&[0, 1, 65534]);
        pack.indices(&[0, 1, 65535]);
        assert_eq!(pack.accessors[0]["componentType"], 5123);
        assert_eq!(pack.accessors[1]["componentType"], 5125);
        assert_eq!(pack.bytes[..8], [0, 0, 1, 0, 0xfe, 0xff, 0, 0]);
        assert_eq!(pack.bytes.len(), 8 + 12);
    }
}
