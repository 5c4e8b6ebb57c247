//! Chapter 15.1: several meshes in one file; and both decoders on such files.

use std::sync::Arc;

use unweld::codec::keyframe::{self, Expected};
use unweld::codec::lift::Cells;
use unweld::container::{SetContents, parse_set};
use unweld::decoder::{Decoder, Options as DecoderOptions};
use unweld::encoder::{Options, SetInput, SetOrder, Source, encode_set};
use unweld::limits::{Budget, Limits};
use unweld::mesh::{IndexedMesh, shapes};

use super::agree::sorted;
use super::container::{BASE, Fields, File, Result, crc32c, demand};
use super::decode::decode_beside;
use super::golden::{essence, load, painted, path, snapped};
use super::keyframe as reference;
use super::lifting::Scale;
use super::on_shapes::same_triangles;
use super::table::read_lattice;
use super::walk::{Mesh, Walk};

/// A member: its file, and whether it stands beside the one before it.
struct Member {
    bytes: Vec<u8>,
    beside: bool,
}

/// §15.1: whether the finest stands first, and the members in the order of the file.
fn read_set(bytes: &[u8]) -> Result<(bool, Vec<Member>)> {
    let mut fields = Fields(bytes);
    demand(fields.take(8)? == b"\x89UWM\r\n\x1A\n" && fields.u16()? == 1, "3.2: magic and version")?;
    let order = fields.u8()?;
    demand(order <= 1 && fields.u8()? == 2 && fields.u8()? == 0, "15.1: header")?;
    let length = fields.u24()? as usize;
    let table = fields.take(length)?;
    demand(length >= 4, "15.1: table too short")?;
    let (table, sum) = table.split_at(length - 4);
    demand(sum == crc32c(&bytes[..16 + table.len()]).to_le_bytes(), "3.4: checksum of the table")?;
    let mut table = Fields(table);
    let whole = table.0;
    read_lattice(&mut table)?;
    let lattice = &whole[..whole.len() - table.0.len()];
    let n = table.varint()?;
    demand((1..=4096).contains(&n), "15.1: number of members")?;
    let mut heads = Vec::new();
    for k in 0..n {
        let (marks, attributes) = (table.u8()?, table.u8()?);
        demand(marks <= u8::from(k > 0), "15.1: marks")?;
        let length = table.varint()?;
        demand(length <= table.0.len() as u64, "15.1: length of a table")?;
        let own = [lattice, table.take(length as usize)?].concat();
        let mut head = b"\x89UWM\r\n\x1A\n\x01\x00\x00\x00".to_vec();
        head.push(attributes);
        head.extend(&(own.len() as u32 + 4).to_le_bytes()[..3]);
        head.extend(own);
        head.extend(crc32c(&head).to_le_bytes());
        heads.push((head, marks == 1));
    }
    demand(table.0.is_empty(), "15.1: bytes behind the last member")?;
    let mut members = Vec::new();
    for (head, beside) in heads {
        let length = atom_bytes(&head)?;
        members.push(Member { bytes: [&head, fields.take(length)?].concat(), beside });
    }
    demand(fields.0.is_empty(), "15.1: trailing bytes")?;
    Ok((order == 1, members))
}

/// How many bytes the atoms have that a header and table tell of.
fn atom_bytes(head: &[u8]) -> Result<usize> {
    File::head(head).map(|(file, _)| file.atoms.iter().map(|atom| atom.length).sum())
}

/// Where the vertices of a member are, as the reference has them and as the crate has.
type BothPlaces = (Vec<[i64; 3]>, Arc<[[i32; 3]]>);

/// Where the vertices of a mesh are, in the order of its walk.
fn places(mesh: &Mesh) -> Vec<[i64; 3]> {
    Walk::of(mesh).vertices(mesh).into_iter().map(|v| mesh.points[v]).collect()
}

