//! `unweld verify`: is a file sound, do its roads lead to the same meshes, and is it the mesh it came from?

use super::args::size;
use super::failure::Usage;
use super::input::{self, Reading};
use super::numbers::{count, grouped};
use super::original::{compare, lists_differ};
use super::output::say;
use super::progress::Progress;
use super::scenes;
use super::triangles::{Fingerprint, Zeros};
use super::uwm::Uwm;
use anyhow::{anyhow, bail};
use std::collections::BTreeMap;
use std::path::PathBuf;
use unweld::container::{Plan, plan_from_keyframe};
use unweld::decoder::{Decoder, Event, Until};
use unweld::formats::Coordinates;
use unweld::mesh::IndexedMesh;
use unweld::mesh::topology::{Census, census};

/// Check a .uwm file; with ORIGINAL, also that it holds the same triangles, as exactly as it claims to, and the same scene
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// The file, - for standard input
    #[arg(value_name = "IN.uwm")]
    input: PathBuf,
    /// The mesh it was made from
    original: Option<PathBuf>,
    /// The member of a set that is compared with ORIGINAL, from 0, the finest, to the coarsest [default: 0]
    #[arg(long, value_name = "J", requires = "original")]
    level: Option<u32>,
    /// Most memory to use, in bytes or with a suffix K, M, G
    #[arg(long, value_name = "M", value_parser = size, default_value = "4G")]
    max_memory: u64,
    /// Nothing but errors
    #[arg(long, short)]
    quiet: bool,
}

/// Runs the command.
///
/// # Errors
/// Those of reading; the first check that fails.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let mut uwm = Uwm::open(&args.input, args.max_memory)?;
    let mut progress = Progress::new(args.quiet);
    let mut lines = vec![format!("{}:", uwm.name)];
    let checked = match uwm.members() {
        Some(members) => check_set(&mut uwm, args.level.unwrap_or(0), members, &mut progress, &mut lines),
        None if args.level.is_some() => return Err(Usage("--level is for sets of meshes".to_owned()).into()),
        None => check(&mut uwm, &mut progress, &mut lines),
    };
    let checked = checked.and_then(|mesh| match &args.original {
        Some(original) => {
            // What is there counts, as where it was encoded by force.
            let scenes = uwm.contents.scene().is_some();
            let reading =
                Reading { max_memory: args.max_memory, force: true, scenes, painted: false, detail: None };
            let mut source = input::read(original, reading)?;
            if source.coordinates == Coordinates::Text && uwm.metadata()?.is_some_and(|m| m.source_float32) {
                to_binary32(&mut source.mesh);
            }
            let name = input::name(original);
            compare(&mut uwm, &mesh, &source.mesh, &name, &mut lines)?;
            scenes::compare(&mut uwm, &source, &name, &mut lines)
        }
        None => Ok(()),
    });
    drop(progress);
    if !args.quiet {
        say(&(lines.join("\n  ") + "\n"))?;
    }
    checked
}

/// Decimals of binary32 numbers, which text cannot call so, are read as that: the shortest of them are nearer to no other binary32 number.
fn to_binary32(mesh: &mut IndexedMesh) {
    mesh.positions.iter_mut().flatten().for_each(|x| *x = f64::from(*x as f32));
}

/// Checks a file; `lines` gets what was found in order. Returns the mesh of level 0.
///
/// # Errors
/// The first check that fails, with the name of the file.
pub fn check(uwm: &mut Uwm, progress: &mut Progress, lines: &mut Vec<String>) -> anyhow::Result<IndexedMesh> {
    let contents = uwm.contents.clone();
    let lattice = contents.header.lattice;
    let name = uwm.name.clone();
    let mut prints = BTreeMap::new();
    let mut topology: Option<Census> = None;
    let mut levels = 0u32;
    let decoder = uwm.decode(None, Until::default(), progress, &mut |decoder, event| {
        if let Event::Level { level, .. } = *event {
            let census =
                sound(decoder, level, topology).map_err(|what| anyhow!("{name}: level {level}: {what}"))?;
            topology = Some(census);
            levels += 1;
            if level == 0 || contents.starts_segment(level) {
                prints.insert(level, Fingerprint::of_level(decoder.mesh(), &lattice));
            }
        }
        Ok(())
    })?;
    lines.push(format!(
        "checksums   {} in {}: right",
        count(contents.atoms.len() as u64, "atom"),
        count(contents.file_bytes(), "byte")
    ));
    lines.push(format!(
        "replay      {} in {}: carried out",
        count(decoder.operations(), "operation"),
        count(levels, "level")
    ));
    let births = (0..contents.base_level()).any(|j| contents.born(j) != [0; 2]);
    if let Some(census) = topology {
        lines.push(format!(
            "manifold    {}: {}, {}, {}",
            if births { "level 0, coarser ones have fewer" } else { "every level" },
            count(census.components as u64, "component"),
            count(census.handles as u64, "handle"),
            count(census.boundary_loops as u64, "boundary loop"),
        ));
    }
    let mesh = decoder.assembled()?;
    drop(decoder);
    keyframes(uwm, progress, &prints, &mesh, lines)?;
    Ok(mesh)
}

