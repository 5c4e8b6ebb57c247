//! Chapter 3.9, and what chapter 3.3 says of resources.

use super::container::*;
use super::inflate::inflate;
use super::table::read_run;

/// What the table says of a resource.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resource {
    /// 0 the scene, 1 a buffer.
    pub kind: u8,
    pub place: u64,
}

/// The resources, and their atoms; those of the k-th have k as items, which the file does not say.
pub fn read_resources(table: &mut Fields) -> Result<(Vec<Resource>, Vec<Atom>)> {
    let count = table.varint()?;
    demand((1..=1 << 16).contains(&count), "3.3: number of resources")?;
    let (mut resources, mut atoms) = (vec![], vec![]);
    for k in 0..count {
        let kind = table.u8()?;
        demand(kind <= 1, "3.3: kind of a resource")?;
        demand(kind == 1 || k == 0, "3.3: a scene that is not the first")?;
        let place = table.varint()?;
        let mut run = read_run(table, RESOURCE, place, None)?;
        for atom in &mut run {
            atom.items = k;
        }
        resources.push(Resource { kind, place });
        atoms.extend(run);
    }
    Ok((resources, atoms))
}

/// Whether they may stand there, with n levels.
pub fn check_places(resources: &[Resource], n: u64) -> Result<()> {
    let mut most = n - 1;
    for resource in resources {
        demand(resource.place <= most, "3.3: place of a resource")?;
        most = resource.place;
    }
    Ok(())
}

/// What is to be had of the resources behind levels below `start`, or of all from the base: their bytes, of the scene its JSON.
pub fn read(file: &File, start: usize) -> Result<Vec<Option<Vec<u8>>>> {
    let is_read = |resource: &Resource| start == file.levels.len() - 1 || resource.place < start as u64;
    let bytes = |k: u64| {
        let own = file.atoms.iter().filter(|atom| atom.kind == RESOURCE && atom.items == k);
        own.flat_map(|atom| atom.bytes.clone()).collect::<Vec<_>>()
    };
    let one = |(k, resource): (u64, &Resource)| match resource.kind {
        _ if !is_read(resource) => Ok(None),
        0 => scene(&bytes(k)).map(Some),
        _ => Ok(Some(bytes(k))),
    };
    (0..).zip(&file.resources).map(one).collect()
}

/// The JSON of a scene.
fn scene(payload: &[u8]) -> Result<Vec<u8>> {
    let mut fields = Fields(payload);
    let form = fields.u8()?;
    demand(form <= 1, "3.9: form of the scene")?;
    let length = fields.varint()?;
    demand((1..=1 << 26).contains(&length), "3.9: length of the scene")?;
    let packed = fields.0;
    demand(form == 0 || length <= 1032 * packed.len() as u64, "3.9: length of the scene")?;
    let json = if form == 0 { packed.to_vec() } else { inflate(packed)? };
    demand(json.len() as u64 == length, "3.9: length of the scene")?;
    Ok(json)
}
