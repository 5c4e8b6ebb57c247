//! Resources: bytes that the mesh does not need and a scene does (spec §3.3, §3.9).

use std::ops::Range;

use super::contents::Contents;
use super::fields::Fields;
use crate::error::FormatError;

/// What a resource is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ResourceKind {
    /// The scene's JSON, a glTF without its geometry; deflated in the file (spec §3.9). At most one, the first of the resources.
    Scene,
    /// A buffer of the scene: the r-th of this kind, from 0, is `buffers[r]` of its JSON.
    Buffer,
}

impl ResourceKind {
    pub(super) fn from_byte(byte: u8) -> Option<Self> {
        match byte {
            0 => Some(Self::Scene),
            1 => Some(Self::Buffer),
            _ => None,
        }
    }

    #[cfg(any(test, feature = "encode"))]
    pub(super) fn to_byte(self) -> u8 {
        match self {
            Self::Scene => 0,
            Self::Buffer => 1,
        }
    }

    /// Its name in a word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scene => "scene",
            Self::Buffer => "buffer",
        }
    }
}

/// What the table of contents says of a resource.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ResourceEntry {
    /// What it is.
    pub kind: ResourceKind,
    /// The level behind whose atoms it stands, 0 to the base; not above that of the resource before it.
    pub place: u32,
    /// Its atoms, by their places in [`Contents::atoms`]: one behind the other, at least one.
    pub atoms: Range<usize>,
    /// Bytes of all of them, at least 1.
    pub bytes: u64,
}

impl ResourceEntry {
    /// What stands in front of its atoms in the table: kind and place.
    pub(super) fn read(fields: &mut Fields, number: usize) -> Result<Self, FormatError> {
        let at = fields.offset();
        let byte = fields.u8()?;
        let kind = ResourceKind::from_byte(byte)
            .ok_or_else(|| fields.fault(at, format!("unknown kind of resource {byte}")))?;
        fields.require(kind != ResourceKind::Scene || number == 0, at, || {
            "a scene that is not the first resource".to_owned()
        })?;
        let place = fields.count(u32::MAX, "the place of a resource")?;
        Ok(Self { kind, place, atoms: 0..0, bytes: 0 })
    }
}

impl Contents {
    /// The number of the resource that is the scene's JSON, if there is one.
    pub fn scene(&self) -> Option<usize> {
        self.resources.iter().position(|entry| entry.kind == ResourceKind::Scene)
    }

    /// The number of the resource that is `buffers[r]` of the scene's JSON.
    pub fn buffer(&self, r: usize) -> Option<usize> {
        let number = r + usize::from(self.scene().is_some());
        (number < self.resources.len()).then_some(number)
    }

    /// The numbers of the resources that stand behind the atoms of level `j`.
    pub fn resources_at(&self, j: u32) -> Range<usize> {
        let first = self.resources.partition_point(|entry| entry.place > j);
        first..self.resources.partition_point(|entry| entry.place >= j)
    }

    /// The atoms of the resources that stand behind those of level `j`; an empty range at their end where there are none.
    pub fn resource_atoms(&self, j: u32) -> Range<usize> {
        let end = self.steps(j).end;
        match self.resources.get(self.resources_at(j)) {
            Some([first, .., last]) => first.atoms.start..last.atoms.end,
            Some([only]) => only.atoms.clone(),
            _ => end..end,
        }
    }

    /// The resource that an atom is of.
    pub fn resource_of(&self, atom: usize) -> Option<usize> {
        let number = self.resources.partition_point(|entry| entry.atoms.end <= atom);
        self.resources.get(number).filter(|entry| entry.atoms.contains(&atom)).map(|_| number)
    }

    /// Checks the bytes of resource `number`, all that it takes in the file, against its atoms' lengths and checksums (spec §3.4).
    ///
    /// # Errors
    /// [`FormatError`] where they differ, or where the file has no such resource.
    pub fn check_resource(&self, number: usize, bytes: &[u8]) -> Result<(), FormatError> {
        let Some(entry) = self.resources.get(number) else {
            return Err(FormatError::new(0, "3.3", format!("there is no resource {number}")));
        };
        let offset = self.bytes(entry.atoms.clone()).start;
        if bytes.len() as u64 != entry.bytes {
            let what = format!("resource {number} has {} bytes instead of {}", bytes.len(), entry.bytes);
            return Err(FormatError::new(offset, "3.3", what));
        }
        let mut rest = bytes;
        for index in entry.atoms.clone() {
            let (atom, behind) = rest.split_at(self.atoms[index].length as usize);
            self.check(index, atom)?;
            rest = behind;
        }
        Ok(())
    }
}

