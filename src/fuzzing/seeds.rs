//! Small files of the encoder, and how fuzz data change them.

use std::sync::OnceLock;

use super::choices::Choices;
use crate::codec::grid::Real;
use crate::container::{AtomKind, AttributeEntry, Coding, Contents, FileBuilder, Level, parse_contents};
use crate::encoder::{Encoder, Keyframes, Options, Preview};
use crate::mesh::{IndexedMesh, Lattice, shapes};

/// A file laid open: what a writer would be given.
#[derive(Clone, Debug)]
pub struct Seed {
    lattice: Lattice,
    coding: Coding,
    maximum: [u32; 3],
    levels: Vec<Level>,
    attributes: Vec<AttributeEntry>,
    pieces: Vec<Piece>,
}

/// An atom.
#[derive(Clone, Debug)]
struct Piece {
    kind: AtomKind,
    level: u32,
    items: u32,
    triangles: u32,
    bytes: Vec<u8>,
}

/// A file with several levels, keyframes and whatever else there is, changed as `choices` say; its checksums are right.
/// `None` where the change breaks a rule that the writer knows. Without choices the file is one of the encoder's.
pub fn changed(choices: &mut Choices) -> Option<Vec<u8>> {
    let seeds = all();
    let mut seed = seeds[choices.below(seeds.len())].clone();
    while let Some(what) = choices.byte() {
        seed.change(what, choices);
    }
    seed.write()
}

/// The payloads of all base and keyframe atoms, and of the residue, with the number of their seed.
pub fn payloads(kinds: &[AtomKind]) -> Vec<(&'static [u8], &'static Seed, u32)> {
    let pieces = all().iter().flat_map(|seed| seed.pieces.iter().map(move |piece| (piece, seed)));
    let fitting = pieces.filter(|(piece, _)| kinds.contains(&piece.kind));
    fitting.map(|(piece, seed)| (&piece.bytes[..], seed, piece.level)).collect()
}

impl Seed {
    /// Its lattice.
    pub fn lattice(&self) -> Lattice {
        self.lattice
    }

    /// How far its levels are lifted.
    pub fn lifting(&self) -> u8 {
        self.coding.lifting
    }

    /// How many vertices and triangles are born with a payload of its own, if any are.
    pub fn born(&self, payload: &[u8]) -> Option<[u32; 2]> {
        let births =
            |piece: &&Piece| piece.kind == AtomKind::Birth && std::ptr::eq(&piece.bytes[..], payload);
        self.pieces.iter().find(births).map(|piece| [piece.items, piece.triangles])
    }

    /// What the table says of a level.
    pub fn level(&self, j: u32) -> &Level {
        &self.levels[j as usize]
    }

    fn of(file: &[u8]) -> Self {
        let contents = parse_contents(file).ok().flatten().expect("the encoder writes what can be read");
        let Contents { header, levels, attributes, atoms, .. } = &*contents;
        let pieces = atoms.iter().map(|atom| Piece {
            kind: atom.kind,
            level: atom.level,
            items: atom.items,
            triangles: atom.triangles,
            bytes: file[atom.offset as usize..atom.end() as usize].to_vec(),
        });
        let (lattice, coding, maximum) = (header.lattice, header.coding, header.maximum);
        let (levels, attributes) = (levels.clone(), attributes.clone());
        Self { lattice, coding, maximum, levels, attributes, pieces: pieces.collect() }
    }

    fn write(self) -> Option<Vec<u8>> {
        let mut builder = FileBuilder::new(self.lattice, self.maximum, self.levels);
        builder.coding = self.coding;
        builder.attributes = self.attributes;
        for Piece { kind, level, items, triangles, bytes } in self.pieces {
            builder.atom(kind, level, items, triangles, bytes);
        }
        let mut file = Vec::new();
        builder.write(&mut file).ok()?;
        Some(file)
    }

    /// Carries out one change; most of them are to payload bytes.
    fn change(&mut self, what: u8, choices: &mut Choices) {
        let count = self.pieces.len();
        let k = choices.below(count);
        let length = self.pieces[k].bytes.len();
        match what % 16 {
            0..8 => {
                let at = choices.below(length);
                if let Some(byte) = self.pieces[k].bytes.get_mut(at) {
                    *byte ^= choices.byte().unwrap_or(1);
                }
            }
            8 => self.pieces[k].bytes.truncate(1 + choices.below(length)),
            9 => {
                let n = choices.below(16);
                self.pieces[k].bytes.extend(choices.bytes(n));
            }
            10 => {
                let n = choices.below(256);
                self.pieces[k].bytes = choices.bytes(n).to_vec();
            }
            11 => {
                let other = choices.below(count);
                let bytes = self.pieces[other].bytes.clone();
                self.pieces[other].bytes = std::mem::replace(&mut self.pieces[k].bytes, bytes);
            }
            12 => self.cut(k, choices.below(length)),
            13 => self.recount(k, choices),
            14 => self.sharpen(choices),
            _ => {
                self.lattice.bits = 8 + choices.below(17) as u32;
                self.coding.lifting = choices.below(34) as u8;
                self.maximum = self.maximum.map(|x| x.min((1 << self.lattice.bits) - 1));
            }
        }
    }

    /// Makes two atoms of one, where its items need not be told apart.
    fn cut(&mut self, k: usize, at: usize) {
        let piece = &mut self.pieces[k];
        if piece.items == 0 && at > 0 {
            let bytes = piece.bytes.split_off(at);
            let rest = Piece { bytes, ..piece.clone() };
            self.pieces.insert(k + 1, rest);
        }
    }

