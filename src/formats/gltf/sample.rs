//! A small scene made by code, to show and to test with: what a file of a web page's model has, without one that is somebody's.

use std::f64::consts::{PI, TAU};
use std::io::Write;

use flate2::write::ZlibEncoder;
use flate2::{Compression, Crc};
use glam::DVec3;
use serde_json::{Value, json};

use super::glb;
use crate::mesh::random::SplitMix64;

/// The scene as a binary glTF file: a globe with a picture on it, which turns once in twelve seconds, on a pillar; round it six pillars, one
/// mesh, with a ball on each, another one; a floor with tiles. All have normals and texture coordinates, the globe with a seam. With `detail`
/// 1 there are some 30,000 triangles to store; they grow with its square. The same bytes everywhere but for what sine and cosine round.
///
/// ```
/// let file = unweld::formats::sample_scene(0.2);
/// assert!(file.starts_with(b"glTF"));
/// ```
pub fn sample_scene(detail: f64) -> Vec<u8> {
    let count = |whole: f64, least: u32| ((whole * detail) as u32).max(least);
    let globe = globe(count(160.0, 8), count(80.0, 4));
    let pillar = lathe(&PILLAR, count(24.0, 6), count(4.0, 1), false);
    let ball = lathe(&half_circle(count(20.0, 4)), count(32.0, 6), 1, true);
    let floor = floor(count(16.0, 1));
    let mut file = File::default();
    let meshes = [("globe", &globe), ("pillar", &pillar), ("ball", &ball), ("floor", &floor)];
    let meshes: Vec<Value> = meshes
        .into_iter()
        .zip([0, 1, 2, 3])
        .map(|((name, mesh), material)| file.mesh(name, mesh, material))
        .collect();
    let times = file.accessor(&[0.0, 3.0, 6.0, 9.0, 12.0], 1, true);
    let half_turns = [0.0, 0.25, 0.5, 0.75, 1.0]
        .map(|turn| [0.0, (PI * turn).sin() as f32, 0.0, (PI * turn).cos() as f32]);
    let turns = file.accessor(half_turns.as_flattened(), 4, false);
    let images = [earth(512, 256), stone(128), tiles(128)].map(|picture| {
        let view = file.view(&png(&picture));
        json!({ "bufferView": view, "mimeType": "image/png" })
    });
    let mut nodes = vec![
        json!({ "name": "globe", "mesh": 0, "translation": [0.0, 1.75, 0.0] }),
        json!({ "name": "stand", "mesh": 1, "scale": [0.9, 0.55, 0.9] }),
        json!({ "name": "floor", "mesh": 3 }),
    ];
    for k in 0..6 {
        let (sin, cos) = (TAU * (f64::from(k) + 0.5) / 6.0).sin_cos();
        let place = |y: f64| [2.3 * cos, y, 2.3 * sin];
        nodes.push(json!({ "name": format!("pillar {}", k + 1), "mesh": 1, "translation": place(0.0) }));
        nodes.push(json!({ "name": format!("ball {}", k + 1), "mesh": 2, "translation": place(1.42), "scale": [0.24, 0.24, 0.24] }));
    }
    let shown: Vec<usize> = (0..nodes.len()).collect();
    let material = |name: &str, colour: [f64; 3], texture: Option<usize>, roughness: f64| {
        let mut base = json!({ "baseColorFactor": [colour[0], colour[1], colour[2], 1.0], "metallicFactor": 0.0, "roughnessFactor": roughness });
        if let Some(index) = texture {
            base["baseColorTexture"] = json!({ "index": index });
        }
        json!({ "name": name, "pbrMetallicRoughness": base })
    };
    let white = [1.0; 3];
    let document = json!({
        "asset": { "version": "2.0", "generator": "unweld" },
        "scene": 0,
        "scenes": [{ "nodes": shown }],
        "nodes": nodes,
        "meshes": meshes,
        "materials": [
            material("globe", white, Some(0), 0.55), material("stone", white, Some(1), 0.8),
            material("brass", [0.72, 0.42, 0.12], None, 0.35), material("tiles", white, Some(2), 0.6),
        ],
        "textures": [{ "source": 0, "sampler": 0 }, { "source": 1, "sampler": 0 }, { "source": 2, "sampler": 0 }],
        "samplers": [{ "magFilter": 9729, "minFilter": 9987 }],
        "images": images,
        "animations": [{
            "name": "turn",
            "channels": [{ "sampler": 0, "target": { "node": 0, "path": "rotation" } }],
            "samplers": [{ "input": times, "output": turns }],
        }],
        "accessors": file.accessors,
        "bufferViews": file.views,
        "buffers": [{ "byteLength": file.binary.len() }],
    });
    let mut bytes = Vec::new();
    glb::write(&document, &file.binary, &mut bytes).expect("memory takes all that is written");
    bytes
}

