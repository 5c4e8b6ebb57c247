//! Resources: where they stand among the levels (spec §3.9).

use super::work::Work;
use crate::container::{FileBuilder, Level, ResourceKind, packed_scene};
use crate::error::{Error, Result};
use crate::limits::MAX_RESOURCES;

/// Bytes that come with the mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Resource {
    /// What it is.
    pub kind: ResourceKind,
    /// Where it is to stand.
    pub place: Place,
    /// Its bytes, at least one: of a scene the JSON as it is.
    pub bytes: Vec<u8>,
}

/// Behind which level a resource stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// The base: what the first picture needs.
    Base,
    /// The first level whose largest error is at most this, in the units of the input; the finest where none is so close.
    Error(f64),
    /// The finest.
    Finest,
}

impl Place {
    /// The number of the level.
    fn level(self, levels: &[Level]) -> u32 {
        let level = match self {
            Self::Base => levels.len() - 1,
            Self::Error(most) => levels.iter().rposition(|level| level.max_error <= most).unwrap_or(0),
            Self::Finest => 0,
        };
        level as u32
    }
}

/// Whether there may be such resources, whatever the levels are.
///
/// # Errors
/// [`Error::Parameter`].
pub fn check(resources: &[Resource]) -> Result<()> {
    let refused = |what: String| Err(Error::Parameter(what));
    if resources.len() > MAX_RESOURCES as usize {
        return refused(format!("{} resources, allowed {MAX_RESOURCES}", resources.len()));
    }
    for (number, resource) in resources.iter().enumerate() {
        if resource.bytes.is_empty() {
            return refused(format!("resource {number} has no bytes"));
        }
        if resource.kind == ResourceKind::Scene && number > 0 {
            return refused(format!("resource {number} is a scene: it must be the first"));
        }
        if let Place::Error(most) = resource.place
            && most.is_nan()
        {
            return refused(format!("resource {number} has no place: its error is no number"));
        }
    }
    Ok(())
}

/// Adds them to a file; bytes of all of them. Each stands no nearer to the base than the one before it.
///
/// # Errors
/// [`Error::Parameter`] where the places rise, [`Error::Limit`] where the scene is too long.
pub fn add_to(file: &mut FileBuilder, resources: &[Resource], work: &mut Work) -> Result<u64> {
    let (mut bytes, mut before) = (0, u32::MAX);
    for (number, resource) in resources.iter().enumerate() {
        let place = resource.place.level(&file.levels);
        if place > before {
            let what = format!(
                "resource {number} stands behind level {place}, the one before it behind level {before}"
            );
            return Err(Error::Parameter(what));
        }
        before = place;
        let length = match resource.kind {
            ResourceKind::Scene => {
                let packed = packed_scene(&resource.bytes)?;
                file.resource(resource.kind, place, &packed);
                work.read(packed.len(), resource.bytes.len() as u64)?;
                packed.len()
            }
            ResourceKind::Buffer => {
                file.resource(resource.kind, place, &resource.bytes);
                resource.bytes.len()
            }
        };
        bytes += length as u64;
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::container::ResourceEntry;
    use crate::decoder;
    use crate::encoder::Encoder;
    use crate::mesh::shapes;

    fn buffer(place: Place, bytes: &[u8]) -> Resource {
        Resource { kind: ResourceKind::Buffer, place, bytes: bytes.to_vec() }
    }

    #[test]
    fn each_stands_where_it_is_wanted() {
        let mesh = shapes::bumpy_sphere(3, 1);
        let scene = Resource { kind: ResourceKind::Scene, ..buffer(Place::Base, b"{\"nodes\":[]}") };
        let plain = Encoder::default().encode_to_vec(&mesh).unwrap();
        let levels = crate::container::parse_contents(&plain).unwrap().unwrap().levels.clone();
        // Not the base's, and not one that level 0 alone has.
        let errors: Vec<f64> = levels.iter().map(|level| level.max_error).collect();
        let place =
            (1..errors.len() - 1).find(|&j| errors[j + 1..].iter().all(|&coarser| coarser > errors[j]));
        let place = place.expect("a level that is closer than all coarser ones");
        let error = errors[place];
        let long: Vec<u8> = (0..150_000u32).map(|i| (i % 251) as u8).collect();
        let resources = vec![
            scene,
            buffer(Place::Base, b"samples"),
            buffer(Place::Error(error), &long),
            buffer(Place::Error(-1.0), b"near"),
            buffer(Place::Finest, b"far"),
        ];
        let file = Encoder::default().resources(resources.clone()).encode_to_vec(&mesh).unwrap();
        let decoder = decoder::decode(&file, decoder::Options::default()).unwrap();
        let entries = decoder.resources();
        let base = levels.len() as u32 - 1;
        let places: Vec<_> = entries.iter().map(|entry| (entry.place, entry.atoms.len())).collect();
        assert_eq!(places, [(base, 1), (base, 1), (place as u32, 3), (0, 1), (0, 1)]);
        assert_eq!(decoder.scene(), Some(&resources[0].bytes[..]));
        for (number, resource) in resources.iter().enumerate() {
            assert_eq!(decoder.resource(number), Some(&resource.bytes[..]), "{number}");
        }
        let bytes: u64 = entries.iter().map(|entry: &ResourceEntry| entry.bytes).sum();
        assert!(file.len() as u64 > plain.len() as u64 + bytes);
        // Without resources nothing is different.
        assert_eq!(Encoder::default().resources(Vec::new()).encode_to_vec(&mesh).unwrap(), plain);
    }

    #[test]
    fn what_cannot_be_is_refused() {
        let mesh = shapes::sphere(3);
        let refused = |resources: Vec<Resource>, why: &str| match Encoder::default()
            .resources(resources)
            .encode_to_vec(&mesh)
        {
            Err(Error::Parameter(what)) => assert!(what.contains(why), "{what}"),
            other => panic!("{why}: {other:?}"),
        };
        let scene = Resource { kind: ResourceKind::Scene, ..buffer(Place::Base, b"{}") };
        refused(vec![buffer(Place::Base, b"")], "resource 0 has no bytes");
        refused(vec![buffer(Place::Base, b"x"), scene.clone()], "resource 1 is a scene");
        refused(vec![scene.clone(), scene], "resource 1 is a scene");
        refused(
            vec![buffer(Place::Finest, b"x"), buffer(Place::Base, b"y")],
            "resource 1 stands behind level",
        );
        refused(vec![buffer(Place::Error(f64::NAN), b"x")], "no number");
        refused(vec![buffer(Place::Base, b"x"); (1 << 16) + 1], "65537 resources, allowed 65536");
    }
}
