//! Pictures of meshes: a small software rasteriser with a z-buffer, and PNG.

use std::io::{self, Write};

use glam::{DMat3, DVec2, DVec3, Vec3};

use crate::error::{Error, Result};
use crate::mesh::IndexedMesh;

/// What a picture shows and from where. The camera looks along -z with y up, from infinitely far away.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Width of the whole picture in pixels, 1 to [`View::MAX_SIDE`].
    pub width: u32,
    /// Height of the picture in pixels, 1 to [`View::MAX_SIDE`].
    pub height: u32,
    /// Turns the meshes about their vertical axis, in degrees; positive brings their left side to the front.
    pub turn_degrees: f64,
    /// Tips the meshes towards the camera, in degrees; positive shows them from above.
    pub tilt_degrees: f64,
    /// Whether edges are drawn; they fade where triangles are a few pixels small.
    pub wireframe: bool,
}

impl View {
    /// Most pixels a side.
    pub const MAX_SIDE: u32 = 8192;
}

/// An image in sRGB, row by row from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Pixels a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width * height` colours: red, green, blue.
    pub pixels: Vec<[u8; 3]>,
}

/// Draws meshes side by side, from left to right, all at one scale and seen from the same place: the one frame that
/// holds them all. Triangles are shaded flat and from both sides; those with a coordinate that is not finite are left out.
///
/// # Errors
/// [`Error::Parameter`] where a side of the picture has no pixel or too many, or an angle is not finite.
pub fn render(meshes: &[&IndexedMesh], view: &View) -> Result<Picture> {
    let sides = 1..=View::MAX_SIDE;
    if !sides.contains(&view.width) || !sides.contains(&view.height) {
        return Err(Error::Parameter(format!("a picture has 1 to {} pixels a side", View::MAX_SIDE)));
    }
    if !view.turn_degrees.is_finite() || !view.tilt_degrees.is_finite() {
        return Err(Error::Parameter("a picture needs finite angles".into()));
    }
    let (width, height) = (view.width as usize, view.height as usize);
    let places = place(meshes, view);
    let edge = |i: usize| i * width / meshes.len();
    let narrowest = (0..meshes.len()).map(|i| edge(i + 1) - edge(i)).min().unwrap_or(width);
    let seen = meshes.iter().zip(&places).flat_map(|(mesh, places)| used(mesh, places));
    let frame = Frame::around(seen, narrowest, height);
    let mut pixels = vec![to_srgb(BACKGROUND); width * height];
    for (i, (mesh, mut places)) in meshes.iter().zip(places).enumerate() {
        let (left, right) = (edge(i), edge(i + 1));
        for p in &mut places {
            *p = frame.project(*p, right - left, height);
        }
        for top in (0..height).step_by(BAND) {
            let bottom = height.min(top + BAND);
            let mut band = Band::new(right - left, top, bottom - top);
            for t in &mesh.triangles {
                band.draw(t.map(|v| places[v as usize]), view.wireframe);
            }
            for y in top..bottom {
                for x in left..right {
                    pixels[y * width + x] = to_srgb(band.average(x - left, y - top));
                }
            }
        }
    }
    Ok(Picture { width: view.width, height: view.height, pixels })
}