#[cfg(test)]
#[expect(clippy::single_range_in_vec_init, reason = "lists of ranges are meant")]
mod tests {
    use super::*;
    use crate::container::testing::{self, resourced_file};
    use crate::container::{
        AtomKind, FileBuilder, Parsed, Parser, Want, parse_contents, plan, plan_from_keyframe,
    };
    use crate::error::Error;
    use crate::fuzzing::mend;

    /// The example of spec §3.9: that of §3.8 with the scene `{}`, stored, behind the base, and the buffer `xyz` behind level 0.
    #[rustfmt::skip]
    const EXAMPLE: [u8; 86] = [
        0x89, 0x55, 0x57, 0x4D, 0x0D, 0x0A, 0x1A, 0x0A, 0x01, 0x00, 0x00, 0x00, 0x80, 0x3A, 0x00, 0x00,
        0x68, 0x00, 0x00, 0x80, 0xBF, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x40, 0x00, 0x00, 0x00,
        0x3F, 0x00, 0xFF, 0x01, 0xEF, 0x01, 0x02, 0x00, 0x01, 0x08, 0x39, 0x91, 0x01, 0x00, 0x06, 0x29,
        0xD0, 0x02, 0x04, 0x04, 0x00, 0x80, 0x3F, 0x00, 0x3F, 0x06, 0x4A, 0x51, 0x04, 0x9F, 0xFD, 0x01,
        0x9F, 0xFB, 0x01, 0x04, 0xE2, 0xE6, 0xBC, 0x41, 0x1B, 0x96, 0x61, 0x62, 0x63, 0x00, 0x02, 0x7B,
        0x7D, 0x64, 0x65, 0x78, 0x79, 0x7A,
    ];

    #[test]
    fn the_bytes_of_the_specification() {
        let contents = parse_contents(&EXAMPLE).unwrap().unwrap();
        let entry =
            |kind, place, atom: usize, bytes| ResourceEntry { kind, place, atoms: atom..atom + 1, bytes };
        let [scene, buffer] = [ResourceKind::Scene, ResourceKind::Buffer];
        assert_eq!(contents.resources, [entry(scene, 1, 1, 4), entry(buffer, 0, 3, 3)]);
        let kinds: Vec<_> =
            contents.atoms.iter().map(|atom| (atom.kind, atom.level, atom.vertices_after)).collect();
        let (base, finer) = ((AtomKind::Base, 1, 4), (AtomKind::Refinement, 0, 5));
        assert_eq!(kinds, [base, (AtomKind::Resource, 1, 4), finer, (AtomKind::Resource, 0, 5)]);
        assert_eq!((contents.steps(1), contents.steps(0), contents.prefix(1)), (0..1, 2..3, 0..2));
        let mut parser = Parser::new();
        let (mut input, mut payloads) = (&EXAMPLE[..], Vec::new());
        loop {
            match parser.parse(&mut input).unwrap() {
                Parsed::Atom { payload, .. } => payloads.push(payload.to_vec()),
                Parsed::End => break,
                _ => {}
            }
        }
        assert_eq!(payloads, [&b"abc"[..], b"\x00\x02{}", b"de", b"xyz"]);
        // And written.
        let mut file =
            FileBuilder::new(testing::golden_header().lattice, [255, 0, 16], contents.levels.clone());
        file.atom(AtomKind::Refinement, 0, 1, 2, b"de".to_vec());
        file.resource(scene, 1, b"\x00\x02{}");
        file.payload(AtomKind::Base, 1, b"abc");
        file.resource(buffer, 0, b"xyz");
        let mut written = Vec::new();
        file.write(&mut written).unwrap();
        assert_eq!(written, EXAMPLE);
    }

