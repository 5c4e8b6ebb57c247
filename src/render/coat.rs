//! What a painted mesh looks like at each of its triangles: colours, normals and a picture, ready to be mixed at samples.

use glam::{DMat3, DVec3, Vec3, Vec4Swizzles};

use super::shade;
use crate::mesh::attributes::Semantic;
use crate::mesh::paint::Paint;
use crate::mesh::paint::coat::{self, Painted, numbers};
use crate::mesh::{Attribute, IndexedMesh};

/// The paint of a mesh that is seen.
pub struct Coat<'a> {
    colours: coat::Coat<'a>,
    normals: Option<&'a Attribute>,
    /// From the mesh's directions to those of the screen, y down.
    turn: DMat3,
}

/// What a triangle is painted with.
pub struct Patch<'a> {
    /// At its corners, on screen.
    normals: Option<[Vec3; 3]>,
    painted: Painted<'a>,
    /// Of its picture.
    level: usize,
}

impl<'a> Coat<'a> {
    /// Of a mesh that is turned, seen along -z.
    pub fn new(mesh: &'a IndexedMesh, paint: &'a Paint, turn: DMat3) -> Self {
        let count = mesh.triangles.len();
        let is_normal = |a: &&Attribute| {
            (a.semantic, a.set, a.components) == (Semantic::Normal, 0, 3) && a.check(count).is_ok()
        };
        Self {
            colours: coat::Coat::new(mesh, paint, shade::MATERIAL),
            normals: mesh.attributes.iter().find(is_normal),
            turn: DMat3::from_diagonal(DVec3::new(1.0, -1.0, 1.0)) * turn,
        }
    }

    /// Of a triangle that takes so many samples; `smooth` are normals on screen for corners that have none of their own.
    pub fn patch(&self, triangle: usize, samples: f64, smooth: Option<[Vec3; 3]>) -> Patch<'_> {
        let normals = self.normals.and_then(|attribute| {
            let of = [0, 1, 2].map(|place| numbers::<3>(attribute, triangle, place));
            let [Some(a), Some(b), Some(c)] = of else { return None };
            Some([a, b, c].map(|n| (self.turn * DVec3::from(n)).normalize_or_zero().as_vec3()))
        });
        let painted = self.colours.of(triangle);
        let level = match &painted.picture {
            Some((texture, _)) => texture.level(painted.of_picture(), samples),
            None => 0,
        };
        Patch { normals: normals.or(smooth), painted, level }
    }
}

impl Patch<'_> {
    /// The light at a point, given by its barycentric coordinates, of a triangle with this normal on screen, which faces the camera; `None` where
    /// nothing is seen.
    pub fn at(&self, facet: Vec3, weights: [f32; 3]) -> Option<Vec3> {
        let colour = self.painted.at(weights, self.level);
        if colour.w < self.painted.cutoff {
            return None;
        }
        let [u, v, w] = weights;
        let normal = self.normals.map_or(facet, |[a, b, c]| a * u + b * v + c * w);
        let normal = if normal.dot(facet) < 0.0 { -normal } else { normal };
        // At the silhouette a normal may look away where its facet does not.
        let normal = normal.with_z(normal.z.max(0.0)).normalize_or(facet);
        Some(shade::lit(normal, colour.xyz()))
    }
}
