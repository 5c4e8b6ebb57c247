//! The command line as a user has it: the built program, its files, its output, its exit codes.
#![cfg(feature = "cli")]

mod bake;
mod batch;
#[cfg(feature = "cloud")]
mod cloud;
mod cut;
mod decode;
mod encode;
mod errors;
mod exact;
mod files;
mod foreign;
mod inputs;
mod measure;
mod serve;
mod sets;
mod simplify;
mod verify;
mod view;

use serde_json::Value;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use tempfile::TempDir;
use unweld::formats::{self, Precision, write_ply};
use unweld::mesh::{IndexedMesh, shapes};

/// A folder for a test's files.
struct Folder(TempDir);

/// What a run left behind.
struct Run {
    code: i32,
    out: Vec<u8>,
    err: String,
}

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    /// With a mesh of 1,280 triangles and its code: `sphere.ply` and `sphere.uwm`.
    fn with_sphere() -> Self {
        let folder = Self::new();
        folder.mesh("sphere.ply", &shapes::bumpy_sphere(3, 1));
        folder
            .run("encode sphere.ply -o sphere.uwm --base-vertices 40 --keyframes every:3 --preview off")
            .succeeded();
        folder
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn mesh(&self, name: &str, mesh: &IndexedMesh) {
        let mut file = std::fs::File::create(self.path(name)).unwrap();
        write_ply(mesh, Precision::Float64, &mut file).unwrap();
    }

    fn write(&self, name: &str, bytes: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), bytes).unwrap();
    }

    fn bytes(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap()
    }

    fn read(&self, name: &str) -> IndexedMesh {
        formats::read(&self.path(name)).unwrap().mesh
    }

    /// Names of all files, sorted.
    fn list(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.0.path()).unwrap();
        let mut names: Vec<String> =
            entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    /// Runs the program in this folder; arguments are separated by blanks.
    fn run(&self, arguments: &str) -> Run {
        self.run_with(arguments, b"")
    }

    fn run_with(&self, arguments: &str, input: &[u8]) -> Run {
        run(self.0.path(), arguments.split_whitespace().map(Into::into).collect(), input)
    }

    /// The object that `info --json` prints.
    fn info(&self, name: &str) -> Value {
        self.run(&format!("info {name} --json")).json()
    }
}

fn run(folder: &Path, arguments: Vec<std::ffi::OsString>, input: &[u8]) -> Run {
    let mut child = Command::new(env!("CARGO_BIN_EXE_unweld"))
        .args(arguments)
        .current_dir(folder)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let input = input.to_vec();
    // A command that does not read it all closes the pipe: no fault of the test.
    let feeder = std::thread::spawn(move || drop(stdin.write_all(&input)));
    let output = child.wait_with_output().unwrap();
    feeder.join().unwrap();
    let err = String::from_utf8(output.stderr).unwrap();
    assert!(!err.contains("panicked"), "{err}");
    Run { code: output.status.code().expect("not ended by a signal"), out: output.stdout, err }
}

impl Run {
    fn succeeded(self) -> Self {
        assert_eq!((self.code, self.err.as_str()), (0, ""));
        self
    }

    /// One line on standard error, nothing on standard output.
    fn failed(&self, code: i32, line: &str) {
        assert_eq!((self.err.as_str(), self.code), (format!("unweld: {line}\n").as_str(), code));
        assert!(self.out.is_empty(), "{}", self.text());
    }

    fn text(&self) -> &str {
        std::str::from_utf8(&self.out).unwrap()
    }

    fn json(&self) -> Value {
        assert_eq!((self.code, self.err.as_str()), (0, ""));
        serde_json::from_slice(&self.out).unwrap()
    }
}

/// Oriented triangles as positions, each turned to its least corner, sorted: equal for equal surfaces.
fn triangles(mesh: &IndexedMesh) -> Vec<[[u64; 3]; 3]> {
    let turned = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| mesh.positions[v as usize].map(|x| (x + 0.0).to_bits()));
        [[a, b, c], [b, c, a], [c, a, b]].into_iter().min().unwrap()
    };
    let mut all: Vec<_> = mesh.triangles.iter().map(turned).collect();
    all.sort_unstable();
    all
}

fn levels(info: &Value) -> &[Value] {
    info["levels"].as_array().unwrap()
}

fn keys(value: &Value) -> Vec<&str> {
    let mut keys: Vec<&str> = value.as_object().unwrap().keys().map(String::as_str).collect();
    // An object is the same in whatever order they are.
    keys.sort_unstable();
    keys
}
