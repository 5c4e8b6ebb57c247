//! Polygons of files as triangles: they cover what the outline goes round, once, and turn as it does.
//!
//! The area of an outline is Newell's (Sutherland et al. 1974), half of the sum of the cross products of its edges, which knows no
//! triangles; that of the shapes made here is known besides.
#![cfg(feature = "formats")]

use proptest::prelude::*;
use std::fmt::Write;
use unweld::formats::{Source, read_bytes};

type Point = [f64; 3];

/// An OBJ file with one face of all its vertices.
fn obj(outline: &[Point]) -> String {
    let mut text = String::new();
    outline.iter().for_each(|[x, y, z]| writeln!(text, "v {x:?} {y:?} {z:?}").unwrap());
    text += "f";
    (1..=outline.len()).for_each(|k| write!(text, " {k}").unwrap());
    text
}

fn read(text: &str) -> Source {
    read_bytes(text.as_bytes(), None, "").unwrap()
}

fn minus(a: Point, b: Point) -> Point {
    std::array::from_fn(|k| a[k] - b[k])
}

fn cross(a: Point, b: Point) -> Point {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The area vector of an outline: as long as the area, along the normal.
fn newell(outline: &[Point]) -> Point {
    let next = outline.iter().cycle().skip(1);
    let edges = outline.iter().zip(next).map(|(&a, &b)| cross(minus(a, outline[0]), minus(b, outline[0])));
    edges.fold([0.0; 3], |sum, c| std::array::from_fn(|k| sum[k] + c[k] / 2.0))
}

/// What must hold of a polygon that does not cross itself; returns its area.
fn covered(outline: &[Point]) -> f64 {
    let source = read(&obj(outline));
    assert_eq!(source.mesh.positions, outline);
    assert_eq!(source.mesh.triangles.len(), outline.len() - 2);
    let mut used = vec![false; outline.len()];
    source.mesh.triangles.iter().flatten().for_each(|&v| used[v as usize] = true);
    assert!(used.iter().all(|used| *used), "a corner is in no triangle");
    let normal = newell(outline);
    let area = dot(normal, normal).sqrt();
    let side = outline.iter().map(|&p| dot(minus(p, outline[0]), minus(p, outline[0]))).fold(0.0, f64::max);
    let mut sum = 0.0;
    for triangle in &source.mesh.triangles {
        let corners = triangle.map(|v| outline[v as usize]);
        let own = newell(&corners);
        assert!(
            dot(own, normal) >= -1e-12 * side * area,
            "{triangle:?} is turned: {own:?} against {normal:?}"
        );
        sum += dot(own, own).sqrt();
    }
    assert!((sum - area).abs() <= 1e-9 * area, "the triangles have an area of {sum}, the polygon {area}");
    let crossing: Vec<&String> = source.dropped.iter().filter(|note| note.contains("cross")).collect();
    assert!(crossing.is_empty(), "{crossing:?}");
    area
}

/// All that must not matter: where the outline begins, which way it goes round, the plane, the place, the size.
fn covered_anyhow(flat: &[[f64; 2]], area: f64) {
    let planes: [[Point; 3]; 4] = [
        [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        // The corners of these are exact numbers, too, and the axes no unit vectors.
        [[7.0, -3.0, 0.5], [1.0, 2.0, -1.0], [-0.5, 1.0, 3.0]],
        [[1048576.0, -4194304.0, 524288.0], [0.0, 0.25, 1.0], [1.0, 0.25, 0.0]],
        // Rounded: the corners are near a plane.
        [[0.1, 0.7, -0.3], [0.36, 0.48, -0.8], [-0.8, 0.6, 0.0]],
    ];
    let steps = (flat.len() / 7).max(1);
    for [origin, u, v] in planes {
        let scale = dot(cross(u, v), cross(u, v)).sqrt();
        let mut outline: Vec<Point> =
            flat.iter().map(|&[x, y]| std::array::from_fn(|k| origin[k] + x * u[k] + y * v[k])).collect();
        for start in (0..flat.len()).step_by(steps) {
            outline.rotate_left(start);
            let there = covered(&outline);
            assert!((there - area * scale).abs() <= 1e-9 * there, "{there}, not {}", area * scale);
            outline.reverse();
            covered(&outline);
        }
    }
    for size in [2f64.powi(-500), 2f64.powi(500)] {
        let outline: Vec<Point> = flat.iter().map(|&[x, y]| [x * size, y * size, 3.0 * size]).collect();
        let triangles = read(&obj(&outline)).mesh.triangles;
        let small: Vec<Point> = flat.iter().map(|&[x, y]| [x, y, 3.0]).collect();
        assert_eq!(triangles, read(&obj(&small)).mesh.triangles);
    }
}

/// A star with so many corners, every second one of them nearer to the middle; it does not see itself from a corner.
fn star(corners: usize, inner: f64) -> Vec<[f64; 2]> {
    let step = std::f64::consts::TAU / corners as f64;
    let corner = |k: usize| (k as f64 * step, if k.is_multiple_of(2) { 10.0 } else { inner });
    (0..corners).map(corner).map(|(angle, r)| [r * angle.cos(), r * angle.sin()]).collect()
}

/// So many teeth of width 1 and height 3, 1 apart, on a bar of height 1: of 4 a tooth and no more than 2 further corners.
fn comb(teeth: usize) -> Vec<[f64; 2]> {
    let length = 2.0 * teeth as f64 - 1.0;
    let mut outline = vec![[0.0, 0.0], [length, 0.0]];
    for tooth in (0..teeth).rev() {
        let x = 2.0 * tooth as f64;
        outline.extend([[x + 1.0, 4.0], [x, 4.0]]);
        if tooth > 0 {
            outline.extend([[x, 1.0], [x - 1.0, 1.0]]);
        }
    }
    outline
}

/// A corridor of width 1 that winds inwards, its outer wall and back along its inner one.
fn spiral(turns: usize) -> (Vec<[f64; 2]>, f64) {
    let (mut outer, mut inner, mut area) = (Vec::new(), Vec::new(), 0.0);
    let (mut x, mut y) = (0.0f64, 0.0f64);
    let sides = 4 * turns;
    for k in 0..=sides {
        let length = 2.0 * (sides - k) as f64 + 4.0;
        let (dx, dy) = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)][k % 4];
        outer.push([x, y]);
        // Left of both the edge before and the edge behind.
        let before =
            if k == 0 { (0.0, 0.0) } else { [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)][(k + 3) % 4] };
        inner.push([x - dy - before.1, y + dx + before.0]);
        (x, y) = (x + length * dx, y + length * dy);
    }
    outer.push([x, y]);
    let (dx, dy) = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)][sides % 4];
    inner.push([x - dy, y + dx]);
    // A trapezium for every side.
    for k in 0..=sides {
        let length =
            |wall: &[[f64; 2]]| (wall[k + 1][0] - wall[k][0]).abs() + (wall[k + 1][1] - wall[k][1]).abs();
        area += (length(&outer) + length(&inner)) / 2.0;
    }
    outer.extend(inner.iter().rev());
    (outer, area)
}

