//! What files tell of the errors of attributes, beside what is measured on the levels as a decoder has them.
#![cfg(feature = "encode")]

use unweld::container::{AttributeError, Contents};
use unweld::decoder::{self, Decoder, Event};
use unweld::encoder::{Encoder, Options};
use unweld::mesh::attributes::{Attribute, Semantic, Stored, Values};
use unweld::mesh::{IndexedMesh, shapes};

/// The levels of a file but the finest, coarse to fine, each with what its entry tells; and the contents.
fn levels(mesh: &IndexedMesh, options: Options) -> (Vec<(IndexedMesh, Vec<AttributeError>)>, Contents) {
    let file = Encoder::new(options).encode_to_vec(mesh).unwrap();
    let mut decoder = Decoder::new(decoder::Options::default());
    decoder.push(&file);
    let mut levels = std::collections::BTreeMap::new();
    while let Some(event) = decoder.poll().unwrap() {
        if let Event::Level { level: j @ 1.., .. } | Event::Attributes { level: j @ 1.. } = event {
            levels.insert(std::cmp::Reverse(j), decoder.assembled().unwrap());
        }
    }
    let contents = decoder.contents().unwrap();
    let errors = |j: u32| contents.level(j).unwrap().attributes.clone();
    let levels = levels.into_iter().map(|(j, mesh)| (mesh, errors(j.0))).collect();
    (levels, Contents::clone(contents))
}

type Vector = [f64; 3];

fn dot(a: Vector, b: Vector) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

fn minus(a: Vector, b: Vector) -> Vector {
    [0, 1, 2].map(|k| a[k] - b[k])
}

fn cross([a, b, c]: Vector, [x, y, z]: Vector) -> Vector {
    [b * z - c * y, c * x - a * z, a * y - b * x]
}

/// What has these shares of three values.
fn mix<const N: usize>(values: [[f64; N]; 3], shares: Vector) -> [f64; N] {
    std::array::from_fn(|k| (0..3).map(|i| values[i][k] * shares[i]).sum())
}

/// The nearest of many points of a triangle to `p`, by their shares: a grid of steps of a sixteenth, made finer round the best.
fn nearest(p: Vector, triangle: [Vector; 3]) -> (f64, Vector) {
    let far = |shares: Vector| {
        let d = minus(mix(triangle, shares), p);
        dot(d, d)
    };
    // The foot of the perpendicular, where it is inside.
    let (ab, ac, ap) =
        (minus(triangle[1], triangle[0]), minus(triangle[2], triangle[0]), minus(p, triangle[0]));
    let n = cross(ab, ac);
    let area = dot(n, n);
    let (v, w) = (dot(cross(ap, ac), n) / area, dot(cross(ab, ap), n) / area);
    let mut all = vec![[1.0 - v - w, v, w]];
    all.retain(|shares| shares.iter().all(|share| *share >= 0.0));
    for k in 0..3 {
        let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
        let t = (dot(minus(p, a), minus(b, a)) / dot(minus(b, a), minus(b, a))).clamp(0.0, 1.0);
        let mut shares = [0.0; 3];
        (shares[k], shares[(k + 1) % 3]) = (1.0 - t, t);
        all.push(shares);
    }
    let best = all.into_iter().map(|shares| (far(shares), shares));
    best.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap()
}

fn corners(mesh: &IndexedMesh, t: usize) -> [Vector; 3] {
    mesh.triangles[t].map(|v| mesh.positions[v as usize])
}

/// The numbers at the corners of a triangle, fractions as such.
fn values<const N: usize>(attribute: &Attribute, t: usize) -> [[f64; N]; 3] {
    let whole = match attribute.values.stored() {
        Stored::U8 if attribute.normalised => 255.0,
        _ => 1.0,
    };
    [0, 1, 2].map(|k| {
        let value = attribute.at(t, k).unwrap();
        std::array::from_fn(|i| attribute.values.number(N * value + i) / whole)
    })
}

