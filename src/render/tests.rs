//! Pictures whose pixels can be told beforehand.

use super::*;
use crate::mesh::attributes::{NO_VALUE, Semantic, Values};
use crate::mesh::paint::{Image, Material};
use crate::mesh::random::SplitMix64;
use crate::mesh::{Attribute, shapes};

fn front() -> View {
    View { width: 100, height: 100, ..View::default() }
}

const BACKGROUND: [u8; 4] = [245, 245, 243, 255];

/// The square [0, 1]^2 at height `z`, facing the camera.
fn square(z: f64) -> IndexedMesh {
    let positions = vec![[0.0, 0.0, z], [1.0, 0.0, z], [1.0, 1.0, z], [0.0, 1.0, z]];
    IndexedMesh::new(positions, vec![[0, 1, 2], [0, 2, 3]])
}

fn background(picture: &Picture) -> usize {
    picture.pixels.iter().filter(|&&p| p == BACKGROUND).count()
}

fn at(picture: &Picture, x: u32, y: u32) -> [u8; 4] {
    picture.pixels[(y * picture.width + x) as usize]
}

#[test]
fn a_square_covers_the_picture_but_its_margins() {
    let picture = render(&[&square(0.0)], &front()).unwrap();
    assert_eq!(picture.pixels.len(), 100 * 100);
    assert_eq!(background(&picture), 100 * 100 - 90 * 90);
    assert_eq!(at(&picture, 5, 5), at(&picture, 94, 94));
    assert_eq!(at(&picture, 4, 50), BACKGROUND);
}

/// Turned by 60 degrees a square is half as wide; its height still decides the scale.
#[test]
fn a_turned_square_is_narrower() {
    let picture = render(&[&square(0.0)], &View { turn_degrees: 60.0, ..front() }).unwrap();
    assert_eq!(background(&picture), 100 * 100 - 90 * 46);
    let tilted = render(&[&square(0.0)], &View { tilt_degrees: -60.0, ..front() }).unwrap();
    assert_eq!(background(&tilted), 100 * 100 - 90 * 46);
    assert!(at(&tilted, 50, 50) != at(&picture, 50, 50));
}

/// A slanted roof before a square or behind it, whichever of the two is drawn first.
#[test]
fn the_nearer_triangle_hides_the_farther() {
    let flat = at(&render(&[&square(0.0)], &front()).unwrap(), 50, 50);
    for (z, square_wins) in [(1.0, true), (-1.0, false)] {
        let mut mesh = square(z);
        mesh.positions.extend([[0.0, 0.0, 0.3], [1.0, 0.0, -0.3], [1.0, 1.0, -0.3], [0.0, 1.0, 0.3]]);
        mesh.triangles.extend([[4, 5, 6], [4, 6, 7]]);
        for _ in 0..2 {
            let picture = render(&[&mesh], &front()).unwrap();
            assert_eq!(at(&picture, 30, 30) == flat, square_wins);
            assert_eq!(background(&picture), 100 * 100 - 90 * 90);
            mesh.triangles.reverse();
        }
    }
}

#[test]
fn both_sides_are_lit_alike() {
    let mut back = square(0.0);
    back.triangles.iter_mut().for_each(|t| t.reverse());
    assert!(render(&[&back], &front()).unwrap() == render(&[&square(0.0)], &front()).unwrap());
}

#[test]
fn meshes_stand_side_by_side_at_one_scale() {
    let mut small = square(0.0);
    small.positions.iter_mut().for_each(|p| *p = p.map(|x| 0.25 + 0.5 * x));
    let strip = View { width: 300, ..front() };
    let picture = render(&[&square(0.0), &small, &IndexedMesh::default()], &strip).unwrap();
    assert_eq!(background(&picture), 300 * 100 - 90 * 90 - 46 * 46);
    assert_eq!(at(&picture, 50, 50), at(&picture, 150, 50));
    assert_eq!(at(&picture, 250, 50), BACKGROUND);
}

