//! `unweld info`: what a file holds.

use super::args::size;
use super::describe::Description;
use super::failure::note;
use super::numbers::{count, grouped};
use super::output::say;
use super::progress::Progress;
use super::uwm::Uwm;
use std::path::PathBuf;
use unweld::codec::residue::{Residue, ResidueCounts};
use unweld::container::plan_from_keyframe;
use unweld::decoder::Until;

/// Tell what a .uwm file holds: levels, bytes, errors, origin
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// The file, - for standard input
    #[arg(value_name = "IN.uwm")]
    input: PathBuf,
    /// One JSON object instead of text
    #[arg(long)]
    json: bool,
    /// No progress bar
    #[arg(long, short)]
    quiet: bool,
    /// Most memory to use, in bytes or with a suffix K, M, G
    #[arg(long, value_name = "M", value_parser = size, default_value = "4G")]
    max_memory: u64,
}

/// Runs the command.
///
/// # Errors
/// Those of reading the file.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let mut uwm = Uwm::open(&args.input, args.max_memory)?;
    if let Some(set) = &uwm.set {
        if args.json {
            return say(&format!("{:#}\n", set.described()));
        }
        let bytes = count(set.contents.file_bytes(), "byte");
        return say(&format!("{}: {bytes}, a set\n{}\n{}", set.name, set.summary(), set.table()));
    }
    let description = describe(&mut uwm, &mut Progress::new(args.quiet))?;
    let cut = uwm.cut();
    if args.json {
        let mut object = description.json();
        object.extend(cut.map(|there| ("cut".to_owned(), cut_json(&uwm, there))));
        say(&format!("{:#}\n", serde_json::Value::Object(object)))?;
        return told_of_cut(&uwm);
    }
    let mut text = format!("{}: {}", uwm.name, count(uwm.contents.file_bytes(), "byte"));
    text += &format!(", format version {}", unweld::container::VERSION);
    if let Some(metadata) = &description.metadata {
        text += &format!(", by {} from {}", metadata.generator, metadata.source);
    }
    text += &format!("\n{}", description.summary());
    if let Some(scene) = description.resources.scene_text() {
        text += &format!("  {:<11}{scene}\n", "scene");
    }
    if let Some(metadata) = description.metadata.as_ref().filter(|m| !m.settings.is_empty()) {
        let settings: Vec<_> =
            metadata.settings.iter().map(|(name, value)| format!("{name} {value}")).collect();
        text += &format!("  {:<11}{}\n", "settings", settings.join(", "));
    }
    text += &format!("\n{}", description.table());
    let resources = description.resources.table();
    if !resources.is_empty() {
        text += &format!("\n{resources}");
    }
    let attributes = description.attribute_table();
    if !attributes.is_empty() {
        text += &format!("\n{attributes}");
    }
    let operations = uwm.contents.operations(0..uwm.contents.atoms.len());
    text += &format!("\n  {} operations between base and level 0\n", grouped(operations));
    say(&text)?;
    told_of_cut(&uwm)
}

/// What a file that is cut off still has.
fn cut_json(uwm: &Uwm, there: u64) -> serde_json::Value {
    let prefix = uwm.prefix(there).ok();
    serde_json::json!({
        "bytes": there,
        "missing_bytes": uwm.contents.file_bytes() - there,
        "level": prefix.as_ref().map(|prefix| uwm.finest_level(prefix)),
        "vertices": prefix.as_ref().map(|prefix| prefix.vertices),
        "triangles": prefix.as_ref().map(|prefix| prefix.triangles),
    })
}

/// Says where a file is cut off, which is an error where no mesh is left.
fn told_of_cut(uwm: &Uwm) -> anyhow::Result<()> {
    if let Some(there) = uwm.cut() {
        uwm.prefix(there)?;
        note(&uwm.cut_text(there));
    }
    Ok(())
}

/// Reads the metadata, the scene, and the residue if there is one, which takes the mesh of level 0; none of them where the file is cut off before it.
///
/// # Errors
/// Those of reading the file.
pub fn describe(uwm: &mut Uwm, progress: &mut Progress) -> anyhow::Result<Description> {
    let mut residue = ResidueCounts::default();
    let residue_atoms = uwm.contents.residue();
    if !residue_atoms.is_empty() && uwm.cut().is_none() {
        let mut plan = plan_from_keyframe(&uwm.contents, 0).without(&uwm.contents, |_| true);
        // What follows the residue can be told without being decoded.
        for part in plan.parts.iter_mut().filter(|part| part.atoms.contains(&residue_atoms.start)) {
            *part = uwm.part(part.atoms.start..residue_atoms.end);
        }
        let decoder = uwm.decode(Some(&plan), Until::default(), progress, &mut |_, _| Ok(()))?;
        residue = decoder.residue().map(Residue::counts).unwrap_or_default();
    }
    Description::new(uwm, residue)
}

const EXAMPLES: &str = "\
EXAMPLES
  unweld info bunny.uwm
  unweld info bunny.uwm --json | jq '.levels[] | [.level, .cumulative_bytes, .max_error_percent]'";
