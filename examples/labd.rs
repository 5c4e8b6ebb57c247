//! lab: labd FILE RUNS [hash]
use unweld::decoder::{self, Decoder};
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let file = std::fs::read(&a[1]).unwrap();
    let runs: usize = a[2].parse().unwrap();
    let mut times = vec![];
    for _ in 0..runs {
        let t = cpu();
        let mut d = Decoder::new(decoder::Options::default());
        d.push(&file);
        let mut h = 0xcbf29ce484222325u64;
        let mut add = |x: u64| h = (h ^ x).wrapping_mul(0x100000001b3).rotate_left(7);
        while let Some(e) = d.poll().unwrap() {
            if a.len() > 3 {
                for b in format!("{e:?}").bytes() {
                    add(b.into())
                }
            }
        }
        times.push(cpu() - t);
        if a.len() > 3 {
            let m = d.mesh();
            for p in &m.positions {
                for x in p {
                    add(*x as u64)
                }
            }
            for t in m.table.triangles() {
                for v in m.table.triangle(t) {
                    add(v.0.into())
                }
            }
            println!("{} {} {} {h:016x}", a[1], m.positions.len(), m.table.triangle_count());
        }
    }
    times.sort_by(f64::total_cmp);
    if a.len() <= 3 {
        println!("{} bytes, median {:.4} min {:.4} s", file.len(), times[runs / 2], times[0]);
    }
}
fn cpu() -> f64 {
    let s = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap();
    s.split(' ').next().unwrap().parse::<f64>().unwrap() / 1e9
}
