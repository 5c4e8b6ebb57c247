//! Shows a mesh growing while its bytes arrive: `cargo run --release --example refine -- FILE.uwm [BYTES_A_PACKET]`.
//! Without a file it encodes a sphere first.

use std::error::Error;
use std::fs::File;
use std::io::{Cursor, Read};
use unweld::decoder::{Decoder, Event, Options};
use unweld::encoder::Encoder;
use unweld::mesh::shapes;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let mut source: Box<dyn Read> = match arguments.first() {
        Some(path) => Box::new(File::open(path)?),
        None => Box::new(Cursor::new(Encoder::default().encode_to_vec(&shapes::bumpy_sphere(5, 7))?)),
    };
    let size = arguments.get(1).map_or(Ok(1400), |size| size.parse())?;
    let mut packet = vec![0; usize::max(size, 1)];
    let mut received = 0;
    let mut decoder = Decoder::new(Options::default());
    loop {
        let count = source.read(&mut packet)?;
        if count == 0 {
            break;
        }
        received += count;
        decoder.push(&packet[..count]);
        while let Some(event) = decoder.poll()? {
            let triangles = decoder.mesh().table.triangle_count();
            match event {
                Event::Whole { .. } => println!("{received:>9} bytes: the base, {triangles} triangles"),
                Event::Refined(delta) => {
                    // What a renderer would upload: four ranges and lists, nothing else has changed.
                    let (new, changed) = (delta.triangles.len(), delta.rewritten.len());
                    println!("{received:>9} bytes: {triangles} triangles, {new} new, {changed} changed");
                }
                Event::Level { level, max_error, .. } => {
                    println!("{received:>9} bytes: level {level}, error {max_error:.3e}")
                }
                _ => {}
            }
        }
    }
    decoder.finish()?;
    Ok(())
}