#[test]
fn shapes_of_all_kinds() {
    covered_anyhow(&[[0.0, 0.0], [5.0, 0.0], [5.0, 1.0], [1.0, 1.0], [1.0, 4.0], [0.0, 4.0]], 8.0);
    covered_anyhow(&[[0.0, 0.0], [2.0, 1.0], [4.0, 0.0], [2.0, 8.0]], 14.0);
    let door =
        [[0.0, 0.0], [3.0, 0.0], [3.0, 2.0], [4.0, 2.0], [4.0, 0.0], [10.0, 0.0], [10.0, 5.0], [0.0, 5.0]];
    covered_anyhow(&door, 48.0);
    // 400 triangles from the middle.
    let angle = std::f64::consts::TAU / 400.0;
    covered_anyhow(&star(400, 1.0), 400.0 * 10.0 * angle.sin() / 2.0);
    let teeth = comb(150);
    assert_eq!(teeth.len(), 600);
    covered_anyhow(&teeth, 299.0 + 150.0 * 3.0);
    for turns in [1, 5, 40] {
        let (outline, area) = spiral(turns);
        covered_anyhow(&outline, area);
    }
}

#[test]
fn corners_in_line_and_corners_that_repeat() {
    // A square with a square hole and the way there twice: corners repeat, one edge is its own neighbour.
    let outer = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]];
    let hole = [[3.0, 3.0], [3.0, 7.0], [7.0, 7.0], [7.0, 3.0]];
    let keyhole = [&outer[..], &outer[..1], &hole, &hole[..1]].concat();
    covered_anyhow(&keyhole, 84.0);
    // Two holes, each at the end of a way of its own.
    let second = hole.map(|[x, y]| [x / 4.0 + 7.25, y / 4.0]);
    let two = [&keyhole[..], &outer[..1], &outer[1..2], &second[3..], &second, &outer[1..2]].concat();
    // From the first corner to the second and back to the hole beside it: the way runs along an edge.
    covered_anyhow(&two, 84.0 - 1.0);
    // Corners in the middle of edges, on all sides.
    let l = [[0.0, 0.0], [5.0, 0.0], [5.0, 1.0], [1.0, 1.0], [1.0, 4.0], [0.0, 4.0]];
    let split: Vec<[f64; 2]> = (0..l.len())
        .flat_map(|k| {
            let (a, b) = (l[k], l[(k + 1) % l.len()]);
            [0.0, 0.25, 0.5].map(|t| [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])])
        })
        .collect();
    covered_anyhow(&split, 8.0);
    // Every corner twice, and one of them three times.
    let twice: Vec<[f64; 2]> = l.iter().flat_map(|&p| [p, p]).chain([l[5]]).collect();
    covered_anyhow(&twice, 8.0);
    // Ways that end: out of the wall, into the room, and along the wall.
    let mut ends = l.to_vec();
    ends.splice(4..4, [[1.0, 3.0], [3.0, 3.0], [1.0, 3.0]]);
    ends.splice(2..2, [[5.0, 0.5], [2.0, 0.5], [5.0, 0.5], [5.0, 0.25], [5.0, 0.75]]);
    covered_anyhow(&ends, 8.0);
    // The tip of a wall in the room is met by triangles, one outside is not: of the 5 corners inside a square 4 triangles
    // are made, of 4 two.
    for (tip, count) in [(2.0, 4), (6.0, 2)] {
        let wall = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [tip, tip - 0.5], [4.0, 4.0], [0.0, 4.0]];
        covered_anyhow(&wall, 16.0);
        assert_eq!(with_area(&wall), count);
    }
    // A ring whose ends touch along a wall: nothing is between them.
    let ring = [
        [0.0, 0.0],
        [9.0, 0.0],
        [9.0, 9.0],
        [0.0, 9.0],
        [0.0, 5.0],
        [3.0, 5.0],
        [3.0, 6.0],
        [6.0, 6.0],
        [6.0, 3.0],
        [3.0, 3.0],
        [3.0, 5.0],
        [2.0, 5.0],
        [1.0, 5.0],
        [0.0, 5.0],
    ];
    covered_anyhow(&ring, 81.0 - 9.0);
    // Two squares that touch in a corner.
    let eight =
        [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [5.0, 2.0], [5.0, 5.0], [2.0, 5.0], [2.0, 2.0], [0.0, 2.0]];
    covered_anyhow(&eight, 13.0);
}

