//! `unweld encode` of several inputs: side by side, each as if it were alone, with one report in the end.

use super::args::is_stream;
use super::describe;
use super::encode::{self, Args, Done};
use super::failure::{self, Usage, note};
use super::identity::Identity;
use super::input;
use super::inputs::{Job, Jobs, is_folder, is_mesh_name};
use super::memory::peak;
use super::numbers::{columns, count, grouped, memory, significant};
use super::output::{Output, say, would_be_lost};
use super::progress::Bars;
use anyhow::{Context, anyhow, bail};
use serde_json::{Map, Value, json};
use std::collections::HashMap;
use std::fs;
use std::num::NonZero;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::Instant;

/// Runs the command.
///
/// # Errors
/// Where the arguments leave unclear what is to be done; in the end, where an input failed.
pub fn run(args: &Args, inputs: &[PathBuf], folder: &Path) -> anyhow::Result<()> {
    check(folder)?;
    let found = Jobs::find(inputs, folder)?;
    spare_inputs(&found.jobs)?;
    fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let start = Instant::now();
    let threads =
        args.jobs.or(thread::available_parallelism().ok()).map_or(1, NonZero::get).min(found.jobs.len());
    let bars = Bars::new(args.quiet, found.jobs.len(), "inputs");
    let results = encode_all(args, &found.jobs, threads, &bars);
    drop(bars);
    let seconds = start.elapsed().as_secs_f64();

    let failed = results.iter().filter(|result| result.outcome.is_err()).count();
    if args.json {
        let files: Vec<Value> =
            found.jobs.iter().zip(&results).map(|(job, result)| entry(job, result)).collect();
        let object = json!({
            "files": files,
            "failed": failed,
            "skipped": { "hidden": found.hidden, "others": found.others },
            "jobs": threads,
            "seconds": seconds,
            "peak_bytes": peak(),
        });
        say(&format!("{object:#}\n"))?;
    } else {
        for (job, done) in
            found.jobs.iter().zip(&results).filter_map(|(job, r)| Some((job, r.outcome.as_ref().ok()?)))
        {
            done.remark(args.quiet, &job.input);
        }
        if !args.quiet {
            say(&report(&found, &results, threads, seconds))?;
        }
    }
    if args.json || args.quiet {
        // What the report would say.
        results
            .iter()
            .filter_map(|result| result.outcome.as_ref().err())
            .for_each(|error| note(&failure::line(error)));
    }
    match failed {
        0 => Ok(()),
        n => bail!("{} of {} failed", grouped(n as u64), count(results.len() as u64, "input")),
    }
}

/// How one input went.
struct Outcome {
    outcome: anyhow::Result<Done>,
    seconds: f64,
}

/// A folder is wanted; a name that is plainly that of a file is more likely a slip.
fn check(folder: &Path) -> anyhow::Result<()> {
    let is_uwm = folder.extension().is_some_and(|e| e.eq_ignore_ascii_case("uwm"));
    let is_file = folder.exists() || is_uwm || is_mesh_name(folder);
    let what = match folder.display() {
        _ if is_stream(folder) => "not to standard output".to_owned(),
        name if !is_folder(folder) && is_file => format!("and {name} is the name of a file"),
        _ => return Ok(()),
    };
    Err(Usage(format!("several inputs, or a folder, go to a folder, {what}")).into())
}

/// No result may replace any of the inputs.
fn spare_inputs(jobs: &[Job]) -> anyhow::Result<()> {
    let identified = |job: &'_ Job| Some((Identity::of_file(&job.input)?, input::name(&job.input)));
    let inputs: HashMap<Identity, String> = jobs.iter().filter_map(identified).collect();
    for output in jobs.iter().filter_map(|job| job.output.as_ref().ok()) {
        if let Some(input) = Identity::of_file(output).and_then(|there| inputs.get(&there)) {
            return Err(would_be_lost(input, &output.display().to_string()).into());
        }
    }
    Ok(())
}