/// Writes a picture as PNG, 8 bits a channel, without transparency.
///
/// # Errors
/// Those of `out`.
pub fn write_png(picture: &Picture, out: &mut impl Write) -> io::Result<()> {
    let mut encoder = png::Encoder::new(out, picture.width, picture.height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(picture.pixels.as_flattened())?;
    Ok(writer.finish()?)
}

/// The vertices of each mesh as the camera has them: in a common cube of side 2 about the origin, turned and tilted.
/// Coordinates are halved first, so that no difference can overflow.
fn place(meshes: &[&IndexedMesh], view: &View) -> Vec<Vec<DVec3>> {
    let halved = |p: &[f64; 3]| DVec3::from(*p) * 0.5;
    let mut places: Vec<Vec<DVec3>> =
        meshes.iter().map(|mesh| mesh.positions.iter().map(halved).collect()).collect();
    let (min, max) = bounds(meshes.iter().zip(&places).flat_map(|(mesh, places)| used(mesh, places)));
    let (centre, half) = ((min + max) * 0.5, (max - min).max_element() * 0.5);
    let turn = DMat3::from_rotation_x(view.tilt_degrees.to_radians())
        * DMat3::from_rotation_y(view.turn_degrees.to_radians());
    for p in places.iter_mut().flatten() {
        *p = turn * if half > 0.0 { (*p - centre) / half } else { *p - centre };
    }
    places
}

/// The finite places of the vertices that triangles use.
fn used<'a>(mesh: &'a IndexedMesh, places: &'a [DVec3]) -> impl Iterator<Item = DVec3> + 'a {
    mesh.triangles.iter().flatten().map(|&v| places[v as usize]).filter(|p| p.is_finite())
}

/// Where the camera points, and how many samples a unit has.
struct Frame {
    centre: DVec2,
    scale: f64,
}

impl Frame {
    /// The frame that fits `points` into a pane of the given pixels, with a margin.
    fn around(points: impl Iterator<Item = DVec3>, width: usize, height: usize) -> Self {
        let (min, max) = bounds(points);
        let (centre, extent) = ((min + max).truncate() * 0.5, (max - min).truncate());
        let room = DVec2::new(width as f64, height as f64) * SIDE as f64 * (1.0 - 2.0 * MARGIN);
        let scale = (room / extent.max(DVec2::splat(1e-9))).min_element();
        if scale.is_finite() { Self { centre, scale } } else { Self { centre: DVec2::ZERO, scale: 1.0 } }
    }

    /// A point in samples from the top left corner of the pane, y down; z towards the camera.
    fn project(&self, p: DVec3, width: usize, height: usize) -> DVec3 {
        let middle = DVec2::new(width as f64, height as f64) * SIDE as f64 * 0.5;
        let offset = (p.truncate() - self.centre) * self.scale;
        DVec3::new(middle.x + offset.x, middle.y - offset.y, p.z * self.scale)
    }
}

/// Some rows of a pane: depth and linear colour of `SIDE` x `SIDE` samples a pixel. All but the colours is in samples.
struct Band {
    top: usize,
    width: usize,
    height: usize,
    depths: Vec<f32>,
    colours: Vec<Vec3>,
}

impl Band {
    /// An empty band of `height` pixel rows from the row `top` on.
    fn new(width: usize, top: usize, height: usize) -> Self {
        let (width, top, height) = (width * SIDE, top * SIDE, height * SIDE);
        let count = width * height;
        Self { top, width, height, depths: vec![f32::NEG_INFINITY; count], colours: vec![BACKGROUND; count] }
    }

    /// Draws a triangle, row by row, between the places where its edges cross the row.
    fn draw(&mut self, [a, b, c]: [DVec3; 3], wireframe: bool) {
        let within = |y: f64| (y - self.top as f64).clamp(0.0, self.height as f64);
        let rows = within(a.y.min(b.y).min(c.y)) as usize..within(a.y.max(b.y).max(c.y)).ceil() as usize;
        if rows.is_empty() {
            return;
        }
        let normal = (b - a).cross(c - a);
        // The z of the normal is twice the area on screen; beneath this no sample would be hit but by chance.
        if !normal.is_finite() || normal.z.abs() < 1e-9 {
            return;
        }
        let colour = shade(normal);
        // Barycentric coordinates are linear in x and y: `slope . (x, y) + constant`.
        let linear = |p: DVec3, q: DVec3| {
            let slope = DVec2::new(p.y - q.y, q.x - p.x) / normal.z;
            (slope, -slope.dot(p.truncate()))
        };
        let planes = [linear(b, c), linear(c, a), linear(a, b)];
        let heights = planes.map(|(slope, _)| slope.length().recip());
        let least_height = heights.into_iter().fold(f64::INFINITY, f64::min) / SIDE as f64;
        let ink = if wireframe { INK * (least_height / FULL_INK_HEIGHT).min(1.0) as f32 } else { 0.0 };

        for row in rows {
            let y = (self.top + row) as f64 + 0.5;
            let (mut low, mut high) = (0.0, self.width as f64);
            let at_start = planes.map(|(slope, constant)| slope.y * y + constant);
            for (start, (slope, _)) in at_start.into_iter().zip(planes) {
                let crossing = -(start + TOLERANCE) / slope.x;
                if slope.x > 0.0 {
                    low = crossing.max(low);
                } else if slope.x < 0.0 {
                    high = crossing.min(high);
                } else if start < -TOLERANCE {
                    high = low;
                }
            }
            let (first, end) = ((low - 0.5).ceil() as usize, (high + 0.5).floor() as usize);
            for column in first..end.min(self.width) {
                let x = column as f64 + 0.5;
                let weights: [f64; 3] = std::array::from_fn(|k| planes[k].0.x * x + at_start[k]);
                let depth = (weights[0] * a.z + weights[1] * b.z + weights[2] * c.z) as f32;
                let sample = row * self.width + column;
                if depth > self.depths[sample] {
                    let from_edge = (0..3).map(|k| weights[k] * heights[k]).fold(f64::INFINITY, f64::min);
                    let inked = (LINE * SIDE as f64 + 0.5 - from_edge).clamp(0.0, 1.0) as f32;
                    self.depths[sample] = depth;
                    self.colours[sample] = colour * (1.0 - ink * inked);
                }
            }
        }
    }

    /// The mean colour of a pixel's samples.
    fn average(&self, x: usize, y: usize) -> Vec3 {
        let rows = (y * SIDE..(y + 1) * SIDE).map(|row| &self.colours[row * self.width + x * SIDE..][..SIDE]);
        rows.flatten().sum::<Vec3>() / (SIDE * SIDE) as f32
    }
}

/// The colour of a facet by its normal on screen (y down): a warm key light from the upper left, a weak one from the
/// camera, a cool sky brighter than the ground. The side that faces the camera is lit, be it front or back.
fn shade(normal: DVec3) -> Vec3 {
    let normal = normal.normalize_or_zero();
    let normal = if normal.z < 0.0 { -normal } else { normal };
    let normal = DVec3::new(normal.x, -normal.y, normal.z).as_vec3();
    let key = KEY_LIGHT.normalize();
    let glint = normal.dot((key + Vec3::Z).normalize()).max(0.0).powi(24);
    let light = KEY_COLOUR * normal.dot(key).max(0.0)
        + Vec3::splat(HEADLIGHT * normal.z)
        + GROUND_COLOUR.lerp(SKY_COLOUR, 0.5 + 0.5 * normal.y);
    MATERIAL * light + KEY_COLOUR * (GLINT * glint)
}

fn bounds(points: impl Iterator<Item = DVec3>) -> (DVec3, DVec3) {
    points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), p| (min.min(p), max.max(p)))
}

