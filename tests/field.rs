//! Situations of public reports, each with the expectation that stands beside it: the command line must do what that says.
//!
//! `KINDS` names what is checked of each kind of situation. The files are not part of the repository: they are looked for in the
//! folder `field` of `$UNWELD_DATA` or `../shared/data`, and without them the test says so and passes.
#![cfg(feature = "cli")]

use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use unweld::formats;
use unweld::mesh::IndexedMesh;

/// Panics where an expectation does not hold.
type Check = fn(&Case);

/// What is checked of each kind.
const KINDS: [(&str, Check); 5] = [
    ("non_convex_polygons", Case::survives),
    ("not_stl_wrong_cause", Case::is_read_or_named),
    ("ply_header_and_number_variants_refused", Case::survives),
    ("stl_count_disagrees_with_length", Case::tells_both_counts),
    ("text_stl_variants_refused", Case::survives),
];

/// The folder of situations, or `None` with a message.
fn field() -> Option<PathBuf> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    let folder = std::env::var_os("UNWELD_DATA").map_or_else(beside, PathBuf::from).join("field");
    if !folder.is_dir() {
        eprintln!("skipped: no folder {}", folder.display());
        return None;
    }
    Some(folder)
}

#[test]
fn every_expectation_holds() {
    let Some(folder) = field() else { return };
    for (kind, check) in KINDS {
        let mut cases: Vec<PathBuf> =
            fs::read_dir(folder.join(kind)).unwrap().map(|entry| entry.unwrap().path()).collect();
        cases.sort();
        assert!(!cases.is_empty(), "{kind}");
        for path in cases {
            eprintln!("{}", path.display());
            check(&Case::new(&path));
        }
    }
}

/// A situation.
struct Case {
    name: String,
    input: PathBuf,
    expected: Value,
    /// Where results go.
    folder: tempfile::TempDir,
}

impl Case {
    fn new(path: &Path) -> Self {
        let expected: Value = serde_json::from_slice(&fs::read(path.join("expected.json")).unwrap()).unwrap();
        let input = path.join(expected["input"].as_str().unwrap());
        let folder = tempfile::tempdir().unwrap();
        Self { name: path.file_name().unwrap().to_string_lossy().into_owned(), input, expected, folder }
    }

    /// Runs the program; returns the exit code and what it says on standard error, but for what is not kept beside the shape.
    fn run(&self, args: &[&str]) -> (i32, String) {
        let program = Command::new(env!("CARGO_BIN_EXE_unweld")).args(args).output().unwrap();
        let says = String::from_utf8(program.stderr).unwrap();
        let says = says.lines().filter(|line| !line.contains(": dropped ")).map(|line| format!("{line}\n"));
        (program.status.code().unwrap(), says.collect())
    }

    /// Encodes the input exactly; returns the exit code and what is said.
    fn encode(&self, further: &[&str]) -> (i32, String) {
        let (input, output) = (self.input.to_str().unwrap(), self.coded());
        self.run(&[&["encode", input, "-o", &output, "--exact", "--quiet"], further].concat())
    }

    fn coded(&self) -> String {
        self.folder.path().join("x.uwm").to_str().unwrap().to_owned()
    }

    /// What comes back from the file that was encoded, which must be sound and the same mesh.
    fn decoded(&self) -> IndexedMesh {
        let (coded, input) = (self.coded(), self.input.to_str().unwrap());
        assert_eq!(self.run(&["verify", &coded, input, "--quiet"]), (0, String::new()), "{}", self.name);
        let output = self.folder.path().join("x.ply");
        let decoded = self.run(&["decode", &coded, "-o", output.to_str().unwrap(), "--quiet"]);
        assert_eq!(decoded, (0, String::new()), "{}", self.name);
        formats::read(&output).unwrap().mesh
    }

    /// The file is encoded and decoded, and comes back as what is expected.
    fn survives(&self) {
        assert_eq!(self.encode(&[]), (0, String::new()), "{}", self.name);
        self.is_expected(&self.decoded());
    }