/// How many triangles of a polygon have an area.
fn with_area(flat: &[[f64; 2]]) -> usize {
    let outline: Vec<Point> = flat.iter().map(|&[x, y]| [x, y, 0.0]).collect();
    let triangles = read(&obj(&outline)).mesh.triangles;
    triangles.iter().filter(|t| newell(&t.map(|v| outline[v as usize]))[2] != 0.0).count()
}

#[test]
fn a_keyhole_has_no_triangle_without_an_area() {
    let outline = [
        [0.0, 0.0],
        [10.0, 0.0],
        [10.0, 10.0],
        [0.0, 10.0],
        [0.0, 0.0],
        [3.0, 3.0],
        [3.0, 7.0],
        [7.0, 7.0],
        [7.0, 3.0],
        [3.0, 3.0],
    ];
    assert_eq!(with_area(&outline), 8);
}

#[test]
fn convex_polygons_are_fans() {
    for corners in [4u32, 5, 9, 1000] {
        let circle = |k: u32| (f64::from(k) * std::f64::consts::TAU / f64::from(corners)).sin_cos();
        for tilt in [0.0, 0.4, 3.0] {
            let outline: Vec<Point> =
                (0..corners).map(circle).map(|(y, x)| [x - 2.0, y, x * tilt - y + 100.0]).collect();
            let fan: Vec<[u32; 3]> = (1..corners - 1).map(|k| [0, k, k + 1]).collect();
            assert_eq!(read(&obj(&outline)).mesh.triangles, fan);
        }
    }
}