/// Vertices with their normals and texture coordinates, and triangles.
#[derive(Default)]
struct Mesh {
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    places: Vec<[f32; 2]>,
    triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// A sheet of so many cells each way, `at` of places in the unit square, the first to the right and the second down: seen from where the
    /// normals point.
    fn sheet([columns, rows]: [u32; 2], at: impl Fn([f64; 2]) -> (DVec3, DVec3, [f64; 2])) -> Self {
        let mut mesh = Self::default();
        for row in 0..=rows {
            for column in 0..=columns {
                let cell = [f64::from(column) / f64::from(columns), f64::from(row) / f64::from(rows)];
                let (position, normal, place) = at(cell);
                mesh.positions.push(position.as_vec3().to_array());
                mesh.normals.push(normal.normalize_or(DVec3::Y).as_vec3().to_array());
                mesh.places.push(place.map(|x| x as f32));
            }
        }
        for row in 0..rows {
            for column in 0..columns {
                let a = row * (columns + 1) + column;
                let [b, c, d] = [a + 1, a + columns + 1, a + columns + 2];
                for [p, q, r] in [[a, c, d], [a, d, b]] {
                    let same = |p: u32, q: u32| mesh.positions[p as usize] == mesh.positions[q as usize];
                    // None at the poles.
                    if !same(p, q) && !same(q, r) && !same(r, p) {
                        mesh.triangles.push([p, q, r]);
                    }
                }
            }
        }
        mesh.used()
    }

    /// Without the vertices that no triangle has.
    fn used(self) -> Self {
        let mut mesh = Self::default();
        let mut numbers = vec![u32::MAX; self.positions.len()];
        for v in self.triangles.as_flattened().iter().map(|&v| v as usize) {
            if numbers[v] == u32::MAX {
                numbers[v] = mesh.positions.len() as u32;
                mesh.positions.push(self.positions[v]);
                mesh.normals.push(self.normals[v]);
                mesh.places.push(self.places[v]);
            }
        }
        mesh.triangles = self.triangles.iter().map(|t| t.map(|v| numbers[v as usize])).collect();
        mesh
    }
}

/// A direction by its longitude, from 0 to 1 eastwards round y, and its latitude, from 0 at the north to 1. Whole turns give the same.
fn direction([u, v]: [f64; 2]) -> DVec3 {
    let (sin, cos) = (TAU * (u % 1.0)).sin_cos();
    let (height, wide) = if v <= 0.0 {
        (1.0, 0.0)
    } else if v >= 1.0 {
        (-1.0, 0.0)
    } else {
        ((PI * v).cos(), (PI * v).sin())
    };
    DVec3::new(sin * wide, height, cos * wide)
}

/// How high land is above the sea at a direction, below 0 where there is sea: waves of several lengths, none of them along an axis.
fn height(at: DVec3) -> f64 {
    let mut random = SplitMix64::new(7);
    let mut number = || f64::from(random.below(1 << 20)) / f64::from(1 << 19) - 1.0;
    let (mut sum, mut scale) = (-0.1, 0.5);
    for octave in 0..5 {
        for _ in 0..3 {
            let way = DVec3::new(number(), number(), number()) * f64::from(3 << octave);
            sum += scale * (way.dot(at) + 3.0 * number()).sin() * 0.5;
        }
        scale *= 0.5;
    }
    sum
}