/// Whether two triangles have other values at a vertex that they share.
fn are_apart(mesh: &IndexedMesh, t: usize, u: usize) -> bool {
    let value = |a: &Attribute, t: usize, k: usize| {
        let at = a.at(t, k).unwrap();
        (0..a.components).map(|i| a.values.bits(at * a.components + i)).collect::<Vec<_>>()
    };
    let [t_vertices, u_vertices] = [t, u].map(|t| mesh.triangles[t]);
    let shared = (0..9).map(|i| (i / 3, i % 3)).filter(|&(k, l)| t_vertices[k] == u_vertices[l]);
    shared.into_iter().any(|(k, l)| mesh.attributes.iter().any(|a| value(a, t, k) != value(a, u, l)))
}

/// Root mean square and the 95 % of the difference, at three points of each triangle of the input, each beside the nearest point of the level, or
/// the best of triangles beyond a seam that are farther by no more than `more`.
fn measure<const N: usize>(
    input: &IndexedMesh,
    level: &IndexedMesh,
    attribute: usize,
    more: f64,
    difference: impl Fn([f64; N], [f64; N]) -> f64,
) -> [f64; 2] {
    let mut found = Vec::new();
    for t in 0..input.triangles.len() {
        let triangle = corners(input, t);
        let n = cross(minus(triangle[1], triangle[0]), minus(triangle[2], triangle[0]));
        for shares in [
            [2.0 / 3.0, 1.0 / 6.0, 1.0 / 6.0],
            [1.0 / 6.0, 2.0 / 3.0, 1.0 / 6.0],
            [1.0 / 6.0, 1.0 / 6.0, 2.0 / 3.0],
        ] {
            let p = mix(triangle, shares);
            let own = mix(values(&input.attributes[attribute], t), shares);
            let near: Vec<_> = (0..level.triangles.len()).map(|t| nearest(p, corners(level, t))).collect();
            let best = (0..near.len()).min_by(|&t, &u| near[t].0.total_cmp(&near[u].0)).unwrap();
            let is_near = |t: &usize| near[*t].0.sqrt() <= near[best].0.sqrt() + more;
            let counts = |t: &usize| *t == best || is_near(t) && are_apart(level, best, *t);
            let others = (0..near.len())
                .filter(counts)
                .map(|t| difference(own, mix(values(&level.attributes[attribute], t), near[t].1)));
            found.push((others.fold(f64::INFINITY, f64::min), dot(n, n).sqrt()));
        }
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = found.iter().map(|(_, area)| area).sum();
    let squares: f64 = found.iter().map(|(x, area)| x * x * area).sum();
    let mut sum = 0.0;
    let reaches = |&&(_, area): &&(f64, f64)| {
        sum += area;
        sum >= 0.95 * total
    };
    [(squares / total).sqrt(), found.iter().find(reaches).unwrap().0]
}

fn length<const N: usize>(a: [f64; N], b: [f64; N]) -> f64 {
    a.iter().zip(b).map(|(x, y)| (x - y) * (x - y)).sum::<f64>().sqrt()
}

fn degrees(a: Vector, b: Vector) -> f64 {
    (dot(a, b) / (dot(a, a) * dot(b, b)).sqrt()).clamp(-1.0, 1.0).acos().to_degrees()
}

/// A torus whose normals, texture coordinates and colours are those of its angles; texture coordinates have seams.
fn torus() -> IndexedMesh {
    let (rings, sides) = (24, 16);
    let mut mesh = IndexedMesh::default();
    let angle = |i: usize, n: usize| i as f64 / n as f64 * std::f64::consts::TAU;
    for (i, j) in (0..rings).flat_map(|i| (0..sides).map(move |j| (i, j))) {
        let (a, b) = (angle(i, rings), angle(j, sides));
        let r = 1.0 + 0.4 * b.cos();
        mesh.positions.push([r * a.cos(), r * a.sin(), 0.4 * b.sin()]);
    }
    let (mut uv, mut normals, mut colors) = (Vec::new(), Vec::new(), Vec::new());
    for (i, j) in (0..rings).flat_map(|i| (0..sides).map(move |j| (i, j))) {
        for corners in [[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]] {
            mesh.triangles.push(corners.map(|(x, y)| (((i + x) % rings) * sides + (j + y) % sides) as u32));
            for (x, y) in corners {
                let (a, b) = (angle(i + x, rings), angle(j + y, sides));
                uv.extend([(i + x) as f32 / rings as f32, (j + y) as f32 / sides as f32]);
                normals.extend([b.cos() * a.cos(), b.cos() * a.sin(), b.sin()].map(|x| x as f32));
                colors.extend([a.cos(), a.sin(), b.sin()].map(|x| (127.5 + 127.5 * x).round() as u8));
            }
        }
    }
    let all: Vec<u32> = (0..3 * mesh.triangles.len() as u32).collect();
    let color = Attribute::new(Semantic::Color, 3, Values::U8(colors), all.clone());
    mesh.attributes = vec![
        Attribute::new(Semantic::TexCoord, 2, Values::F32(uv), all.clone()),
        Attribute::new(Semantic::Normal, 3, Values::F32(normals), all),
        Attribute { normalised: true, ..color },
    ];
    mesh
}

#[test]
fn errors_are_those_that_can_be_measured() {
    let mesh = torus();
    let mut options = Options::default();
    options.simplify.base_vertices = Some(24);
    let (levels, contents) = levels(&mesh, options);
    assert!(levels.len() > 3 && contents.level(0).unwrap().attributes.is_empty());
    let base = contents.base_level();
    for ((level, errors), j) in levels.iter().zip((1..=base).rev()) {
        let places: Vec<_> = errors.iter().map(|error| error.attribute).collect();
        assert_eq!(places, contents.alive_at(j).collect::<Vec<_>>());
        let rms = contents.level(j).unwrap().rms_error;
        for &AttributeError { attribute, error, high } in errors {
            let [own, own_high] = match attribute {
                0 => measure::<2>(&mesh, level, attribute, rms, length),
                1 => measure::<3>(&mesh, level, attribute, rms, degrees),
                _ => measure::<3>(&mesh, level, attribute, rms, length),
            };
            let close = |told: f64, own: f64| (0.8 * own..1.25 * own).contains(&told);
            let high = high.unwrap();
            assert!(
                close(error, own) && close(high, own_high),
                "level {j}, {attribute}: {error} {own}, {high} {own_high}"
            );
        }
    }
    // The coarser the farther, down to what rounding leaves.
    let of = |k: usize| {
        levels.iter().map(move |(_, errors)| errors.iter().find(|e| e.attribute == k).map(|e| e.error))
    };
    let normals: Vec<f64> = of(1).flatten().collect();
    assert!(
        normals.windows(2).all(|pair| pair[0] >= pair[1])
            && normals[0] > 4.0
            && normals[0] > 5.0 * normals[normals.len() - 1],
        "{normals:?}"
    );
}

/// A box, finely cut, each side with texture coordinates of its own in proportion to its places: a level that keeps the sides has exact ones everywhere, but for
/// quantisation, also right beside the edges where those of the next side begin.
#[test]
fn beside_a_seam_its_own_side_counts() {
    let mesh = of_sides(12);
    let (levels, contents) = levels(&mesh, Options::default());
    let rounding = contents.attributes[0].error;
    let mut compared = 0;
    for (_, errors) in &levels {
        for error in errors.iter().filter(|error| error.attribute == 0) {
            assert!(error.error < 3.0 * rounding + 1e-3, "{error:?} {rounding}");
            compared += 1;
        }
    }
    assert!(compared > 2);
}

/// Six sides of a cube of n x n squares, vertices shared; texture coordinates of each side in a tile of its own, and parts: three.
fn of_sides(n: usize) -> IndexedMesh {
    let mut mesh = IndexedMesh::default();
    let mut places = std::collections::BTreeMap::new();
    let (mut uv, mut parts) = (Vec::new(), Vec::new());
    for side in 0..6 {
        let axis = side / 2;
        let at = |i: usize, j: usize| {
            let mut p = [0; 3];
            (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (n * (side % 2), i, j);
            p
        };
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            for mut corners in [[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]] {
                if side % 2 == 0 {
                    corners.reverse();
                }
                let vertices = corners.map(|(x, y)| {
                    let p = at(i + x, j + y);
                    let next = places.len() as u32;
                    *places.entry(p).or_insert_with(|| {
                        mesh.positions.push(p.map(|x| x as f64 / n as f64));
                        next
                    })
                });
                mesh.triangles.push(vertices);
                parts.push(axis as u32);
                for (x, y) in corners {
                    let within = [i + x, j + y].map(|k| 0.3 * k as f32 / n as f32);
                    uv.extend([within[0] + 0.33 * axis as f32, within[1] + 0.5 * (side % 2) as f32]);
                }
            }
        }
    }
    let all: Vec<u32> = (0..3 * mesh.triangles.len() as u32).collect();
    mesh.attributes =
        vec![Attribute::new(Semantic::TexCoord, 2, Values::F32(uv), all), Attribute::parts(&parts)];
    mesh
}

/// Borders between parts are straight: no level shows another part.
#[test]
fn of_parts_the_share_is_told() {
    let (levels, contents) = levels(&of_sides(12), Options::default());
    assert_eq!(contents.attributes[1].semantic, Semantic::Part);
    let told: Vec<_> =
        levels.iter().flat_map(|(_, errors)| errors).filter(|error| error.attribute == 1).collect();
    assert!(!told.is_empty());
    for error in told {
        assert!(error.high.is_none() && (0.0..0.02).contains(&error.error), "{error:?}");
    }
}

/// The same for the same mesh, whatever its scale and where it lies: nothing but the positions' own numbers differs.
#[test]
fn a_scale_of_two_changes_nothing() {
    let mesh = torus();
    let mut large = mesh.clone();
    large.positions.iter_mut().flatten().for_each(|x| *x *= 1024.0);
    let of = |mesh: &IndexedMesh| {
        levels(mesh, Options::default()).1.levels.into_iter().map(|level| level.attributes)
    };
    assert!(of(&mesh).eq(of(&large)));
}

/// What the levels tell is all that a mesh gains: without attributes, with joints alone, with a constant, there is nothing.
#[test]
fn nothing_is_told_where_there_is_nothing_to_tell() {
    let mut mesh = shapes::sphere(4);
    let corners: Vec<u32> = mesh.triangles.iter().flatten().copied().collect();
    let joints = (0..mesh.positions.len()).flat_map(|v| [(v % 7) as u8, (v % 5) as u8]).collect();
    mesh.attributes = vec![
        Attribute::new(Semantic::Joints, 2, Values::U8(joints), corners.clone()),
        Attribute::new(Semantic::Color, 1, Values::U8(vec![9]), vec![0; corners.len()]),
    ];
    let (levels, contents) = levels(&mesh, Options::default());
    assert!(!levels.is_empty() && contents.levels.iter().all(|level| level.attributes.is_empty()));
}

/// Numbers of any size are told as well as can be, and none makes the file impossible.
#[test]
fn numbers_of_any_size() {
    for size in [1e-300, 1e300, f64::MAX / 8.0] {
        let mut mesh = shapes::sphere(4);
        let corners: Vec<u32> = mesh.triangles.iter().flatten().copied().collect();
        let numbers = mesh.positions.iter().map(|p| p[0] * size).collect();
        mesh.attributes = vec![Attribute::new(Semantic::Generic, 1, Values::F64(numbers), corners)];
        for exact in [None, Some(unweld::codec::grid::Real::Binary64)] {
            let options = Options { exact, ..Options::default() };
            let (levels, _) = levels(&mesh, options);
            let told = levels.iter().flat_map(|(_, errors)| errors);
            assert!(told.clone().all(|error| error.error.is_finite() && error.high.unwrap().is_finite()));
        }
    }
}
