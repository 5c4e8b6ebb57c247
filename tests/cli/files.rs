//! What becomes of files: inputs stay, what is replaced keeps its access, and nothing half-made is left.

use super::Folder;

/// A tetrahedron.
const OBJ: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";

impl super::Run {
    /// Refused for its arguments, in these words.
    pub fn refused(&self, what: &str) {
        assert_eq!((self.code, self.out.len()), (2, 0), "{}", self.err);
        assert!(self.err.contains(what), "{what}: {}", self.err);
    }
}

impl Folder {
    /// That a command refuses its input as its output, and leaves the folder as it is.
    fn spares(&self, command: &str, what: &str) {
        let before: Vec<_> = self.list().into_iter().map(|name| (self.kept(&name), name)).collect();
        self.run(command).refused(what);
        let after: Vec<_> = self.list().into_iter().map(|name| (self.kept(&name), name)).collect();
        assert_eq!(before, after, "{command}");
    }

    fn kept(&self, name: &str) -> Option<Vec<u8>> {
        std::fs::read(self.path(name)).ok()
    }

    /// Runs a line of a shell, in which `unweld` is the program; `None` without such a shell.
    #[cfg(unix)]
    pub fn shell(&self, line: &str) -> Option<(Option<i32>, String)> {
        let program = env!("CARGO_BIN_EXE_unweld");
        let script = format!("unweld() {{ '{program}' \"$@\"; }}; {line}");
        let output =
            std::process::Command::new("bash").args(["-c", &script]).current_dir(self.0.path()).output();
        let Ok(output) = output else {
            eprintln!("skipped: no bash");
            return None;
        };
        Some((output.status.code(), String::from_utf8(output.stderr).unwrap()))
    }

    fn unfinished(&self) -> Vec<String> {
        self.list().into_iter().filter(|name| name.contains(".unweld-")).collect()
    }
}

#[test]
fn no_command_writes_over_its_input() {
    let folder = Folder::with_sphere();
    folder.write("in.obj", OBJ);
    // A .uwm file under a name that decode and view write to.
    for name in ["coded.ply", "coded.png", "level-0.ply"] {
        folder.write(name, folder.bytes("sphere.uwm"));
    }
    folder.spares("encode in.obj -o in.obj", "in.obj is the input, which would be lost");
    folder.spares("encode in.obj -o ./in.obj -q", "./in.obj is the input in.obj, which would be lost");
    folder.spares("encode in.obj -o in.obj --force", "in.obj is the input");
    folder.spares("decode coded.ply -o coded.ply", "coded.ply is the input");
    folder.spares("decode coded.ply -o coded.ply --level 3", "coded.ply is the input");
    folder.spares("simplify in.obj -o in.obj --faces 4", "in.obj is the input");
    folder.spares("view coded.png -o coded.png", "coded.png is the input");
    folder.spares("fetch http://localhost:9/a -o in.obj --token-file in.obj", "in.obj is the input");
    // Levels find their names themselves.
    let levels = folder.run("decode level-0.ply --all-levels . -q");
    levels.refused("./level-0.ply is the input level-0.ply");
    assert_eq!(folder.bytes("level-0.ply"), folder.bytes("sphere.uwm"));
}

#[cfg(unix)]
#[test]
fn links_and_streams_lead_to_the_input_too() {
    use std::fs::hard_link;
    use std::os::unix::fs::symlink;
    let folder = Folder::new();
    folder.write("in.obj", OBJ);
    symlink("in.obj", folder.path("link.uwm")).unwrap();
    symlink("link.uwm", folder.path("further.uwm")).unwrap();
    hard_link(folder.path("in.obj"), folder.path("hard.uwm")).unwrap();
    for name in ["link.uwm", "further.uwm", "hard.uwm"] {
        folder.spares(&format!("encode in.obj -o {name}"), &format!("{name} is the input in.obj"));
    }
    symlink("in.obj", folder.path("link.obj")).unwrap();
    folder.spares("encode link.obj -o in.obj", "in.obj is the input link.obj");
    for (line, what) in [
        ("unweld encode - -o hard.uwm < in.obj", "hard.uwm is the input standard input"),
        ("unweld encode in.obj -o - >> in.obj", "standard output is the input in.obj"),
        (
            "unweld simplify - -o - --faces 4 < in.obj >> hard.uwm",
            "standard output is the input standard input",
        ),
    ] {
        let Some((code, err)) = folder.shell(line) else { return };
        assert_eq!(code, Some(2), "{line}: {err}");
        assert!(err.contains(what), "{line}: {err}");
        assert_eq!(folder.bytes("in.obj"), OBJ.as_bytes());
    }
    // What is no file cannot be lost.
    folder.run("encode in.obj -o /dev/null -q").succeeded();
}

