//! Files made to cost more than they are worth: those of the data folder, `UNWELD_DATA` or `../shared/data`, where there is one.

use super::{BESIDE, alone, peak_of};
use std::path::{Path, PathBuf};
use unweld::decoder::{Decoder, Options};
use unweld::limits::{FREE_WORK, Limits, WORK_A_BYTE};
use unweld::{Error, Result};

fn folder() -> PathBuf {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    std::env::var_os("UNWELD_DATA").map_or_else(beside, PathBuf::from).join("hostile")
}

/// Decodes to the end, assembles, goes down and up again.
fn run(decoder: &mut Decoder, file: &[u8]) -> Result<()> {
    decoder.push(file);
    while decoder.poll()?.is_some() {}
    decoder.finish()?;
    drop(decoder.assembled()?);
    if decoder.coarsen()?.is_some() {
        decoder.restore()?;
    }
    Ok(())
}

#[test]
fn files_of_the_data_folder_stay_within_memory_and_work() {
    let _turn = alone();
    let Ok(entries) = folder().read_dir() else {
        eprintln!("skipped: no folder of hostile files at {}", folder().display());
        return;
    };
    let files = entries.flatten().map(|entry| entry.path());
    let files: Vec<_> = files.filter(|path| path.extension().is_some_and(|e| e == "uwm")).collect();
    assert!(!files.is_empty());
    for path in files {
        let file = std::fs::read(&path).unwrap();
        for memory in [64 << 20, 700 << 20] {
            let options = Options {
                limits: Limits { memory, ..Limits::default() },
                undo: true,
                flips: true,
                ..Options::default()
            };
            let mut decoder = Decoder::new(options);
            let (outcome, peak) = peak_of(|| run(&mut decoder, &file));
            let (name, work) = (path.display(), decoder.work());
            eprintln!("{name} within {memory}: {peak} bytes, {work} units: {outcome:?}");
            assert!(peak <= memory + BESIDE + file.len() as u64, "{name}: {peak} bytes");
            assert!(work <= FREE_WORK + WORK_A_BYTE * file.len() as u64, "{name}: {work} units");
            let refused = matches!(outcome, Ok(()) | Err(Error::Limit { .. } | Error::Format(_)));
            assert!(refused, "{name}: {outcome:?}");
            if name.to_string().contains("levels-") {
                assert!(work == 0, "{name}: refused by its table of contents, before any work");
            }
        }
    }
}