/// Both decoders on a set; they must show the same, which is the inputs.
fn agree_on(bytes: &[u8], inputs: &[IndexedMesh]) {
    let set = parse_set(bytes).unwrap().unwrap();
    let (finest_first, members) = read_set(bytes).unwrap();
    assert_eq!((finest_first, members.len()), (set.finest_first, inputs.len()));
    let mut other: Option<BothPlaces> = None;
    for (number, member) in set.in_file_order().into_iter().zip(&members) {
        let theirs = &set.members[number as usize];
        assert_eq!(member.beside, theirs.leans);
        let mut decoder = Decoder::new(DecoderOptions::default());
        let beside = other.take().filter(|_| member.beside);
        let (ours, known) = beside.unzip();
        if let Some(known) = known {
            decoder.beside(known);
        }
        decoder.push(&theirs.head);
        decoder.push(&bytes[theirs.bytes.start as usize..theirs.bytes.end as usize]);
        while decoder.poll().unwrap().is_some() {}
        decoder.finish().unwrap();
        let file = File::read(&member.bytes).unwrap();
        assert_eq!(file.levels.len(), 1, "15.1: one level");
        let mut points = Vec::new();
        let whole =
            decode_beside(&file, 0, ours.as_deref(), &mut |_, mesh, _| points = places(mesh)).unwrap();
        let assembled = decoder.assembled().unwrap();
        let of_crate = assembled.triangles.iter().map(|t| t.map(|v| assembled.positions[v as usize]));
        let of_reference = whole.triangles.iter().map(|t| t.map(|v| whole.positions[v]));
        assert!(sorted(of_crate) == sorted(of_reference), "member {number} is not the same");
        assert_eq!(whole.values.is_empty(), assembled.attributes.is_empty());
        same_triangles(&inputs[number as usize], &whole, &file);
        other = Some((points, decoder.mesh().positions.as_slice().into()));
    }
}

/// A ball with attributes and a triangle twice; its first vertices alone, then some of these moved; a torus beside it.
fn inputs() -> Vec<IndexedMesh> {
    let fine = painted();
    let mut coarse = snapped(shapes::sphere(0));
    coarse.positions = fine.positions[..coarse.positions.len()].to_vec();
    let mut moved = coarse.clone();
    moved.positions[3] = [0.25, -0.5, 0.125];
    moved.triangles.truncate(15);
    vec![fine, snapped(shapes::torus(4, 5)), coarse, moved]
}

fn packed(inputs: &[IndexedMesh], order: SetOrder) -> Vec<u8> {
    let input = |mesh: &IndexedMesh| SetInput { mesh: mesh.clone(), source: Source::default(), exact: None };
    let inputs: Vec<_> = inputs.iter().map(input).collect();
    let options = Options { position_bits: 10, ..Options::default() };
    let mut file = Vec::new();
    encode_set(&inputs, order, &options, &mut |_, _| true, &mut file).unwrap();
    file
}

const GOLDEN: [(&str, SetOrder); 2] = [("set.uwm", SetOrder::Stream), ("small_set.uwm", SetOrder::Small)];

#[test]
fn the_encoder_still_writes_these_sets() {
    let bless = std::env::var_os("UNWELD_BLESS").is_some_and(|value| value == "1");
    for (name, order) in GOLDEN {
        let written = packed(&inputs(), order);
        if bless {
            std::fs::write(path(name), &written).unwrap();
        }
        let [ours, golden] = [written, load(name)].map(|bytes| {
            let (order, members) = read_set(&bytes).unwrap();
            let own = members.iter().map(|member| (essence(&member.bytes).bytes(), member.beside));
            (order, own.collect::<Vec<_>>())
        });
        assert!(ours == golden, "{name}: other bytes");
    }
}

#[test]
fn both_decoders_read_the_sets() {
    for (name, _) in GOLDEN {
        agree_on(&load(name), &inputs());
    }
    let small = parse_set(&load("small_set.uwm")).unwrap().unwrap();
    // The coarse meshes know nearly all of their vertices by the one before.
    assert_eq!([0, 2, 3].map(|j| small.members[j].leans), [false, false, true]);
    assert_eq!((small.chain(3), small.chain(0)), (vec![2, 3], vec![0]));
}

/// The fine ball and the coarse one, whose vertices are its first, next to each other.
fn nested() -> [IndexedMesh; 2] {
    let [fine, _, coarse, _] = <[IndexedMesh; 4]>::try_from(inputs()).unwrap();
    [fine, coarse]
}

