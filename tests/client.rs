//! What a browser gets (feature `wasm`): a copy of the mesh that changes are applied to is the mesh.

use unweld::codec::grid::Real;
use unweld::container::{AttributeEntry, Level, Measure, Want, parse_contents, parse_set};
use unweld::decoder::{Options, decode};
use unweld::encoder::{
    AttributeBirth, Encoder, Keyframes, Options as Encoding, Preview, SetInput, SetOrder, Source, encode_set,
};
use unweld::mesh::attributes::{Attribute, Domain, NO_VALUE, Semantic, Stored, Values};
use unweld::mesh::distance::{Sampling, surface_distances};
use unweld::mesh::{IndexedMesh, shapes};
use unweld::wasm::{Changes, Client, Corners, Settings};

/// What a page keeps.
#[derive(Default)]
struct Copy {
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    entries: Vec<AttributeEntry>,
    dress: Dress,
}

/// What a page keeps of attributes.
#[derive(Clone, Default)]
struct Dress {
    alive: Vec<u32>,
    /// The vertex of each wedge, and the wedges of each triangle.
    vertices: Vec<u32>,
    triangles: Vec<[u32; 3]>,
    /// The numbers of each attribute, by wedge or by triangle.
    columns: Vec<Vec<f64>>,
}

impl Dress {
    fn apply(&mut self, corners: &Corners, changes: &Changes, entries: &[AttributeEntry]) {
        let triangles = changes.counts[1];
        if corners.first_triangle == 0 {
            *self = Self { alive: corners.alive.clone(), ..Self::default() };
            self.columns = vec![Vec::new(); corners.alive.len()];
        }
        assert_eq!((&self.alive, self.vertices.len()), (&corners.alive, corners.first_wedge as usize));
        self.vertices.extend(&corners.vertices);
        let has_wedges = self.alive.iter().any(|&k| entries[k as usize].domain == Domain::Corner);
        let rewritten: &[u32] = if corners.first_triangle == 0 { &[] } else { &changes.rewritten };
        if has_wedges {
            append(&mut self.triangles, corners.first_triangle, &corners.indices, triangles as usize);
            scatter(&mut self.triangles, rewritten, &corners.rewritten);
            assert!(self.triangles.iter().flatten().all(|&wedge| (wedge as usize) < self.vertices.len()));
        }
        let mut rest = &corners.values[..];
        for (column, &k) in self.columns.iter_mut().zip(&self.alive) {
            let AttributeEntry { domain, components, stored, .. } = entries[k as usize];
            let added = match domain {
                Domain::Corner => corners.vertices.len(),
                Domain::Triangle => (triangles - corners.first_triangle) as usize,
            };
            let changed = if domain == Domain::Triangle { rewritten } else { &[] };
            let width = if stored == Stored::U8 { 1 } else { 4 };
            let size = (components * (added + changed.len()) * width).next_multiple_of(4);
            let (bytes, after) = rest.split_at(size);
            rest = after;
            let list: Vec<f64> = match stored {
                Stored::U8 => bytes.iter().map(|&x| x.into()).collect(),
                Stored::U32 => words(bytes).map(|x| u32::from_le_bytes(x).into()).collect(),
                _ => words(bytes).map(|x| f32::from_le_bytes(x).into()).collect(),
            };
            column.extend(&list[..components * added]);
            for (&t, value) in changed.iter().zip(list[components * added..].chunks(components)) {
                column[components * t as usize..][..components].copy_from_slice(value);
            }
        }
        assert!(rest.is_empty(), "all values are of an attribute");
    }
}

impl Copy {
    fn apply(&mut self, changes: &Changes) {
        let [vertices, triangles] = changes.counts.map(|count| count as usize);
        append(&mut self.positions, changes.first_vertex, &changes.positions, vertices);
        append(&mut self.normals, changes.first_vertex, &changes.normals, vertices);
        append(&mut self.triangles, changes.first_triangle, &changes.indices, triangles);
        assert_eq!(changes.from.len(), changes.positions.len());
        scatter(&mut self.positions, &changes.moved, &changes.moved_positions);
        scatter(&mut self.normals, &changes.turned, &changes.turned_normals);
        scatter(&mut self.triangles, &changes.rewritten, &changes.rewritten_indices);
        assert!(self.triangles.iter().flatten().all(|&v| (v as usize) < vertices));
        if changes.first_vertex == 0 {
            self.dress = Dress::default();
        }
        if changes.corners.alive.is_empty() {
            assert_eq!(changes.corners, Corners::default());
        } else {
            self.dress.apply(&changes.corners, changes, &self.entries);
        }
    }