#[test]
fn a_quad_that_is_not_flat_is_a_fan() {
    // Corners up and down in turn, by more than its sides are long; seen from above it is convex.
    for height in [1e-9, 0.1, 3.0] {
        let outline = [[0.0, 0.0, height], [1.0, 0.1, -height], [1.2, 1.0, height], [-0.1, 0.9, -height]];
        assert_eq!(read(&obj(&outline)).mesh.triangles, [[0, 1, 2], [0, 2, 3]], "{height}");
    }
}

#[test]
fn all_formats_cut_alike() {
    let l: Vec<Point> = [[1.0, 1.0], [1.0, 4.0], [0.0, 4.0], [0.0, 0.0], [5.0, 0.0], [5.0, 1.0]]
        .map(|[x, y]| [x, 2.0 - y, y])
        .to_vec();
    // From corner 3 it is not seen whole.
    let turned: Vec<Point> = l[2..].iter().chain(&l[..2]).copied().collect();
    let expected = read(&obj(&turned)).mesh;
    let rows = |head: &str| turned.iter().map(|[x, y, z]| format!("{head}{x} {y} {z}\n")).collect::<String>();
    let vertex = "element vertex 6\nproperty float x\nproperty float y\nproperty float z\n";
    let face = "element face 1\nproperty list uchar int vertex_indices\n";
    let ply = "ply\nformat ascii 1.0\n";
    for text in [
        format!("{ply}{vertex}{face}end_header\n{}6 0 1 2 3 4 5\n", rows("")),
        // The face is there before its vertices are.
        format!("{ply}{face}{vertex}end_header\n6 0 1 2 3 4 5\n{}", rows("")),
        format!("OFF\n6 1 0\n{}6 0 1 2 3 4 5\n", rows("")),
        format!("solid\nfacet normal 0 0 1\nouter loop\n{}endloop\nendfacet\nendsolid\n", rows("vertex ")),
        format!("f 1 2 3 4 5 6\n{}", rows("v ")),
    ] {
        assert_eq!(read(&text).mesh, expected, "{text}");
    }
    assert_ne!(expected.triangles, [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]]);
    covered(&turned);
}

#[test]
fn a_hundred_thousand_corners() {
    let flat = |outline: Vec<[f64; 2]>| -> Vec<Point> { outline.iter().map(|&[x, y]| [x, y, 0.0]).collect() };
    covered(&flat(star(100_000, 1.0)));
    assert_eq!(covered(&flat(comb(25_000))), 49_999.0 + 75_000.0);
    let (outline, area) = spiral(12_500);
    assert_eq!(outline.len(), 100_004);
    assert!((covered(&flat(outline)) / area - 1.0).abs() < 1e-9);
}