    /// Moves items to the next atom of a level, or promises more or fewer of them.
    fn recount(&mut self, k: usize, choices: &mut Choices) {
        let sign = if choices.below(2) == 0 { 1 } else { u32::MAX };
        let (items, triangles) = (choices.below(4) as u32, choices.below(8) as u32);
        let (items, triangles) = (items.wrapping_mul(sign), triangles.wrapping_mul(sign));
        let (kind, level) = (self.pieces[k].kind, self.pieces[k].level);
        self.pieces[k].items = self.pieces[k].items.wrapping_add(items);
        self.pieces[k].triangles = self.pieces[k].triangles.wrapping_add(triangles);
        if let Some(next) = self.pieces.get_mut(k + 1).filter(|next| (next.kind, next.level) == (kind, level))
        {
            next.items = next.items.wrapping_sub(items);
            next.triangles = next.triangles.wrapping_sub(triangles);
            return;
        }
        let finest = if kind == AtomKind::Base { self.levels.len() - 1 } else { level as usize };
        for level in self.levels.iter_mut().take(finest + 1) {
            level.vertices = level.vertices.wrapping_add(items);
            level.triangles = level.triangles.wrapping_add(triangles);
        }
    }

    /// Changes the precision of all levels from one on, with the passes that this takes.
    fn sharpen(&mut self, choices: &mut Choices) {
        let (first, precision) = (1 + choices.below(self.levels.len()), choices.below(25) as u32);
        for level in self.levels.iter_mut().skip(first) {
            level.precision = precision;
        }
        self.pieces.retain(|piece| piece.kind != AtomKind::Precision);
        for j in 1..self.levels.len() {
            let [fine, coarse] = [j - 1, j].map(|j| &self.levels[j]);
            let items = coarse.vertices.wrapping_mul(coarse.precision.wrapping_sub(fine.precision));
            if items > 0 {
                let n = choices.below(256);
                let bytes = choices.bytes(n).to_vec();
                let kind = AtomKind::Precision;
                self.pieces.push(Piece { kind, level: j as u32 - 1, items, triangles: 0, bytes });
            }
        }
    }
}

fn all() -> &'static [Seed] {
    static ALL: OnceLock<Vec<Seed>> = OnceLock::new();
    ALL.get_or_init(|| {
        let meshes = [
            shapes::disc_with_ears(),
            shapes::sphere(1),
            shapes::torus_with_hole(6, 5),
            shapes::two_components(),
            shapes::handle_body(2),
            heap(),
        ];
        let smooth = meshes.iter().map(|mesh| encoded(mesh, Vec::new()));
        let others = [encoded(&meshes[2], vec![1, 1, 4]), encoded(&meshes[5], vec![2])];
        let lists = [&meshes[5], &meshes[2]].map(|mesh| {
            let mut mesh = mesh.clone();
            // Two vertices in one place, with zeros of both signs.
            mesh.positions.push(mesh.positions[0].map(|x| if x == 0.0 { -x } else { x }));
            mesh.triangles[1] =
                mesh.triangles[1].map(|v| if v == 0 { mesh.positions.len() as u32 - 1 } else { v });
            encoded_with(
                &mesh,
                Options { exact: Some(Real::Binary64), keep_order: true, ..small(Vec::new()) },
            )
        });
        let many = [encoded(&parts(), Vec::new()), encoded(&parts(), vec![1, 2])];
        smooth.chain(others).chain(lists).chain(many).collect()
    })
}

fn encoded(mesh: &IndexedMesh, schedule: Vec<u32>) -> Seed {
    encoded_with(mesh, small(schedule))
}

fn small(schedule: Vec<u32>) -> Options {
    let (keyframes, atom_bytes) = (Keyframes::Every(2), 12);
    let preview = Preview::Schedule(schedule);
    let mut options = Options { position_bits: 8, keyframes, atom_bytes, preview, ..Options::default() };
    options.simplify.base_vertices = Some(4);
    options
}

fn encoded_with(mesh: &IndexedMesh, options: Options) -> Seed {
    let file = Encoder::new(options).encode_to_vec(mesh).expect("a small mesh can be encoded");
    Seed::of(&file)
}

/// A sphere, and tetrahedra, strips and triangles of other sizes beside it, most of which are born late.
fn parts() -> IndexedMesh {
    let triangle = IndexedMesh::new(vec![[0.0; 3], [1.0, 0.25, 0.125], [0.25, 1.0, 0.5]], vec![[0, 1, 2]]);
    let parts = [shapes::tetrahedron(), shapes::strip(3), triangle];
    let mut mesh = shapes::sphere(1);
    for k in 0..12 {
        let (part, first) = (&parts[k % 3], mesh.positions.len() as u32);
        let (size, at) = (2.0 / (2.0 + k as f64), [3 + k % 4, k % 3, k % 5].map(|x| x as f64));
        mesh.positions.extend(part.positions.iter().map(|p| [0, 1, 2].map(|i| at[i] + size * p[i])));
        mesh.triangles.extend(part.triangles.iter().map(|t| t.map(|v| v + first)));
    }
    mesh
}

/// What no manifold holds: a sheet with a reversed triangle, a repeated one and one of two vertices, a fin, a bow-tie, and a
/// vertex in no triangle.
fn heap() -> IndexedMesh {
    let mut mesh = shapes::grid(3, 3);
    let n = mesh.positions.len() as u32;
    mesh.triangles[4].swap(0, 1);
    let [a, b, c] = mesh.triangles[7];
    mesh.positions.extend([[1.0, 1.0, 2.0], [-1.0, -1.0, 1.0], [-2.0, -1.0, 1.0], [40.0, 0.0, 0.0]]);
    mesh.triangles.extend([[a, b, c], [a, a, b], [a, b, n], [0, n + 1, n + 2]]);
    mesh
}
