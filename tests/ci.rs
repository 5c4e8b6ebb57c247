//! `.ci/run` on a bare machine: what it asks of Debian before it installs anything.
#![cfg(target_os = "linux")]

use std::fs;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::Path;
use std::process::Command;
use tempfile::TempDir;

/// A copy of the script with nothing on the path but what it is told of.
struct Machine(TempDir);

impl Machine {
    /// With an `apt-get` that writes down what it is asked for, and packages of Rust of this version; `None` without the few tools
    /// that any machine has.
    fn with_candidate(version: &str) -> Option<Self> {
        let machine = Self(tempfile::tempdir().unwrap());
        for folder in [".ci", "bin"] {
            fs::create_dir(machine.path(folder)).unwrap();
        }
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        for name in [".ci/run", "Cargo.toml"] {
            fs::copy(root.join(name), machine.path(name)).unwrap();
        }
        for tool in ["bash", "dirname", "id", "sed", "sort", "head", "cut"] {
            let Some(there) =
                ["/bin", "/usr/bin"].map(|bin| Path::new(bin).join(tool)).into_iter().find(|p| p.exists())
            else {
                eprintln!("skipped: no {tool}");
                return None;
            };
            symlink(there, machine.path("bin").join(tool)).unwrap();
        }
        machine.program("apt-get", "echo \"$*\" >> asked");
        machine.program("sudo", "\"$@\"");
        machine.program(
            "apt-cache",
            &format!("printf 'rustc:\\n  Installed: (none)\\n  Candidate: {version}\\n'"),
        );
        Some(machine)
    }

    fn path(&self, name: &str) -> std::path::PathBuf {
        self.0.path().join(name)
    }

    fn program(&self, name: &str, script: &str) {
        let path = self.path("bin").join(name);
        fs::write(&path, format!("#!{}\n{script}\n", self.path("bin").join("bash").display())).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
    }

    /// What the script says at its end, and what it has asked `apt-get` for.
    fn run(&self) -> (String, Vec<String>) {
        let output = Command::new(self.path("bin/bash"))
            .arg(".ci/run")
            .current_dir(self.0.path())
            .env_clear()
            .env("PATH", self.path("bin"))
            .output()
            .unwrap();
        assert!(!output.status.success(), "there is no toolchain to go on with");
        let asked = fs::read_to_string(self.path("asked")).unwrap_or_default();
        (String::from_utf8(output.stderr).unwrap(), asked.lines().map(str::to_owned).collect())
    }
}

#[test]
fn a_rust_that_is_too_old_is_not_even_installed() {
    for (version, said) in [
        ("1.63.0+dfsg1-2", "Debian's Rust 1.63.0 is too old: 1."),
        ("1.9.0-1", "Debian's Rust 1.9.0 is too old: 1."),
        ("(none)", "there is no Rust here, nor in Debian's packages: 1."),
    ] {
        let Some(machine) = Machine::with_candidate(version) else { return };
        let (text, asked) = machine.run();
        assert!(text.contains(said), "{version}: {text}");
        assert_eq!(asked, ["update -qq"], "{version}");
    }
}

#[test]
fn a_new_one_is_installed_without_a_terminal() {
    let Some(machine) = Machine::with_candidate("1.999.0+dfsg1-1") else { return };
    let (_, asked) = machine.run();
    assert_eq!(asked.len(), 2, "{asked:?}");
    assert!(asked[1].starts_with("-o Dpkg::Use-Pty=0 install "), "{asked:?}");
    assert!(asked[1].contains(" cargo rustc rustfmt rust-clippy"), "{asked:?}");
}

#[test]
fn one_that_is_here_counts_first() {
    let Some(machine) = Machine::with_candidate("1.999.0") else { return };
    machine.program("cargo", "true");
    machine.program("rustc", "echo 'rustc 1.70.0 (90c541806 2023-05-31)'");
    let (text, asked) = machine.run();
    assert!(text.contains("this machine's Rust 1.70.0 is too old"), "{text}");
    assert!(asked.is_empty(), "{asked:?}");
}