#[test]
fn a_pattern_behind_the_option_eats_no_mesh() {
    let folder = Folder::new();
    let off = "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n";
    for name in ["a.off", "b.off", "c.off"] {
        folder.write(name, off);
    }
    folder.spares("encode -o a.off b.off", "a.off is the name of a mesh");
    folder.spares("encode -o a.off b.off c.off", "a.off is the name of a file");
    for name in ["x.PLY", "x.obj", "x.stl", "x.off.gz", "x.glb", "x.gltf", "x.drc", "x.3mf"] {
        folder.spares(&format!("encode a.off -o {name}"), &format!("{name} is the name of a mesh"));
        folder.spares(&format!("encode a.off b.off -o {name}"), &format!("{name} is the name of a file"));
    }
    folder.run("encode a.off -o a.drc --force -q").succeeded();
    folder.run("encode a.off -o a.bin -q").succeeded();
    assert_eq!(folder.bytes("a.drc"), folder.bytes("a.bin"));
}

#[cfg(unix)]
#[test]
fn no_result_of_several_is_one_of_the_inputs() {
    let folder = Folder::new();
    folder.write("b.obj", OBJ);
    std::fs::create_dir(folder.path("in")).unwrap();
    folder.write("in/a.obj", OBJ);
    // The result of one is a name of the other, from wherever it was found.
    std::fs::hard_link(folder.path("b.obj"), folder.path("in/a.uwm")).unwrap();
    for inputs in ["in/a.obj b.obj", "b.obj in", "in/a.obj in b.obj"] {
        folder
            .run(&format!("encode {inputs} -o in"))
            .refused("in/a.uwm is the input b.obj, which would be lost");
        assert_eq!(folder.bytes("b.obj"), OBJ.as_bytes(), "{inputs}");
    }
    assert!(!folder.path("in/b.uwm").exists(), "nothing is begun");
    folder.run("encode in/a.obj b.obj -o out -q").succeeded();
    folder.run("encode in -o in -q").succeeded();
}

#[cfg(unix)]
#[test]
fn what_is_replaced_keeps_its_access() {
    use std::fs::{Permissions, metadata, set_permissions};
    use std::os::unix::fs::{MetadataExt, PermissionsExt, chown};
    let folder = Folder::with_sphere();
    let mode = |name: &str| metadata(folder.path(name)).unwrap().mode() & 0o7777;
    for (kept, name, command) in [
        (0o600, "a.uwm", "encode sphere.ply -o a.uwm -q"),
        (0o640, "a.obj", "decode sphere.uwm -o a.obj -q"),
        (0o755, "a.ply", "simplify sphere.ply -o a.ply --faces 100 -q"),
        (0o604, "a.png", "view sphere.ply -o a.png -q"),
        (0o660, "level-0.ply", "decode sphere.uwm --all-levels . -q"),
    ] {
        folder.write(name, "old");
        set_permissions(folder.path(name), Permissions::from_mode(kept)).unwrap();
        folder.run(command).succeeded();
        assert_ne!(folder.bytes(name), b"old");
        assert_eq!(mode(name), kept, "{command}");
    }
    // One of whose owner the process cannot be stays as it may be; root may give files away.
    folder.write("theirs.uwm", "old");
    if chown(folder.path("theirs.uwm"), Some(12345), Some(23456)).is_ok() {
        set_permissions(folder.path("theirs.uwm"), Permissions::from_mode(0o640)).unwrap();
        folder.run("encode sphere.ply -o theirs.uwm -q").succeeded();
        let there = metadata(folder.path("theirs.uwm")).unwrap();
        assert_eq!((there.uid(), there.gid(), there.mode() & 0o7777), (12345, 23456, 0o640));
    }
}

