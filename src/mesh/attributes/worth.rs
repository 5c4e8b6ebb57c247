//! What a difference of values is worth beside a distance: for whoever weighs attributes against the shape.

use super::{Attribute, Domain, Semantic};
use glam::DVec3;

/// Whether the triangles of an attribute's charts do not mix.
pub(crate) fn is_chart(attribute: &Attribute) -> bool {
    match attribute.semantic {
        Semantic::TexCoord => attribute.domain == Domain::Corner && matches!(attribute.components, 2 | 3),
        Semantic::Part => attribute.domain == Domain::Triangle,
        _ => false,
    }
}

/// How many lengths of `size`, the longest side of the mesh, a difference of 1 is worth. `triangles` are its values, by corner, and the
/// corners' places.
///
/// Texture coordinates: as much as the texture slips along the surface (Cohen, Olano and Manocha 1998), by the areas that both have
/// in all: so neither the unit of the coordinates nor how often a texture is repeated matters. Normals, colours and what else may be
/// shown: by [`BRIGHTNESS`], for light makes at most the difference of two unit normals of them. What has no metric, as the numbers of
/// joints, is worth nothing, and tangents follow from the others.
pub(crate) fn worth(
    attribute: &Attribute,
    size: f64,
    triangles: impl Iterator<Item = ([Option<usize>; 3], [[f64; 3]; 3])>,
) -> f64 {
    match attribute.semantic {
        Semantic::Normal if attribute.components == 3 => BRIGHTNESS,
        Semantic::TexCoord if is_chart(attribute) => {
            let [surface, chart] = areas(attribute, triangles);
            if chart > 0.0 && size > 0.0 { (surface / chart).sqrt() / size } else { 0.0 }
        }
        Semantic::Color => BRIGHTNESS / full_scale(attribute),
        Semantic::Generic => BRIGHTNESS / range(attribute),
        _ => 0.0,
    }
}

/// The area of the surface that has texture coordinates, and that of the texture.
fn areas(
    attribute: &Attribute,
    triangles: impl Iterator<Item = ([Option<usize>; 3], [[f64; 3]; 3])>,
) -> [f64; 2] {
    let mut areas = [0.0; 2];
    for (values, places) in triangles {
        let [Some(a), Some(b), Some(c)] = values else { continue };
        let at = |value: usize| {
            let first = value * attribute.components;
            let number =
                |k: usize| if k < attribute.components { attribute.values.number(first + k) } else { 0.0 };
            [0, 1, 2].map(number)
        };
        areas[0] += area(places);
        areas[1] += area([a, b, c].map(at));
    }
    areas
}

fn area([a, b, c]: [[f64; 3]; 3]) -> f64 {
    let [a, b, c] = [a, b, c].map(DVec3::from_array);
    0.5 * (b - a).cross(c - a).length()
}

/// What stands for full brightness.
fn full_scale(attribute: &Attribute) -> f64 {
    attribute.values.stored().one().unwrap_or_else(|| {
        (0..attribute.values.len()).fold(1.0, |most, at| f64::max(most, attribute.values.number(at)))
    })
}

/// From the least to the largest number.
fn range(attribute: &Attribute) -> f64 {
    let numbers = || (0..attribute.values.len()).map(|at| attribute.values.number(at));
    numbers().fold(f64::NEG_INFINITY, f64::max) - numbers().fold(f64::INFINITY, f64::min)
}

/// What one of brightness is worth, black to white, in sizes of the mesh: so a bump of a fiftieth of the size counts as much for its tilt,
/// which is what light makes of it, as for its height; wider ones count more for their height, finer ones for their tilt.
const BRIGHTNESS: f64 = 0.02;