#[test]
fn neighbours_that_share_vertices() {
    for order in [SetOrder::Small, SetOrder::Stream] {
        let bytes = packed(&nested(), order);
        let set = parse_set(&bytes).unwrap().unwrap();
        let second = *set.in_file_order().last().unwrap();
        assert!(set.members[second as usize].leans, "{order:?}");
        agree_on(&bytes, &nested());
    }
}

/// The base of a member with its bits changed: both decoders refuse it, or read the same of it.
#[test]
fn changed_bases_are_the_same_to_both() {
    let bytes = packed(&nested(), SetOrder::Small);
    let (_, members) = read_set(&bytes).unwrap();
    let [fine, coarse] = [0, 1].map(|k: usize| File::read(&members[k].bytes).unwrap());
    let mut known = Vec::new();
    decode_beside(&fine, 0, None, &mut |_, mesh, _| known = places(mesh)).unwrap();
    let other: Vec<[i32; 3]> = known.iter().map(|p| p.map(|x| x as i32)).collect();
    let (payload, level) = (coarse.payload(BASE, 0), coarse.levels[0]);
    let (mut read, mut refused) = (0, 0);
    for k in 0..8 * payload.len() {
        let mut payload = payload.clone();
        payload[k / 8] ^= 1 << (k % 8);
        let ours = reference::read_beside(&payload, level, Scale::plain(10), &known, &mut |_, _| Ok(()));
        let cells = Cells { bits: 10, precision: 0, lifting: 0 };
        let [vertices, triangles] = [level.vertices, level.triangles].map(|n| n as u32);
        let expected = Expected { vertices, triangles, cells };
        let mut budget = Budget::new(Limits::default());
        budget.receive(1 << 20);
        let theirs = keyframe::decode_beside(&payload, expected, &other, &mut budget, |_, _| Ok(()));
        match (ours, theirs) {
            (Ok(ours), Ok(theirs)) => {
                let theirs: Vec<_> = theirs.positions.iter().map(|p| p.map(i64::from)).collect();
                assert_eq!(places(&ours), theirs, "bit {k}");
                read += 1;
            }
            (Err(_), Err(_)) => refused += 1,
            (ours, theirs) => {
                panic!("bit {k}: {:?} and {:?}", ours.err(), theirs.err().map(|e| e.to_string()))
            }
        }
    }
    assert!(refused > 0 && read + refused == 8 * payload.len());
}

/// Each byte of header and table changed, the checksum mended: whatever it says, both take it or refuse it.
#[test]
fn changed_tables_are_the_same_to_both() {
    let bytes = packed(&nested(), SetOrder::Stream);
    let set = parse_set(&bytes).unwrap().unwrap();
    let end = 16 + set.table_bytes as usize;
    for k in 10..end - 4 {
        for change in [1, 2, 128, 255] {
            let mut bytes = bytes.clone();
            bytes[k] ^= change;
            let sum = crc32c(&bytes[..end - 4]).to_le_bytes();
            bytes[end - 4..end].copy_from_slice(&sum);
            let ours = read_set(&bytes).and_then(|(_, members)| {
                members.iter().try_for_each(|member| {
                    let told = File::read(&member.bytes)?;
                    demand(told.levels.len() == 1, "15.1: one level")
                })
            });
            let theirs = parse_set(&bytes).is_ok_and(|set| set.is_some_and(|set| is_whole(&bytes, &set)));
            assert_eq!(ours.is_ok(), theirs, "byte {k} changed by {change}: {:?}", ours.err());
        }
    }
}

/// Whether the atoms of all members are there, and theirs.
fn is_whole(bytes: &[u8], set: &SetContents) -> bool {
    let fits = |member: &unweld::container::Member| {
        let Some(own) = bytes.get(member.bytes.start as usize..member.bytes.end as usize) else {
            return false;
        };
        let start = member.contents.header.table_end();
        let atom = |k: usize| {
            let atom = &member.contents.atoms[k];
            member
                .contents
                .check(k, &own[(atom.offset - start) as usize..(atom.end() - start) as usize])
                .is_ok()
        };
        (0..member.contents.atoms.len()).all(atom)
    };
    set.file_bytes() == bytes.len() as u64 && set.members.iter().all(fits)
}
