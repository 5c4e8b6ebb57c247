//! Each fuzz body on some thousand inputs, the same ones every time; `fuzz/` runs them for longer.
#![cfg(all(feature = "encode", feature = "formats"))]

use unweld::fuzzing;

/// A multiplicative generator (Steele and Vigna 2021): good enough to pick bytes.
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(0xD134_2543_DE82_EF95).wrapping_add(1);
        ((self.0 >> 32) as usize * n) >> 32
    }

    /// Up to `most` bytes; mostly few, sometimes small numbers only.
    fn bytes(&mut self, most: usize) -> Vec<u8> {
        let (most, values) = (1 + self.below(most), [256, 256, 8][self.below(3)]);
        let length = self.below(most + 1);
        (0..length).map(|_| self.below(values) as u8).collect()
    }
}

/// How many times the usual number of inputs; more of them are other ones.
fn factor() -> usize {
    std::env::var("UNWELD_FUZZ").ok().and_then(|n| n.parse().ok()).unwrap_or(1)
}

/// Runs `body` on random bytes; where it panics, they are printed.
fn smoke(body: fn(&[u8]), count: usize, most: usize) {
    let mut random = Random(factor() as u64);
    body(&[]);
    for _ in 0..count * factor() {
        let data = random.bytes(most);
        let outcome = std::panic::catch_unwind(|| body(&data));
        assert!(outcome.is_ok(), "on {data:?}");
    }
}

#[test]
fn scene_writer() {
    smoke(fuzzing::fuzz_scene_writer, 1500, 30);
}

#[test]
fn scenes() {
    smoke(fuzzing::fuzz_scenes, 4000, 30);
}

#[test]
fn sets() {
    smoke(fuzzing::fuzz_sets, 400, 200);
}

#[test]
fn container() {
    smoke(fuzzing::fuzz_container, 3000, 300);
}

#[test]
fn decode() {
    smoke(fuzzing::fuzz_decode, 3000, 40);
}

#[test]
fn chunks() {
    smoke(fuzzing::fuzz_chunks, 2000, 40);
}

#[test]
fn resources() {
    smoke(fuzzing::fuzz_resources, 1500, 200);
}

#[test]
fn refinement() {
    smoke(fuzzing::fuzz_refinement, 3000, 200);
}

#[test]
fn keyframe() {
    smoke(fuzzing::fuzz_keyframe, 5000, 60);
}

#[test]
fn residue() {
    smoke(fuzzing::fuzz_residue, 5000, 60);
}

#[test]
fn exact() {
    smoke(fuzzing::fuzz_exact, 5000, 200);
}

#[test]
fn round_trip() {
    smoke(fuzzing::fuzz_round_trip, 3000, 150);
}

#[test]
fn formats() {
    let mut random = Random(factor() as u64);
    smoke(fuzzing::fuzz_formats, 2000, 200);
    for file in FILES {
        unweld::formats::read_bytes(file, None, "").expect("what is then changed is a mesh");
        for _ in 0..2000 * factor() {
            let mut bytes = file.to_vec();
            for _ in 0..random.below(4) {
                let at = random.below(bytes.len());
                match random.below(4) {
                    0 => bytes.truncate(at),
                    1 => drop(bytes.splice(at..at, random.bytes(8))),
                    2 => bytes[at] = b" \n-0123456789./#e"[random.below(17)],
                    _ => bytes[at] = random.below(256) as u8,
                }
                if bytes.is_empty() {
                    break;
                }
            }
            let outcome = std::panic::catch_unwind(|| fuzzing::fuzz_formats(&bytes));
            assert!(outcome.is_ok(), "on {:?}", String::from_utf8_lossy(&bytes));
        }
    }
}