#[cfg(unix)]
#[test]
fn what_is_write_protected_stays() {
    use std::fs::{Permissions, set_permissions};
    use std::os::unix::fs::{PermissionsExt, symlink};
    let folder = Folder::with_sphere();
    for name in ["old.uwm", "old.ply", "old.png"] {
        folder.write(name, "precious");
        set_permissions(folder.path(name), Permissions::from_mode(0o444)).unwrap();
    }
    symlink("old.uwm", folder.path("link.uwm")).unwrap();
    for (command, name) in [
        ("encode sphere.ply -o", "old.uwm"),
        ("encode sphere.ply -o", "link.uwm"),
        ("decode sphere.uwm -o", "old.ply"),
        ("simplify sphere.ply --faces 100 -o", "old.ply"),
        ("view sphere.ply -o", "old.png"),
        ("fetch http://localhost:9/a -o", "old.uwm"),
    ] {
        folder.run(&format!("{command} {name}")).failed(1, &format!("{name}: it is write-protected"));
        assert_eq!(folder.bytes(name), b"precious");
    }
    assert_eq!(
        folder.run("encode sphere.ply sphere.ply -o . -q").code,
        0,
        "another name is none of its business"
    );
}

#[cfg(unix)]
#[test]
fn links_are_followed_to_what_is_not_there_yet() {
    use std::os::unix::fs::symlink;
    let folder = Folder::with_sphere();
    std::fs::create_dir(folder.path("t")).unwrap();
    symlink("t/next", folder.path("out.uwm")).unwrap();
    // From where it stands, not from where the command runs.
    symlink("real.uwm", folder.path("t/next")).unwrap();
    folder.run("encode sphere.ply -o out.uwm -q").succeeded();
    assert!(folder.path("out.uwm").is_symlink() && folder.path("t/next").is_symlink());
    assert!(folder.path("t/real.uwm").is_file() && !folder.path("t/real.uwm").is_symlink());
    folder.run("verify t/real.uwm sphere.ply -q").succeeded();
    symlink("no/where.uwm", folder.path("lost.uwm")).unwrap();
    folder
        .run("encode sphere.ply -o lost.uwm -q")
        .failed(1, "lost.uwm: No such file or directory (os error 2)");
    assert!(folder.path("lost.uwm").is_symlink());
    symlink("circle.uwm", folder.path("circle.uwm")).unwrap();
    folder
        .run("encode sphere.ply -o circle.uwm -q")
        .failed(1, "circle.uwm: too many links, or a circle of them");
}

#[cfg(unix)]
#[test]
fn a_file_larger_than_allowed_is_an_error_like_any_other() {
    let folder = Folder::with_sphere();
    folder.write("old.uwm", "precious");
    let before = folder.list();
    // The base, of 40 vertices and 76 triangles, is the first to be written, and too large already.
    let base = super::levels(&folder.info("sphere.uwm")).len() - 1;
    let large = "File too large (os error 27)";
    for (line, what) in [
        ("unweld encode sphere.ply -o old.uwm", format!("old.uwm: {large}")),
        ("unweld decode sphere.uwm -o new.ply", format!("new.ply: {large}")),
        ("unweld view sphere.ply -o new.png", format!("new.png: {large}")),
        ("unweld decode sphere.uwm --all-levels .", format!("./level-{base}.ply: {large}")),
    ] {
        // Blocks of 1024 bytes.
        let Some((code, err)) = folder.shell(&format!("ulimit -f 1; {line}")) else { return };
        assert_eq!((code, err), (Some(1), format!("unweld: {what}\n")), "{line}");
        assert_eq!(folder.unfinished(), [""; 0]);
        assert_eq!((folder.list(), folder.bytes("old.uwm")), (before.clone(), b"precious".to_vec()));
    }
}

