//! How far the colours of a mesh are from those of another.

use glam::{DVec3, Vec4Swizzles};
use rayon::ThreadPoolBuilder;

use super::BakeOptions;
use super::bake::{Source, check, in_chunks};
use crate::error::{Error, Result};
use crate::mesh::IndexedMesh;
use crate::mesh::distance::Near;
use crate::mesh::paint::coat::Coat;
use crate::mesh::paint::{Paint, light};
use crate::mesh::random::SplitMix64;

/// The mean difference of red, green and blue in sRGB, 0 to 255, at `samples` points spread over the area of a mesh: of its own colours and of those
/// that the nearest points of the original have. Of `options` the threads count. The same for any number of them.
///
/// # Errors
/// As [`bake`](fn@super::bake).
pub fn colour_difference(
    (mesh, paint): (&IndexedMesh, &Paint),
    (original, original_paint): (&IndexedMesh, &Paint),
    samples: usize,
    options: &BakeOptions,
) -> Result<f64> {
    check(mesh)?;
    check(original)?;
    let source = Source::new(mesh, original, original_paint, options)?;
    let coat = Coat::new(mesh, paint, glam::Vec3::ONE);
    let corners = |t: usize| mesh.triangles[t].map(|v| DVec3::from(mesh.positions[v as usize]));
    let mut area = 0.0;
    let sums: Vec<f64> = (0..mesh.triangles.len())
        .map(|t| {
            let [a, b, c] = corners(t);
            area += (b - a).cross(c - a).length();
            area
        })
        .collect();
    let pool = ThreadPoolBuilder::new().num_threads(options.threads.get()).build();
    let pool = pool.map_err(|e| Error::Io(std::io::Error::other(e).into()))?;
    let of_range = |range: std::ops::Range<usize>| {
        let mut random = SplitMix64::new(range.start as u64);
        let mut near = Near::default();
        let mut sum = 0.0;
        for k in range {
            let at = (k as f64 + 0.5) / samples as f64 * area;
            let t = sums.partition_point(|&sum| sum <= at).min(sums.len() - 1);
            let (u, v) = (random.unit(), random.unit());
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            let [a, b, c] = corners(t);
            let own = coat.of(t).at([1.0 - u - v, u, v].map(|share| share as f32), 0).xyz();
            let other = source.light(a + (b - a) * u + (c - a) * v, 0.0, &mut near).0.xyz();
            let [own, other] = [own, other].map(light::to_srgb);
            sum += (0..3).map(|k| f64::from(own[k].abs_diff(other[k]))).sum::<f64>() / 3.0;
        }
        sum
    };
    let mut sum = 0.0;
    in_chunks(&pool, samples, 1024, of_range, &mut |_, more| {
        sum += more;
        Ok(())
    })?;
    Ok(sum / samples.max(1) as f64)
}
