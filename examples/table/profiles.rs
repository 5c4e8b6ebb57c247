//! The profiles beside each other.

use super::cases::Case;
use super::measure::geometric_mean;
use super::overview::{Measured, measure};
use super::tables::{Cell, Table};
use unweld::encoder::{Options, Profile};

/// One row a mesh and profile, then one of geometric means a profile.
///
/// # Errors
/// Those of the coders.
pub fn table(cases: &[Case], runs: usize) -> anyhow::Result<Table> {
    let mut table = Table::new("Profiles", &[NOTE], &COLUMNS);
    let mut ratios: [Vec<[Option<f64>; 4]>; PROFILES.len()] = Default::default();
    for case in cases {
        for (k, (name, profile)) in PROFILES.into_iter().enumerate() {
            eprintln!("{}: profile {name}", case.name);
            let options = Options { position_bits: case.bits, ..Options::profile(profile) };
            let measured = measure(case, &options, runs)?;
            let figures = figures(&measured);
            table.rows.push(row(&case.name, name, Some(&measured), figures));
            ratios[k].push(figures);
        }
    }
    for ((name, _), ratios) in PROFILES.iter().zip(&ratios) {
        let mean = |k: usize| geometric_mean(ratios.iter().filter_map(|figures| figures[k]));
        table.foot.push(row("geometric mean", name, None, [0, 1, 2, 3].map(mean)));
    }
    Ok(table)
}

/// Ratios to the peers: size, error, times of encoding and decoding.
fn figures(measured: &Measured) -> [Option<f64>; 4] {
    let [encode, decode] = measured.time_ratios();
    [Some(measured.size_ratio()), measured.error_ratio(), Some(encode), Some(decode)]
}

fn row(mesh: &str, profile: &str, measured: Option<&Measured>, figures: [Option<f64>; 4]) -> Vec<Cell> {
    let mut row = vec![Cell::text(mesh), Cell::text(profile)];
    row.push(measured.map_or(Cell::None, |m| Cell::Count(m.bytes as u64)));
    row.extend([Cell::number(figures[0], 3), Cell::number(figures[1], 2)]);
    for k in 0..2 {
        row.push(Cell::number(measured.map(|m| m.seconds[k]), 3));
        row.push(Cell::number(figures[2 + k], 2));
    }
    row
}

const PROFILES: [(&str, Profile); 3] =
    [("default", Profile::Default), ("small", Profile::Small), ("fine", Profile::Fine)];

const COLUMNS: [&str; 9] = [
    "mesh",
    "profile",
    "bytes",
    "bytes/Draco",
    "error/meshopt",
    "encode s",
    "encode/Draco",
    "decode s",
    "decode/Draco",
];

const NOTE: &str = "`--profile default|small|fine`; bytes without residue; error: the geometric mean of the ratios at 50, 25, 10 and 5 % of the \
    triangles. Everything else as in the table of whole files.";
