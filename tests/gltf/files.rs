//! Buffers in files beside the glTF.

use crate::builder::*;
use std::fs;
use unweld::Error;
use unweld::formats::{Source, read};

fn written(uri: &str) -> (tempfile::TempDir, Result<Source, Error>) {
    let folder = tempfile::tempdir().unwrap();
    let mut gltf = triangle();
    gltf.json["buffers"][0] = serde_json::json!({"byteLength": gltf.binary.len(), "uri": uri});
    fs::create_dir_all(folder.path().join("scene/data")).unwrap();
    fs::write(folder.path().join("outside.bin"), &gltf.binary).unwrap();
    fs::write(folder.path().join("scene/data/a b.bin"), &gltf.binary).unwrap();
    let path = folder.path().join("scene/model.gltf");
    fs::write(&path, gltf.json.to_string()).unwrap();
    let outcome = read(&path);
    (folder, outcome)
}

#[test]
fn a_buffer_in_a_folder_below() {
    assert_eq!(written("data/a%20b.bin").1.unwrap(), triangle().read());
}

#[test]
fn what_is_elsewhere_is_not_read() {
    let refused = |uri: &str| written(uri).1.unwrap_err().to_string();
    for uri in ["../outside.bin", "data/../../outside.bin", "%2e%2e/outside.bin", "/etc/hostname"] {
        let says = refused(uri);
        assert!(
            says.ends_with("/buffers/0: uri: a file that is not below the glTF's own folder"),
            "{uri}: {says}"
        );
    }
    assert!(refused("data/none.bin").contains("/buffers/0: uri: "));
    assert!(refused("data/none.bin").contains("none.bin"));
    assert!(refused("http://example.org/a.bin").contains("a URI of scheme `http`"));
}

/// The command line knows the folder, and that standard input has none.
#[cfg(feature = "cli")]
#[test]
fn the_command_line_reads_them_too() {
    use std::process::{Command, Stdio};
    let (folder, _) = written("data/a%20b.bin");
    let run = |input: &str| {
        let file = fs::File::open(folder.path().join("scene/model.gltf")).unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_unweld"));
        command
            .args(["encode", input, "-o", "x.uwm", "--force", "-q"])
            .current_dir(folder.path().join("scene"));
        let output = command.stdin(Stdio::from(file)).output().unwrap();
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    assert_eq!(run("model.gltf"), (Some(0), String::new()));
    let (code, says) = run("-");
    assert_eq!(code, Some(1));
    assert!(
        says.contains("standard input: /buffers/0: uri: the folder of data/a b.bin is not known"),
        "{says}"
    );
}
