//! The parallel removal on a GPU and on the processor: one mesh. Skipped where there is no GPU; failed with CI=true if a driver for one is
//! installed that needs none (Debian: mesa-vulkan-drivers). Real meshes as in `real_meshes.rs`.

use std::path::{Path, PathBuf};
use unweld::gpu::Gpu;
use unweld::mesh::{IndexedMesh, shapes};
use unweld::reduce::removal::{Guard, Options, Rule, Surface, View};

/// A GPU, if there is one.
fn gpu() -> Option<Gpu> {
    match Gpu::open() {
        Ok(gpu) => {
            eprintln!("on {}", gpu.name());
            Some(gpu)
        }
        Err(e) => {
            let drivers = Path::new("/usr/share/vulkan/icd.d").read_dir().into_iter().flatten().flatten();
            let is_there =
                drivers.into_iter().any(|d| d.file_name().to_string_lossy().starts_with("lvp_icd"));
            let is_ci = std::env::var("CI").is_ok_and(|ci| ci == "true");
            assert!(!(is_ci && is_there), "the driver of the processor is installed, yet {e}");
            eprintln!("skipped: {e}");
            None
        }
    }
}

/// None, and 19 from all sides, near, far and out of all bounds.
fn views(mesh: &IndexedMesh) -> impl Iterator<Item = Option<View>> {
    let size = mesh.diagonal();
    let round = (0..15).map(move |k| {
        let turn = f64::from(k) * 0.42;
        let far = size * [0.3, 0.8, 1.5, 6.0][k as usize % 4];
        let eye = [far * turn.cos(), far * turn.sin(), far / 3.0];
        View { eye, pixels: f64::from(1 << (k % 7)) / 4.0, height: 1000.0, fov: 40.0 + f64::from(k) }
    });
    let extremes = [
        View { eye: [0.0; 3], pixels: 1e300, height: 1e-300, fov: 179.9 },
        View { eye: [1e300, -1e300, 0.0], pixels: 3.0, height: 1.0, fov: 60.0 },
        View { eye: [1e-300; 3], pixels: 1e-300, height: 1e300, fov: 1e-9 },
        View { eye: [0.0, -size, 0.0], pixels: 200.0, height: 900.0, fov: 10.0 },
    ];
    std::iter::once(None).chain(round.chain(extremes).map(Some))
}

/// Compares all that is told: triangles in their order, and each iteration.
fn compare(gpu: &Gpu, name: &str, mesh: &IndexedMesh, spacing: u32, threads: &[usize]) {
    let surface = Surface::new(mesh, spacing).unwrap();
    let mut loaded = gpu.load(&surface).unwrap();
    for (k, view) in views(mesh).enumerate() {
        let options = Options::default();
        let there = loaded.simplify(view.as_ref(), options).unwrap();
        for &threads in threads {
            let here = surface.simplify(view.as_ref(), Options { threads, ..options }).unwrap();
            assert!(
                here == there,
                "{name}, view {k}, {threads} threads: {:?} and {:?}",
                here.iterations,
                there.iterations
            );
        }
    }
}

/// Triangles at random, a fan that is too wide, one that is not, three sheets on an edge, and all in one place.
fn odd() -> Vec<IndexedMesh> {
    let mut seed = 4u32;
    let mut random = || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        seed >> 8
    };
    let positions: Vec<[f64; 3]> = (0..300).map(|_| std::array::from_fn(|_| f64::from(random()))).collect();
    let soup = (0..200).map(|_| std::array::from_fn(|_| random() % 60)).collect();
    let fan = |n: u32| (1..n).map(|k| [0, k, k + 1]).collect::<Vec<_>>();
    let mut flat = shapes::bumpy_sphere(2, 1);
    flat.positions.iter_mut().for_each(|p| *p = [3.0, p[1].round(), 0.0]);
    let mut sheets = shapes::grid(9, 9);
    let lower = sheets.triangles.clone();
    for sheet in 1..3u32 {
        let name = |v: u32| if v < 10 { v } else { v + 100 * sheet };
        sheets.triangles.extend(lower.iter().map(|t| t.map(name)));
        let moved: Vec<_> =
            (0..100).map(|v| sheets.positions[v]).map(|[x, y, z]| [x, y, z + y * f64::from(sheet)]).collect();
        sheets.positions.extend(moved);
    }
    vec![
        IndexedMesh::new(positions.clone(), soup),
        IndexedMesh::new(positions.clone(), (0..90).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect()),
        IndexedMesh::new(positions.clone(), fan(299)),
        IndexedMesh::new(positions.clone(), fan(200)),
        IndexedMesh::new(positions, (2..100).map(|k| [0, 1, k]).collect()),
        flat,
        sheets,
        IndexedMesh::default(),
    ]
}

