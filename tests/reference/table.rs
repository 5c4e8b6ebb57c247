//! Chapter 3.3: the table of contents.

use super::container::*;

/// The level entries, §3.3.
pub fn read_levels(table: &mut Fields, n: usize, vb: u64, tb: u64, bits: u32) -> Result<Vec<Level>> {
    let mut levels: Vec<Level> = Vec::new();
    for j in (0..n).rev() {
        let (mut vertices, mut triangles, mut most) = (vb, tb, bits);
        if let Some(coarser) = levels.last() {
            let (v, t) = (table.varint()?, table.varint()?);
            demand((1..=1 << 30).contains(&v) && v <= t && t <= 2 * v, "3.3: what a level adds")?;
            (vertices, triangles, most) = (coarser.vertices + v, coarser.triangles + t, coarser.shift);
        }
        let shift = u32::from(table.u8()?);
        demand(shift <= most && (j > 0 || shift == 0), "3.3: precision shift")?;
        let max_error = table.f64()?;
        let rms_error = f32::from_bits(table.u32()? as u32);
        demand(max_error.is_finite() && max_error >= 0.0, "3.3: largest distance")?;
        demand(rms_error.is_finite() && rms_error >= 0.0, "3.3: mean distance")?;
        levels.push(Level { vertices, triangles, shift, max_error, rms_error });
    }
    levels.reverse();
    let triangles = |levels: &[Level]| levels.iter().map(|level| level.triangles).sum::<u64>();
    demand(
        triangles(&levels[1..]) <= (1 << 24) + 32 * triangles(&levels[..1]),
        "3.6: triangles of all levels",
    )?;
    Ok(levels)
}

/// The atom entries; the atoms' bytes are still missing.
pub fn read_atoms(table: &mut Fields, levels: &[Level]) -> Result<Vec<Atom>> {
    let count = table.varint()?;
    demand((1..=1 << 20).contains(&count), "3.3: number of atoms")?;
    let atoms = (0..count).map(|_| read_atom(table)).collect::<Result<Vec<_>>>()?;
    check_kinds(&atoms, levels.len() as u64 - 1)?;
    check_sums(&atoms, levels)?;
    Ok(atoms)
}

fn read_atom(table: &mut Fields) -> Result<Atom> {
    let kind = table.u8()?;
    let [level, length, items, triangles] =
        [table.varint()?, table.varint()?, table.varint()?, table.varint()?];
    demand([level, items, triangles].iter().all(|&x| x < 1 << 32), "3.3: fields of an atom entry")?;
    demand((1..=65536).contains(&length), "3.3: length of an atom")?;
    let sum = table.u32()? as u32;
    Ok(Atom { kind, level, items, triangles, length: length as usize, sum, bytes: Vec::new() })
}

/// What each entry must hold, and the order of the atoms.
fn check_kinds(atoms: &[Atom], base: u64) -> Result<()> {
    let mut places = Vec::new();
    for Atom { kind, level, items, triangles, .. } in atoms {
        // The place in the list of §3.3, then the level from coarse to fine, then precision before refinement.
        let (place, range) = match *kind {
            BASE => ((1, 0, 0), base..base + 1),
            PRECISION | REFINEMENT => ((2, base.wrapping_sub(*level), *kind), 0..base),
            RESIDUE => ((3, 0, 0), 0..1),
            CORRECTION => ((4, 0, 0), 0..1),
            ORDER => ((5, 0, 0), 0..1),
            METADATA => ((6, 0, 0), 0..1),
            KEYFRAME => ((7, base.wrapping_sub(*level), 0), 0..base),
            128.. => continue,
            _ => return refuse("3.3: an atom of a kind that must be known"),
        };
        demand(range.contains(level), "3.3: level of an atom")?;
        demand(places.last().is_none_or(|last| *last <= place), "3.3: order of the atoms")?;
        places.push(place);
        demand((*items >= 1) == (*kind == PRECISION || *kind == REFINEMENT), "3.3: items")?;
        let refines = *kind == REFINEMENT && (*items..=2 * items).contains(triangles);
        demand(refines || (*kind != REFINEMENT && *triangles == 0), "3.3: triangles")?;
    }
    demand(places.first() == Some(&(1, 0, 0)), "3.3: the base")?;
    let metadata = atoms.iter().filter(|a| a.kind == METADATA).map(|a| a.length).sum::<usize>();
    demand(metadata <= 1 << 20, "3.5: bytes of metadata")
}

/// The sums at the end of §3.3.
fn check_sums(atoms: &[Atom], levels: &[Level]) -> Result<()> {
    for (j, pair) in levels.windows(2).enumerate() {
        let (fine, coarse) = (pair[0], pair[1]);
        let of = |kind| atoms.iter().filter(move |a| a.kind == kind && a.level == j as u64);
        let steps = coarse.vertices * u64::from(coarse.shift - fine.shift);
        demand(of(PRECISION).map(|a| a.items).sum::<u64>() == steps, "3.3: precision items")?;
        let added = (fine.vertices - coarse.vertices, fine.triangles - coarse.triangles);
        let sums = of(REFINEMENT).fold((0, 0), |(v, t), a| (v + a.items, t + a.triangles));
        demand(sums == added, "3.3: refinement items and triangles")?;
    }
    Ok(())
}
