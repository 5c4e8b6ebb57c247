use unweld::encoder::{Encoder, Options};
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let bits: u32 = a[3].parse().unwrap();
    let source = unweld::formats::read(a[1].as_ref()).unwrap();
    let mut e = Encoder::new(Options { position_bits: bits, ..Options::default() });
    let mut file = Vec::new();
    let r = e.encode(&source.mesh, &mut file).unwrap();
    std::fs::write(&a[2], &file).unwrap();
    println!("{} {} bits {}", a[1], file.len(), file.len() as f64 * 8.0 / source.mesh.positions.len() as f64);
    let _ = r;
}
