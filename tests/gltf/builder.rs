//! glTF made by code.

use serde_json::{Value, json};
use unweld::Error;
use unweld::formats::{ReadOptions, Source, read_with};

pub const BYTE: u32 = 5120;
pub const UNSIGNED_BYTE: u32 = 5121;
pub const SHORT: u32 = 5122;
pub const UNSIGNED_SHORT: u32 = 5123;
pub const UNSIGNED_INT: u32 = 5125;
pub const FLOAT: u32 = 5126;

/// A document whose only buffer is the binary chunk, or a data URI.
pub struct Gltf {
    pub json: Value,
    pub binary: Vec<u8>,
}

impl Gltf {
    /// Nothing but lists.
    pub fn new() -> Self {
        let json = json!({
            "asset": {"version": "2.0"}, "buffers": [{}], "bufferViews": [], "accessors": [], "meshes": [], "nodes": [],
        });
        Self { json, binary: Vec::new() }
    }

    /// Appends to a list; returns the number of the item.
    pub fn push(&mut self, list: &str, item: Value) -> usize {
        if self.json[list].is_null() {
            self.json[list] = json!([]);
        }
        let list = self.json[list].as_array_mut().unwrap();
        list.push(item);
        list.len() - 1
    }

    /// A view of some bytes.
    pub fn view(&mut self, bytes: &[u8]) -> usize {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let offset = self.binary.len();
        self.binary.extend(bytes);
        self.push("bufferViews", json!({"buffer": 0, "byteOffset": offset, "byteLength": bytes.len()}))
    }

    /// An accessor of some bytes, close together.
    pub fn accessor(&mut self, kind: &str, component: u32, count: usize, bytes: &[u8]) -> usize {
        let view = self.view(bytes);
        let accessor = json!({"bufferView": view, "componentType": component, "count": count, "type": kind});
        self.push("accessors", accessor)
    }

    pub fn floats(&mut self, kind: &str, numbers: &[f32]) -> usize {
        let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
        let each = ["SCALAR", "VEC2", "VEC3", "VEC4"].iter().position(|k| *k == kind).unwrap() + 1;
        self.accessor(kind, FLOAT, numbers.len() / each, &bytes)
    }

    pub fn normalised(&mut self, accessor: usize) -> usize {
        self.json["accessors"][accessor]["normalized"] = true.into();
        accessor
    }

    pub fn indices(&mut self, list: &[u16]) -> usize {
        let bytes: Vec<u8> = list.iter().flat_map(|x| x.to_le_bytes()).collect();
        self.accessor("SCALAR", UNSIGNED_SHORT, list.len(), &bytes)
    }

    /// A mesh of one primitive.
    pub fn mesh(&mut self, primitive: Value) -> usize {
        self.push("meshes", json!({"primitives": [primitive]}))
    }

    /// A mesh of one primitive, and a node that has it.
    pub fn shown(&mut self, primitive: Value) -> usize {
        let mesh = self.mesh(primitive);
        self.push("nodes", json!({"mesh": mesh}))
    }

    fn finished(&self) -> Value {
        let mut json = self.json.clone();
        if json["buffers"][0]["byteLength"].is_null() {
            json["buffers"][0]["byteLength"] = self.binary.len().into();
        }
        json
    }

    /// As a binary file.
    pub fn glb(&self) -> Vec<u8> {
        self.framed(&self.finished())
    }

    /// As a binary file, whatever the JSON is.
    pub fn glb_as_it_is(&self) -> Vec<u8> {
        self.framed(&self.json)
    }

    fn framed(&self, json: &Value) -> Vec<u8> {
        let mut json = json.to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut binary = self.binary.clone();
        binary.resize(binary.len().next_multiple_of(4), 0);
        let chunk =
            |kind: &[u8; 4], data: &[u8]| [&(data.len() as u32).to_le_bytes()[..], kind, data].concat();
        let body = [chunk(b"JSON", &json), chunk(b"BIN\0", &binary)].concat();
        [b"glTF", &2u32.to_le_bytes()[..], &(12 + body.len() as u32).to_le_bytes(), &body].concat()
    }

    /// As text that has its buffer in itself.
    pub fn text(&self) -> Vec<u8> {
        let mut json = self.finished();
        json["buffers"][0]["uri"] =
            format!("data:application/octet-stream;base64,{}", base64(&self.binary)).into();
        json.to_string().into_bytes()
    }

    pub fn read(&self) -> Source {
        let source = self.outcome().unwrap();
        // Text and binary are the same.
        let text = read_with(&self.text(), &ReadOptions::default()).unwrap();
        assert_eq!(format!("{source:?}"), format!("{text:?}"));
        source
    }

    pub fn outcome(&self) -> Result<Source, Error> {
        read_with(&self.glb(), &ReadOptions::default())
    }

    /// What is said of a file that is refused.
    pub fn refused(&self) -> String {
        match self.outcome() {
            Err(Error::Input(error)) => error.to_string(),
            other => panic!("{other:?}"),
        }
    }
}

/// A triangle in the plane z = 0, shown once.
pub fn triangle() -> Gltf {
    let mut gltf = Gltf::new();
    let positions = gltf.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 2.0, 0.0]);
    let indices = gltf.indices(&[0, 1, 2]);
    gltf.shown(json!({"attributes": {"POSITION": positions}, "indices": indices}));
    gltf
}

pub fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let group = |bytes: &[u8]| {
        let bits = (0..3).fold(0u32, |bits, k| bits << 8 | u32::from(bytes.get(k).copied().unwrap_or(0)));
        let digit =
            |k: usize| if k <= bytes.len() { DIGITS[(bits >> (18 - 6 * k) & 63) as usize] } else { b'=' };
        [0, 1, 2, 3].map(|k| char::from(digit(k)))
    };
    bytes.chunks(3).flat_map(group).collect()
}
