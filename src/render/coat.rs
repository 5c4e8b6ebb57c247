//! What a painted mesh looks like at each of its triangles: colours, normals and a picture, ready to be mixed at samples.

use glam::{DMat3, DVec3, Vec2, Vec3, Vec4, Vec4Swizzles};

use super::shade;
use super::texture::Texture;
use crate::mesh::attributes::{Domain, Semantic};
use crate::mesh::paint::{Material, Paint};
use crate::mesh::{Attribute, IndexedMesh};

/// The paint of a mesh.
pub struct Coat<'a> {
    paint: &'a Paint,
    textures: Vec<Option<Texture>>,
    normals: Option<&'a Attribute>,
    colours: Option<&'a Attribute>,
    parts: Option<&'a Attribute>,
    /// Texture coordinates by their sets.
    places: Vec<&'a Attribute>,
    /// From the mesh's directions to those of the screen, y down.
    turn: DMat3,
    /// The linear light of each number in sRGB.
    decode: [f32; 256],
}

/// What a triangle is painted with.
pub struct Patch<'a> {
    /// At its corners, on screen.
    normals: Option<[Vec3; 3]>,
    /// At its corners, in linear light.
    colours: [Vec4; 3],
    picture: Option<Picture<'a>>,
    cutoff: f32,
}

/// A picture on a triangle.
struct Picture<'a> {
    texture: &'a Texture,
    level: usize,
    corners: [Vec2; 3],
}

impl<'a> Coat<'a> {
    /// Of a mesh that is turned, seen along -z.
    pub fn new(mesh: &'a IndexedMesh, paint: &'a Paint, turn: DMat3) -> Self {
        let count = mesh.triangles.len();
        let fits = |a: &&Attribute| a.check(count).is_ok();
        let attributes = || mesh.attributes.iter().filter(fits);
        let first = |semantic: Semantic| attributes().find(|a| (a.semantic, a.set) == (semantic, 0));
        let decode = std::array::from_fn(|x| shade::from_srgb([x as u8; 3]).x);
        Self {
            textures: paint.images.iter().map(|image| Texture::new(image, &decode)).collect(),
            paint,
            normals: first(Semantic::Normal).filter(|a| a.components == 3),
            colours: first(Semantic::Color),
            parts: first(Semantic::Part).filter(|a| a.domain == Domain::Triangle),
            places: attributes().filter(|a| a.semantic == Semantic::TexCoord && a.components >= 2).collect(),
            turn: DMat3::from_diagonal(DVec3::new(1.0, -1.0, 1.0)) * turn,
            decode,
        }
    }

    /// Of a triangle that takes so many samples; `smooth` are normals on screen for corners that have none of their own.
    pub fn patch(&self, triangle: usize, samples: f64, smooth: Option<[Vec3; 3]>) -> Patch<'_> {
        let material = self.material(triangle);
        let opacity = |colour: Vec4| colour * Vec4::from(material.colour);
        let colours = [0, 1, 2].map(|place| opacity(self.colour(triangle, place)));
        let normals = self.normals.and_then(|attribute| {
            let of = [0, 1, 2].map(|place| numbers::<3>(attribute, triangle, place));
            let [Some(a), Some(b), Some(c)] = of else { return None };
            Some([a, b, c].map(|n| (self.turn * DVec3::from(n)).normalize_or_zero().as_vec3()))
        });
        let picture = self.picture(&material, triangle, samples);
        Patch { normals: normals.or(smooth), colours, picture, cutoff: material.cutoff }
    }

    fn material(&self, triangle: usize) -> Material {
        let value = self.parts.and_then(|parts| Some((parts, parts.at(triangle, 0)?)));
        let part = value.map_or(0.0, |(parts, value)| parts.values.number(value));
        let number = self.paint.of_parts.get(part as usize).copied().flatten();
        let material = number.and_then(|number| self.paint.materials.get(number)).copied();
        // What has no colour at all is as shapes are.
        let unpainted = || match self.colours {
            Some(_) => Material::default(),
            None => Material { colour: shade::MATERIAL.extend(1.0).to_array(), ..Material::default() },
        };
        material.unwrap_or_else(unpainted)
    }

    fn colour(&self, triangle: usize, place: usize) -> Vec4 {
        let value = self.colours.and_then(|colours| Some((colours, colours.at(triangle, place)?)));
        let Some((colours, value)) = value else { return Vec4::ONE };
        let of = |k: usize| {
            let x = colours.values.fraction(colours.components * value + k, true) as f32;
            if x.is_finite() { x.clamp(0.0, 1.0) } else { 0.0 }
        };
        let light = |x: f32| {
            if self.paint.is_linear { x } else { self.decode[(x * 255.0).round() as usize] }
        };
        match colours.components {
            1 | 2 => Vec3::splat(light(of(0))).extend(1.0),
            3 => Vec3::new(light(of(0)), light(of(1)), light(of(2))).extend(1.0),
            _ => Vec4::new(light(of(0)), light(of(1)), light(of(2)), of(3)),
        }
    }

    fn picture(&self, material: &Material, triangle: usize, samples: f64) -> Option<Picture<'_>> {
        let texture = self.textures.get(material.image?)?.as_ref()?;
        let attribute = self.places.iter().find(|a| a.set == material.set)?;
        let of = [0, 1, 2].map(|place| numbers::<2>(attribute, triangle, place));
        let [Some(a), Some(b), Some(c)] = of else { return None };
        let corners = [a, b, c].map(|[u, v]| {
            let place = Vec3::new(u as f32, v as f32, 1.0);
            Vec2::from(material.transform.map(|row| Vec3::from(row).dot(place)))
        });
        let [a, b, c] = corners;
        let of_picture = f64::from(0.5 * (b - a).perp_dot(c - a).abs());
        Some(Picture { texture, level: texture.level(of_picture, samples), corners })
    }
}

impl Patch<'_> {
    /// The light at a point, given by its barycentric coordinates, of a triangle with this normal on screen, which faces the camera; `None` where
    /// nothing is seen.
    pub fn at(&self, facet: Vec3, weights: [f32; 3]) -> Option<Vec3> {
        let [u, v, w] = weights;
        let [a, b, c] = self.colours;
        let mut colour = a * u + b * v + c * w;
        if let Some(picture) = &self.picture {
            let [a, b, c] = picture.corners;
            colour *= Vec4::from(picture.texture.at(picture.level, a * u + b * v + c * w));
        }
        if colour.w < self.cutoff {
            return None;
        }
        let normal = self.normals.map_or(facet, |[a, b, c]| a * u + b * v + c * w);
        let normal = if normal.dot(facet) < 0.0 { -normal } else { normal };
        // At the silhouette a normal may look away where its facet does not.
        let normal = normal.with_z(normal.z.max(0.0)).normalize_or(facet);
        Some(shade::lit(normal, colour.xyz()))
    }
}

/// Numbers of a corner, if it has them and all are finite.
fn numbers<const N: usize>(attribute: &Attribute, triangle: usize, place: usize) -> Option<[f64; N]> {
    let first = attribute.components * attribute.at(triangle, place)?;
    let numbers = std::array::from_fn(|k| attribute.values.fraction(first + k, attribute.normalised));
    numbers.iter().all(|x: &f64| x.is_finite()).then_some(numbers)
}
