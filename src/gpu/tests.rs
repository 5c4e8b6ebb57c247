use super::*;
use crate::error::Error;
use crate::mesh::shapes;

#[test]
fn a_gpu_that_is_taken_away_is_an_error() {
    let Ok(gpu) = Gpu::open() else {
        eprintln!("skipped: there is no GPU");
        return;
    };
    let surface = Surface::new(&shapes::bumpy_sphere(2, 1), 3).unwrap();
    let mut loaded = gpu.load(&surface).unwrap();
    loaded.simplify(None, Options::default()).unwrap();
    gpu.device.device.destroy();
    for _ in 0..2 {
        let told = loaded.simplify(None, Options::default());
        assert!(matches!(&told, Err(Error::Io(e)) if e.to_string().starts_with("the GPU ")), "{told:?}");
    }
    let told = gpu.load(&surface).map(|_| ());
    assert!(matches!(&told, Err(Error::Io(_))), "{told:?}");
}
