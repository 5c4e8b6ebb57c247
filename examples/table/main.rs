//! The benchmark: unweld beside Draco, meshoptimizer and published figures, as tables.
//!
//! `cargo run --release --features peers --example table -- --help`
//!
//! [`args::Section`] has the parts. Each makes tables ([`tables`]): `sizes` of meshes from files ([`cases`], [`glb`]) and of generated ones
//! ([`made`], [`generate`]), `overview` with times ([`measure`]) and errors ([`quality`]), `reference` and `curves` of prefixes, and so on, beside the
//! [`peers`]. [`figures`] says which of their columns matter and what they are to be; [`goals`] sums these up below each table and in
//! one on top.

mod args;
mod attributes;
mod cad;
mod cases;
mod curves;
mod drawing;
mod exact;
mod figures;
mod generate;
mod glb;
mod goals;
mod hqms;
mod keyframes;
mod linear;
mod looks;
mod machine;
mod made;
mod measure;
mod overview;
mod paper;
mod peers;
mod prefixes;
mod profiles;
mod progressive;
mod quality;
mod reference;
mod simplifiers;
mod simplifiers_papers;
mod sizes;
mod tables;

use anyhow::Context;
use args::{Args, Section};
use cases::{Case, default_file};
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
            goals::close(&mut table);
            // What has been said of an earlier table is not said again.
            table.notes.retain(|note| told.insert(note.clone()));
            println!("{}", table.plain());
            tables.push(table);
        }
    }
    let summary = goals::summary(&tables);
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
    let made = |made: Vec<made::Made>, bits: u32| {
        let bits = args.bits.unwrap_or(bits);
        made.into_iter().map(move |(name, mesh)| Case::of(name.to_owned(), mesh, bits))
    };
    Ok(match section {
        Section::Sizes => {
            let files = args.files(&[&MESHES[..], &[DRAGON]].concat())?;
            let cases = files.iter().map(|file| Case::read(file, args.bits.unwrap_or(12)));
            vec![sizes::table("Sizes", "Default settings.", cases, true)?]
        }
        Section::Structured => {
            let cases = made(made::structured::meshes(), 12);
            vec![sizes::table("Structured meshes", STRUCTURED_NOTE, cases, false)?]
        }
        Section::Small => {
            let cases = SMALL.iter().map(|file| Case::read(&default_file(file)?, args.bits.unwrap_or(14)));
            vec![sizes::table("Small meshes", "Positions alone, welded.", cases, false)?]
        }
        Section::Acceptance => {
            let cases = made(made::fresh::meshes(args.seed), 12);
            vec![sizes::table("Acceptance", ACCEPTANCE_NOTE, cases, false)?]
        }
        Section::Main => overview::tables("Whole files", &args.cases(&MESHES, 12)?, runs)?,
        Section::Dragon => overview::tables("The dragon", &args.cases(&[DRAGON], 14)?, runs)?,
        Section::Cad => vec![cad::table(args.bits.unwrap_or(14))?],
        Section::Progressive => vec![progressive::table(args.bits)?],
        Section::Earlier => vec![reference::table()?],
        Section::Prefixes => vec![prefixes::table(&args.cases(&[BUNNY], 12)?)?],
        Section::Curves => vec![curves::table(&args.cases(&CURVES, 12)?, args.curves())?],
        Section::Hqms => vec![hqms::table()?],
        Section::Simplifiers => simplifiers::tables(args)?,
        Section::Keyframes => vec![keyframes::table(&args.cases(&MESHES, 12)?)?],
        Section::Linear => vec![linear::table(args)?],
        Section::Paper => paper::tables(&args.cases(&MESHES[..2], 12)?, runs)?,
        Section::Profiles => vec![profiles::table(&args.cases(&MESHES, 12)?, runs)?],
        Section::Exact => vec![exact::table(&args.files(&EXACT)?)?],
        Section::Looks => vec![looks::table(&args.meshes, args.sheet.as_deref())?],
        Section::Attributes => vec![attributes::table(&args.files(&MODELS)?, args.peers().as_deref())?],
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
/// Files of the meshes whose curves are drawn.
const CURVES: [&str; 5] = [MESHES[0], MESHES[1], MESHES[3], MESHES[4], "synth_terrain.ply.gz"];
/// Files of the table of small meshes.
const SMALL: [&str; 6] = [
    "gltf/tex_cat_statue.glb",
    "gltf/tex_boombox.glb",
    "gltf/tex_waterbottle.glb",
    "gltf/tex_suzanne_unindexed.glb",
    "tex_duck.glb",
    "tex_spot/spot_triangulated.obj.gz",
];
/// Files of the table of attributes.
const MODELS: [&str; 15] = [
    "tex_duck.glb",
    "gltf/tex_boombox.glb",
    "gltf/tex_waterbottle.glb",
    "gltf/tex_scifihelmet_unindexed.glb",
    "gltf/tex_suzanne_unindexed.glb",
    "gltf/tex_flighthelmet.glb",
    "gltf/tex_barnlamp.glb",
    "gltf/tex_terrain.glb",
    "gltf/tex_cat_statue.glb",
    "gltf/tex_house_5657charts.glb",
    "gltf/textransform_sheencloth.glb",
    "gltf/tex_vive.glb",
    "gltf/tex_cosmos_constcolor.glb",
    "gltf/tex_touch.glb",
    "gltf/skin_cesiumman.glb",
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

const STRUCTURED_NOTE: &str =
    "Generated by formulas, the same on every machine: every decision can follow the rows of most of them.";
const ACCEPTANCE_NOTE: &str = "Generated by formulas: the kinds that the codec is for, meshes that nothing in it was chosen on. `--seed` gives others.";
