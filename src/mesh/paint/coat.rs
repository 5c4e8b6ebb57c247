//! The colours of a painted mesh, looked up at its triangles: those of its corners, of the materials of its parts and of their pictures, in
//! linear light.

use glam::{Vec2, Vec3, Vec4};

use super::texture::Texture;
use super::{Material, Paint, light};
use crate::mesh::attributes::{Domain, Semantic};
use crate::mesh::{Attribute, IndexedMesh};

/// The paint of a mesh.
pub(crate) struct Coat<'a> {
    paint: &'a Paint,
    textures: Vec<Option<Texture>>,
    colours: Option<&'a Attribute>,
    parts: Option<&'a Attribute>,
    /// Texture coordinates by their sets.
    places: Vec<&'a Attribute>,
    /// What has no colour at all.
    bare: Material,
    /// The linear light of each number in sRGB.
    decode: [f32; 256],
}

/// What a triangle is painted with.
pub(crate) struct Painted<'a> {
    /// At its corners, with opacity.
    pub colours: [Vec4; 3],
    /// The picture, and where in it the corners are.
    pub picture: Option<(&'a Texture, [Vec2; 3])>,
    /// The opacity below which nothing is seen.
    pub cutoff: f32,
}

impl<'a> Coat<'a> {
    /// Of a mesh; what has no colour at all has that of `bare`, in linear light.
    pub(crate) fn new(mesh: &'a IndexedMesh, paint: &'a Paint, bare: Vec3) -> Self {
        let count = mesh.triangles.len();
        let attributes = || mesh.attributes.iter().filter(|a| a.check(count).is_ok());
        let first = |semantic: Semantic| attributes().find(|a| (a.semantic, a.set) == (semantic, 0));
        let decode = std::array::from_fn(|x| light::from_srgb([x as u8; 3]).x);
        Self {
            textures: paint.images.iter().map(|image| Texture::new(image, &decode)).collect(),
            paint,
            colours: first(Semantic::Color),
            parts: first(Semantic::Part).filter(|a| a.domain == Domain::Triangle),
            places: attributes().filter(|a| a.semantic == Semantic::TexCoord && a.components >= 2).collect(),
            bare: Material { colour: bare.extend(1.0).to_array(), ..Material::default() },
            decode,
        }
    }

    /// What a triangle is painted with.
    pub(crate) fn of(&self, triangle: usize) -> Painted<'_> {
        let told = self.told(triangle).copied();
        // What has no colour at all is bare.
        let material =
            told.unwrap_or_else(|| if self.colours.is_some() { Material::default() } else { self.bare });
        let own = Vec4::from(material.colour);
        let colours = [0, 1, 2].map(|place| self.colour(triangle, place) * own);
        Painted { colours, picture: self.picture(&material, triangle), cutoff: material.cutoff }
    }

    /// Whether a triangle is bare.
    pub(crate) fn is_bare(&self, triangle: usize) -> bool {
        self.told(triangle).is_none()
            && self.colours.is_none_or(|colours| (0..3).all(|place| colours.at(triangle, place).is_none()))
    }

    /// Whether the material of a triangle has a picture that cannot be laid on it, for want of texture coordinates.
    pub(crate) fn lacks_places(&self, triangle: usize) -> bool {
        self.told(triangle)
            .is_some_and(|material| material.image.is_some() && self.picture(material, triangle).is_none())
    }

    fn told(&self, triangle: usize) -> Option<&Material> {
        let value = self.parts.and_then(|parts| Some((parts, parts.at(triangle, 0)?)));
        let part = value.map_or(0.0, |(parts, value)| parts.values.number(value));
        self.paint.material(part as usize)
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

    fn picture(&self, material: &Material, triangle: usize) -> Option<(&Texture, [Vec2; 3])> {
        let texture = self.textures.get(material.image?)?.as_ref()?;
        let attribute = self.places.iter().find(|a| a.set == material.set)?;
        let of = [0, 1, 2].map(|place| numbers::<2>(attribute, triangle, place));
        let [Some(a), Some(b), Some(c)] = of else { return None };
        let corners = [a, b, c].map(|[u, v]| {
            let place = Vec3::new(u as f32, v as f32, 1.0);
            Vec2::from(material.transform.map(|row| Vec3::from(row).dot(place)))
        });
        Some((texture, corners))
    }
}

impl Painted<'_> {
    /// The light and the opacity where the corners weigh so much, by a level of the picture.
    pub(crate) fn at(&self, weights: [f32; 3], level: usize) -> Vec4 {
        let [u, v, w] = weights;
        let [a, b, c] = self.colours;
        let colour = a * u + b * v + c * w;
        match &self.picture {
            Some((texture, [a, b, c])) => colour * Vec4::from(texture.at(level, *a * u + *b * v + *c * w)),
            None => colour,
        }
    }

    /// How much of the picture's area it has.
    pub(crate) fn of_picture(&self) -> f64 {
        self.picture.as_ref().map_or(0.0, |(_, [a, b, c])| f64::from(0.5 * (*b - *a).perp_dot(*c - *a).abs()))
    }
}

/// Numbers of a corner, if it has them and all are finite.
pub(crate) fn numbers<const N: usize>(
    attribute: &Attribute,
    triangle: usize,
    place: usize,
) -> Option<[f64; N]> {
    let first = attribute.components * attribute.at(triangle, place)?;
    let numbers = std::array::from_fn(|k| attribute.values.fraction(first + k, attribute.normalised));
    numbers.iter().all(|x: &f64| x.is_finite()).then_some(numbers)
}