/// A ball of radius 1 whose land is raised, with a seam of its picture from pole to pole.
fn globe(columns: u32, rows: u32) -> Mesh {
    let at = |place: [f64; 2]| {
        let way = direction(place);
        way * (1.0 + LAND * height(way).clamp(0.0, 1.0))
    };
    Mesh::sheet([columns, rows], |[u, v]| {
        let step = 1e-4;
        let way = direction([u, v]);
        let is_pole = v <= 0.0 || v >= 1.0;
        let east = at([u + step, v]) - at([u + 1.0 - step, v]);
        let south = at([u, v + step]) - at([u, v - step]);
        (at([u, v]), if is_pole { way } else { south.cross(east) }, [if is_pole { MIDDLE } else { u }, v])
    })
}

/// A profile turned about y: radii and heights from the top, so many cells each step; of a ball round the origin or with an edge at each point.
fn lathe(profile: &[[f64; 2]], columns: u32, steps: u32, is_ball: bool) -> Mesh {
    let mut mesh = Mesh::default();
    for pair in profile.windows(2) {
        let ([r, y], [s, z]) = (pair[0], pair[1]);
        let slope = DVec3::new(y - z, s - r, 0.0);
        let part = Mesh::sheet([columns, steps], |[u, v]| {
            let (sin, cos) = (TAU * (u % 1.0)).sin_cos();
            // The next step begins where this one ends.
            let along = |from: f64, to: f64| if v < 1.0 { from + v * (to - from) } else { to };
            let (radius, height) = (along(r, s), along(y, z));
            let position = DVec3::new(sin * radius, height, cos * radius);
            let round = DVec3::new(sin, 0.0, cos);
            let normal = if is_ball { position } else { round * slope.x + DVec3::Y * slope.y };
            (position, normal, [3.0 * if radius > 0.0 { u } else { MIDDLE }, height])
        });
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(part.positions);
        mesh.normals.extend(part.normals);
        mesh.places.extend(part.places);
        mesh.triangles.extend(part.triangles.iter().map(|t| t.map(|v| v + first)));
    }
    mesh
}

/// The profile of a ball.
fn half_circle(steps: u32) -> Vec<[f64; 2]> {
    let way = |k: u32| direction([0.25, f64::from(k) / f64::from(steps)]);
    (0..=steps).map(way).map(|way| [way.x, way.y]).collect()
}

/// A round floor at y = 0, from its middle to its rim.
fn floor(cells: u32) -> Mesh {
    Mesh::sheet([4 * cells, cells], |[u, v]| {
        let (sin, cos) = (TAU * (u % 1.0)).sin_cos();
        let place = [sin, cos].map(|x| 3.2 * v * x);
        (DVec3::new(place[0], 0.0, place[1]), DVec3::Y, place.map(|x| 0.5 * x))
    })
}

/// Radii and heights of a pillar, from the top.
const PILLAR: [[f64; 2]; 9] = [
    [0.0, 1.2],
    [0.34, 1.2],
    [0.34, 1.08],
    [0.2, 1.0],
    [0.17, 0.6],
    [0.22, 0.2],
    [0.36, 0.12],
    [0.36, 0.0],
    [0.0, 0.0],
];
/// Where a pole is on a picture, from its left to its right: so it is one place for all triangles there.
const MIDDLE: f64 = 0.5;
/// How high the highest land is.
const LAND: f64 = 0.12;

/// A picture in sRGB.
struct Picture {
    width: u32,
    height: u32,
    pixels: Vec<[u8; 3]>,
}

impl Picture {
    fn new(width: u32, height: u32, at: impl Fn([f64; 2]) -> DVec3) -> Self {
        let middle = |k: u32, count: u32| (f64::from(k) + 0.5) / f64::from(count);
        let places = (0..height).flat_map(|y| (0..width).map(move |x| [middle(x, width), middle(y, height)]));
        let pixels = places.map(|place| (at(place) * 255.0).round().to_array().map(|x| x as u8)).collect();
        Self { width, height, pixels }
    }
}