#[test]
fn edges_are_drawn_where_triangles_are_large() {
    let drawn = View { wireframe: true, ..front() };
    let count = |picture: Picture| {
        let plain = at(&picture, 30, 50);
        picture.pixels.iter().filter(|&&p| p != plain && p != BACKGROUND).count()
    };
    let lines = count(render(&[&square(0.0)], &drawn).unwrap());
    assert!((4 * 89..6 * 90 + 3 * 90).contains(&lines), "{lines}");
    assert_eq!(count(render(&[&square(0.0)], &front()).unwrap()), 0);
}

#[test]
fn nothing_gives_the_background() {
    for meshes in [vec![], vec![&IndexedMesh::default()], vec![&IndexedMesh::new(vec![[1.0; 3]], vec![])]] {
        assert_eq!(background(&render(&meshes, &front()).unwrap()), 100 * 100);
    }
}

#[test]
fn sizes_and_angles_are_checked() {
    for view in [
        View { width: 0, ..front() },
        View { height: View::MAX_SIDE + 1, ..front() },
        View { turn_degrees: f64::NAN, ..front() },
        View { tilt_degrees: f64::INFINITY, ..front() },
    ] {
        assert!(matches!(render(&[&square(0.0)], &view), Err(Error::Parameter(_))));
    }
    let narrow = View { width: 2, ..front() };
    assert_eq!(render(&[&square(0.0); 5], &narrow).unwrap().pixels.len(), 200);
}

#[test]
fn the_scale_of_the_coordinates_does_not_show() {
    let view = View { turn_degrees: 20.0, tilt_degrees: 30.0, wireframe: true, ..front() };
    let mesh = shapes::sphere(2);
    let expected = render(&[&mesh], &view).unwrap();
    for exponent in [-1000, -100, 100, 1020] {
        let mut scaled = mesh.clone();
        // A power of two, so that no coordinate is rounded.
        scaled.positions.iter_mut().for_each(|p| *p = p.map(|x| x * 2.0_f64.powi(exponent)));
        assert!(render(&[&scaled], &view).unwrap() == expected, "2^{exponent}");
    }
}

#[test]
fn wild_coordinates_do_no_harm() {
    let wild = [0.0, -0.0, 5e-324, 1e-30, 1.0, 1e30, f64::MAX, f64::MIN, f64::INFINITY, f64::NAN];
    let mut random = SplitMix64::new(11);
    for _ in 0..300 {
        let mut one = || wild[random.below(wild.len() as u32) as usize];
        let positions = (0..6).map(|_| [one(), one(), one()]).collect();
        let mesh = IndexedMesh::new(positions, vec![[0, 1, 2], [3, 4, 5], [0, 2, 5], [1, 1, 1]]);
        render(&[&mesh, &square(0.0)], &View { turn_degrees: 30.0, wireframe: true, ..front() }).unwrap();
    }
    let point = IndexedMesh::new(vec![[7.0; 3]], vec![[0; 3]; 9]);
    assert_eq!(background(&render(&[&point], &front()).unwrap()), 100 * 100);
}

#[test]
fn a_png_holds_the_picture() {
    let opaque = View { width: 37, height: 21, tilt_degrees: 10.0, ..View::default() };
    let transparent = View { background: None, ..opaque };
    for (view, kind, channels) in [(opaque, png::ColorType::Rgb, 3), (transparent, png::ColorType::Rgba, 4)] {
        let picture = render(&[&shapes::torus(8, 12)], &view).unwrap();
        let mut file = Vec::new();
        write_png(&picture, &mut file).unwrap();
        let mut reader = png::Decoder::new(io::Cursor::new(file)).read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut bytes).unwrap();
        assert_eq!((info.width, info.height, info.color_type), (37, 21, kind));
        let expected: Vec<u8> = picture.pixels.iter().flat_map(|p| p[..channels].to_vec()).collect();
        assert_eq!(bytes, expected);
    }
}

