//! Decodes files, of a set the finest member, and prints for each its vertices, its triangles, a digest of its triangles as positions in any order, one of its arrays in
//! their order (`-` where there is a residue), and the milliseconds it took: what `web/tests/digest.mjs` must print too, but for the last.
//! Positions are those of the lattice, as the page has them.

use std::time::Instant;
use unweld::codec::walk::Tour;
use unweld::codec::whole::Whole;
use unweld::container::{SetContents, parse_set};
use unweld::decoder::{Decoder, Options, decode};
use unweld::error::Error;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    for path in std::env::args().skip(1) {
        let bytes = std::fs::read(&path)?;
        let begin = Instant::now();
        let decoder = decoded(&bytes)?;
        let time = begin.elapsed();
        let (bare, residue) = (decoder.mesh(), decoder.residue().cloned().unwrap_or_default());
        let lattice = &decoder.contents().ok_or("no contents")?.header.lattice;
        let mesh = Whole::new(bare, &residue, &Tour::new(bare)).on_lattice(lattice);
        let corner = |v: u32| mesh.positions[v as usize].map(|x| (x as f32).to_bits());
        let mut sum = 0u32;
        for t in &mesh.triangles {
            let [a, b, c] = t.map(corner);
            let first = [[a, b, c], [b, c, a], [c, a, b]].into_iter().min().unwrap_or_default();
            sum = sum.wrapping_add(digest(first.into_iter().flatten()));
        }
        let plain = residue.is_empty();
        let positions =
            bare.positions.iter().flat_map(|&p| lattice.position(p).map(|x| (x as f32).to_bits()));
        let indices = bare.table.triangles().flat_map(|t| bare.table.triangle(t).map(|v| v.0));
        let exact = if plain { format!("{:08x}", digest(positions.chain(indices))) } else { "-".into() };
        let name = path.rsplit('/').next().unwrap_or_default();
        let [vertices, triangles] = [mesh.positions.len(), mesh.triangles.len()];
        println!("{name} {triangles} {sum:08x} {exact} {} ms, {vertices} vertices", time.as_millis());
    }
    Ok(())
}

/// A mesh, or the finest member of a set, by those that it takes.
fn decoded(bytes: &[u8]) -> Result<Decoder, Box<dyn std::error::Error>> {
    if !SetContents::is_set(bytes) {
        return Ok(decode(bytes, Options::default())?);
    }
    let set = parse_set(bytes).map_err(Error::from)?.ok_or("a table that is cut off")?;
    let mut before: Option<Decoder> = None;
    for number in set.chain(0) {
        let member = &set.members[number as usize];
        let mut decoder = Decoder::new(Options::default());
        if let Some(before) = before.filter(|_| member.leans) {
            decoder.beside(before.mesh().positions.as_slice().into());
        }
        decoder.push(&member.head);
        decoder.push(&bytes[member.bytes.start as usize..member.bytes.end as usize]);
        while decoder.poll()?.is_some() {}
        decoder.finish()?;
        before = Some(decoder);
    }
    Ok(before.ok_or("a set without members")?)
}

/// FNV-1a over numbers of 32 bits.
fn digest(numbers: impl Iterator<Item = u32>) -> u32 {
    numbers.fold(0x811c_9dc5, |hash, number| (hash ^ number).wrapping_mul(0x0100_0193))
}