/// Sea, land by its height, ice at the poles, and lines every 15 degrees.
fn earth(width: u32, height_pixels: u32) -> Picture {
    Picture::new(width, height_pixels, |[u, v]| {
        let way = direction([u, v]);
        let high = height(way);
        let mixed = |stops: &[(f64, [f64; 3])], x: f64| {
            let k = stops.iter().rposition(|(from, _)| *from <= x).unwrap_or(0).min(stops.len() - 2);
            let ((a, low), (b, high)) = (stops[k], stops[k + 1]);
            DVec3::from(low).lerp(high.into(), ((x - a) / (b - a)).clamp(0.0, 1.0))
        };
        let ground = if way.y.abs() > 0.9 - 0.1 * high {
            DVec3::new(0.93, 0.95, 0.97)
        } else if high < 0.0 {
            mixed(&[(-0.7, [0.03, 0.12, 0.32]), (-0.1, [0.07, 0.33, 0.55]), (0.0, [0.25, 0.6, 0.7])], high)
        } else {
            mixed(
                &[
                    (0.0, [0.78, 0.72, 0.5]),
                    (0.05, [0.3, 0.52, 0.2]),
                    (0.3, [0.36, 0.4, 0.18]),
                    (0.6, [0.55, 0.45, 0.36]),
                ],
                high,
            )
        };
        let line = |x: f64, parts: f64, wide: f64| (x * parts - (x * parts).round()).abs() / parts < wide;
        let drawn = line(u, 24.0, 0.0012 / (PI * v).sin()) || line(v, 12.0, 0.0024);
        if drawn { ground * 0.55 + DVec3::splat(0.35) } else { ground }
    })
}

/// Bricks, which repeat.
fn stone(size: u32) -> Picture {
    Picture::new(size, size, |[u, v]| {
        let row = (4.0 * v).floor();
        let [x, y] = [2.0 * u + 0.5 * (row % 2.0), 4.0 * v].map(f64::fract);
        let grain = 0.03 * ((TAU * (9.0 * u + 2.0 * v)).sin() * (TAU * (13.0 * v - 3.0 * u)).sin());
        let is_joint = x.min(1.0 - x) < 0.03 || y.min(1.0 - y) < 0.06;
        let brick = 0.05 * (TAU * ((2.0 * u + 0.5 * (row % 2.0)).floor() * 0.37 + row * 0.23)).sin();
        let light = if is_joint { 0.45 } else { 0.68 + brick } + grain;
        DVec3::new(light, 0.94 * light, 0.84 * light)
    })
}

/// Tiles of two colours, which repeat.
fn tiles(size: u32) -> Picture {
    Picture::new(size, size, |[u, v]| {
        let [x, y] = [2.0 * u, 2.0 * v];
        let is_dark = (x.floor() + y.floor()) % 2.0 > 0.5;
        let [x, y] = [x.fract() - 0.5, y.fract() - 0.5];
        let is_joint = x.abs().max(y.abs()) > 0.48;
        let is_round = (x * x + y * y).sqrt() < 0.22;
        match (is_joint, is_round, is_dark) {
            (true, ..) => DVec3::splat(0.35),
            (_, true, _) => DVec3::new(0.62, 0.3, 0.2),
            (_, _, true) => DVec3::new(0.36, 0.42, 0.45),
            _ => DVec3::new(0.82, 0.8, 0.74),
        }
    })
}

/// A PNG (RFC 2083), each row the differences from the one above.
fn png(Picture { width, height, pixels }: &Picture) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
    let mut above = vec![[0; 3]; *width as usize];
    for row in pixels.chunks(*width as usize) {
        let mut line = vec![UP];
        line.extend(row.iter().zip(&above).flat_map(|(p, q)| [0, 1, 2].map(|k| p[k].wrapping_sub(q[k]))));
        encoder.write_all(&line).expect("memory takes all that is written");
        above.copy_from_slice(row);
    }
    let data = encoder.finish().expect("memory takes all that is written");
    let mut png = b"\x89PNG\r\n\x1a\n".to_vec();
    let mut chunk = |kind: &[u8; 4], body: &[u8]| {
        let mut crc = Crc::new();
        crc.update(kind);
        crc.update(body);
        png.extend((body.len() as u32).to_be_bytes());
        png.extend(kind);
        png.extend(body);
        png.extend(crc.sum().to_be_bytes());
    };
    let [width, height] = [width, height].map(|side| side.to_be_bytes());
    // 8 bits of red, green and blue.
    chunk(b"IHDR", &[&width[..], &height, &[8, 2, 0, 0, 0]].concat());
    chunk(b"IDAT", &data);
    chunk(b"IEND", &[]);
    png
}

/// The filter of a row of differences from the one above.
const UP: u8 = 2;