    #[test]
    fn each_rule_is_checked() {
        let rules: [(usize, &[u8], u64, &str); 9] = [
            (38, &[0], 38, "no resources where the header tells of some"),
            (39, &[2], 39, "unknown kind of resource 2"),
            (39, &[0xFF], 39, "unknown kind of resource 255"),
            (44, &[0], 44, "a scene that is not the first resource"),
            (40, &[2], 39, "a resource stands behind level 2, allowed 0 to 1"),
            (45, &[2], 44, "a resource stands behind level 2, allowed 0 to 1"),
            (41, &[0], 41, "an empty atom"),
            // The second stands before the first, which is where it may stand.
            (40, &[0, 8, 0x39, 0x91, 1, 1], 44, "a resource stands behind level 1, allowed 0 to 0"),
            (46, &[0], 46, "an empty atom"),
        ];
        for (at, change, offset, what) in rules {
            let mut bytes = EXAMPLE;
            bytes[at..at + change.len()].copy_from_slice(change);
            mend(&mut bytes);
            let fault = parse_contents(&bytes).expect_err("a rule is broken");
            assert_eq!(fault, FormatError::new(offset, "3.3", what), "{change:?} at {at}");
        }
        // More than there may be, whatever follows; and more than follow.
        let counted = |count: &[u8]| {
            let mut bytes = [&EXAMPLE[..38], count, &EXAMPLE[39..]].concat();
            bytes[13] += count.len() as u8 - 1;
            mend(&mut bytes);
            parse_contents(&bytes).expect_err("a rule is broken").what
        };
        assert_eq!(counted(&[0x81, 0x80, 0x04]), "the number of resources is 65537, allowed 65536");
        assert_eq!(counted(&[0x80, 0x80, 0x04]), "unknown kind of resource 2");
        // Without the mark what tells of them is taken for levels.
        let mut bytes = EXAMPLE;
        bytes[12] = 0;
        mend(&mut bytes);
        assert!(parse_contents(&bytes).is_err());
    }

    #[test]
    fn no_more_atoms_than_allowed() {
        let atoms = |count: usize| {
            let mut bytes = EXAMPLE[..46].to_vec();
            bytes.extend([3, 0, 0].repeat(count - 4));
            bytes.extend(&EXAMPLE[46..74]);
            let length = bytes.len() as u32 - 16;
            bytes[13..16].copy_from_slice(&length.to_le_bytes()[..3]);
            mend(&mut bytes);
            parse_contents(&bytes).map(|contents| contents.unwrap().atoms.len())
        };
        let most = crate::limits::MAX_ATOMS as usize;
        assert_eq!(atoms(most), Ok(most));
        assert_eq!(atoms(most + 1).unwrap_err().what, "more than 1048576 atoms");
    }

    /// Atoms: 0 base, 1 2 resources of the base, 3 to 8 level 1, 9 10 a resource behind it, 11 to 13 level 0, 14 a resource, 15 residue,
    /// 16 attributes, 17 metadata, 18 keyframe of level 1.
    #[test]
    fn what_belongs_to_a_level() {
        let contents = testing::contents(&resourced_file());
        assert_eq!([2, 1, 0].map(|j| contents.steps(j)), [0..1, 3..9, 11..14]);
        assert_eq!([3, 2, 1, 0].map(|j| contents.resource_atoms(j)), [0..0, 1..3, 9..11, 14..15]);
        assert_eq!([3, 2, 1, 0].map(|j| contents.resources_at(j)), [0..0, 0..2, 2..3, 3..4]);
        assert_eq!([2, 1, 0].map(|j| contents.prefix(j)), [0..3, 0..11, 0..18]);
        assert_eq!((contents.attribute_atoms(1), contents.born(1)), (7..9, [4, 4]));
        assert_eq!(contents.beyond_mesh(), 14..18);
        assert_eq!(
            (contents.scene(), contents.buffer(0), contents.buffer(2), contents.buffer(3)),
            (Some(0), Some(1), Some(3), None)
        );
        assert_eq!(
            [0, 1, 2, 8, 9, 10, 14, 18].map(|atom| contents.resource_of(atom)),
            [None, Some(0), Some(1), None, Some(2), Some(2), Some(3), None]
        );
    }