const FILES: [&[u8]; 17] = [
    b"mtllib a.mtl\nv 0 0 0 1 0 .5\nv 1 0 0 1 1 1 .5\nv 1 1 0\nv 0 1 0 255 0 7\nvt 0 0\nvt 1 nan\nvt .1 .2 .3\nvn 0 0 1\nvn 1 0 0\no x\ng a b\nusemtl m\ns 1\nf 1/1/1 2/2/1 3/3/2 4//2\ng\ns off\nf 1/-1 2/1 3/2\n",
    b"ply\nformat ascii 1.0\ncomment TextureFile a.png\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\nproperty float ny\nproperty float nz\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nproperty short q\nelement face 2\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\nproperty int texnumber\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n0 0 0 0 0 1 1 2 3 4\n1 0 0 0 0 1 1 2 3 4\n0 1 0 0 0 1 1 2 3 4\n1 1 0 0 0 1 1 2 3 4\n3 0 1 2 6 .1 .2 .3 .4 .5 .6 0 1 2 3\n4 1 2 3 0 0 -1 4 5 6\n",
    b"a binary STL file of one facet; COLOR=abcd filled with blanks up to 80 bytes    \x01\0\0\0\0\0\0\0\0\0\0\0\0\0\x80\x3f\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x80\x3f\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x80\x3f\0\0\0\0\x01\x04",
    b"# a square\nv 0 0 0\nv 1 0 0 0.5\nv 1 1 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\no x\nusemtl m\ns off\nf 1/1/1 2/1/1 3/1/1 4/1/1\nf -1 -2 \\\n -3\n",
    b"ply\nformat ascii 1.0\ncomment c\nelement vertex 3\nproperty float x\nproperty float y\nproperty double z\nproperty uchar red\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 1\n1 0 0 2\n0 1e1 0 3\n3 0 1 2\n",
    b"ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty short x\nproperty short y\nproperty short z\nelement face 1\nproperty list uchar ushort vertex_indices\nend_header\n\0\0\0\0\0\0\x01\0\0\0\0\0\0\0\x01\0\0\0\x03\0\0\x01\0\x02\0",
    b"ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty char x\nproperty char y\nproperty char z\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n\0\0\0\x01\0\0\0\x01\0\0\0\0\x03\0\0\0\0\0\0\0\x01\0\0\0\x02",
    b"solid a\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n   vertex 0 1e1 0\n  endloop\n endfacet\nendsolid a\nsolid\nendsolid\n",
    b"a binary STL file of one facet; its header is filled with blanks up to 80 bytes.\x01\0\0\0\0\0\0\0\0\0\0\0\0\0\x80\x3f\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x80\x3f\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x80\x3f\0\0\0\0\x01\0",
    b"facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nend loop\nend facet\nend solid\nendsolid\n\0\0",
    b"\xef\xbb\xbfply \nformat ascii 1.0\nBy hand\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar float vertex_index\nend_header\n0 0 0\n2 1 0\n4 0 0\n2 3 0\n4.0 0 1. 2.0 3\n",
    b"v 0 0 0\nv 2 1 0\nv 4 0 0\nv 2 3 0\nf 1 2 3 4\nf 1 3 2 4 1\nf 4 3 2 1 2\n",
    b"OFF\n7 1 0\n0 0 0\n9 0 0\n9 9 0\n0 9 0\n3 3 0\n3 6 0\n6 6 0\n9 0 1 2 3 0 4 5 6 4\n",
    b"STCNOFF # a square\n4 2 4\n0 0 0 0 0 1 1 0 0 1 0 0\n1 0 0 0 0 1 1 0 0 1 1 0\n1 1 0 0 0 1 1 0 0 1 1 1\n0 1 0 0 0 1 1 0 0 1 0 1\n3 0 1 2\n3 0 2 3 255 0 0\n",
    b"OFF BINARY\n\0\0\0\x03\0\0\0\x01\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x3f\x80\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x3f\x80\0\0\0\0\0\0\0\0\0\x03\0\0\0\0\0\0\0\x01\0\0\0\x02\0\0\0\0",
    b"{\"asset\":{\"version\":\"2.0\"},\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"children\":[1],\"scale\":[1,-2,1]},{\"mesh\":0,\"extensions\":{\"EXT_mesh_gpu_instancing\":{\"attributes\":{\"TRANSLATION\":3}}}}],\"meshes\":[{\"name\":\"m\",\"primitives\":[{\"attributes\":{\"POSITION\":0,\"TEXCOORD_0\":2,\"NORMAL\":0},\"indices\":1,\"mode\":4},{\"attributes\":{\"POSITION\":0},\"mode\":5}]}],\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"},{\"bufferView\":1,\"componentType\":5123,\"count\":3,\"type\":\"SCALAR\"},{\"bufferView\":2,\"componentType\":5121,\"normalized\":true,\"count\":3,\"type\":\"VEC2\",\"sparse\":{\"count\":1,\"indices\":{\"bufferView\":2,\"componentType\":5121},\"values\":{\"bufferView\":2}}},{\"bufferView\":3,\"componentType\":5126,\"count\":1,\"type\":\"VEC3\"}],\"bufferViews\":[{\"buffer\":0,\"byteLength\":36},{\"buffer\":0,\"byteOffset\":36,\"byteLength\":6},{\"buffer\":0,\"byteOffset\":44,\"byteLength\":8},{\"buffer\":0,\"byteOffset\":52,\"byteLength\":12}],\"buffers\":[{\"byteLength\":64,\"uri\":\"data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAABAAIAAAAAAP8AAP8AAAAAgD8AAAAAAAAAAA==\"}]}",
    b"glTF\x02\0\0\0\xf8\x03\0\0\x9c\x03\0\0JSON{\"asset\":{\"version\":\"2.0\"},\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"children\":[1],\"scale\":[1,-2,1]},{\"mesh\":0,\"extensions\":{\"EXT_mesh_gpu_instancing\":{\"attributes\":{\"TRANSLATION\":3}}}}],\"meshes\":[{\"name\":\"m\",\"primitives\":[{\"attributes\":{\"POSITION\":0,\"TEXCOORD_0\":2,\"NORMAL\":0},\"indices\":1,\"mode\":4},{\"attributes\":{\"POSITION\":0},\"mode\":5}]}],\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"},{\"bufferView\":1,\"componentType\":5123,\"count\":3,\"type\":\"SCALAR\"},{\"bufferView\":2,\"componentType\":5121,\"normalized\":true,\"count\":3,\"type\":\"VEC2\",\"sparse\":{\"count\":1,\"indices\":{\"bufferView\":2,\"componentType\":5121},\"values\":{\"bufferView\":2}}},{\"bufferView\":3,\"componentType\":5126,\"count\":1,\"type\":\"VEC3\"}],\"bufferViews\":[{\"buffer\":0,\"byteLength\":36},{\"buffer\":0,\"byteOffset\":36,\"byteLength\":6},{\"buffer\":0,\"byteOffset\":44,\"byteLength\":8},{\"buffer\":0,\"byteOffset\":52,\"byteLength\":12}],\"buffers\":[{\"byteLength\":64}]}   @\0\0\0BIN\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x80?\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x80?\0\0\0\0\0\0\x01\0\x02\0\0\0\0\0\xff\0\0\xff\0\0\0\0\x80?\0\0\0\0\0\0\0\0",
];
