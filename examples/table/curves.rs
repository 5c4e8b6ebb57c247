//! Error against bytes: of prefixes, beside the best simplified mesh that Draco codes to as many bytes.

use super::cases::Case;
use super::drawing::{self, Curve};
use super::peers::{Draco, meshopt_simplify_with_update, on_lattice};
use super::prefixes;
use super::quality::{SAMPLES, SEED, mean_distance};
use super::tables::{Cell, Table, grouped};
use anyhow::Context;
use std::path::Path;
use unweld::encoder::{Encoder, Options, Profile};
use unweld::mesh::{IndexedMesh, lattice};

/// Bytes, and the mean error in % of the diagonal.
pub type Point = (f64, f64);

/// One row a mesh and share of the file; where there is a folder, a picture a mesh in it, which the notes show.
///
/// # Errors
/// Those of the coders and of writing.
pub fn table(cases: &[Case], folder: Option<&Path>) -> anyhow::Result<Table> {
    if let Some(folder) = folder {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    let columns = [
        "mesh",
        "share %",
        "bytes",
        "error %",
        "error %, small",
        "error %, fine",
        "error %, single",
        "error/single",
    ];
    let mut table = Table::new("Prefixes beside single-rate files", &[&note()], &columns);
    let mut pictures = Vec::new();
    for case in cases {
        eprintln!("curves: {}", case.name);
        let encode = |profile| {
            let options = Options { position_bits: case.bits, ..Options::profile(profile) };
            Encoder::new(options).encode_to_vec(&case.mesh)
        };
        let files = [encode(Profile::Default)?, encode(Profile::Small)?, encode(Profile::Fine)?];
        let single = single_rate(case)?;
        for share in SHARES {
            let bytes = files[0].len() * share as usize / 100;
            let mut errors = [None; 3];
            for (error, file) in errors.iter_mut().zip(&files) {
                let mesh = prefixes::decode(&file[..bytes.min(file.len())])?;
                *error = mesh.and_then(|mesh| percent(case, &mesh));
            }
            let peer = at(&single, bytes as f64);
            let mut row =
                vec![Cell::text(&case.name), Cell::Count(u64::from(share)), Cell::Count(bytes as u64)];
            row.extend(errors.into_iter().chain([peer]).map(|error| Cell::number(error, 4)));
            row.push(Cell::number(errors[0].zip(peer).map(|(ours, peer)| ours / peer), 2));
            table.rows.push(row);
        }
        let Some(folder) = folder else { continue };
        let stem = case.name.split('.').next().unwrap_or(&case.name);
        let path = folder.join(format!("{stem}.svg"));
        let curves = [
            Curve { name: "unweld, prefixes of one file", points: prefixes_of(case, &files[0])? },
            Curve {
                name: "unweld --profile small, prefixes of one file",
                points: prefixes_of(case, &files[1])?,
            },
            Curve { name: "meshopt_simplifyWithUpdate, then Draco: a file a point", points: single },
        ];
        let triangles = grouped(case.mesh.triangles.len() as u64);
        let title = format!("{stem}, {triangles} triangles, {} bits", case.bits);
        let picture = drawing::draw(&title, &curves)?;
        std::fs::write(&path, picture).with_context(|| path.display().to_string())?;
        pictures.push(format!("![{title}: error against bytes]({})", path.display()));
    }
    if !pictures.is_empty() {
        table.notes.push(pictures.join("\n"));
    }
    Ok(table)
}

/// The prefixes of a file, from the first that is a mesh to the whole.
fn prefixes_of(case: &Case, file: &[u8]) -> anyhow::Result<Vec<Point>> {
    let mut points = Vec::new();
    for step in (0..STEPS).rev() {
        let bytes = (file.len() as f64 * 2f64.powf(-f64::from(step) / 2.0)) as usize;
        let Some(mesh) = prefixes::decode(&file[..bytes])? else { continue };
        points.extend(percent(case, &mesh).map(|error| (bytes as f64, error)));
    }
    Ok(points)
}

/// The best of simplified meshes and bits: each smaller than all that are nearer to the original.
fn single_rate(case: &Case) -> anyhow::Result<Vec<Point>> {
    let mut points = Vec::new();
    let mut add = |mesh: &IndexedMesh, bits: u32| -> anyhow::Result<()> {
        points.push(coded(case, mesh, bits)?);
        Ok(())
    };
    for bits in case.bits - 2..=case.bits {
        add(&case.mesh, bits)?;
    }
    for step in 1..STEPS {
        let triangles = case.mesh.triangles.len() as f64 * 2f64.powf(-f64::from(step) / 2.0);
        let Some(mesh) = meshopt_simplify_with_update(&case.mesh, triangles as usize) else { break };
        let Some(error) = percent(case, &mesh) else { break };
        // Bits for which the lattice's step is neither far below the error nor, where there are more bits, far above.
        let steps = |bits: u32| extent(&mesh) / 2f64.powi(bits as i32) / (error / 100.0 * case.diagonal());
        for bits in (6..=case.bits).filter(|&b| steps(b) > 0.4 && (steps(b) < 5.0 || b == case.bits)) {
            add(&mesh, bits)?;
        }
    }
    Ok(envelope(points))
}

/// What Draco makes of a mesh with so many bits.
///
/// # Errors
/// Those of Draco.
pub fn coded(case: &Case, mesh: &IndexedMesh, bits: u32) -> anyhow::Result<Point> {
    let draco = Draco::new(mesh, bits)?;
    let bytes = draco.encode(draco.encoder())?.len() as f64;
    Ok((bytes, percent(case, &on_lattice(mesh, bits)?).context("a mesh has a surface")?))
}

/// The points that no other beats in both.
fn envelope(mut points: Vec<Point>) -> Vec<Point> {
    points.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut least = f64::INFINITY;
    points.retain(|point| {
        let better = point.1 < least;
        least = least.min(point.1);
        better
    });
    points
}

/// The error at so many bytes, straight between two points in logarithms; `None` before the first, the last one's after it.
fn at(points: &[Point], bytes: f64) -> Option<f64> {
    let next = points.iter().position(|point| point.0 >= bytes);
    match next {
        Some(0) => (points[0].0 <= bytes).then_some(points[0].1),
        Some(k) => {
            let [(x, y), (u, v)] = [points[k - 1], points[k]];
            let t = (bytes / x).ln() / (u / x).ln();
            Some(y * (v / y).powf(t))
        }
        None => points.last().map(|point| point.1),
    }
}

/// The mean distance of a case's surface from a mesh, in % of the diagonal.
pub fn percent(case: &Case, mesh: &IndexedMesh) -> Option<f64> {
    mean_distance(case, mesh).map(|error| error * 100.0 / case.diagonal())
}

/// The longest side of the bounding box.
fn extent(mesh: &IndexedMesh) -> f64 {
    let bounds = lattice::bounds(mesh.positions.iter().copied());
    bounds.map_or(0.0, |(min, max)| (0..3).map(|k| max[k] - min[k]).fold(0.0, f64::max))
}

fn note() -> String {
    format!(
        "Bytes against mean error (of the original's surface from the mesh, in % of the diagonal of the bounding box, {SAMPLES} points, seed {SEED}). Error, small, fine: prefixes of one \
         file of each profile, of as many bytes: the share is of the default's. Single: a file for each point, the best of `meshopt_simplifyWithUpdate` (which moves vertices) to many numbers of triangles, coded by Draco \
         (Edgebreaker, compression level 10) with 6 to as many bits a coordinate; between two of them straight in logarithms.",
    )
}

/// Shares of the file, in percent.
const SHARES: [u32; 6] = [2, 5, 10, 20, 35, 50];
/// Points of a curve: each has the bytes, or the triangles, of the one before divided by the root of 2.
const STEPS: u32 = 15;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_best_are_kept_and_read_between() {
        let points = envelope(vec![(100.0, 1.0), (10.0, 10.0), (50.0, 20.0), (100.0, 3.0), (200.0, 1.0)]);
        assert_eq!(points, [(10.0, 10.0), (100.0, 1.0)]);
        assert_eq!(
            [5.0, 10.0, 100.0, 500.0].map(|bytes| at(&points, bytes)),
            [None, Some(10.0), Some(1.0), Some(1.0)]
        );
        assert!((at(&points, 1000f64.sqrt()).unwrap() - 10f64.sqrt()).abs() < 1e-9);
    }
}
