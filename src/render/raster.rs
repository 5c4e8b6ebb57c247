//! Triangles to samples: a z-buffer that holds some rows of the picture at a time.

use glam::{DVec2, DVec3, Vec3, Vec4};

use super::shade::shade;

/// Samples a pixel along each axis.
pub const SIDE: usize = 3;

/// Some rows of a pane: depth and linear colour of `SIDE` x `SIDE` samples a pixel. All but the colours is in samples.
pub struct Band {
    top: usize,
    width: usize,
    height: usize,
    depths: Vec<f32>,
    colours: Vec<Vec3>,
}

/// Whether a triangle is seen: it has an area on screen, and all its coordinates are finite.
pub fn is_seen(corners: [DVec3; 3]) -> bool {
    normal(corners).is_some()
}

impl Band {
    /// An empty band of `height` pixel rows from the row `top` on.
    pub fn new(width: usize, top: usize, height: usize) -> Self {
        let (width, top, height) = (width * SIDE, top * SIDE, height * SIDE);
        let count = width * height;
        Self { top, width, height, depths: vec![f32::NEG_INFINITY; count], colours: vec![Vec3::ZERO; count] }
    }

    /// Draws a triangle, row by row, between the places where its edges cross the row. `smooth` gives the averaged
    /// normals of its corners.
    pub fn draw(
        &mut self,
        [a, b, c]: [DVec3; 3],
        smooth: impl FnOnce() -> Option<[Vec3; 3]>,
        wireframe: bool,
    ) {
        let within = |y: f64| (y - self.top as f64).clamp(0.0, self.height as f64);
        let rows = within(a.y.min(b.y).min(c.y)) as usize..within(a.y.max(b.y).max(c.y)).ceil() as usize;
        if rows.is_empty() {
            return;
        }
        let Some(normal) = normal([a, b, c]) else { return };
        let colours = shade(normal, smooth());
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
                    let colour: Vec3 = (0..3).map(|k| colours[k] * weights[k] as f32).sum();
                    self.depths[sample] = depth;
                    self.colours[sample] = colour * (1.0 - ink * inked);
                }
            }
        }
    }

    /// The sum of the colours of a pixel's samples that a triangle covers, and what part of all they are, both over
    /// the number of samples: colour premultiplied by opacity.
    pub fn pixel(&self, x: usize, y: usize) -> Vec4 {
        let rows = (y * SIDE..(y + 1) * SIDE).flat_map(|row| {
            let samples = row * self.width + x * SIDE..row * self.width + (x + 1) * SIDE;
            self.depths[samples.clone()].iter().zip(&self.colours[samples])
        });
        let covered = rows.filter(|(depth, _)| **depth > f32::NEG_INFINITY);
        covered.map(|(_, colour)| colour.extend(1.0)).sum::<Vec4>() / (SIDE * SIDE) as f32
    }
}

/// Its z is twice the area on screen, signed; `None` beneath an area that no sample would be hit by but by chance.
fn normal([a, b, c]: [DVec3; 3]) -> Option<DVec3> {
    let normal = (b - a).cross(c - a);
    (normal.is_finite() && normal.z.abs() >= 1e-9).then_some(normal)
}

/// Half the width of a drawn edge, in pixels.
const LINE: f64 = 0.45;
/// How dark an edge is, and the least height of a triangle, in pixels, that has edges so dark.
const INK: f32 = 0.5;
const FULL_INK_HEIGHT: f64 = 12.0;
/// Barycentric slack, so that no sample on a common edge falls between two triangles.
const TOLERANCE: f64 = 1e-9;
