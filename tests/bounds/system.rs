//! A system that has less memory than is allowed: the command says so and ends, as long as the allocator lets it.
#![cfg(target_os = "linux")]

use super::{alone, files};
use std::process::Command;
use unweld::mesh::IndexedMesh;

#[test]
fn less_memory_than_wanted_is_told() {
    let _turn = alone();
    let folder = tempfile::tempdir().unwrap();
    let square = IndexedMesh::new(
        vec![[0.0; 3], [65_535.0, 0.0, 0.0], [65_535.0, 65_535.0, 0.0], [0.0, 65_535.0, 0.0]],
        vec![[0, 1, 2], [0, 2, 3]],
    );
    let file = files::with_levels(files::mesh(&square), 18, files::Longest::new);
    std::fs::write(folder.path().join("square.uwm"), file).unwrap();
    let mut told = 0;
    let mut done = 0;
    // From too little to start with up to more than is needed, in KiB.
    for limit in (20 << 10..240 << 10).step_by(10 << 10) {
        let run = format!("ulimit -v {limit} && exec \"$0\" decode square.uwm -o square.ply --quiet");
        let mut command = Command::new("sh");
        command.args(["-c", &run, env!("CARGO_BIN_EXE_unweld")]).current_dir(folder.path());
        let out = command.output().unwrap();
        let text = String::from_utf8_lossy(&out.stderr).into_owned();
        match out.status.code() {
            Some(0) => done += 1,
            Some(1) if text.contains("out of memory: the system has no ") => told += 1,
            // Neither the program nor its libraries could be loaded.
            Some(_) if !text.starts_with("unweld") && !text.contains("memory allocation of") => {}
            // The system itself ends what it cannot lay out in so little, before it begins.
            None if text.is_empty() && told + done == 0 => {}
            other => panic!("{limit} KiB: {other:?}, {text}"),
        }
        assert!(out.status.code() == Some(0) || !folder.path().join("square.ply").exists() || done > 0);
    }
    assert!(told > 0 && done > 0, "{told} runs were refused, {done} were not");
}
