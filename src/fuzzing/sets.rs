//! Sets of meshes: tables, and bases beside other meshes.

use std::sync::{Arc, OnceLock};

use super::choices::Choices;
use crate::codec::keyframe::{self, Expected};
use crate::codec::lift::Cells;
use crate::container::{Header, parse_set};
use crate::decoder::{Decoder, Options};
use crate::encoder::{self, SetInput, SetOrder, Source, encode_set};
use crate::limits::{Budget, Limits};
use crate::mesh::{IndexedMesh, shapes};

/// Reads `data` as a set, and as changes to a small one whose checksum is then mended: members come or are refused, and take no more than is
/// allowed. Then as the base of a mesh beside another one: what is accepted can be written, and is then read as the same mesh.
pub fn fuzz_sets(data: &[u8]) {
    let _ = parse_set(data);
    let mut choices = Choices(data);
    let seeds = seeds();
    let mut file = seeds[choices.below(seeds.len())].clone();
    let table = parse_set(&file).ok().flatten().expect("the writer wrote it").table_bytes as usize;
    let end = Header::SIZE + table;
    for _ in 0..choices.below(4) {
        let range = if choices.below(2) == 0 { end } else { file.len() };
        let at = choices.below(range);
        file[at] ^= choices.byte().unwrap_or(1);
    }
    let sum = crc32c::crc32c(&file[..end - 4]).to_le_bytes();
    file[end - 4..end].copy_from_slice(&sum);
    decode_all(&file);
    beside(choices);
}

/// Decodes all members in their order, as far as they can be.
fn decode_all(file: &[u8]) {
    let Ok(Some(set)) = parse_set(file) else { return };
    let limits = Limits { memory: 1 << 24, work: 1 << 24 };
    let mut other: Option<Arc<[[i32; 3]]>> = None;
    for number in set.in_file_order() {
        let member = &set.members[number as usize];
        assert!(set.chain(number).ends_with(&[number]) && set.cost(number) <= set.file_bytes());
        let there = file.get(member.bytes.start as usize..(member.bytes.end as usize).min(file.len()));
        let mut decoder = Decoder::new(Options { limits, ..Options::default() });
        match other.take() {
            Some(other) if member.leans => decoder.beside(other),
            None if member.leans => return,
            _ => {}
        }
        decoder.push(&member.head);
        decoder.push(there.unwrap_or_default());
        while matches!(decoder.poll(), Ok(Some(_))) {}
        if decoder.level() == Some(0) {
            decoder.mesh().table.check().expect("a member is a manifold");
            let _ = decoder.assembled();
            other = Some(decoder.mesh().positions.as_slice().into());
        }
    }
}

fn beside(mut choices: Choices) {
    let count = 1 + choices.below(40);
    let spread = 1 + choices.below(255) as i32;
    let mut coordinate = || choices.below(256) as i32 % spread;
    let other: Vec<[i32; 3]> = (0..count).map(|_| [coordinate(), coordinate(), coordinate()]).collect();
    let [vertices, triangles] = [3, 1].map(|least| least + choices.below(12) as u32);
    let expected = Expected { vertices, triangles, cells: Cells { bits: 8, precision: 0, lifting: 0 } };
    let budget = || {
        let mut budget = Budget::new(Limits { memory: 1 << 20, work: 1 << 20 });
        budget.receive(1 << 10);
        budget
    };
    let read =
        |payload: &[u8]| keyframe::decode_beside(payload, expected, &other, &mut budget(), |_, _| Ok(()));
    let Ok(mesh) = read(choices.0) else { return };
    let written =
        keyframe::encode_beside(&mesh, &other, &mut budget(), |_, _| 0).expect("it was read with as much");
    let again = read(&written.payload).expect("what was written can be read");
    assert_eq!(again.positions, mesh.positions);
    assert!(again.table.triangles().eq(mesh.table.triangles()));
}

/// Small sets in both orders.
fn seeds() -> &'static [Vec<u8>] {
    static SEEDS: OnceLock<Vec<Vec<u8>>> = OnceLock::new();
    SEEDS.get_or_init(|| {
        let fine = shapes::sphere(1);
        let mut coarse = shapes::sphere(0);
        let count = coarse.positions.len();
        coarse.positions.copy_from_slice(&fine.positions[..count]);
        let torn =
            IndexedMesh::new(coarse.positions.clone(), [coarse.triangles.clone(), vec![[0, 0, 1]]].concat());
        let input =
            |mesh: &IndexedMesh| SetInput { mesh: mesh.clone(), source: Source::default(), exact: None };
        let inputs = [&coarse, &fine, &torn].map(input);
        let options = encoder::Options { position_bits: 8, ..encoder::Options::default() };
        let packed = |order| {
            let mut file = Vec::new();
            encode_set(&inputs, order, &options, &mut |_, _| true, &mut file)
                .expect("small meshes can be packed");
            file
        };
        [SetOrder::Stream, SetOrder::Small].map(packed).to_vec()
    })
}
