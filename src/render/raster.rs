//! Triangles to samples: a z-buffer that holds some rows of the picture at a time.

use std::ops::Range;

use glam::{DVec2, DVec3, Vec3, Vec4};

use super::coat::Patch;
use super::shade::{facing, shade};

/// Samples a pixel along each axis.
pub const SIDE: usize = 3;

/// Some rows of a pane: of `SIDE` x `SIDE` samples a pixel the depth, linear colour, and opacity, 0 or 1. All but the
/// colours is in samples.
pub struct Band {
    top: usize,
    width: usize,
    height: usize,
    depths: Vec<f32>,
    colours: Vec<Vec4>,
}

/// What a triangle looks like.
pub enum Surface<'a> {
    /// Of the one material of all shapes; with averaged normals of its corners where shading is smooth.
    Plain(Option<[Vec3; 3]>),
    /// As it is painted.
    Painted(Patch<'a>),
}

/// The samples that a triangle covers lie in these rows; `None` where it is not seen: its area on screen is so small
/// that a sample would be hit by chance alone, or a coordinate is not finite.
pub fn rows(corners: [DVec3; 3]) -> Option<Range<f64>> {
    let [a, b, c] = corners.map(|p| p.y);
    normal(corners).map(|_| a.min(b).min(c)..a.max(b).max(c))
}

impl Band {
    /// An empty band of `height` pixel rows from the row `top` on.
    pub fn new(width: usize, top: usize, height: usize) -> Self {
        let (width, top, height) = (width * SIDE, top * SIDE, height * SIDE);
        let count = width * height;
        Self { top, width, height, depths: vec![f32::NEG_INFINITY; count], colours: vec![Vec4::ZERO; count] }
    }

    /// Draws a triangle, row by row, between the places where its edges cross the row. `surface` tells of one that takes so many samples
    /// what it looks like.
    pub fn draw<'p>(
        &mut self,
        [a, b, c]: [DVec3; 3],
        surface: impl FnOnce(f64) -> Surface<'p>,
        wireframe: bool,
    ) {
        let (Some(normal), Some(rows)) = (normal([a, b, c]), rows([a, b, c])) else { return };
        let surface = surface(0.5 * normal.z.abs());
        let facet = facing(normal);
        let within = |y: f64| (y - self.top as f64).clamp(0.0, self.height as f64);
        let colours = match &surface {
            Surface::Plain(smooth) => shade(normal, *smooth),
            Surface::Painted(_) => Default::default(),
        };
        // Barycentric coordinates are linear in x and y: `slope . (x, y) + constant`.
        let linear = |p: DVec3, q: DVec3| {
            let slope = DVec2::new(p.y - q.y, q.x - p.x) / normal.z;
            (slope, -slope.dot(p.truncate()))
        };
        let planes = [linear(b, c), linear(c, a), linear(a, b)];
        let edges = wireframe.then(|| Edges::of(planes.map(|(slope, _)| slope)));

        for row in within(rows.start) as usize..within(rows.end).ceil() as usize {
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
                    let [u, v, w] = weights.map(|weight| weight as f32);
                    let light = edges.as_ref().map_or(1.0, |edges| edges.light(weights));
                    let colour = match &surface {
                        Surface::Plain(_) => Some(colours[0] * u + colours[1] * v + colours[2] * w),
                        Surface::Painted(patch) => patch.at(facet, [u, v, w]),
                    };
                    let Some(colour) = colour else { continue };
                    self.depths[sample] = depth;
                    self.colours[sample] = (colour * light).extend(1.0);
                }
            }
        }
    }

    /// The mean colour and opacity of a pixel's samples.
    pub fn pixel(&self, x: usize, y: usize) -> Vec4 {
        let rows = (y * SIDE..(y + 1) * SIDE).map(|row| &self.colours[row * self.width + x * SIDE..][..SIDE]);
        rows.flatten().sum::<Vec4>() / (SIDE * SIDE) as f32
    }
}

/// How edges are drawn: heights of the triangle over them, in samples, and the ink they get.
struct Edges {
    heights: [f64; 3],
    ink: f32,
}

impl Edges {
    /// By the slopes of the barycentric coordinates.
    fn of(slopes: [DVec2; 3]) -> Self {
        let heights = slopes.map(|slope| slope.length().recip());
        let least = heights.into_iter().fold(f64::INFINITY, f64::min) / SIDE as f64;
        Self { heights, ink: INK * (least / FULL_INK_HEIGHT).min(1.0) as f32 }
    }

    /// What part of the light is left at a point, given by its barycentric coordinates.
    fn light(&self, weights: [f64; 3]) -> f32 {
        let distances = weights.iter().zip(self.heights).map(|(weight, height)| weight * height);
        let nearest = distances.fold(f64::INFINITY, f64::min);
        1.0 - self.ink * (LINE * SIDE as f64 + 0.5 - nearest).clamp(0.0, 1.0) as f32
    }
}

/// Its z is twice the area on screen, signed.
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