    #[test]
    fn plans_have_what_belongs_to_their_levels() {
        let contents = testing::contents(&resourced_file());
        let atoms =
            |plan: crate::container::Plan| plan.parts.into_iter().map(|part| part.atoms).collect::<Vec<_>>();
        let whole = |want| atoms(plan(&contents, want));
        assert_eq!([2, 1, 0].map(|j| whole(Want::Level(j))), [vec![0..3], vec![0..11], vec![0..18]]);
        let triangles = |j: usize| contents.levels[j].triangles;
        assert_eq!(whole(Want::Triangles(0)), [0..3]);
        assert_eq!(whole(Want::Triangles(triangles(1))), [0..11]);
        assert_eq!(whole(Want::Triangles(triangles(0))), [0..15]);
        assert_eq!(whole(Want::Triangles(triangles(1) - 1)), [0..6], "all but the birth");
        // Their bytes count.
        let bytes = |end: usize| Want::Bytes(contents.atoms[end - 1].end());
        assert_eq!(
            [1, 2, 3, 4, 10, 11].map(|end| whole(bytes(end))),
            [1, 2, 3, 4, 10, 11].map(|end| vec![0..end])
        );
        // A way in by the keyframe passes by those of the base and of level 1, which come first.
        assert_eq!(atoms(plan_from_keyframe(&contents, 1)), [1..3, 9..11, 18..19]);
        assert_eq!(atoms(plan_from_keyframe(&contents, 0)), [1..3, 9..11, 18..19, 11..18]);
        assert_eq!(atoms(plan_from_keyframe(&contents, 2)), [0..3]);
        let without = |plan: crate::container::Plan, numbers: &[usize]| {
            atoms(plan.without(&contents, |k| numbers.contains(&k)))
        };
        assert_eq!(without(plan_from_keyframe(&contents, 0), &[0, 1, 2, 3]), [18..19, 11..14, 15..18]);
        assert_eq!(without(plan_from_keyframe(&contents, 0), &[0, 3]), [2..3, 9..11, 18..19, 11..14, 15..18]);
        assert_eq!(without(plan(&contents, Want::All), &[2]), [0..9, 11..18]);
        assert_eq!(without(plan(&contents, Want::All), &[]), [0..18]);
        assert_eq!(without(plan(&contents, bytes(10)), &[2]), [0..9], "half of it");
    }

    #[test]
    fn the_bytes_of_one_are_checked() {
        let file = resourced_file();
        let (bytes, contents) = (testing::bytes(&file), testing::contents(&file));
        let range = contents.bytes(contents.resources[2].atoms.clone());
        let own = &bytes[range.start as usize..range.end as usize];
        assert_eq!(own, b"smallpicture");
        assert_eq!(contents.check_resource(2, own), Ok(()));
        assert!(contents.check_resource(2, &own[1..]).is_err() && contents.check_resource(1, own).is_err());
        assert!(contents.check_resource(4, own).is_err());
        let mut other = own.to_vec();
        other[7] ^= 1;
        let fault = contents.check_resource(2, &other).unwrap_err();
        assert_eq!((fault.offset, fault.section), (range.start + 5, "3.4"));
    }

    #[test]
    fn what_is_out_of_order_is_not_written() {
        let refused = |change: fn(&mut FileBuilder), why: &str| {
            let mut file = resourced_file();
            change(&mut file);
            match file.write(&mut Vec::new()) {
                Err(Error::Parameter(what)) => assert!(what.contains(why), "{what}"),
                other => panic!("{why}: {other:?}"),
            }
        };
        refused(
            |file| file.resource(ResourceKind::Buffer, 1, b"late"),
            "resource 3 does not stand behind level 0",
        );
        refused(|file| file.resource(ResourceKind::Buffer, 3, b"far"), "does not stand");
        refused(|file| file.resource(ResourceKind::Scene, 0, b"two"), "a scene that is not the first");
        refused(|file| file.resource(ResourceKind::Buffer, 0, b""), "resource 4 has no bytes");
        refused(|file| file.atom(AtomKind::Resource, 0, 0, 0, b"?".to_vec()), "not told of");
        refused(|file| file.resources[2].atoms = 1, "does not stand");
    }
}