/// What becomes the lists of a glTF.
#[derive(Default)]
struct File {
    binary: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl File {
    fn view(&mut self, bytes: &[u8]) -> usize {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        self.views.push(json!({ "buffer": 0, "byteOffset": self.binary.len(), "byteLength": bytes.len() }));
        self.binary.extend(bytes);
        self.views.len() - 1
    }

    /// Of values of so many numbers, with their bounds if `bounded`.
    fn accessor(&mut self, numbers: &[f32], components: usize, bounded: bool) -> usize {
        let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
        let view = self.view(&bytes);
        let kind = ["", "SCALAR", "VEC2", "VEC3", "VEC4"][components];
        let mut accessor = json!({ "bufferView": view, "componentType": 5126, "count": numbers.len() / components, "type": kind });
        if bounded {
            let of = |k: usize, best: fn(f32, f32) -> f32| {
                numbers.iter().skip(k).step_by(components).copied().reduce(best)
            };
            accessor["min"] = (0..components).map(|k| of(k, f32::min)).collect();
            accessor["max"] = (0..components).map(|k| of(k, f32::max)).collect();
        }
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn mesh(&mut self, name: &str, mesh: &Mesh, material: usize) -> Value {
        let position = self.accessor(mesh.positions.as_flattened(), 3, true);
        let normal = self.accessor(mesh.normals.as_flattened(), 3, false);
        let place = self.accessor(mesh.places.as_flattened(), 2, false);
        let indices: Vec<u8> = mesh.triangles.as_flattened().iter().flat_map(|v| v.to_le_bytes()).collect();
        let view = self.view(&indices);
        self.accessors.push(json!({ "bufferView": view, "componentType": 5125, "count": 3 * mesh.triangles.len(), "type": "SCALAR" }));
        let attributes = json!({ "POSITION": position, "NORMAL": normal, "TEXCOORD_0": place });
        json!({ "name": name, "primitives": [{ "attributes": attributes, "indices": self.accessors.len() - 1, "material": material }] })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::{ReadOptions, Role, read_painted, read_with};
    use crate::mesh::attributes::Semantic;

    #[test]
    fn the_scene_is_what_it_tells() {
        let file = sample_scene(0.2);
        let source = read_with(&file, &ReadOptions { scenes: true, ..ReadOptions::default() }).unwrap();
        assert_eq!((source.dropped.len(), source.mesh.bodies.len()), (0, 4), "{:?}", source.dropped);
        let semantics: Vec<_> = source.mesh.attributes.iter().map(|a| a.semantic).collect();
        assert_eq!(semantics, [Semantic::Part, Semantic::Normal, Semantic::TexCoord]);
        let scene = source.scene.unwrap();
        let json: Value = serde_json::from_slice(&scene.json).unwrap();
        assert_eq!(json["nodes"].as_array().map(Vec::len), Some(15));
        assert_eq!(json["animations"][0]["channels"].as_array().map(Vec::len), Some(1));
        let originals = scene.buffers.iter().filter(|buffer| matches!(buffer.role, Role::Original { .. }));
        assert_eq!(originals.count(), 3);
    }

    /// Each triangle is seen from where its normals point, and the pictures can be decoded.
    #[test]
    fn surfaces_look_outwards() {
        let (source, paint) = read_painted(&sample_scene(0.2), &ReadOptions::default()).unwrap();
        let mesh = &source.mesh;
        let normals = mesh.attributes.iter().find(|a| a.semantic == Semantic::Normal).unwrap();
        for (t, corners) in mesh.triangles.iter().enumerate() {
            let [a, b, c] = corners.map(|v| DVec3::from(mesh.positions[v as usize]));
            let normal = |place: usize| {
                let at = 3 * normals.at(t, place).unwrap();
                DVec3::from([0, 1, 2].map(|k| normals.values.number(at + k)))
            };
            let facet = (b - a).cross(c - a);
            assert!(facet.dot(normal(0) + normal(1) + normal(2)) > 0.0, "{t}: {a} {b} {c}");
        }
        if cfg!(feature = "images") {
            let sizes: Vec<_> = paint.images.iter().map(|image| (image.width, image.height)).collect();
            assert_eq!(sizes, [(512, 256), (128, 128), (128, 128)]);
            let stone = earth(512, 256).pixels;
            assert!(paint.images[0].pixels.iter().zip(&stone).all(|(p, q)| p[..3] == q[..]));
        }
    }
}