#[cfg(unix)]
#[test]
fn a_signal_leaves_nothing_unfinished() {
    use std::os::unix::process::ExitStatusExt;
    use std::process::{Command, Stdio};
    let folder = Folder::new();
    folder.mesh("m.ply", &unweld::mesh::shapes::bumpy_sphere(5, 1));
    folder.run("encode m.ply -o m.uwm -q").succeeded();
    for (name, number) in [("INT", 2), ("TERM", 15), ("HUP", 1)] {
        if is_ignored(number) {
            eprintln!("skipped: {name} is ignored here, as under nohup");
            continue;
        }
        // Levels are written one after the other: most of the time one of them is unfinished.
        let caught = (0..50).any(|_| {
            let mut child = Command::new(env!("CARGO_BIN_EXE_unweld"))
                .args(["decode", "m.uwm", "--all-levels", ".", "-q"])
                .current_dir(folder.0.path())
                .stdin(Stdio::null())
                .spawn()
                .unwrap();
            while folder.unfinished().is_empty() && child.try_wait().unwrap().is_none() {}
            Command::new("kill").args([&format!("-{name}"), &child.id().to_string()]).status().unwrap();
            let status = child.wait().unwrap();
            assert_eq!(folder.unfinished(), [""; 0], "{name}");
            assert!(status.success() || status.signal() == Some(number), "{status}");
            status.signal().is_some()
        });
        assert!(caught, "it was always through before {name}");
    }
}

/// Whether a signal is ignored by this process, and so by those that it starts; false where that is not known.
#[cfg(unix)]
fn is_ignored(number: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (number - 1) & 1 > 0)
}

/// Signals that whoever starts the command ignores, as shells do for what runs in the background, do not end it.
#[cfg(target_os = "linux")]
#[test]
fn signals_that_were_ignored_stay_ignored() {
    use std::process::{Command, Stdio};
    let folder = Folder::new();
    folder.mesh("m.ply", &unweld::mesh::shapes::bumpy_sphere(4, 1));
    folder.run("encode m.ply -o m.uwm -q").succeeded();
    let line = format!("trap '' INT; exec '{}' decode m.uwm --all-levels . -q", env!("CARGO_BIN_EXE_unweld"));
    for _ in 0..5 {
        let child = Command::new("bash")
            .args(["-c", &line])
            .current_dir(folder.0.path())
            .stdin(Stdio::null())
            .spawn();
        let Ok(mut child) = child else { return eprintln!("skipped: no bash") };
        while folder.unfinished().is_empty() && child.try_wait().unwrap().is_none() {}
        Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
        assert!(child.wait().unwrap().success());
    }
}

/// What replaces a private file is never open to others, not even for a moment.
#[cfg(unix)]
#[test]
fn what_is_unfinished_is_closed_to_others() {
    use std::fs::{Permissions, metadata, set_permissions};
    use std::os::unix::fs::{MetadataExt, PermissionsExt};
    use std::process::{Command, Stdio};
    let folder = Folder::new();
    folder.mesh("m.ply", &unweld::mesh::shapes::bumpy_sphere(4, 1));
    folder.run("encode m.ply -o m.uwm -q").succeeded();
    folder.run("decode m.uwm --all-levels . -q").succeeded();
    for name in folder.list() {
        set_permissions(folder.path(&name), Permissions::from_mode(0o600)).unwrap();
    }
    let mut seen = 0;
    // Each time some are seen, more than one of them before its end.
    for _ in 0..200 {
        let mut child = Command::new(env!("CARGO_BIN_EXE_unweld"))
            .args(["decode", "m.uwm", "--all-levels", ".", "-q"])
            .current_dir(folder.0.path())
            .stdin(Stdio::null())
            .spawn()
            .unwrap();
        while child.try_wait().unwrap().is_none() {
            for name in folder.unfinished() {
                // It may have got its name meanwhile.
                let Ok(there) = metadata(folder.path(&name)) else { continue };
                assert_eq!(there.mode() & 0o077, 0);
                seen += 1;
            }
        }
        if seen > 30 {
            return;
        }
    }
    panic!("only {seen} unfinished files were seen");
}
