//! Chapter 5.5.1: sizes of triangles and neighbourhoods before a level.

use std::collections::BTreeMap;

use super::vector::{d2, larger};
use super::walk::{Mesh, Walk};

/// What is measured once.
pub struct Survey {
    /// Twice the areas, by the triangles' vertices in ascending order.
    area: BTreeMap<[usize; 3], f32>,
    /// Mean squared lengths of the edges, by vertex.
    pub extent: Vec<f32>,
}

impl Survey {
    /// `cell` is P.
    pub fn of(mesh: &Mesh, walk: &Walk, cell: impl Fn(usize) -> [i64; 3]) -> Self {
        let mut area = BTreeMap::new();
        let mut sum = vec![0.0f32; mesh.points.len()];
        let mut count = vec![0.0f32; mesh.points.len()];
        for &c in &walk.triangles {
            let triangle = mesh.triangle(c);
            let [u, v, w] = triangle;
            let side = |a, b| d2(cell(a), cell(b));
            let (uv, vw, wu) = (side(u, v), side(v, w), side(w, u));
            for (corner, both) in [(u, uv + wu), (v, uv + vw), (w, vw + wu)] {
                sum[corner] += both;
                count[corner] += 2.0;
            }
            let h = 0.5 * ((uv + wu) - vw);
            area.insert(name(triangle), larger(uv * wu - h * h, 0.0).sqrt());
        }
        let extent = sum.iter().zip(&count).map(|(sum, count)| sum / count).collect();
        Self { area, extent }
    }

    /// Of a triangle that the mesh had then.
    pub fn area(&self, triangle: [usize; 3]) -> f32 {
        self.area[&name(triangle)]
    }
}

fn name(mut triangle: [usize; 3]) -> [usize; 3] {
    triangle.sort_unstable();
    triangle
}