    fn is_expected(&self, mesh: &IndexedMesh) {
        let name = &self.name;
        let corners: Vec<[[f64; 3]; 3]> =
            mesh.triangles.iter().map(|t| t.map(|v| mesh.positions[v as usize])).collect();
        if let Some(count) = self.expected["n_triangles"].as_u64() {
            assert_eq!(corners.len() as u64, count, "{name}");
        }
        let normals: Vec<[f64; 3]> = corners.iter().map(normal).collect();
        if let Some(area) = self.expected["area"].as_f64() {
            let sum: f64 = normals.iter().map(|n| dot(n, n).sqrt() / 2.0).sum();
            assert!((sum - area).abs() < 1e-9 * area, "{name}: an area of {sum}, not {area}");
        }
        if self.expected["all_one_orientation"] == true {
            let sum = normals.iter().fold([0.0; 3], |sum, n| [sum[0] + n[0], sum[1] + n[1], sum[2] + n[2]]);
            assert!(normals.iter().all(|n| dot(n, &sum) > 0.0), "{name}: a triangle is turned: {corners:?}");
        }
        if let Some(triangles) = self.expected["triangles"].as_array() {
            let number = |triangle: &Value, k: usize| triangle[k].as_f64().unwrap();
            let corner = |triangle: &Value, v: usize| [0, 1, 2].map(|k| number(triangle, 3 * v + k));
            let triangles: Vec<_> = triangles.iter().map(|t| [0, 1, 2].map(|v| corner(t, v))).collect();
            assert_eq!(sorted(&corners), sorted(&triangles), "{name}");
        }
    }

    /// Refused for what the file is; where it can be made out, it may as well be read.
    fn is_read_or_named(&self) {
        let (code, says) = self.encode(&[]);
        let cause = match &self.name[..] {
            "stl_blank_comment" => {
                assert_eq!((code, &says[..]), (0, ""));
                // A box.
                assert_eq!(self.decoded().triangles.len(), 12);
                return;
            }
            "stl_html" => "line 1: this is an HTML page",
            "stl_utf16" => "byte 0: this is text in UTF-16",
            other => panic!("{other}: no expectation"),
        };
        assert_eq!(Some(i64::from(code)), self.expected["exit"].as_i64(), "{}", self.name);
        assert!(says.contains(cause), "{}: {says}", self.name);
    }

    /// Refused at the count, with it and with that of the facets that are there, which `--force` reads.
    fn tells_both_counts(&self) {
        let bytes = fs::read(&self.input).unwrap();
        let told = u32::from_le_bytes(bytes[80..84].try_into().unwrap());
        let there = (bytes.len() - 84) / 50;
        let (code, says) = self.encode(&[]);
        assert_eq!(code, 1, "{}", self.name);
        let cause = format!("byte 80: the header tells of {told} facets, {there} are there");
        assert!(says.contains(&cause) && says.contains("--force"), "{}: {says}", self.name);
        assert!(!Path::new(&self.coded()).exists(), "{}", self.name);
        assert_eq!(self.encode(&["--force"]), (0, String::new()), "{}", self.name);
        let mesh = self.decoded();
        assert_eq!(mesh.triangles.len(), there, "{}", self.name);
        self.is_expected(&mesh);
    }
}

fn normal([a, b, c]: &[[f64; 3]; 3]) -> [f64; 3] {
    let minus = |x: &[f64; 3], y: &[f64; 3]| [x[0] - y[0], x[1] - y[1], x[2] - y[2]];
    let (u, v) = (minus(b, a), minus(c, a));
    [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
}

fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Triangles in one order, each turned so that its least corner comes first.
fn sorted(triangles: &[[[f64; 3]; 3]]) -> Vec<[[f64; 3]; 3]> {
    let mut sorted = triangles.to_vec();
    for triangle in &mut sorted {
        // One zero.
        triangle.as_flattened_mut().iter_mut().for_each(|x| *x += 0.0);
        let least = (0..3).min_by(|&a, &b| triangle[a].partial_cmp(&triangle[b]).unwrap()).unwrap();
        triangle.rotate_left(least);
    }
    sorted.sort_by(|a, b| a.partial_cmp(b).unwrap());
    sorted
}
