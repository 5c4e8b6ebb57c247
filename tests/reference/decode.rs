//! Chapter 1: from a file to its levels.

use super::attributes::{self, Attributes};
use super::container::{
    ATTRIBUTES, BASE, BIRTH, File, KEYFRAME, Level, METADATA, PRECISION, REFINEMENT, Result,
};
use super::entropy::Code;
use super::refinement::{self, Models};
use super::residue::Whole;
use super::walk::Mesh;
use super::{correction, keyframe, metadata, order, residue};

/// What is shown of a level: its mesh, and the attributes that it has.
pub type See<'a> = &'a mut dyn FnMut(usize, &Mesh, &Attributes);

/// Decodes from the base or the keyframe of level `start` to the whole of level 0. Each level is shown to `see`, the last without what is
/// born there.
pub fn decode(file: &File, start: usize, see: See) -> Result<Whole> {
    decode_beside(file, start, None, see)
}

/// The same of a member of a set that stands beside another mesh, whose vertices these are (§15.2).
pub fn decode_beside(file: &File, start: usize, other: Option<&[[i64; 3]]>, see: See) -> Result<Whole> {
    let shift = |j: usize| file.levels[j].shift;
    let kind = if start == file.levels.len() - 1 { BASE } else { KEYFRAME };
    let mut values = Attributes::of(file);
    // What is born at level 0 comes behind the residue.
    let told = values.born(|birth| birth >= start.max(1) as u64);
    let mut behind = |code: &mut Code, mesh: &Mesh| values.pass(code, mesh, &told);
    let payload = file.payload(kind, start);
    let (level, scale) = (file.levels[start], file.scale(start));
    let mut mesh = match other {
        Some(other) => keyframe::read_beside(&payload, level, scale, other, &mut behind)?,
        None => keyframe::read_with(&payload, level, scale, &mut behind)?,
    };
    let mut models = Models::fresh(file.rich_models);
    see(start, &mesh, &values);
    for j in (0..start).rev() {
        if shift(j) < shift(j + 1) {
            let atoms = file.atoms_of(PRECISION, j);
            refinement::precision_pass(&mut mesh, atoms, (shift(j + 1), shift(j)), &mut models)?;
        }
        let atoms = file.atoms_of(REFINEMENT, j);
        if !atoms.is_empty() {
            refinement::level_pass(&mut mesh, &mut values, atoms, file.scale(j), &mut models)?;
        }
        if let Some(last) = file.atoms_of(BIRTH, j).last() {
            let level = Level { vertices: last.items, triangles: last.triangles, ..file.levels[j] };
            let mut own = None;
            let mut behind = |code: &mut Code, mesh: &Mesh| {
                own = Some(values.pass_of_components(code, mesh)?);
                Ok(())
            };
            let born = keyframe::read_birth(&file.payload(BIRTH, j), level, file.scale(j), &mut behind)?;
            values.join(own.expect("the components have been read"), mesh.points.len());
            keyframe::join(&mut mesh, born);
        }
        let told = values.born(|birth| birth == j as u64);
        if j > 0 && !told.is_empty() {
            let payload = file.payload(ATTRIBUTES, j);
            let mut code = Code::start(&payload);
            values.pass(&mut code, &mesh, &told)?;
            code.end()?;
        }
        see(j, &mesh, &values);
        if !file.atoms_of(KEYFRAME, j).is_empty() {
            models = Models::fresh(file.rich_models);
        }
    }
    let (mut whole, origins) = residue::whole(file, &mesh)?;
    attributes::give_values(file, &mut values, &mesh, &mut whole, &origins)?;
    correction::correct(file, &mut whole, &origins)?;
    let whole = order::put_in_order(file, &mesh, whole, &origins)?;
    let payload = file.payload(METADATA, 0);
    if !payload.is_empty() {
        metadata::check(&payload)?;
    }
    Ok(whole)
}
