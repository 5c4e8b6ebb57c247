//! Levels of detail as one binary glTF, whose node names the coarser ones (`MSFT_lod`).

use super::inputs::is_folder;
use super::output::Output;
use std::path::Path;
use unweld::formats::write_levels_of_detail;
use unweld::mesh::IndexedMesh;

/// Whether a path is to be such a file.
pub fn is_file(path: &Path) -> bool {
    !is_folder(path) && path.extension().is_some_and(|end| end.eq_ignore_ascii_case("glb"))
}

/// Writes levels, the finest first, whose largest distances from it are these.
///
/// # Errors
/// Those of the medium.
pub fn write(levels: &[IndexedMesh], errors: &[f64], diagonal: f64, output: &Output) -> anyhow::Result<()> {
    let coverage = coverage(errors, diagonal);
    output.write(|mut out| write_levels_of_detail(levels, &coverage, &mut out))
}

/// Down to which share of the screen's area each level is to be shown: until on a screen of so many lines, which the diagonal is as high as
/// where the share is 1, the next one is off by no more than one of them. The last one is shown however small it is.
fn coverage(errors: &[f64], diagonal: f64) -> Vec<f64> {
    let of_next = |&error: &f64| {
        let share = (diagonal / (LINES * error)).powi(2);
        // What is no number is nothing over nothing: all in one place.
        if share.is_nan() { 1.0 } else { share.min(1.0) }
    };
    let mut shares: Vec<f64> = errors.iter().skip(1).map(of_next).collect();
    shares.push(0.0);
    for k in 1..shares.len() {
        shares[k] = shares[k].min(shares[k - 1]);
    }
    shares
}

/// Lines of a screen.
const LINES: f64 = 1080.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_level_is_shown_until_the_next_is_off_by_a_pixel() {
        // Half of the screen's height is a quarter of its area: there a 540th of the diagonal is a pixel.
        let shares = coverage(&[0.0, 2.0 / 540.0, 2.0 / 108.0], 2.0);
        assert!((shares[0] - 0.25).abs() < 1e-12 && (shares[1] - 0.01).abs() < 1e-12, "{shares:?}");
        assert_eq!(shares[2], 0.0);
        // One that is no farther off than the one before it takes its place; a mesh in one place.
        assert_eq!(coverage(&[0.0, 1.0, 0.5, 0.0], 1080.0), [1.0, 1.0, 1.0, 0.0]);
        assert_eq!(coverage(&[0.0, 2.0, 1.0], 1080.0), [0.25, 0.25, 0.0]);
        assert_eq!(coverage(&[0.0, 0.0], 0.0), [1.0, 0.0]);
        assert_eq!(coverage(&[0.0], 1.0), [0.0]);
    }
}
