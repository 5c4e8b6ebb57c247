//! Light and colour: what a surface looks like by its normal, and normals averaged for smooth shading.

use glam::{DVec3, Vec3};

use crate::mesh::IndexedMesh;
use crate::mesh::topology::first_in_place;

/// The colour of each corner of a triangle, in linear light. Its `normal` on screen (y down) is of any length and
/// either side: the side that faces the camera is lit, be it front or back. Corners are given an averaged normal by
/// `smooth`, which they follow but at creases.
pub fn shade(normal: DVec3, smooth: Option<[Vec3; 3]>) -> [Vec3; 3] {
    let facet = facing(normal);
    let corner = |average: Vec3| {
        let cosine = average.dot(facet);
        if cosine.abs() < CREASE_COSINE {
            return None;
        }
        let average = average * cosine.signum();
        // At the silhouette an average may look away where its facet does not.
        Some(lit(average.with_z(average.z.max(0.0)).normalize_or(facet), MATERIAL))
    };
    let flat = lit(facet, MATERIAL);
    smooth.map_or([flat; 3], |averages| averages.map(|average| corner(average).unwrap_or(flat)))
}

/// The direction of a normal on screen, of any length and either side, that faces the camera.
pub fn facing(normal: DVec3) -> Vec3 {
    let normal = normal.normalize_or_zero().as_vec3();
    if normal.z < 0.0 { -normal } else { normal }
}

/// For each vertex the mean normal of its triangles, weighted by their angles there (Thürmer and Wüthrich 1998), so that
/// it does not matter how a plane is cut into triangles: of length 1, or 0 where they cancel out.
/// Vertices in the same place have the same, so that neither seams nor triangles that share no vertices show.
pub fn averages(mesh: &IndexedMesh, places: &[DVec3]) -> Vec<Vec3> {
    let same = first_in_place(&mesh.positions);
    let mut sums = vec![DVec3::ZERO; places.len()];
    for t in &mesh.triangles {
        let corners = t.map(|v| places[v as usize]);
        let edges = [0, 1, 2].map(|k| corners[(k + 1) % 3] - corners[k]);
        let normal = edges[0].cross(edges[1]).normalize_or_zero();
        for k in 0..3 {
            let weighted = normal * edges[k].angle_between(-edges[(k + 2) % 3]);
            if weighted.is_finite() {
                sums[same[t[k] as usize] as usize] += weighted;
            }
        }
    }
    same.iter().map(|&v| sums[v as usize].normalize_or_zero().as_vec3()).collect()
}

/// The colour of a material by a normal on screen that faces the camera: a warm key light from the upper left, a weak one from the
/// camera, a cool sky brighter than the ground.
pub fn lit(normal: Vec3, material: Vec3) -> Vec3 {
    let normal = Vec3::new(normal.x, -normal.y, normal.z);
    let key = KEY_LIGHT.normalize();
    let glint = normal.dot((key + Vec3::Z).normalize()).max(0.0).powi(24);
    let light = KEY_COLOUR * normal.dot(key).max(0.0)
        + Vec3::splat(HEADLIGHT * normal.z)
        + GROUND_COLOUR.lerp(SKY_COLOUR, 0.5 + 0.5 * normal.y);
    material * light + KEY_COLOUR * (GLINT * glint)
}

/// The material of shapes. Colours are in linear light.
pub const MATERIAL: Vec3 = Vec3::new(0.33, 0.51, 0.7);
const KEY_COLOUR: Vec3 = Vec3::new(1.08, 0.99, 0.86);
const SKY_COLOUR: Vec3 = Vec3::new(0.16, 0.2, 0.26);
const GROUND_COLOUR: Vec3 = Vec3::new(0.05, 0.045, 0.04);
/// Strength of the light from the camera, and of the reflection of the main light.
const HEADLIGHT: f32 = 0.2;
const GLINT: f32 = 0.07;
/// Towards the main light: x right, y up, z to the camera.
const KEY_LIGHT: Vec3 = Vec3::new(-0.7, 0.7, 0.65);
/// The cosine of 30 degrees: an average farther from its facet is that of a crease, of about 60 degrees or more.
const CREASE_COSINE: f32 = 0.866;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    #[test]
    fn either_side_is_lit_and_smooth_corners_agree_with_their_facet() {
        let normal = DVec3::new(0.3, -0.2, 0.9);
        let flat = shade(normal, None);
        assert_eq!(flat, shade(normal * -7.0, None));
        let near = DVec3::new(0.2, -0.3, 0.9).normalize().as_vec3();
        let smooth = shade(normal, Some([near, -near, near]));
        assert!(smooth[0] == smooth[1] && smooth[0] != flat[0]);
        // 50 degrees away, and nothing at all.
        let crease = DVec3::new(-0.6, -0.2, 0.7).normalize().as_vec3();
        assert_eq!(shade(normal, Some([crease, Vec3::ZERO, crease])), flat);
    }

    /// On a sphere the mean normal is the direction of the vertex, also where every triangle has vertices of its own.
    #[test]
    fn averages_are_the_same_in_the_same_place() {
        let sphere = shapes::sphere(3);
        let positions: Vec<[f64; 3]> =
            sphere.triangles.iter().flatten().map(|&v| sphere.positions[v as usize]).collect();
        let soup = IndexedMesh::new(
            positions,
            (0..sphere.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
        );
        for mesh in [sphere, soup] {
            let places: Vec<DVec3> = mesh.positions.iter().map(|&p| p.into()).collect();
            for (average, place) in averages(&mesh, &places).iter().zip(&places) {
                assert!(average.dot(place.normalize().as_vec3()) > 0.999, "{average} at {place}");
            }
        }
    }
}