/// A flag in the plane x = 0 that is longer along z than along y: whatever is upwards decides how it lies.
#[test]
fn the_upward_axis_is_upwards() {
    let box_of = |size: [f64; 3]| {
        let mut mesh = shapes::sphere(1);
        mesh.positions.iter_mut().for_each(|p| (0..3).for_each(|k| p[k] *= size[k]));
        mesh
    };
    // Widths and heights of the ellipsoid's outline in pixels.
    let outline = |up, size| {
        let picture = render(&[&box_of(size)], &View { up, ..front() }).unwrap();
        let covered = |x: u32, y: u32| at(&picture, x, y) != BACKGROUND;
        let columns = (0..100).filter(|&x| (0..100).any(|y| covered(x, y))).count();
        let rows = (0..100).filter(|&y| (0..100).any(|x| covered(x, y))).count();
        (columns, rows)
    };
    let near = |(a, b): (usize, usize), (c, d): (usize, usize)| a.abs_diff(c) <= 2 && b.abs_diff(d) <= 2;
    for (up, size) in [(Up::X, [3.0, 1.0, 0.5]), (Up::Y, [1.0, 3.0, 0.5]), (Up::Z, [1.0, 0.5, 3.0])] {
        assert!(near(outline(up, size), (30, 90)), "{up:?}: {:?}", outline(up, size));
    }
    // One triangle with its point towards +z and its base along x: upright seen with z up, from its front.
    let arrow = IndexedMesh::new(vec![[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.8, 0.0, 2.0]], vec![[0, 1, 2]]);
    let picture = render(&[&arrow], &View { up: Up::Z, ..front() }).unwrap();
    assert_ne!(at(&picture, 83, 10), BACKGROUND, "the point is above, at the right");
    assert_eq!(at(&picture, 17, 10), BACKGROUND);
}

/// Parts of pixels at the outline are parts of opacity, and the colour there is that of the mesh alone.
#[test]
fn a_transparent_background_leaves_the_colour_of_the_mesh() {
    let view = View { background: None, turn_degrees: 58.7, ..front() };
    let picture = render(&[&square(0.0)], &view).unwrap();
    assert_eq!(at(&picture, 0, 0), [0; 4]);
    let middle = at(&picture, 50, 50);
    assert_eq!(middle[3], 255);
    let seen: Vec<_> = picture.pixels.iter().filter(|p| p[3] > 0).collect();
    assert!(seen.iter().all(|p| p[..3] == middle[..3]));
    assert!(seen.iter().any(|p| p[3] < 255), "no edge falls between pixels");
    let black = View { background: Some([0; 3]), ..view };
    assert_eq!(at(&render(&[&square(0.0)], &black).unwrap(), 0, 0), [0, 0, 0, 255]);
}

#[test]
fn what_has_no_area_on_screen_is_not_drawn() {
    let mut mesh = square(0.0);
    mesh.positions.extend([[0.0, 0.0, 1.0], [f64::NAN, 0.0, 0.0]]);
    // Seen from its edge, degenerate, not finite.
    mesh.triangles.extend([[0, 1, 4], [1, 1, 2], [1, 2, 5]]);
    assert_eq!(render(&[&mesh, &square(0.0)], &front()).unwrap().drawn, [2, 2]);
    let edge_on = View { turn_degrees: 90.0, ..front() };
    let picture = render(&[&square(0.0)], &edge_on).unwrap();
    assert_eq!((background(&picture), &picture.drawn[..]), (100 * 100, &[0][..]));
}

/// Neighbouring pixels differ less where colours run; the sharp edges of a cube stay.
#[test]
fn smooth_shading_hides_shallow_edges_alone() {
    let steps = |mesh: &IndexedMesh, smooth: bool| {
        let picture =
            render(&[mesh], &View { smooth, tilt_degrees: 30.0, turn_degrees: 30.0, ..front() }).unwrap();
        let inner = |p: [u8; 4]| p != BACKGROUND;
        let row: Vec<[u8; 4]> = (20..80).map(|x| at(&picture, x, 50)).filter(|&p| inner(p)).collect();
        row.windows(2).map(|pair| pair[0][0].abs_diff(pair[1][0])).max().unwrap()
    };
    let sphere = shapes::sphere(3);
    assert!(2 * steps(&sphere, true) < steps(&sphere, false));
    let (v, mut cube) = (|k: u32| [k & 1, k >> 1 & 1, k >> 2].map(f64::from), IndexedMesh::default());
    cube.positions = (0..8).map(v).collect();
    for [a, b, c, d] in [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]] {
        cube.triangles.extend([[a, b, c], [a, c, d]]);
    }
    assert_eq!(steps(&cube, true), steps(&cube, false));
}

