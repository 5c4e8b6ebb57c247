//! Chapter 3.3: the table of contents.

use super::attribute::{Attribute, AttributeError, read_errors};
use super::container::*;

/// The lattice: origin, step, bits and the far corner of the bounding box.
pub fn read_lattice(table: &mut Fields) -> Result<([f64; 3], f64, u32, [u64; 3])> {
    let form = table.u8()?;
    let bits = u32::from(form % 32);
    demand((8..=24).contains(&bits) && form < 128, "3.3: form of the lattice")?;
    let mut real = |short: bool| match short {
        true => Ok(f64::from(f32::from_bits(table.u32()? as u32))),
        false => table.f64(),
    };
    let (short_origin, short_step) = (form / 32 % 2 == 1, form / 64 == 1);
    let origin = [real(short_origin)?, real(short_origin)?, real(short_origin)?];
    let step = real(short_step)?;
    demand(origin.iter().all(|x| x.is_finite()) && step.is_finite() && step >= 0.0, "3.3: lattice")?;
    let is_short = |x: &f64| f64::from(*x as f32).to_bits() == x.to_bits();
    demand(
        short_origin == origin.iter().all(is_short) && short_step == is_short(&step),
        "3.3: form of the lattice",
    )?;
    let mut maximum = [0; 3];
    for (maximum, x) in maximum.iter_mut().zip(origin) {
        let lacking = table.varint()?;
        demand(lacking < 1 << bits, "3.3: bounding box")?;
        *maximum = (1 << bits) - 1 - lacking;
        demand((x + step * *maximum as f64).is_finite(), "3.3: bounding box")?;
    }
    Ok((origin, step, bits, maximum))
}

/// The levels, how far their attributes are off, and the atoms in their entries, whose bytes are still missing.
pub type Levels = (Vec<Level>, Vec<Vec<AttributeError>>, Vec<Atom>);

/// The level entries, and the atoms in them. `resources` are the atoms that stand behind what a level has.
pub fn read_levels(
    table: &mut Fields,
    n: usize,
    bits: u32,
    step: f64,
    attributes: &[Attribute],
    resources: &[Atom],
) -> Result<Levels> {
    let base = n as u64 - 1;
    let told = attributes.iter().filter(|attribute| attribute.constant.is_none());
    let births: Vec<u64> = told.map(|attribute| attribute.birth).collect();
    let (mut vertices, mut triangles, shift) = (table.varint()?, table.varint()?, table.varint()?);
    demand([vertices, triangles].iter().all(|&count| count <= 1 << 30), "3.3: counts")?;
    demand(
        vertices <= 3 * triangles && 3 * triangles <= vertices * vertices.saturating_sub(1),
        "3.6: counts of the base",
    )?;
    demand(n == 1 || triangles > 0, "3.6: a base without triangles")?;
    demand(shift <= u64::from(bits), "3.3: precision shift")?;
    let mut shift = shift as u32;
    let mut codes = [table.u16()? as i64, table.u16()? as i64];
    let behind = |j: u64| resources.iter().filter(move |atom| atom.level == j).cloned();
    let mut errors = vec![read_errors(table, attributes, base, &[])?];
    let (mut levels, mut atoms) = (vec![], read_run(table, BASE, base, None)?);
    atoms.extend(behind(base));
    levels.push(level(vertices, triangles, shift, codes, step)?);
    for j in (0..base).rev() {
        let mut shape = table.varint()?;
        let mut born = (0, 0);
        if shape == 0 {
            born = (table.varint()?, table.varint()?);
            let (v, t) = born;
            demand(v <= 1 << 30 && (1..=1 << 30).contains(&t), "3.3: counts of a birth")?;
            demand(v <= 3 * t && 3 * t <= v * v.saturating_sub(1), "3.6: counts of a birth")?;
            shape = table.varint()?;
        }
        let added = shape / 4;
        demand((added >= 1 || born.0 > 0) && shape < 1 << 32, "3.3: what a level adds")?;
        let (mut single, mut finer) = (0, 0);
        if shape % 2 == 1 {
            single = table.varint()?;
            demand((1..=added).contains(&single), "3.3: single triangles")?;
        }
        if shape / 2 % 2 == 1 {
            finer = table.varint()?;
            demand(1 <= finer && finer <= u64::from(shift), "3.3: precision shift")?;
        }
        for code in &mut codes {
            let difference = table.varint()?;
            demand(difference < 1 << 32, "3.3: difference of an error")?;
            let difference = difference as i64;
            // 0, -1, 1, -2, 2, ...
            *code += if difference % 2 == 0 { difference / 2 } else { -(difference / 2) - 1 } - 48;
        }
        let coarser = errors.last().map_or(&[][..], |errors: &Vec<AttributeError>| errors);
        let finer_errors = read_errors(table, attributes, j, coarser)?;
        errors.push(finer_errors);
        if finer > 0 {
            atoms.extend(read_run(table, PRECISION, j, Some((vertices * finer, 0)))?);
        }
        if added > 0 {
            atoms.extend(read_run(table, REFINEMENT, j, Some((added, single)))?);
        }
        if born.0 > 0 {
            let mut run = read_run(table, BIRTH, j, None)?;
            if let Some(last) = run.last_mut() {
                (last.items, last.triangles) = born;
            }
            atoms.extend(run);
        }
        if j > 0 && births.contains(&j) {
            atoms.extend(read_run(table, ATTRIBUTES, j, None)?);
        }
        atoms.extend(behind(j));
        (vertices, triangles) = (vertices + added + born.0, triangles + 2 * added - single + born.1);
        demand(vertices <= 1 << 30 && triangles <= 1 << 30, "3.6: counts")?;
        shift -= finer as u32;
        levels.push(level(vertices, triangles, shift, codes, step)?);
    }
    demand(shift == 0, "3.3: precision shift of level 0")?;
    levels.reverse();
    errors.reverse();
    let triangles = |levels: &[Level]| levels.iter().map(|level| level.triangles).sum::<u64>();
    demand(
        triangles(&levels[1..]) <= (1 << 24) + 32 * triangles(&levels[..1]),
        "3.6: triangles of all levels",
    )?;
    Ok((levels, errors, atoms))
}

