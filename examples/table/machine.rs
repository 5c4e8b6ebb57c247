//! What the figures were measured on and with, without naming the machine or its folders.

use std::path::Path;
use std::process::Command;

/// A list in Markdown: processor, memory, system, compiler, crates, command.
pub fn description() -> String {
    let lines = [
        ("Machine", format!("{}, {} logical cores, {} of memory", processor(), cores(), memory())),
        ("System", system()),
        ("Compiler", compiler()),
        ("Crates", ["unweld", "draco-core", "meshopt"].map(version).join(", ")),
        ("Command", format!("`{}`", command(std::env::args().skip(1)))),
    ];
    lines.iter().map(|(what, value)| format!("- {what}: {value}\n")).collect()
}

/// The command as it was given; of paths only the names.
fn command(arguments: impl Iterator<Item = String>) -> String {
    let name = |argument: String| match Path::new(&argument).file_name() {
        Some(name) if argument.contains('/') => name.to_string_lossy().into_owned(),
        _ => argument,
    };
    let mut words = vec!["cargo run --release --features peers --example table --".to_owned()];
    words.extend(arguments.map(name));
    words.join(" ")
}

fn processor() -> String {
    let model = value_of("/proc/cpuinfo", "model name", ':');
    model.unwrap_or_else(|| std::env::consts::ARCH.to_owned())
}

fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

fn memory() -> String {
    let kibibytes = value_of("/proc/meminfo", "MemTotal", ':')
        .and_then(|value| value.split_whitespace().next()?.parse::<f64>().ok());
    kibibytes.map_or("unknown amount".to_owned(), |k| format!("{:.0} GiB", k / f64::from(1 << 20)))
}

fn system() -> String {
    let name = value_of("/etc/os-release", "PRETTY_NAME", '=').map(|name| name.trim_matches('"').to_owned());
    name.unwrap_or_else(|| std::env::consts::OS.to_owned())
}

fn compiler() -> String {
    let output = Command::new("rustc").arg("--version").output();
    let version = output.ok().and_then(|output| String::from_utf8(output.stdout).ok());
    version.map_or("unknown".to_owned(), |version| version.trim().to_owned())
}

/// A crate and its version, from the lock file of this build.
fn version(name: &str) -> String {
    let after = LOCK.split_once(&format!("name = \"{name}\"\nversion = \"")).map(|(_, after)| after);
    let version = after.and_then(|after| after.split('"').next()).unwrap_or("unknown");
    format!("{name} {version}")
}

/// The first value of a key in a file of lines `key separator value`.
fn value_of(file: &str, key: &str, separator: char) -> Option<String> {
    let text = std::fs::read_to_string(file).ok()?;
    let mut pairs = text.lines().filter_map(|line| line.split_once(separator));
    pairs.find(|(name, _)| name.trim() == key).map(|(_, value)| value.trim().to_owned())
}

const LOCK: &str = include_str!("../../Cargo.lock");

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_told_by_their_names() {
        let arguments = ["/home/someone/a.ply", "--runs", "1", "b.ply"].map(str::to_owned);
        let expected = "cargo run --release --features peers --example table -- a.ply --runs 1 b.ply";
        assert_eq!(command(arguments.into_iter()), expected);
    }

    #[test]
    fn versions_come_from_the_lock_file() {
        assert_eq!(version("draco-core"), "draco-core 2.3.3");
        assert_eq!(version("no-such-crate"), "no-such-crate unknown");
    }
}
