//! Uniform clustering: one vertex a cell of a grid (Rossignac and Borrel 1993), at the weighted centre, or where the quadric is least
//! (Lindstrom 2000).

use super::cluster::{boundary_edges, merge, surviving};
use super::collapse::SINGULAR;
use super::quadric::{Form, Quadric};
use super::star::relative;
use super::working::Working;
use super::{Options, Pass, Representative, Ticker};
use crate::error::Result;
use crate::mesh::lattice;
use glam::DVec3;
use std::collections::HashMap;

/// Clusters by the finest grid that leaves at most `faces` triangles.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(super) fn run(
    working: &mut Working,
    faces: usize,
    options: &Options,
    ticker: &mut Ticker,
) -> Result<Vec<Pass>> {
    let (vertices, triangles) = (working.positions.len(), working.living);
    let Some((min, max)) = lattice::bounds(working.positions.iter().copied()).filter(|_| triangles > faces)
    else {
        return Ok(Vec::new());
    };
    let longest = (0..3).map(|k| max[k] - min[k]).fold(0.0, f64::max);
    let count = |cells: u32, working: &Working| {
        let keys = keys(&working.positions, min, longest, cells);
        surviving(&working.triangles, |v| keys[v as usize])
    };
    // So few cells along the longest side fit; so many do not.
    let (mut low, mut high) = (1, MOST_CELLS);
    while high - low > 1 {
        ticker.tell(triangles)?;
        // By ratios: the first steps are the largest.
        let middle = ((f64::from(low) * f64::from(high)).sqrt() as u32).clamp(low + 1, high - 1);
        if count(middle, working) <= faces {
            low = middle;
        } else {
            high = middle;
        }
    }
    let keys = keys(&working.positions, min, longest, low);
    let places = places(working, &keys, min, longest / f64::from(low), options);
    let contractions = vertices - places.len();
    merge(working, |v| keys[v as usize], places);
    Ok(vec![Pass { vertices, triangles, contractions }])
}

/// For each vertex the number of its cell among those that have one.
fn keys(positions: &[[f64; 3]], min: [f64; 3], longest: f64, cells: u32) -> Vec<u32> {
    let mut numbers: HashMap<[u32; 3], u32> = HashMap::new();
    let scale = if longest > 0.0 { f64::from(cells) / longest } else { 0.0 };
    let mut key = |p: &[f64; 3]| {
        let cell: [u32; 3] = std::array::from_fn(|k| (((p[k] - min[k]) * scale) as u32).min(cells - 1));
        let next = numbers.len() as u32;
        *numbers.entry(cell).or_insert(next)
    };
    positions.iter().map(&mut key).collect()
}

/// The place of each cell's vertex.
fn places(working: &mut Working, keys: &[u32], min: [f64; 3], size: f64, options: &Options) -> Vec<[f64; 3]> {
    let cells = keys.iter().map(|&key| key as usize + 1).max().unwrap_or(0);
    // By the area of the triangles round each vertex; without an area the mean counts.
    let mut weighted = vec![(DVec3::ZERO, 0.0); cells];
    let mut plain = vec![(DVec3::ZERO, 0.0); cells];
    let mut quadrics = vec![Quadric::default(); cells];
    let at = |v: u32| relative(working.positions[v as usize], min);
    for (v, &key) in (0..).zip(keys) {
        let (sum, count) = &mut plain[key as usize];
        *sum += at(v);
        *count += 1.0;
    }
    for triangle in &working.triangles {
        let [a, b, c] = triangle.map(at);
        let cross = (b - a).cross(c - a);
        let mut form = Form::default();
        form.add_triangle(cross, options.weights);
        let plane = Quadric::through(form, a);
        for (v, place) in triangle.iter().zip([a, b, c]) {
            let (sum, weight) = &mut weighted[keys[*v as usize] as usize];
            *sum += place * cross.length();
            *weight += cross.length();
            quadrics[keys[*v as usize] as usize] += plane;
        }
    }
    let centre = |cell: usize| {
        let [(sum, weight), (all, count)] = [weighted[cell], plain[cell]];
        if weight > 0.0 { sum / weight } else { all / count }
    };
    let origin = DVec3::from(min);
    if options.representative == Representative::Centre {
        return (0..cells).map(|cell| (centre(cell) + origin).to_array()).collect();
    }
    for edge in boundary_edges(working) {
        let [a, b] = edge.ends.map(|v| relative(working.positions[v as usize], min));
        let mut form = Form::default();
        form.add_boundary(b - a, edge.cross, options.weights);
        let plane = Quadric::through(form, a);
        edge.ends.iter().for_each(|&v| quadrics[keys[v as usize] as usize] += plane);
    }
    let place = |cell: usize| {
        let centre = centre(cell);
        let optimum = quadrics[cell].optimum(centre, SINGULAR).filter(|d| d.length() <= size);
        (centre + optimum.unwrap_or_default() + origin).to_array()
    };
    (0..cells).map(place).collect()
}

/// Cells along the longest side, at most.
const MOST_CELLS: u32 = 1 << 20;