/// From linear light to sRGB (IEC 61966-2-1).
fn to_srgb(colour: Vec3) -> [u8; 3] {
    let encode = |x: f32| if x <= 0.0031308 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
    colour.to_array().map(|x| (encode(x.clamp(0.0, 1.0)) * 255.0).round() as u8)
}

/// Pixel rows drawn at a time: bounds the memory.
const BAND: usize = 64;
/// Samples a pixel along each axis.
const SIDE: usize = 3;
/// Part of a pane that is left free on each side.
const MARGIN: f64 = 0.05;
/// Colours in linear light.
const BACKGROUND: Vec3 = Vec3::new(0.91, 0.91, 0.9);
const MATERIAL: Vec3 = Vec3::new(0.33, 0.51, 0.7);
const KEY_COLOUR: Vec3 = Vec3::new(1.08, 0.99, 0.86);
const SKY_COLOUR: Vec3 = Vec3::new(0.16, 0.2, 0.26);
const GROUND_COLOUR: Vec3 = Vec3::new(0.05, 0.045, 0.04);
/// Strength of the light from the camera, and of the reflection of the main light.
const HEADLIGHT: f32 = 0.12;
const GLINT: f32 = 0.07;
/// Towards the main light: x right, y up, z to the camera.
const KEY_LIGHT: Vec3 = Vec3::new(-0.7, 0.7, 0.65);
/// Half the width of a drawn edge, in pixels.
const LINE: f64 = 0.45;
/// How dark an edge is, and the least height of a triangle, in pixels, that has edges so dark.
const INK: f32 = 0.5;
const FULL_INK_HEIGHT: f64 = 12.0;
/// Barycentric slack, so that no sample on a common edge falls between two triangles.
const TOLERANCE: f64 = 1e-9;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::random::SplitMix64;
    use crate::mesh::shapes;

    const FRONT: View =
        View { width: 100, height: 100, turn_degrees: 0.0, tilt_degrees: 0.0, wireframe: false };

    /// The square [0, 1]^2 at height `z`, facing the camera.
    fn square(z: f64) -> IndexedMesh {
        let positions = vec![[0.0, 0.0, z], [1.0, 0.0, z], [1.0, 1.0, z], [0.0, 1.0, z]];
        IndexedMesh::new(positions, vec![[0, 1, 2], [0, 2, 3]])
    }

    fn background(picture: &Picture) -> usize {
        picture.pixels.iter().filter(|&&p| p == to_srgb(BACKGROUND)).count()
    }

    fn at(picture: &Picture, x: u32, y: u32) -> [u8; 3] {
        picture.pixels[(y * picture.width + x) as usize]
    }

    #[test]
    fn a_square_covers_the_picture_but_its_margins() {
        let picture = render(&[&square(0.0)], &FRONT).unwrap();
        assert_eq!(picture.pixels.len(), 100 * 100);
        assert_eq!(background(&picture), 100 * 100 - 90 * 90);
        assert_eq!(at(&picture, 5, 5), at(&picture, 94, 94));
        assert_eq!(at(&picture, 4, 50), to_srgb(BACKGROUND));
    }

    /// Turned by 60 degrees a square is half as wide; its height still decides the scale.
    #[test]
    fn a_turned_square_is_narrower() {
        let picture = render(&[&square(0.0)], &View { turn_degrees: 60.0, ..FRONT }).unwrap();
        assert_eq!(background(&picture), 100 * 100 - 90 * 46);
        let tilted = render(&[&square(0.0)], &View { tilt_degrees: -60.0, ..FRONT }).unwrap();
        assert_eq!(background(&tilted), 100 * 100 - 90 * 46);
        assert!(at(&tilted, 50, 50) != at(&picture, 50, 50));
    }

    /// A slanted roof before a square or behind it, whichever of the two is drawn first.
    #[test]
    fn the_nearer_triangle_hides_the_farther() {
        let flat = at(&render(&[&square(0.0)], &FRONT).unwrap(), 50, 50);
        for (z, square_wins) in [(1.0, true), (-1.0, false)] {
            let mut mesh = square(z);
            mesh.positions.extend([[0.0, 0.0, 0.3], [1.0, 0.0, -0.3], [1.0, 1.0, -0.3], [0.0, 1.0, 0.3]]);
            mesh.triangles.extend([[4, 5, 6], [4, 6, 7]]);
            for _ in 0..2 {
                let picture = render(&[&mesh], &FRONT).unwrap();
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
        assert!(render(&[&back], &FRONT).unwrap() == render(&[&square(0.0)], &FRONT).unwrap());
    }

    #[test]
    fn meshes_stand_side_by_side_at_one_scale() {
        let mut small = square(0.0);
        small.positions.iter_mut().for_each(|p| *p = p.map(|x| 0.25 + 0.5 * x));
        let strip = View { width: 300, ..FRONT };
        let picture = render(&[&square(0.0), &small, &IndexedMesh::default()], &strip).unwrap();
        assert_eq!(background(&picture), 300 * 100 - 90 * 90 - 46 * 46);
        assert_eq!(at(&picture, 50, 50), at(&picture, 150, 50));
        assert_eq!(at(&picture, 250, 50), to_srgb(BACKGROUND));
    }

    #[test]
    fn edges_are_drawn_where_triangles_are_large() {
        let drawn = View { wireframe: true, ..FRONT };
        let count = |picture: Picture| {
            let plain = at(&picture, 30, 50);
            picture.pixels.iter().filter(|&&p| p != plain && p != to_srgb(BACKGROUND)).count()
        };
        let lines = count(render(&[&square(0.0)], &drawn).unwrap());
        assert!((4 * 89..6 * 90 + 3 * 90).contains(&lines), "{lines}");
        assert_eq!(count(render(&[&square(0.0)], &FRONT).unwrap()), 0);
    }

    #[test]
    fn nothing_gives_the_background() {
        for meshes in [vec![], vec![&IndexedMesh::default()], vec![&IndexedMesh::new(vec![[1.0; 3]], vec![])]]
        {
            assert_eq!(background(&render(&meshes, &FRONT).unwrap()), 100 * 100);
        }
    }

    #[test]
    fn sizes_and_angles_are_checked() {
        for view in [
            View { width: 0, ..FRONT },
            View { height: View::MAX_SIDE + 1, ..FRONT },
            View { turn_degrees: f64::NAN, ..FRONT },
            View { tilt_degrees: f64::INFINITY, ..FRONT },
        ] {
            assert!(matches!(render(&[&square(0.0)], &view), Err(Error::Parameter(_))));
        }
        let narrow = View { width: 2, ..FRONT };
        assert_eq!(render(&[&square(0.0); 5], &narrow).unwrap().pixels.len(), 200);
    }

    #[test]
    fn the_scale_of_the_coordinates_does_not_show() {
        let view = View { turn_degrees: 20.0, tilt_degrees: 30.0, wireframe: true, ..FRONT };
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
            render(&[&mesh, &square(0.0)], &View { turn_degrees: 30.0, wireframe: true, ..FRONT }).unwrap();
        }
        let point = IndexedMesh::new(vec![[7.0; 3]], vec![[0; 3]; 9]);
        assert_eq!(background(&render(&[&point], &FRONT).unwrap()), 100 * 100);
    }

    #[test]
    fn a_png_holds_the_picture() {
        let view = View { width: 37, height: 21, turn_degrees: 10.0, tilt_degrees: 10.0, wireframe: true };
        let picture = render(&[&shapes::torus(8, 12)], &view).unwrap();
        let mut file = Vec::new();
        write_png(&picture, &mut file).unwrap();
        let mut reader = png::Decoder::new(io::Cursor::new(file)).read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut bytes).unwrap();
        assert_eq!((info.width, info.height, info.color_type), (37, 21, png::ColorType::Rgb));
        assert_eq!(bytes, picture.pixels.as_flattened());
    }
}