fn level(vertices: u64, triangles: u64, shift: u32, codes: [i64; 2], step: f64) -> Result<Level> {
    let unit = if step > 0.0 { step } else { 1.0 };
    demand(codes.iter().all(|code| (0..0x7F80).contains(code)), "3.3: an error")?;
    // The upper half of a binary32 number.
    let [max_error, rms_error] = codes.map(|code| f64::from(f32::from_bits((code as u32) << 16)) * unit);
    demand(max_error.is_finite() && rms_error.is_finite(), "3.3: an error")?;
    Ok(Level { vertices, triangles, shift, max_error, rms_error })
}

/// The atoms of a payload, or of a pass of so many items, so many of which add one triangle.
pub fn read_run(table: &mut Fields, kind: u8, level: u64, mut rest: Option<(u64, u64)>) -> Result<Vec<Atom>> {
    let mut atoms = Vec::new();
    loop {
        let word = table.varint()?;
        let (length, more) = (word / 2, word % 2 == 1);
        demand((1..=65536).contains(&length), "3.3: length of an atom")?;
        let (mut items, mut single) = (0, 0);
        if let Some((all, singles)) = &mut rest {
            (items, single) = (*all, *singles);
            if more {
                items = table.varint()?;
                single = if *singles > 0 { table.varint()? } else { 0 };
                demand(1 <= items && items < *all && single <= *singles, "3.3: items of an atom")?;
            }
            demand(items < 1 << 32, "3.3: items of an atom")?;
            (*all, *singles) = (*all - items, *singles - single);
            demand(single <= items && *singles <= *all, "3.3: single triangles of an atom")?;
        }
        let triangles = if kind == REFINEMENT { 2 * items - single } else { 0 };
        let sum = if length < 1024 { table.u16()? } else { table.u32()? } as u32;
        atoms.push(Atom { kind, level, items, triangles, length: length as usize, sum, bytes: Vec::new() });
        if !more {
            return Ok(atoms);
        }
    }
}

/// What stands behind level 0.
pub fn read_payloads(table: &mut Fields, base: u64, atoms: &mut Vec<Atom>) -> Result<()> {
    let mut last = (0, 0);
    while !table.0.is_empty() {
        let kind = table.u8()?;
        let level = if kind == KEYFRAME { table.varint()? } else { 0 };
        // The place in the list of §3.3, then the level from coarse to fine.
        let place = match kind {
            RESIDUE => (1, 0),
            ATTRIBUTES => (2, 0),
            CORRECTION => (3, 0),
            ORDER => (4, 0),
            METADATA => (5, 0),
            KEYFRAME => {
                demand(level < base, "3.3: level of a keyframe")?;
                (6, base - level)
            }
            128.. => last,
            _ => return refuse("3.3: an atom of a kind that must be known"),
        };
        demand(kind >= 128 || last < place, "3.3: order of the payloads")?;
        last = place;
        let run = read_run(table, kind, level, None)?;
        let bytes = run.iter().map(|atom| atom.length).sum::<usize>();
        demand(kind != METADATA || bytes <= 1 << 20, "3.5: bytes of metadata")?;
        atoms.extend(run);
    }
    Ok(())
}