#[test]
fn generated_meshes() {
    let Some(gpu) = gpu() else { return };
    let meshes = [
        ("sphere", shapes::bumpy_sphere(4, 9)),
        ("torus", shapes::torus(30, 8)),
        ("torus with a hole", shapes::torus_with_hole(50, 31)),
        ("sheet", shapes::grid(40, 31)),
        ("ring", shapes::annulus(40)),
        ("handles", shapes::handle_body(4)),
        ("two", shapes::two_components()),
        ("strip", shapes::strip(30)),
        ("ears", shapes::disc_with_ears()),
        ("tetrahedron", shapes::tetrahedron()),
    ];
    for (k, (name, mesh)) in meshes.iter().enumerate() {
        compare(&gpu, name, mesh, [3, 5, 9][k % 3], &[1, 2, 8]);
    }
    for (k, mesh) in odd().iter().enumerate() {
        compare(&gpu, &format!("odd mesh {k}"), mesh, 2, &[1, 2, 8]);
    }
}

#[test]
fn all_rules_and_guards() {
    let Some(gpu) = gpu() else { return };
    for mesh in
        [shapes::bumpy_sphere(3, 1), shapes::torus_with_hole(20, 12), shapes::grid(15, 9), odd().remove(6)]
    {
        let surface = Surface::new(&mesh, 3).unwrap();
        let mut loaded = gpu.load(&surface).unwrap();
        for rule in [Rule::Of2015, Rule::Of2016] {
            for guard in [Guard::Veto, Guard::Blind, Guard::Independent] {
                let options = Options { rule, guard, threads: 1 };
                for view in views(&mesh).step_by(5) {
                    let here = surface.simplify(view.as_ref(), options).unwrap();
                    assert_eq!(loaded.simplify(view.as_ref(), options).unwrap(), here, "{options:?}");
                }
            }
        }
    }
}

#[test]
fn real_meshes() {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    let folder = std::env::var_os("UNWELD_DATA").map_or_else(beside, PathBuf::from);
    if !folder.is_dir() {
        eprintln!("skipped: no folder of real meshes at {}", folder.display());
        return;
    }
    let Some(gpu) = gpu() else { return };
    let names = [
        "scan_bunny.ply.gz",
        "organic_horse.ply.gz",
        "cad_fandisk.obj.gz",
        "genus1_rocker_arm.obj.gz",
        "open_elephant_106_holes.off.gz",
        "bench/igea.ply.gz",
    ];
    for (k, name) in names.iter().enumerate() {
        let mesh = unweld::formats::read(&folder.join(name)).unwrap().mesh;
        compare(&gpu, name, &mesh, 3 + k as u32, &[1, 2, 8]);
    }
}

#[cfg(feature = "cli")]
#[test]
fn the_command_tells_of_its_device() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m.ply");
    let mut file = Vec::new();
    let mesh = shapes::bumpy_sphere(3, 1);
    unweld::formats::write_ply(&mesh, unweld::formats::Precision::Float64, &mut file).unwrap();
    std::fs::write(&path, file).unwrap();
    let run = |device: &str| {
        let output = std::process::Command::new(env!("CARGO_BIN_EXE_unweld"))
            .args(["simplify", path.to_str().unwrap(), "-o", "-"])
            .args(["--method", "parallel", "--orbit", "2", "--device", device])
            // Without drivers there is no GPU.
            .env("VK_DRIVER_FILES", "/nowhere")
            .env("VK_ICD_FILENAMES", "/nowhere")
            .output()
            .unwrap();
        (output.status.code(), output.stdout, String::from_utf8(output.stderr).unwrap())
    };
    let [cpu, auto] = ["cpu", "auto"].map(run);
    assert!(cpu.0 == Some(0) && auto.0 == Some(0) && auto.1 == cpu.1, "{cpu:?} {auto:?}");
    assert!(cpu.2.contains("  device     processor\n"), "{}", cpu.2);
    if cfg!(target_os = "linux") {
        assert!(auto.2.contains("the processor computes: there is no GPU"), "{}", auto.2);
        let (code, _, told) = run("gpu");
        assert_eq!(code, Some(2));
        assert!(told.contains("--device gpu: there is no GPU that can compute"), "{told}");
    }
}
