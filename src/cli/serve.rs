//! `unweld serve`: meshes over HTTP.

use super::args::size;
use super::failure::{Usage, note};
use super::numbers::count;
use super::output::say;
use super::signals::stopped;
use anyhow::Context;
use clap::ValueEnum;
use std::fs;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;
use tracing_subscriber::filter::LevelFilter;
use unweld::server::{Options, Server};
use unweld::store::Store;

/// Serve .uwm files over HTTP: whole, in ranges, or the atoms that lead from one level to another
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// A folder, or the URL of an object store: s3://, gs://, az://, http(s)://, memory://
    #[arg(default_value = ".")]
    location: String,
    /// The address to listen on; port 0 takes any that is free
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1:8080")]
    addr: SocketAddr,
    /// Do not tell the names of the meshes
    #[arg(long)]
    no_list: bool,
    /// Serve only who sends one of the tokens in this file, one a line, as `Authorization: Bearer TOKEN`
    #[arg(long, value_name = "FILE")]
    token_file: Option<PathBuf>,
    /// How long caches may keep an answer without asking again, 0 (not at all) or more
    #[arg(long, value_name = "SECONDS", default_value_t = Options::default().max_age)]
    max_age: u32,
    /// Most connections at a time, 1 to 1,000,000
    #[arg(long, value_name = "N", default_value_t = Options::default().connections as u32,
          value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    connections: u32,
    /// Memory for parts of files that are often wanted; 0 for none
    #[arg(long, value_name = "BYTES", default_value = "64M", value_parser = size)]
    cache: u64,
    /// How long a connection may be idle, and a client take nothing of an answer, 1 or more
    #[arg(long, value_name = "SECONDS", default_value_t = 30, value_parser = clap::value_parser!(u32).range(1..))]
    timeout: u32,
    /// What to log, on standard error
    #[arg(long, value_enum, value_name = "LEVEL", default_value = "warn")]
    log: Log,
    /// Tell address and location as one JSON object
    #[arg(long)]
    json: bool,
    /// Do not tell them at all
    #[arg(long, short)]
    quiet: bool,
}

/// What is worth a line.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Log {
    /// Nothing
    Off,
    /// What went wrong
    Warn,
    /// Every request
    Info,
    /// Every connection that broke, too
    Debug,
}

/// Runs the command until it is interrupted or terminated.
///
/// # Errors
/// Where the location, the address or the tokens cannot be had.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let location = &args.location;
    let tokens = args.token_file.as_ref().map(tokens).transpose()?.unwrap_or_default();
    let store = Store::open(location).with_context(|| location.clone())?;
    let store = store.with_cache(usize::try_from(args.cache).unwrap_or(usize::MAX));
    log(args.log);
    let connections = available(args.connections as usize);
    let timeout = Duration::from_secs(args.timeout.into());
    let options = Options {
        list: !args.no_list,
        max_age: args.max_age,
        tokens,
        connections,
        idle: timeout,
        stall: timeout,
        ..Options::default()
    };
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build()?;
    runtime.block_on(async {
        let stop = stopped()?;
        let server = Server::bind(args.addr, store, options).await.with_context(|| args.addr.to_string())?;
        let address = server.address()?;
        if args.json {
            let object = serde_json::json!({ "address": address.to_string(), "location": location });
            say(&format!("{object}\n"))?;
        } else if !args.quiet {
            say(&format!("Serving {location} at http://{address}/ (Ctrl-C stops it)\n"))?;
        }
        server.run(stop).await;
        Ok(())
    })
}

/// The tokens of a file, one a line.
fn tokens(path: &PathBuf) -> anyhow::Result<Vec<String>> {
    let text = fs::read_to_string(path).with_context(|| path.display().to_string())?;
    let tokens: Vec<String> =
        text.lines().map(str::trim).filter(|t| !t.is_empty()).map(str::to_owned).collect();
    if tokens.is_empty() {
        // Nobody or everybody: either would be a surprise.
        return Err(Usage(format!("{}: there is no token in it", path.display())).into());
    }
    if let Some(line) = text.lines().position(|t| !t.trim().bytes().all(|b| b.is_ascii_graphic())) {
        let what = "a token has letters, digits and signs of ASCII only";
        anyhow::bail!("{}: line {}: {what}", path.display(), line + 1);
    }
    Ok(tokens)
}

/// So many connections as the system lets this process have, each with an open file.
#[cfg(unix)]
fn available(wanted: usize) -> usize {
    use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
    let limit = getrlimit(Resource::Nofile);
    // It may be raised to the hard limit by anybody; where it cannot, the soft one holds.
    let _ = setrlimit(Resource::Nofile, Rlimit { current: limit.maximum, maximum: limit.maximum });
    let files =
        getrlimit(Resource::Nofile).current.map_or(usize::MAX, |n| usize::try_from(n).unwrap_or(usize::MAX));
    let most = (files.saturating_sub(64) / 2).max(1);
    if most < wanted {
        note(&format!("the limit of open files allows {} at a time", count(most as u64, "connection")));
    }
    wanted.min(most)
}

#[cfg(not(unix))]
fn available(wanted: usize) -> usize {
    wanted
}

fn log(level: Log) {
    let level = match level {
        Log::Off => LevelFilter::OFF,
        Log::Warn => LevelFilter::WARN,
        Log::Info => LevelFilter::INFO,
        Log::Debug => LevelFilter::DEBUG,
    };
    let lines = tracing_subscriber::fmt().with_writer(std::io::stderr).with_ansi(false).with_target(false);
    lines.with_max_level(level).init();
}

const EXAMPLES: &str = "\
EXAMPLES
  unweld serve coded/                                     a folder, at http://127.0.0.1:8080/
  unweld serve coded/ --addr 0.0.0.0:80 --log info        for everybody, with a line for each request
  unweld serve coded/ --cache 1G                          much memory for parts of files that are often wanted
  unweld serve coded/ --token-file tokens --no-list       for those who know a token and a name
  unweld serve s3://bucket/meshes                         an object store (a build with --features cloud); the
                                                          credentials are in AWS_ACCESS_KEY_ID and the like

  curl localhost:8080/meshes                                    which meshes there are, and their levels
  curl localhost:8080/meshes/bunny.uwm -o bunny.uwm             a whole file; ranges work, too
  curl 'localhost:8080/meshes/bunny/refine?max_bytes=20000'     the first 20 kB, in whole atoms
  curl 'localhost:8080/meshes/bunny/refine?from=12&to=8'        what leads from level 12 to level 8";
