//! Positions and triangles of binary glTF files: as much of them as the small meshes need.

use anyhow::{Context, ensure};
use serde_json::Value;
use unweld::mesh::IndexedMesh;

/// All primitives of all meshes, as they lie in their own coordinates, in one.
///
/// # Errors
/// Where something is missing, out of bounds or of a kind that is not read here.
pub fn read(bytes: &[u8]) -> anyhow::Result<IndexedMesh> {
    let (text, binary) = chunks(bytes).context("no binary glTF file of two chunks")?;
    let document: Value = serde_json::from_slice(text)?;
    let list = |value: &Value| value.as_array().cloned().unwrap_or_default();
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for primitive in list(&document["meshes"]).iter().flat_map(|mesh| list(&mesh["primitives"])) {
        ensure!(primitive["mode"].as_u64().unwrap_or(4) == 4, "a primitive is not of triangles");
        let first = positions.len() as u32;
        let floats = elements(&document, binary, &primitive["attributes"]["POSITION"], "VEC3", &[FLOAT])?;
        let count = floats.len() as u32;
        for element in &floats {
            // Three numbers of four bytes: the accessor says so.
            let (coordinates, _) = element.as_chunks();
            positions.push([0, 1, 2].map(|k| f64::from(f32::from_le_bytes(coordinates[k]))));
        }
        let indices: Vec<u32> = if primitive["indices"].is_null() {
            (0..count).collect()
        } else {
            let kinds = [UNSIGNED_BYTE, UNSIGNED_SHORT, UNSIGNED_INT];
            let indices = elements(&document, binary, &primitive["indices"], "SCALAR", &kinds)?;
            indices
                .iter()
                .map(|element| element.iter().rev().fold(0, |x, &byte| x << 8 | u32::from(byte)))
                .collect()
        };
        ensure!(indices.iter().all(|&v| v < count), "an index is too large");
        triangles.extend(indices.as_chunks().0.iter().map(|t: &[u32; 3]| t.map(|v| first + v)));
    }
    ensure!(!triangles.is_empty(), "there are no triangles");
    Ok(IndexedMesh::new(positions, triangles))
}

/// The JSON chunk and the binary one.
fn chunks(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let number = |at: usize| Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?) as usize);
    let text = number(12)?;
    let binary = number(20 + text)?;
    let rest = bytes.get(28 + text..)?;
    (bytes.starts_with(b"glTF")).then(|| Some((bytes.get(20..20 + text)?, rest.get(..binary)?)))?
}

/// The elements of an accessor, its bytes each.
fn elements<'a>(
    document: &Value,
    binary: &'a [u8],
    accessor: &Value,
    shape: &str,
    kinds: &[u64],
) -> anyhow::Result<Vec<&'a [u8]>> {
    let number = |value: &Value| value.as_u64().map(|n| n as usize);
    let accessor = &document["accessors"][number(accessor).context("an accessor is missing")?];
    let kind = accessor["componentType"].as_u64().unwrap_or(0);
    let known = accessor["type"] == shape && kinds.contains(&kind) && accessor["sparse"].is_null();
    ensure!(known, "an accessor is of a kind that is not read here");
    let view =
        &document["bufferViews"][number(&accessor["bufferView"]).context("an accessor has no view")?];
    let component = match kind {
        UNSIGNED_BYTE => 1,
        UNSIGNED_SHORT => 2,
        _ => 4,
    };
    let size = component * if shape == "VEC3" { 3 } else { 1 };
    let stride = number(&view["byteStride"]).unwrap_or(size);
    let start = number(&view["byteOffset"]).unwrap_or(0) + number(&accessor["byteOffset"]).unwrap_or(0);
    let count = number(&accessor["count"]).context("an accessor has no count")?;
    let element = |k: usize| binary.get(start + k * stride..start + k * stride + size);
    (0..count).map(element).collect::<Option<Vec<_>>>().context("an accessor is out of bounds")
}

const UNSIGNED_BYTE: u64 = 5121;
const UNSIGNED_SHORT: u64 = 5123;
const UNSIGNED_INT: u64 = 5125;
const FLOAT: u64 = 5126;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_comes_out_and_a_cut_one_does_not() {
        let text = br#"{"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
            "accessors":[{"bufferView":0,"componentType":5126,"type":"VEC3","count":3},
                         {"bufferView":0,"byteOffset":36,"componentType":5123,"type":"SCALAR","count":3}],
            "bufferViews":[{}]}"#;
        let mut binary: Vec<u8> = (0..9u8).flat_map(|x| f32::from(x).to_le_bytes()).collect();
        binary.extend([2, 0, 0, 0, 1, 0]);
        let file = |binary: &[u8]| {
            let number = |n: usize| (n as u32).to_le_bytes();
            [
                &b"glTF"[..],
                &number(2),
                &number(0),
                &number(text.len()),
                b"JSON",
                text,
                &number(binary.len()),
                b"BIN\0",
                binary,
            ]
            .concat()
        };
        let mesh = read(&file(&binary)).unwrap();
        assert_eq!(mesh.triangles, [[2, 0, 1]]);
        assert_eq!(mesh.positions[1], [3.0, 4.0, 5.0]);
        assert!(read(&file(&binary[..40])).is_err());
        assert!(read(b"glTF").is_err());
    }
}