/// A picture of many bands is the same however they fall to threads, and no seam shows between them.
#[test]
fn bands_do_not_show() {
    let tall = View { width: 40, height: 1000, wireframe: true, ..View::default() };
    let mut mesh = square(0.0);
    mesh.positions.iter_mut().for_each(|p| p[1] *= 25.0);
    let picture = render(&[&mesh], &tall).unwrap();
    assert_eq!(picture, render(&[&mesh], &tall).unwrap());
    assert_eq!(background(&picture), 40 * 1000 - 36 * 900);
}

/// Every row is told of once, whoever draws it.
#[test]
fn progress_comes_to_an_end() {
    let view = View { width: 9, height: 1000, ..View::default() };
    let heard = Mutex::new(Vec::new());
    render_with(&[(&square(0.0)).into()], &view, &|done, total| heard.lock().unwrap().push((done, total)))
        .unwrap();
    let mut heard = heard.into_inner().unwrap();
    heard.sort_unstable();
    assert!(heard.windows(2).all(|pair| pair[0].0 < pair[1].0));
    assert_eq!(heard.last(), Some(&(1000, 1000)));
}

/// The square, with texture coordinates from (0, 0) at its upper left corner to (1, 1).
fn square_with_uv() -> IndexedMesh {
    let mut mesh = square(0.0);
    let uv = Values::F32(vec![0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
    mesh.attributes.push(Attribute::new(Semantic::TexCoord, 2, uv, vec![0, 1, 2, 0, 2, 3]));
    mesh
}

const RED: [u8; 4] = [255, 0, 0, 255];
const GREEN: [u8; 4] = [0, 255, 0, 255];
const BLUE: [u8; 4] = [0, 0, 255, 255];
const CLEAR: [u8; 4] = [255, 255, 255, 0];

/// Red and green above, blue and nothing below.
fn flag(material: Material) -> Paint {
    let image = Image { width: 2, height: 2, pixels: vec![RED, GREEN, BLUE, CLEAR] };
    let materials = vec![Material { image: Some(0), ..material }];
    Paint { materials, of_parts: vec![Some(0)], images: vec![image], is_linear: true, ..Paint::default() }
}

fn painted(mesh: &IndexedMesh, paint: &Paint, view: &View) -> Picture {
    render_with(&[Model { mesh, paint: Some(paint) }], view, &|_, _| ()).unwrap()
}

/// Which of its three colours is the strongest, and whether the others are but what glints.
fn hue(picture: &Picture, x: u32, y: u32) -> Option<usize> {
    let rgb = at(picture, x, y);
    let most = (0..3).max_by_key(|&k| rgb[k])?;
    (0..3).all(|k| k == most || rgb[k] < rgb[most] / 2).then_some(most)
}

#[test]
fn a_picture_lies_as_its_coordinates_say() {
    let mesh = square_with_uv();
    let picture = painted(&mesh, &flag(Material::default()), &front());
    assert_eq!(
        [hue(&picture, 27, 27), hue(&picture, 72, 27), hue(&picture, 27, 72)],
        [Some(0), Some(1), Some(2)]
    );
    // Half a picture to the right, and twice as many downwards.
    let transform = [[1.0, 0.0, 0.5], [0.0, 2.0, 0.0]];
    let moved = painted(&mesh, &flag(Material { transform, ..Material::default() }), &front());
    let hues = [(27, 16), (72, 16), (72, 38), (27, 61), (72, 61), (72, 83)].map(|(x, y)| hue(&moved, x, y));
    assert_eq!(hues, [Some(1), Some(0), Some(2), Some(1), Some(0), Some(2)]);
    // Another set has no such coordinates: the material is all there is.
    let plain = painted(&mesh, &flag(Material { set: 1, ..Material::default() }), &front());
    assert_eq!((hue(&plain, 27, 27), at(&plain, 27, 27)), (None, at(&plain, 72, 72)));
}

#[test]
fn what_is_below_the_cutoff_is_not_seen() {
    let mesh = square_with_uv();
    let cut = |cutoff| painted(&mesh, &flag(Material { cutoff, ..Material::default() }), &front());
    assert_eq!(background(&cut(0.0)), 100 * 100 - 90 * 90);
    let picture = cut(0.5);
    assert_eq!((at(&picture, 80, 80), hue(&picture, 27, 72)), (BACKGROUND, Some(2)));
    // What is behind shows there.
    let behind = square(-1.0);
    let mut both = square_with_uv();
    both.positions.extend(&behind.positions);
    both.triangles.extend(behind.triangles.iter().map(|t| t.map(|v| v + 4)));
    both.attributes[0].corners.extend([NO_VALUE; 6]);
    both.attributes.push(Attribute::parts(&[0, 0, 1, 1]));
    let paint = flag(Material { cutoff: 0.5, ..Material::default() });
    assert_eq!(
        at(&painted(&both, &paint, &front()), 80, 80),
        at(&render(&[&behind], &front()).unwrap(), 80, 80)
    );
}

/// Colours at corners run from one to the other; a half in sRGB is less light than a half.
#[test]
fn colours_at_corners_are_mixed() {
    let mut mesh = square(0.0);
    let colours = Values::U8(vec![255, 0, 0, 0, 0, 255]);
    mesh.attributes.push(Attribute::new(Semantic::Color, 3, colours, vec![0, 1, 1, 0, 1, 0]));
    let picture = painted(&mesh, &Paint::default(), &front());
    assert_eq!(
        [hue(&picture, 8, 50), hue(&picture, 92, 50), hue(&picture, 50, 50)],
        [Some(0), Some(2), None]
    );
    let grey = |is_linear| {
        let mut mesh = square(0.0);
        mesh.attributes.push(Attribute::new(Semantic::Color, 1, Values::F32(vec![0.5]), vec![0; 6]));
        at(&painted(&mesh, &Paint { is_linear, ..Paint::default() }, &front()), 50, 50)[0]
    };
    assert!(grey(true) > grey(false) + 20);
}

/// Normals of the mesh decide how light it is, on whichever side; they turn with it.
#[test]
fn normals_of_the_mesh_are_lit() {
    let with = |normals: Vec<f32>, turn_degrees: f64| {
        let mut mesh = square(0.0);
        mesh.attributes.push(Attribute::new(Semantic::Normal, 3, Values::F32(normals), vec![0; 6]));
        at(&painted(&mesh, &Paint::default(), &View { turn_degrees, ..front() }), 50, 50)
    };
    let near = |a: [u8; 4], b: [u8; 4]| (0..4).all(|k| a[k].abs_diff(b[k]) <= 1);
    let shape =
        |turn_degrees| at(&render(&[&square(0.0)], &View { turn_degrees, ..front() }).unwrap(), 50, 50);
    for turn in [0.0, 40.0] {
        assert!(
            near(with(vec![0.0, 0.0, 3.0], turn), shape(turn))
                && near(with(vec![0.0, 0.0, -1.0], turn), shape(turn))
        );
    }
    assert!(!near(with(vec![-0.6, 0.6, 1.0], 0.0), shape(0.0)));
    // No direction, and none that is a number.
    assert!(near(with(vec![0.0; 3], 0.0), shape(0.0)) && near(with(vec![f32::NAN; 3], 0.0), shape(0.0)));
}

/// Whatever a file has of parts, places and pictures, something is drawn.
#[test]
fn wild_paint_does_no_harm() {
    let wild = [0.0, -1.0, 1e-30, 0.5, 3.0, 1e30, f32::INFINITY, f32::NAN];
    let mut random = SplitMix64::new(5);
    for _ in 0..100 {
        let mut one = || wild[random.below(wild.len() as u32) as usize];
        let mut mesh = square_with_uv();
        mesh.attributes[0].values = Values::F32((0..8).map(|_| one()).collect());
        mesh.attributes.push(Attribute::new(
            Semantic::Color,
            4,
            Values::F32([0; 4].map(|_| one()).to_vec()),
            vec![0; 6],
        ));
        let (transform, cutoff) = ([[one(), one(), one()], [one(), one(), one()]], one());
        let mut paint =
            flag(Material { colour: [0; 4].map(|_| one()), transform, cutoff, ..Material::default() });
        mesh.attributes.push(Attribute::parts(&[random.below(3), u32::MAX]));
        paint.of_parts = vec![Some(7), None, Some(0)];
        painted(&mesh, &paint, &View { smooth: true, wireframe: true, ..front() });
    }
}