    /// The mesh, with the vertices just appended where they begin.
    fn surface(&self, begin: Option<&Changes>) -> IndexedMesh {
        let mut positions: Vec<_> = self.positions.iter().map(|p| p.map(f64::from)).collect();
        if let Some(changes) = begin {
            positions.truncate(changes.first_vertex as usize);
            positions.extend(changes.from.chunks_exact(3).map(|x| [x[0], x[1], x[2]].map(f64::from)));
        }
        IndexedMesh { positions, triangles: self.triangles.clone(), ..IndexedMesh::default() }
    }

    /// The triangles as positions, each from its smallest corner on, sorted.
    fn soup(&self) -> Vec<[[u32; 3]; 3]> {
        soup(&self.triangles, |v| self.positions[v as usize])
    }
}

fn append<T: std::marker::Copy + Default>(array: &mut Vec<[T; 3]>, first: u32, more: &[T], count: usize) {
    array.truncate(first as usize);
    assert_eq!(array.len(), first as usize, "what is appended follows what was there");
    array.extend(more.chunks_exact(3).map(|x| [x[0], x[1], x[2]]));
    assert_eq!(array.len(), count);
}

fn scatter<T: std::marker::Copy>(array: &mut [[T; 3]], places: &[u32], values: &[T]) {
    assert_eq!(3 * places.len(), values.len());
    for (&place, x) in places.iter().zip(values.chunks_exact(3)) {
        array[place as usize] = [x[0], x[1], x[2]];
    }
}

fn soup(triangles: &[[u32; 3]], position: impl Fn(u32) -> [f32; 3]) -> Vec<[[u32; 3]; 3]> {
    let turned = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| position(v).map(f32::to_bits));
        [[a, b, c], [b, c, a], [c, a, b]].into_iter().min().expect("there are three")
    };
    let mut soup: Vec<_> = triangles.iter().map(turned).collect();
    soup.sort_unstable();
    soup
}

/// Pieces of a file, and where they begin.
fn pieces(file: &[u8], size: usize) -> impl Iterator<Item = (u64, &[u8])> {
    (0..).step_by(size).zip(file.chunks(size))
}

/// Follows a file in pieces, taking changes after every so many events.
fn follow(file: &[u8], piece: usize, every: usize, settings: Settings) -> (Client, Copy, String) {
    let (mut client, mut copy, mut report) = (Client::new(settings), Copy::default(), String::new());
    let mut events = 0;
    for (at, bytes) in pieces(file, piece) {
        client.push(at, bytes);
        while client.poll().expect("the file is well-formed") {
            events += 1;
            copy.entries = client.decoder().contents().map_or(Vec::new(), |of| of.attributes.clone());
            if events % every == 0 {
                copy.apply(&client.take());
            }
        }
        report += &client.report();
    }
    copy.apply(&client.take());
    (client, copy, report)
}

fn file(mesh: &IndexedMesh) -> Vec<u8> {
    Encoder::new(Encoding { position_bits: 12, ..Encoding::default() })
        .encode_to_vec(mesh)
        .expect("it can be encoded")
}

/// A closed mesh, an open one with a handle, and one with all that a residue holds.
fn meshes() -> Vec<IndexedMesh> {
    let mut torn = shapes::torus_with_hole(9, 7);
    let [a, b, c] = torn.triangles[5];
    torn.triangles.push([a, b, c]);
    torn.triangles.push([c, b, a]);
    torn.triangles.push([a, a, b]);
    torn.positions.push([0.1, 0.2, 0.3]);
    // A fan that touches the rest in one vertex, and a reversed triangle.
    let tip = torn.positions.len() as u32;
    torn.positions.extend([[3.0, 0.0, 0.0], [3.0, 1.0, 0.0]]);
    torn.triangles.push([a, tip, tip + 1]);
    torn.triangles[20].swap(0, 1);
    vec![shapes::bumpy_sphere(3, 1), shapes::torus_with_hole(9, 7), torn]
}