/// Each thread takes the next input as soon as it is through with one; results are in the order of the jobs.
fn encode_all(args: &Args, jobs: &[Job], threads: usize, bars: &Bars) -> Vec<Outcome> {
    let queue = Mutex::new(jobs.iter().enumerate());
    let results = Mutex::new(Vec::new());
    let work = || {
        let next = || queue.lock().unwrap_or_else(PoisonError::into_inner).next();
        while let Some((k, job)) = next() {
            let start = Instant::now();
            let outcome = encode(args, job, bars);
            let seconds = start.elapsed().as_secs_f64();
            results.lock().unwrap_or_else(PoisonError::into_inner).push((k, Outcome { outcome, seconds }));
            bars.done();
        }
    };
    thread::scope(|scope| {
        (1..threads).for_each(|_| drop(scope.spawn(work)));
        work();
    });
    let mut results = results.into_inner().unwrap_or_else(PoisonError::into_inner);
    results.sort_by_key(|(k, _)| *k);
    results.into_iter().map(|(_, result)| result).collect()
}

fn encode(args: &Args, job: &Job, bars: &Bars) -> anyhow::Result<Done> {
    let path = job.output.as_ref().map_err(|cause| anyhow!("{}: {cause}", input::name(&job.input)))?;
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    let output = Output::new(path, [&*job.input])?;
    encode::encode_to(args, &job.input, &output, &mut bars.piece(input::file_name(&job.input)))
}

fn entry(job: &Job, result: &Outcome) -> Value {
    let mut object = Map::new();
    object.insert("path".to_owned(), json!(input::name(&job.input)));
    match &result.outcome {
        Ok(done) => {
            object.insert(
                "output".to_owned(),
                json!(job.output.as_ref().ok().map(|path| path.display().to_string())),
            );
            object.extend(done.json());
        }
        Err(error) => drop(object.insert("error".to_owned(), json!(failure::line(error)))),
    }
    Value::Object(object)
}

/// A line an input, and the sums.
fn report(found: &Jobs, results: &[Outcome], threads: usize, seconds: f64) -> String {
    let heads = ["input", "triangles", "bytes", "bits a vertex", "seconds", "result"];
    let mut lines = vec![heads.map(str::to_owned).to_vec()];
    let (mut encoded, mut triangles, mut bytes) = (0, 0, 0);
    for (job, result) in found.jobs.iter().zip(results) {
        let name = input::name(&job.input);
        let seconds = format!("{:.2}", result.seconds);
        lines.push(match &result.outcome {
            Ok(done) => {
                encoded += 1;
                triangles += done.description.triangles();
                bytes += done.report.bytes;
                let bits = done.report.bytes as f64 * 8.0 / done.description.vertices().max(1) as f64;
                vec![
                    name,
                    grouped(done.description.triangles()),
                    grouped(done.report.bytes),
                    significant(bits, 3),
                    seconds,
                    found_in(done),
                ]
            }
            Err(error) => {
                let line = failure::line(error);
                let cause = line.strip_prefix(&format!("{name}: ")).unwrap_or(&line);
                vec![name, String::new(), String::new(), String::new(), seconds, format!("failed: {cause}")]
            }
        });
    }
    let mut text = columns(&lines, &[0, 5]);
    text += &format!(
        "\n  {:<11}{} of {}: {}, {}\n",
        "encoded",
        grouped(encoded as u64),
        count(results.len() as u64, "input"),
        count(triangles, "triangle"),
        count(bytes, "byte"),
    );
    let skipped = [(found.others, "other file"), (found.hidden, "hidden file")];
    let skipped: Vec<String> =
        skipped.iter().filter(|(n, _)| *n > 0).map(|(n, noun)| count(*n as u64, noun)).collect();
    if !skipped.is_empty() {
        text += &format!("  {:<11}{}\n", "skipped", skipped.join(", "));
    }
    text += &format!("  {:<11}{seconds:.2} s, {} at a time\n", "time", count(threads as u64, "input"));
    text + &format!("  {:<11}{} at its peak\n", "memory", memory(peak()))
}

/// What conditioning found, and what was dropped.
fn found_in(done: &Done) -> String {
    let Some(metadata) = &done.description.metadata else { return String::new() };
    let found = describe::found(metadata);
    if metadata.dropped.is_empty() {
        found
    } else {
        format!("{found}; dropped {}", metadata.dropped.join(", "))
    }
}
