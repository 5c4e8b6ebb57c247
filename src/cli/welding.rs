//! What there is to say of nearly equal vertices.

use super::numbers::{count, of_diagonal};
use serde_json::{Value, json};
use unweld::encoder::{Joined, Report};

/// Vertices that were joined, in a line of the report.
pub fn text(report: &Report, exact: bool) -> Option<String> {
    let joined = report.conditioning.joined_vertices;
    let far = of_diagonal(report.joined.distance, report.diagonal);
    let after = if exact { "level 0 has them apart again" } else { "without --exact they stay so" };
    let vertices = count(joined as u64, "vertex");
    (joined > 0).then(|| format!("{vertices} with others, none further than {far}; {after}"))
}

/// The same for programs.
pub fn json(report: &Report) -> Value {
    json!({
        "vertices": report.conditioning.joined_vertices,
        "max_distance": report.joined.distance,
        "parts": report.joined.parts,
        "lattice_parts": report.joined.lattice_parts,
    })
}

/// That there are many parts which nearly equal vertices keep apart, where `base_vertices` are wanted.
///
/// A part keeps three vertices at least, so parts too many swell every level: it is told when the vertices that
/// they keep would be a quarter of the base. That some parts of many touch is nothing special, as with a lid and its box:
/// it must be half of them.
pub fn warning(joined: &Joined, base_vertices: usize) -> Option<String> {
    let Joined { parts, lattice_parts, .. } = *joined;
    let too_many = parts.saturating_sub(lattice_parts);
    (2 * lattice_parts <= parts && 12 * too_many >= base_vertices.max(1)).then(|| {
        format!(
            "{} would be {} if nearly equal vertices were one: --weld lattice joins those on the same point of the lattice, \
             --weld DISTANCE those so near to each other",
            count(parts as u64, "part"),
            super::numbers::grouped(lattice_parts as u64),
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_many_parts_are_worth_a_warning() {
        let told = |parts, lattice_parts| {
            warning(&Joined { parts, lattice_parts, ..Joined::default() }, 150).is_some()
        };
        assert!(told(1000, 1) && told(1000, 500) && told(14, 1));
        // As many as they look; fewer than half; a lid on its box; 12 too many, 36 of 150 vertices.
        assert!(!told(1000, 1000) && !told(1000, 501) && !told(2, 1) && !told(13, 1));
    }
}
