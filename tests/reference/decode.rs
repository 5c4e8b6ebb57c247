//! Chapter 1: from a file to its levels.

use super::container::{BASE, BIRTH, File, KEYFRAME, Level, METADATA, PRECISION, REFINEMENT, Result};
use super::refinement::{self, Models};
use super::residue::Whole;
use super::walk::Mesh;
use super::{attributes, correction, keyframe, metadata, order, residue};

/// Decodes from the base or the keyframe of level `start` to the whole of level 0. Each level is shown to `see`.
pub fn decode(file: &File, start: usize, see: &mut dyn FnMut(usize, &Mesh)) -> Result<Whole> {
    let shift = |j: usize| file.levels[j].shift;
    let kind = if start == file.levels.len() - 1 { BASE } else { KEYFRAME };
    let mut mesh = keyframe::read(&file.payload(kind, start), file.levels[start], file.scale(start))?;
    let mut models = Models::fresh(file.rich_models);
    see(start, &mesh);
    for j in (0..start).rev() {
        if shift(j) < shift(j + 1) {
            let atoms = file.atoms_of(PRECISION, j);
            refinement::precision_pass(&mut mesh, atoms, (shift(j + 1), shift(j)), &mut models)?;
        }
        let atoms = file.atoms_of(REFINEMENT, j);
        if !atoms.is_empty() {
            refinement::level_pass(&mut mesh, atoms, file.scale(j), &mut models)?;
        }
        if let Some(last) = file.atoms_of(BIRTH, j).last() {
            let level = Level { vertices: last.items, triangles: last.triangles, ..file.levels[j] };
            let born = keyframe::read_birth(&file.payload(BIRTH, j), level, file.scale(j))?;
            keyframe::join(&mut mesh, born);
        }
        see(j, &mesh);
        if !file.atoms_of(KEYFRAME, j).is_empty() {
            models = Models::fresh(file.rich_models);
        }
    }
    let (mut whole, origins) = residue::whole(file, &mesh)?;
    attributes::give_values(file, &mesh, &mut whole, &origins)?;
    correction::correct(file, &mut whole, &origins)?;
    let whole = order::put_in_order(file, &mesh, whole, &origins)?;
    let payload = file.payload(METADATA, 0);
    if !payload.is_empty() {
        metadata::check(&payload)?;
    }
    Ok(whole)
}