/// Checks the members of a set one after the other, and comes back to member `wanted`, whose mesh it returns.
fn check_set(
    uwm: &mut Uwm,
    wanted: u32,
    members: Vec<u32>,
    progress: &mut Progress,
    lines: &mut Vec<String>,
) -> anyhow::Result<IndexedMesh> {
    for number in members {
        uwm.enter(number, progress)?;
        let mut own = Vec::new();
        let mesh = check(uwm, progress, &mut own)?;
        let (atoms, triangles) = (uwm.contents.atoms.len() as u64, mesh.triangles.len() as u64);
        lines.push(format!(
            "member {number:<4} {}, {}: right",
            count(atoms, "atom"),
            count(triangles, "triangle")
        ));
    }
    uwm.enter(wanted, progress)?;
    Ok(uwm.level(0, progress)?.assembled()?)
}

/// Connectivity, counts and topology of a level; `before` is the topology of the coarser ones.
fn sound(decoder: &Decoder, level: u32, before: Option<Census>) -> Result<Census, String> {
    let mesh = decoder.mesh();
    mesh.table.check().map_err(|e| e.to_string())?;
    if let Some(entry) = decoder.contents().and_then(|contents| contents.level(level)) {
        let (vertices, triangles) = (mesh.positions.len(), mesh.table.triangle_count());
        if (vertices, triangles) != (entry.vertices as usize, entry.triangles as usize) {
            let told = format!("{} vertices and {} triangles", entry.vertices, entry.triangles);
            return Err(format!("{vertices} vertices and {triangles} triangles, the table says {told}"));
        }
    }
    let now = census(&mesh.table);
    let born = decoder.contents().is_some_and(|contents| contents.born(level) != [0; 2]);
    let numbers = |c: &Census| [c.components, c.handles, c.boundary_loops];
    // Components that are born bring their own; otherwise nothing changes.
    let follows = |before: &Census| {
        let mut pairs = numbers(before).into_iter().zip(numbers(&now));
        let grows = numbers(before)[0] < numbers(&now)[0];
        pairs.all(|(before, now)| before == now || born && before < now) && grows == born
    };
    match before.filter(|before| !follows(before)) {
        Some(before) => Err(format!("its topology is {now:?}, that of coarser levels {before:?}")),
        None => Ok(now),
    }
}

/// From each keyframe to the next: both roads must lead to the same triangles.
fn keyframes(
    uwm: &mut Uwm,
    progress: &mut Progress,
    prints: &BTreeMap<u32, Fingerprint>,
    mesh: &IndexedMesh,
    lines: &mut Vec<String>,
) -> anyhow::Result<()> {
    let contents = uwm.contents.clone();
    let (name, lattice) = (uwm.name.clone(), contents.header.lattice);
    let starts: Vec<u32> = contents.segments().filter(|&level| contents.keyframe(level).is_some()).collect();
    for (k, &start) in starts.iter().enumerate() {
        let end = starts.get(k + 1).copied().unwrap_or(0);
        let plan = segment(uwm, start, end);
        let decoder = uwm.decode(Some(&plan), Until::default(), progress, &mut |decoder, event| match *event {
            Event::Level { level, .. } if level == start || level == end => {
                if prints.get(&level) == Some(&Fingerprint::of_level(decoder.mesh(), &lattice)) {
                    return Ok(());
                }
                bail!("{name}: level {level} from the keyframe of level {start} is not what the replay gives")
            }
            _ => Ok(()),
        })?;
        if end > 0 {
            continue;
        }
        let (back, print) = (decoder.assembled()?, |mesh| Fingerprint::of(mesh, Zeros::Apart));
        let ordered = decoder.order().is_some();
        if print(&back) != print(mesh) || (ordered && lists_differ(&back, mesh, Zeros::Apart).is_some()) {
            bail!(
                "{name}: level 0 from the keyframe of level {start}, residue and all, is not what the replay gives"
            );
        }
    }
    let text = match starts.len() {
        0 => "none but the base".to_owned(),
        n => format!("{}: they, and what follows from them, as by replay", grouped(n as u64)),
    };
    lines.push(format!("keyframes   {text}"));
    Ok(())
}

/// The way from the keyframe of level `start` to level `end`, whether that has a keyframe or not; at level 0 with
/// all that belongs to it.
fn segment(uwm: &Uwm, start: u32, end: u32) -> Plan {
    let contents = &uwm.contents;
    let mut runs = vec![contents.keyframe(start).unwrap_or(0..0)];
    if start > end {
        runs.push(contents.steps(start - 1).start..contents.steps(end).end);
    }
    if end == 0 && !contents.beyond_mesh().is_empty() {
        runs.push(contents.beyond_mesh());
    }
    let parts = runs.into_iter().map(|atoms| uwm.part(atoms)).collect();
    Plan { start, parts, ..plan_from_keyframe(contents, end) }
}

const EXAMPLES: &str = "\
EXAMPLES
  unweld verify bunny.uwm
  unweld verify bunny.uwm bunny.ply";