#[test]
fn the_copy_is_the_mesh_however_it_is_cut() {
    for mesh in meshes() {
        let file = file(&mesh);
        let whole = decode(&file, Options::default()).unwrap().assembled().unwrap();
        let expected = soup(&whole.triangles, |v| whole.positions[v as usize].map(|x| x as f32));
        assert_eq!(expected.len(), mesh.triangles.len());
        for (piece, every) in [(file.len(), 1), (file.len(), 5), (100, 1), (333, 7), (1, 1000)] {
            let (client, copy, report) = follow(&file, piece, every, Settings::default());
            assert_eq!(copy.soup(), expected, "pieces of {piece}, every {every} events");
            assert!(report.contains(r#""type":"end""#));
            assert_eq!(client.end(), client.decoder().contents().map(|contents| contents.file_bytes()));
        }
    }
}

#[test]
fn normals_are_those_of_the_triangles() {
    let file = file(&shapes::bumpy_sphere(3, 1));
    let (_, copy, _) = follow(&file, 64, 1, Settings::default());
    let mut sums = vec![[0.0f64; 3]; copy.positions.len()];
    for t in &copy.triangles {
        let [a, b, c] = t.map(|v| copy.positions[v as usize].map(f64::from));
        let [u, v] = [b, c].map(|p| [0, 1, 2].map(|k| p[k] - a[k]));
        let cross = [0, 1, 2].map(|k| u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3]);
        for v in t {
            for k in 0..3 {
                sums[*v as usize][k] += cross[k];
            }
        }
    }
    for (normal, sum) in copy.normals.iter().zip(sums) {
        let length = sum.iter().map(|x| x * x).sum::<f64>().sqrt();
        for k in 0..3 {
            assert!((f64::from(normal[k]) - sum[k] / length).abs() < 1e-4);
        }
    }
}

#[test]
fn down_and_up_again() {
    for mesh in meshes() {
        let file = file(&mesh);
        let settings = Settings { undo: true, ..Settings::default() };
        let (mut client, mut copy, _) = follow(&file, 500, 3, settings);
        let finest = copy.soup();
        let levels = client.decoder().contents().unwrap().levels.clone();
        while let Some(level) = client.coarsen().unwrap() {
            copy.apply(&client.take());
            assert_eq!(copy.triangles.len(), levels[level as usize].triangles as usize);
        }
        while client.restore().unwrap().is_some() {}
        copy.apply(&client.take());
        assert_eq!(copy.soup(), finest);
    }
}

#[test]
fn only_what_is_wanted() {
    let file = file(&shapes::bumpy_sphere(3, 1));
    let (client, copy, report) =
        follow(&file, 200, 1, Settings { want: Want::Level(3), ..Settings::default() });
    let contents = client.decoder().contents().unwrap().clone();
    assert_eq!(copy.triangles.len(), contents.level(3).unwrap().triangles as usize);
    assert_eq!(client.end(), Some(contents.bytes(contents.steps(3)).end));
    assert!(report.contains(r#""type":"end""#) && !report.contains(r#""type":"residue""#));
}

#[test]
fn level_0_is_all() {
    let mut mesh = shapes::bumpy_sphere(2, 1);
    mesh.triangles.push(mesh.triangles[7]);
    let encoding = Encoding {
        exact: Some(Real::Binary64),
        keep_order: true,
        keyframes: Keyframes::All,
        ..Encoding::default()
    };
    let file = Encoder::new(encoding).encode_to_vec(&mesh).unwrap();
    let (_, whole, report) = follow(&file, 200, 1, Settings::default());
    assert!(report.contains(r#""type":"residue""#) && report.contains(r#""type":"metadata""#));
    assert_eq!(whole.triangles.len(), 321, "the triangle that is there twice");
    for want in [Want::Level(0), Want::Error(Measure::Max, 0.0), Want::Error(Measure::Rms, 0.0)] {
        let (client, copy, told) = follow(&file, 200, 1, Settings { want, ..Settings::default() });
        assert_eq!((copy.soup(), told), (whole.soup(), report.clone()), "{want:?}");
        assert!(client.decoder().order().is_some() && client.decoder().correction().is_some());
    }
}

#[test]
fn an_error_by_either_measure() {
    let file = file(&shapes::bumpy_sphere(3, 1));
    let contents = parse_contents(&file).unwrap().unwrap();
    // Between the two errors of a level, so that one of them is too large and the other is not.
    let most = (contents.levels[4].max_error + contents.levels[4].rms_error) / 2.0;
    let coarsest = |error: fn(&Level) -> f64| contents.levels.iter().rposition(|l| error(l) <= most).unwrap();
    let by_max = coarsest(|level| level.max_error);
    let by_rms = coarsest(|level| level.rms_error);
    assert!(by_rms > by_max, "{by_rms} {by_max}");
    for (measure, level) in [(Measure::Max, by_max), (Measure::Rms, by_rms)] {
        let settings = Settings { want: Want::Error(measure, most), ..Settings::default() };
        let (_, copy, _) = follow(&file, 200, 1, settings);
        assert_eq!(copy.triangles.len(), contents.levels[level].triangles as usize, "{measure:?}");
    }
}

#[test]
fn what_is_wanted_may_change() {
    let file = file(&shapes::bumpy_sphere(3, 1));
    let whole = follow(&file, file.len(), 1, Settings::default()).1.soup();
    let settings = Settings { want: Want::Level(u32::MAX), ..Settings::default() };
    let (mut client, mut copy, report) = follow(&file, 100, 1, settings);
    let contents = client.decoder().contents().unwrap().clone();
    assert_eq!(copy.triangles.len(), contents.header.base_triangles as usize);
    assert_eq!(report.matches(r#""type":"end""#).count(), 1);
    for (want, level) in [(Want::Level(4), 4), (Want::Level(4), 4), (Want::Level(6), 4), (Want::Level(1), 1)]
    {
        client.want(want);
        while client.poll().unwrap() {}
        client.finish().unwrap();
        copy.apply(&client.take());
        assert_eq!(copy.triangles.len(), contents.level(level).unwrap().triangles as usize, "{want:?}");
        // All bytes have been handed over: what is behind was kept.
        let ends = client.report().matches(r#""type":"end""#).count();
        assert!(ends <= 1, "the end is told once, and not again where the same is wanted");
    }
    client.want(Want::All);
    while client.poll().unwrap() {}
    copy.apply(&client.take());
    assert_eq!(copy.soup(), whole);
}

/// A mesh with attributes and a residue, most of its triangles without them, and something else, as members 0, 1 and 2.
fn members() -> [IndexedMesh; 3] {
    let mut fine = shapes::bumpy_sphere(3, 1);
    let part = IndexedMesh::new(fine.positions.clone(), fine.triangles[..700].to_vec());
    fine.triangles.push(fine.triangles[9]);
    [dressed(fine), part, shapes::torus(9, 7)]
}

fn set(order: SetOrder) -> Vec<u8> {
    let inputs = members().map(|mesh| SetInput { mesh, source: Source::default(), exact: None });
    let options = Encoding { position_bits: 12, ..Encoding::default() };
    let mut file = Vec::new();
    encode_set(&inputs, order, &options, &mut |_, _| true, &mut file).expect("it can be encoded");
    file
}

#[test]
fn members_of_a_set_take_each_others_place() {
    let triangles = members().map(|mesh| mesh.triangles.len());
    for order in [SetOrder::Stream, SetOrder::Small] {
        let file = set(order);
        let contents = parse_set(&file).unwrap().unwrap();
        assert!(contents.members.iter().any(|member| member.leans));
        // Each as a mesh of its own, for comparison; where its vertices are told by others this is what decoding those gives.
        let mut soups = Vec::new();
        for (piece, every) in [(file.len(), 1), (100, 1), (1, 1000), (17, 3)] {
            let settings = Settings { undo: true, ..Settings::default() };
            let (mut client, mut copy, report) = follow(&file, piece, every, settings);
            let mut told = vec![copy.soup()];
            assert_eq!(copy.dress.alive.len(), 4, "{order:?}: the finest has its attributes");
            while let Some(number) = client.coarsen().unwrap() {
                copy.entries = client.decoder().contents().unwrap().attributes.clone();
                copy.apply(&client.take());
                assert_eq!(told.len(), number as usize);
                told.push(copy.soup());
            }
            assert_eq!(told.iter().map(Vec::len).collect::<Vec<_>>(), triangles);
            while client.restore().unwrap().is_some() {}
            copy.entries = client.decoder().contents().unwrap().attributes.clone();
            copy.apply(&client.take());
            assert_eq!(copy.soup(), told[0]);
            let shown = if order == SetOrder::Stream { 3 } else { 1 };
            assert_eq!(report.matches(r#""type":"level""#).count(), shown, "{order:?}");
            assert!(report.matches(r#""type":"end""#).count() == 1 && report.contains(r#""set":true"#));
            soups.push(told);
        }
        assert!(soups.windows(2).all(|pair| pair[0] == pair[1]), "{order:?}: however it is cut");

        let settings = Settings { want: Want::Level(1), ..Settings::default() };
        let (mut client, mut copy, _) = follow(&file, 50, 1, settings);
        assert_eq!(copy.soup(), soups[0][1], "{order:?}");
        assert_eq!(client.end(), Some(contents.members[1].bytes.end));
        client.want(Want::All);
        while client.poll().unwrap() {}
        client.finish().unwrap();
        copy.entries = client.decoder().contents().unwrap().attributes.clone();
        copy.apply(&client.take());
        assert_eq!(copy.soup(), soups[0][0], "{order:?}");
    }
}

#[test]
fn faults_of_a_set() {
    let file = set(SetOrder::Stream);
    let contents = parse_set(&file).unwrap().unwrap();
    let told = |bytes: &[u8]| {
        let mut client = Client::new(Settings::default());
        client.push(0, bytes);
        let outcome = std::iter::from_fn(|| Some(client.poll())).find(|told| !matches!(told, Ok(true)));
        match outcome {
            Some(Err(error)) => error.to_string(),
            _ => client.finish().unwrap_err().to_string(),
        }
    };
    let mut wrong = file.clone();
    let at = contents.members[1].bytes.start;
    wrong[at as usize] ^= 1;
    assert!(told(&wrong).starts_with(&format!("byte {at}: member 1: atom 0 ")), "{}", told(&wrong));
    wrong[20] ^= 1;
    assert!(told(&wrong).starts_with("byte 0: header and table of the set do not match"), "{}", told(&wrong));
    for cut in [11, 12, 40, contents.head_end() as usize, at as usize + 3, file.len() - 1] {
        let error = told(&file[..cut]);
        assert!(error.starts_with(&format!("byte {cut}: ")) && error.contains("cut off"), "{error}");
    }
}

#[test]
fn new_vertices_begin_no_further_from_the_surface_than_is_told() {
    let preview = Encoding { position_bits: 12, preview: Preview::Coarse, ..Encoding::default() };
    let coarse = Encoder::new(preview).encode_to_vec(&shapes::bumpy_sphere(3, 1)).unwrap();
    let plain = meshes().iter().take(2).map(file).collect::<Vec<_>>();
    let mut near = 0.0_f64;
    for file in plain.iter().chain([&coarse]) {
        for every in [1, 3, 10] {
            let settings = Settings { jumps: true, ..Settings::default() };
            let (mut client, mut copy) = (Client::new(settings), Copy::default());
            client.push(0, file);
            for event in 1.. {
                let more = client.poll().unwrap();
                if more && event % every != 0 {
                    continue;
                }
                let changes = client.take();
                let before = copy.surface(None);
                copy.apply(&changes);
                if changes.first_vertex > 0 {
                    let begun = copy.surface(Some(&changes));
                    let sampling = Sampling { samples: 2000, ..Sampling::default() };
                    let ways = surface_distances(&before, &begun, &sampling, &mut |_, _| {}).unwrap();
                    let most = ways[0].max.max(ways[1].max);
                    let jump = f64::from(changes.jump);
                    assert!(most <= jump + 1e-5, "{most} is more than {jump}");
                    near = near.max(if jump > 1e-3 { most / jump } else { 0.0 });
                }
                if !more {
                    break;
                }
            }
        }
    }
    assert!(near > 0.3, "the bound is worth something: {near}");
}

#[test]
fn positions_relative_to_the_corner_of_the_box() {
    let mut mesh = shapes::sphere(2);
    for p in &mut mesh.positions {
        *p = [p[0] + 4.0e6, p[1] + 5.0e5, p[2]];
    }
    let file = file(&mesh);
    let (client, copy, _) = follow(&file, 1000, 1, Settings { relative: true, ..Settings::default() });
    let lattice = client.decoder().contents().unwrap().header.lattice;
    for (p, q) in copy.positions.iter().zip(&client.decoder().mesh().positions) {
        for k in 0..3 {
            assert!((f64::from(p[k]) - lattice.step * f64::from(q[k])).abs() < 1e-6);
        }
    }
}

#[test]
fn a_fault_names_its_atom() {
    let plain = Encoding { preview: Preview::Off, ..Encoding::default() };
    let mut file = Encoder::new(plain).encode_to_vec(&shapes::bumpy_sphere(3, 1)).unwrap();
    let contents = unweld::container::parse_contents(&file).unwrap().unwrap();
    let index = contents.steps(2).start;
    file[contents.atoms[index].offset as usize] ^= 0x40;
    let mut client = Client::new(Settings::default());
    client.push(0, &file);
    let error = loop {
        match client.poll() {
            Ok(more) => assert!(more, "the fault is found"),
            Err(error) => break error,
        }
    };
    let report = client.report();
    assert!(
        report.contains(&format!(r#""atom":{{"index":{index},"kind":"refinement","level":2}}"#)),
        "{report}"
    );
    assert!(report.contains(&error.to_string()), "{report}");
    let mut copy = Copy::default();
    copy.apply(&client.take());
    assert_eq!(copy.triangles.len(), contents.level(3).unwrap().triangles as usize);
}

/// A share of a turn from the negative y axis on, along a square: the same number on every machine.
fn turn(x: f64, y: f64) -> f64 {
    let way = x / (x.abs() + y.abs()).max(1e-9) / 4.0;
    let from = if y >= 0.0 { 0.5 + way } else { -way };
    if y < 0.0 && x >= 0.0 { from + 1.0 } else { from }
}

/// Texture coordinates with a seam along x = 0, y < 0, unit normals, colours and parts, all by position; without colours on some triangles.
fn dressed(mesh: IndexedMesh) -> IndexedMesh {
    dressed_but(mesh, |t| t % 7 == 3)
}

fn dressed_but(mut mesh: IndexedMesh, is_bare: impl Fn(u32) -> bool) -> IndexedMesh {
    let of_corner = |triangle: &[u32; 3], k: usize| {
        let [x, y, z] = mesh.positions[triangle[k] as usize];
        let [u, wraps] = [turn(x, y), f64::from(y < 0.0)];
        let left = triangle.iter().any(|&v| mesh.positions[v as usize][0] < -1e-9);
        ([u + if left && u > 0.75 { -wraps } else { 0.0 }, z], [x, y, z])
    };
    let corners: Vec<_> = mesh.triangles.iter().flat_map(|t| [0, 1, 2].map(|k| of_corner(t, k))).collect();
    let numbers = |count| (0..count as u32).collect::<Vec<_>>();
    let uv = corners.iter().flat_map(|(uv, _)| uv.map(|x| x as f32)).collect();
    let normals = corners.iter().flat_map(|&(_, p)| {
        let length = p.iter().map(|x| x * x).sum::<f64>().sqrt().max(1e-9);
        p.map(|x| x / length)
    });
    let colors = corners.iter().flat_map(|&(_, p)| p.map(|x| (127.5 + 127.5 * x).clamp(0.0, 255.0) as u8));
    let some = |c: u32| if is_bare(c / 3) { NO_VALUE } else { c };
    let parts: Vec<u32> =
        corners.chunks_exact(3).map(|t| if t.iter().all(|(_, p)| p[2] >= 0.0) { 5 } else { 2 }).collect();
    let all = numbers(corners.len());
    let colored = Attribute::new(
        Semantic::Color,
        3,
        Values::U8(colors.collect()),
        all.iter().copied().map(some).collect(),
    );
    let normals = Values::F64(normals.collect());
    mesh.attributes = vec![
        Attribute::new(Semantic::TexCoord, 2, Values::F32(uv), all.clone()),
        Attribute::new(Semantic::Normal, 3, normals, all),
        Attribute { normalised: true, ..colored },
        Attribute::parts(&parts),
    ];
    mesh
}

/// A triangle by its corners, the smallest first: position, and the numbers of each attribute.
type Numbers = [Vec<u64>; 3];

fn dressed_soup(count: usize, corner: impl Fn(usize, usize) -> Vec<f64>) -> Vec<Numbers> {
    let mut soup: Vec<Numbers> = (0..count)
        .map(|t| {
            let mut corners = [0, 1, 2].map(|k| corner(t, k).iter().map(|x| x.to_bits()).collect());
            let least = (0..3).min_by_key(|&k| &corners[k]).unwrap_or(0);
            corners.rotate_left(least);
            corners
        })
        .collect();
    soup.sort();
    soup
}

/// What the program hands out, with the numbers that a page has.
fn of_assembled(mesh: &IndexedMesh) -> Vec<Numbers> {
    dressed_soup(mesh.triangles.len(), |t, k| {
        let position = mesh.positions[mesh.triangles[t][k] as usize].map(|x| f64::from(x as f32));
        let mut numbers = position.to_vec();
        for a in &mesh.attributes {
            let none = if a.semantic == Semantic::Part { f64::from(u32::MAX) } else { 0.0 };
            let value = a.at(t, k);
            let number =
                |i| value.map_or(none, |value| f64::from(a.values.number(a.components * value + i) as f32));
            numbers.extend((0..a.components).map(number));
        }
        numbers
    })
}

/// What the page has.
fn of_copy(copy: &Copy) -> Vec<Numbers> {
    let Dress { alive, vertices, triangles, columns } = &copy.dress;
    dressed_soup(copy.triangles.len(), |t, k| {
        let at_corner = triangles.get(t).map(|wedges| wedges[k] as usize);
        let vertex = at_corner.map_or(copy.triangles[t][k], |wedge| vertices[wedge]) as usize;
        // One that is sewn together with the triangle's own lies where it does.
        assert_eq!(copy.positions[vertex], copy.positions[copy.triangles[t][k] as usize]);
        let mut numbers = copy.positions[vertex].map(f64::from).to_vec();
        for (&name, column) in alive.iter().zip(columns) {
            let AttributeEntry { domain, components, .. } = copy.entries[name as usize];
            let at = if domain == Domain::Corner { at_corner.expect("it is at corners") } else { t };
            numbers.extend(&column[components * at..components * (at + 1)]);
        }
        numbers
    })
}

fn words(bytes: &[u8]) -> impl Iterator<Item = [u8; 4]> + '_ {
    bytes.chunks_exact(4).map(|x| [x[0], x[1], x[2], x[3]])
}

/// At every event, and at every level shown again, the page has at each corner what the decoder has.
#[test]
fn attributes_are_those_of_the_file() {
    let (mut early, mut anew, mut appended, mut lowered) = (0, 0, 0, 0);
    for mesh in meshes() {
        let mesh = dressed(mesh);
        let parts = IndexedMesh { attributes: mesh.attributes[3..].to_vec(), ..mesh.clone() };
        let corners = 3 * mesh.triangles.len();
        let uniform = Attribute::new(Semantic::Color, 3, Values::U8(vec![9, 8, 7]), vec![0; corners]);
        let mut both = mesh.clone();
        both.attributes[2] = uniform.clone();
        let uniform = IndexedMesh { attributes: vec![uniform], ..mesh.clone() };
        let attribute_births = vec![("uv".into(), AttributeBirth::Finest)];
        let late = Encoding { position_bits: 12, attribute_births, ..Encoding::default() };
        let late = Encoder::new(late).encode_to_vec(&mesh).unwrap();
        let files = [mesh, parts, both, uniform].map(|mesh| file(&mesh));
        for file in files.into_iter().chain([late]) {
            for (piece, every) in [(file.len(), 1), (file.len(), 1000), (100, 3), (1, 1)] {
                let settings = Settings { undo: true, ..Settings::default() };
                let (mut client, mut copy, mut events) = (Client::new(settings), Copy::default(), 0);
                let mut waits = false;
                for (at, bytes) in pieces(&file, piece) {
                    client.push(at, bytes);
                    while client.poll().unwrap() {
                        events += 1;
                        copy.entries =
                            client.decoder().contents().map_or(Vec::new(), |of| of.attributes.clone());
                        if events % every != 0 || client.decoder().level().is_none() {
                            continue;
                        }
                        let changes = client.take();
                        copy.apply(&changes);
                        let whole = client.decoder().assembled().unwrap();
                        // What the residue adds is shown once its attributes are there.
                        waits = whole.triangles.len() > copy.triangles.len();
                        if !waits {
                            assert_eq!(of_copy(&copy), of_assembled(&whole), "event {events}");
                        }
                        early +=
                            usize::from(client.decoder().level() != Some(0) && !copy.dress.alive.is_empty());
                        anew += usize::from(
                            changes.first_vertex > 0
                                && !changes.corners.vertices.is_empty()
                                && changes.corners.first_triangle == 0,
                        );
                        appended += usize::from(changes.corners.first_wedge > 0);
                    }
                }
                assert!(!waits);
                copy.apply(&client.take());
                let mut steps = Vec::new();
                loop {
                    let whole = client.decoder().assembled().unwrap();
                    assert_eq!(
                        of_copy(&copy),
                        of_assembled(&whole),
                        "pieces of {piece}, every {every} events"
                    );
                    if client.coarsen().unwrap().is_none() {
                        break;
                    }
                    copy.apply(&client.take());
                    steps.push(copy.dress.vertices.len());
                    lowered += usize::from(!copy.dress.alive.is_empty());
                }
                assert!(steps.is_sorted_by(|a, b| a >= b), "wedges of finer levels are left out");
                while client.restore().unwrap().is_some() {
                    copy.apply(&client.take());
                    let whole = client.decoder().assembled().unwrap();
                    assert_eq!(of_copy(&copy), of_assembled(&whole));
                }
            }
        }
    }
    assert!(early > 0 && anew > 0 && appended > 0 && lowered > 0, "{early} {anew} {appended} {lowered}");
}

#[test]
fn without_attributes_nothing_is_told_of_any() {
    let file = file(&meshes()[2]);
    let (_, copy, report) = follow(&file, 100, 1, Settings::default());
    assert!(copy.dress.alive.is_empty() && report.contains(r#""fileAttributes":[]"#));
}

/// Files for the tests of the page, `UNWELD_BLESS=1` writes them: a globe dressed, with a triangle that is there twice, and an icosahedron with the
/// normals of its faces; and what the globe's corners have at each of its levels.
#[test]
fn files_for_the_page_are_what_the_encoder_writes() {
    let mut globe = shapes::sphere(3);
    globe.triangles.push(globe.triangles[9]);
    let mut facets = shapes::sphere(0);
    let normal = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| facets.positions[v as usize]);
        let sum = [0, 1, 2].map(|k| a[k] + b[k] + c[k]);
        let length = sum.iter().map(|x| x * x).sum::<f64>().sqrt();
        sum.map(|x| (x / length) as f32)
    };
    let normals = facets.triangles.iter().flat_map(normal).collect();
    let of_faces = (0..facets.triangles.len() as u32).flat_map(|t| [t; 3]).collect();
    facets.attributes = vec![Attribute::new(Semantic::Normal, 3, Values::F32(normals), of_faces)];
    globe.part_names = ["", "", "below", "", "", "above"].map(str::to_owned).to_vec();
    // Colours are born in the end, all others before.
    let births = vec![("color".to_owned(), AttributeBirth::Finest)];
    let late = Encoding { position_bits: 12, attribute_births: births, ..Encoding::default() };
    let globe = Encoder::new(late).encode_to_vec(&dressed_but(globe, |t| t < 100)).unwrap();
    let facets = file(&facets);
    let levels = levels_of(&globe).into_bytes();
    for (name, written) in [("globe.uwm", globe), ("facets.uwm", facets), ("globe.json", levels)] {
        let path = format!("{}/web/tests/{name}", env!("CARGO_MANIFEST_DIR"));
        if std::env::var_os("UNWELD_BLESS").is_some_and(|value| value == "1") {
            std::fs::write(&path, &written).unwrap();
        }
        assert!(std::fs::read(&path).is_ok_and(|bytes| bytes == written), "{path}: other bytes");
    }
}

/// A digest of all triangles with their values, for each level from 0 on, as JSON.
fn levels_of(file: &[u8]) -> String {
    let mut decoder = decode(file, Options { undo: true, ..Options::default() }).unwrap();
    let mut digests = Vec::new();
    loop {
        let soup = of_assembled(&decoder.assembled().unwrap());
        digests.push(format!("\"{:08x}\"", soup.iter().map(digest).fold(0, u32::wrapping_add)));
        if decoder.coarsen().unwrap().is_none() {
            return format!("[{}]\n", digests.join(", "));
        }
    }
}

/// Of a triangle, whichever corner comes first: the bits of its numbers in binary32.
fn digest(triangle: &Numbers) -> u32 {
    let bits = |k: usize| triangle[k % 3].iter().map(|&x| (f64::from_bits(x) as f32).to_bits());
    let turned = (0..3).map(|k| (k..k + 3).flat_map(bits).collect::<Vec<_>>()).min().unwrap();
    turned.iter().fold(0x811c_9dc5, |hash: u32, x| (hash ^ x).wrapping_mul(0x0100_0193))
}

/// The page's declaration of what it is given, which no compiler compares with ours.
#[test]
fn the_page_declares_the_same_fields() {
    let source = include_str!("../web/src/module.ts");
    let (_, declared) = source.split_once("export interface Changes {\n").expect("it is declared");
    let (declared, _) = declared.split_once('}').expect("the declaration ends");
    let declared: Vec<_> = declared
        .lines()
        .filter_map(|line| line.trim().trim_end_matches(';').split_once(": "))
        .map(|(name, kind)| (name, kind.to_owned()))
        .collect();
    let changes = Changes::default();
    let ours = changes.fields().map(|(name, field)| {
        let kind = match field.kind() {
            "u32[]" => "Uint32Array",
            "f32[]" => "Float32Array",
            "u8[]" => "Uint8Array",
            _ => "number",
        };
        (name, kind.to_owned())
    });
    assert_eq!(declared, ours);
}