#[test]
fn a_tangle_of_twenty_thousand_corners_ends() {
    // The multiples of the golden ratio: every edge crosses thousands of others.
    let golden = |k: usize, by: f64| (k as f64 * by).fract();
    let outline: Vec<Point> =
        (0..20_000).map(|k| [golden(k, 0.618_033_988_75), golden(k, 0.754_877_666_25), 0.0]).collect();
    let source = read(&obj(&outline));
    assert_eq!(source.mesh.triangles.len(), outline.len() - 2);
    let note =
        "which side is inside in polygons that cross themselves (1, the first is face 1, counted from 1)";
    assert_eq!(source.dropped, [note, "polygons (1, cut into triangles)"]);
}

/// Turns a closed way through points until it does not cross itself (Flood 1956): every turn makes it shorter, so that this ends.
fn untangled(mut points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    let n = points.len();
    let side = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| {
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0.0
    };
    let cross = |a, b, c, d| side(a, b, c) != side(a, b, d) && side(c, d, a) != side(c, d, b);
    loop {
        let pairs = (0..n).flat_map(|i| (i + 2..n).map(move |j| (i, j))).filter(|&(i, j)| (j + 1) % n != i);
        let crossing =
            pairs.clone().find(|&(i, j)| cross(points[i], points[i + 1], points[j], points[(j + 1) % n]));
        let Some((i, j)) = crossing else { return points };
        points[i + 1..=j].reverse();
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn any_polygon_that_does_not_cross_itself(
        points in prop::collection::vec(prop::array::uniform2(-100.0f64..100.0), 4..40),
        origin in prop::array::uniform3(-1e6f64..1e6),
        [u, v] in prop::array::uniform2(prop::array::uniform3(-1.0f64..1.0)),
    ) {
        let flat = untangled(points);
        covered(&flat.iter().map(|&[x, y]| [x, y, 0.0]).collect::<Vec<Point>>());
        // In any plane: rounded, so that the corners lie near it.
        prop_assume!(dot(cross(u, v), cross(u, v)) > 0.01);
        let there = |[x, y]: [f64; 2]| -> Point { std::array::from_fn(|k| x * u[k] + y * v[k]) };
        covered(&flat.iter().map(|&p| there(p)).collect::<Vec<Point>>());
        let far: Vec<Point> =
            flat.iter().map(|&p| there(p)).map(|p| std::array::from_fn(|k| origin[k] + p[k])).collect();
        let source = read(&obj(&far));
        prop_assert_eq!(source.mesh.triangles.len(), flat.len() - 2);
    }

    /// Each point is in as many triangles as it is in the polygon: none or one.
    #[test]
    fn no_point_is_covered_twice(
        points in prop::collection::vec(prop::array::uniform2(0.0f64..16.0), 4..24),
        probes in prop::collection::vec(prop::array::uniform2(0.0f64..16.0), 50),
    ) {
        let flat = untangled(points);
        let outline: Vec<Point> = flat.iter().map(|&[x, y]| [x, y, 0.0]).collect();
        let triangles = read(&obj(&outline)).mesh.triangles;
        for probe in probes {
            // How often a ray to the right crosses the outline.
            let crosses = |outline: &[[f64; 2]]| {
                let next = outline.iter().cycle().skip(1);
                outline.iter().zip(next).filter(|&(a, b)| {
                    let t = (probe[1] - a[1]) / (b[1] - a[1]);
                    (a[1] > probe[1]) != (b[1] > probe[1]) && a[0] + t * (b[0] - a[0]) > probe[0]
                }).count()
            };
            let inside = crosses(&flat) % 2;
            let covering = triangles.iter().filter(|t| crosses(&t.map(|v| flat[v as usize])) % 2 == 1).count();
            prop_assert_eq!(covering, inside, "at {:?}", probe);
        }
    }
}
