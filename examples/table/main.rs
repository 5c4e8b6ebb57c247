//! The benchmark: unweld beside Draco, meshoptimizer and published figures, as tables.
//!
//! `cargo run --release --features peers --example table -- --help`

mod args;
mod cases;
mod exact;
mod generate;
mod keyframes;
mod linear;
mod machine;
mod measure;
mod overview;
mod paper;
mod peers;
mod prefixes;
mod profiles;
mod progressive;
mod quality;
mod structured;
mod summary;
mod tables;

use anyhow::Context;
use args::{Args, Section};
use clap::Parser;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::process::ExitCode;
use tables::Table;

fn main() -> ExitCode {
    match run(&Args::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("table: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(args: &Args) -> anyhow::Result<()> {
    let machine = machine::description();
    println!("{machine}");
    let mut tables = Vec::new();
    let mut told = BTreeSet::new();
    for section in args.sections() {
        for mut table in measure(args, section)? {
            // What has been said of an earlier table is not said again.
            table.notes.retain(|note| told.insert(note.clone()));
            println!("{}", table.plain());
            tables.push(table);
        }
    }
    let summary = summary::table(&tables);
    if !summary.rows.is_empty() {
        println!("{}", summary.plain());
        tables.insert(0, summary);
    }
    if let Some(path) = args.out() {
        let body: Vec<String> = tables.iter().map(Table::markdown).collect();
        let text = format!("# Benchmarks\n\n{machine}\n{BROWSER}\n{}", body.join("\n"));
        std::fs::write(path, text).with_context(|| path.display().to_string())?;
    }
    if let Some(path) = &args.json {
        let tables: Vec<Value> = tables.iter().map(Table::json).collect();
        let machine: Vec<&str> = machine.lines().map(|line| line.trim_start_matches("- ")).collect();
        let text = format!("{:#}\n", json!({ "machine": machine, "tables": tables }));
        std::fs::write(path, text).with_context(|| path.display().to_string())?;
    }
    Ok(())
}

/// The tables of a section.
fn measure(args: &Args, section: Section) -> anyhow::Result<Vec<Table>> {
    let runs = args.runs as usize;
    Ok(match section {
        Section::Main => overview::tables("Whole files", &args.cases(&MESHES, 12)?, runs)?,
        Section::Dragon => overview::tables("The dragon", &args.cases(&[DRAGON], 14)?, runs)?,
        Section::Structured => vec![structured::table(args.bits.unwrap_or(12))?],
        Section::Progressive => vec![progressive::table(args.bits)?],
        Section::Keyframes => vec![keyframes::table(&args.cases(&MESHES, 12)?)?],
        Section::Linear => vec![linear::table(args)?],
        Section::Prefixes => vec![prefixes::table(&args.cases(&[BUNNY], 12)?)?],
        Section::Paper => paper::tables(&args.cases(&MESHES[..2], 12)?, runs)?,
        Section::Exact => vec![exact::table(&args.files(&EXACT)?)?],
        Section::Profiles => vec![profiles::table(&args.cases(&MESHES, 12)?, runs)?],
    })
}

/// Files of the default meshes.
const MESHES: [&str; 7] = [
    BUNNY,
    "organic_horse.ply.gz",
    "bench/igea.ply.gz",
    "genus1_rocker_arm.obj.gz",
    "cad_fandisk.obj.gz",
    "organic_cat.obj.gz",
    "genus12_boot.obj.gz",
];
/// Files of the table of exact coordinates; the last two hold binary32 and binary64 noise.
const EXACT: [&str; 10] = [
    MESHES[0],
    MESHES[1],
    MESHES[2],
    DRAGON,
    MESHES[4],
    MESHES[3],
    MESHES[5],
    MESHES[6],
    "synth_scan.ply.gz",
    "synth_terrain_utm_f64_holes.ply.gz",
];
/// Where the rest stands, which this does not measure.
const BROWSER: &str = "Loaded in a page, by three.js, beside Draco and meshoptimizer: [web/BENCHMARKS.md](web/BENCHMARKS.md), written by `web/bench`.\n";
const BUNNY: &str = "scan_bunny.ply.gz";
const DRAGON: &str = "bench/dragon_vrip.ply.gz";
