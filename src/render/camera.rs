//! From the coordinates of a mesh to samples of the picture: an orthographic camera that looks along -z.

use glam::{DMat3, DVec2, DVec3};

use super::raster::SIDE;
use super::{Up, View};
use crate::mesh::IndexedMesh;

/// The vertices of each mesh as the camera has them: in a common cube of side 2 about the origin, turned and tilted.
/// Coordinates are halved first, so that no difference can overflow.
pub fn place(meshes: &[&IndexedMesh], view: &View) -> Vec<Vec<DVec3>> {
    let halved = |p: &[f64; 3]| DVec3::from(*p) * 0.5;
    let mut places: Vec<Vec<DVec3>> =
        meshes.iter().map(|mesh| mesh.positions.iter().map(halved).collect()).collect();
    let (min, max) = bounds(meshes.iter().zip(&places).flat_map(|(mesh, places)| used(mesh, places)));
    let (centre, half) = ((min + max) * 0.5, (max - min).max_element() * 0.5);
    let turn = turn(view);
    for p in places.iter_mut().flatten() {
        *p = turn * if half > 0.0 { (*p - centre) / half } else { *p - centre };
    }
    places
}

/// From directions of a mesh to those that the camera has.
pub fn turn(view: &View) -> DMat3 {
    DMat3::from_rotation_x(view.tilt_degrees.to_radians())
        * DMat3::from_rotation_y(view.turn_degrees.to_radians())
        * upright(view.up)
}

/// The finite places of the vertices that triangles use.
pub fn used<'a>(mesh: &'a IndexedMesh, places: &'a [DVec3]) -> impl Iterator<Item = DVec3> + 'a {
    mesh.triangles.iter().flatten().map(|&v| places[v as usize]).filter(|p| p.is_finite())
}

/// Where the camera points, and how many samples a unit has.
pub struct Frame {
    centre: DVec2,
    scale: f64,
}

impl Frame {
    /// The frame that fits `points` into a pane of the given pixels, with a margin.
    pub fn around(points: impl Iterator<Item = DVec3>, width: usize, height: usize) -> Self {
        let (min, max) = bounds(points);
        let (centre, extent) = ((min + max).truncate() * 0.5, (max - min).truncate());
        let room = DVec2::new(width as f64, height as f64) * SIDE as f64 * (1.0 - 2.0 * MARGIN);
        let scale = (room / extent.max(DVec2::splat(1e-9))).min_element();
        if scale.is_finite() { Self { centre, scale } } else { Self { centre: DVec2::ZERO, scale: 1.0 } }
    }

    /// A point in samples from the top left corner of the pane, y down; z towards the camera.
    pub fn project(&self, p: DVec3, width: usize, height: usize) -> DVec3 {
        let middle = DVec2::new(width as f64, height as f64) * SIDE as f64 * 0.5;
        let offset = (p.truncate() - self.centre) * self.scale;
        DVec3::new(middle.x + offset.x, middle.y - offset.y, p.z * self.scale)
    }
}

/// Brings the upward axis to y by a rotation, hence without mirroring.
fn upright(up: Up) -> DMat3 {
    match up {
        Up::X => DMat3::from_cols(DVec3::Y, DVec3::NEG_X, DVec3::Z),
        Up::Y => DMat3::IDENTITY,
        Up::Z => DMat3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::Y),
    }
}

fn bounds(points: impl Iterator<Item = DVec3>) -> (DVec3, DVec3) {
    points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), p| (min.min(p), max.max(p)))
}

/// Part of a pane that is left free on each side.
const MARGIN: f64 = 0.05;
