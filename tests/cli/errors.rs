//! Exit codes, the texts of errors, and what becomes of files when something fails.

use super::{Folder, levels, run};

#[test]
fn faults_of_the_data_are_told_in_one_line() {
    let folder = Folder::with_sphere();
    let missing = "No such file or directory (os error 2)";
    folder.run("encode no.ply -o x.uwm").failed(1, &format!("no.ply: {missing}"));
    folder.run("info no.uwm").failed(1, &format!("no.uwm: {missing}"));
    folder.run("encode sphere.ply -o no/x.uwm").failed(1, &format!("no/x.uwm: {missing}"));
    folder.run("verify sphere.uwm no.ply").failed_after_output(&format!("no.ply: {missing}"));
    folder.write("bad.obj", "v 0 0 0\nv 1 0 0\nv 0 one 0\nf 1 2 3\n");
    let run = folder.run("encode bad.obj -o x.uwm");
    assert!(run.err.starts_with("unweld: bad.obj: line 3: ") && run.err.lines().count() == 1, "{}", run.err);
    assert_eq!(run.code, 1);
    folder.write("empty.ply", "");
    folder.run("encode empty.ply -o x.uwm").failed(1, "empty.ply: the file is empty");
    folder.run_with("encode - -o x.uwm", b"").failed(1, "standard input: the file is empty");
    folder.run("info sphere.ply").failed(1, "sphere.ply: byte 0: not a .uwm file (spec §3.2)");
    folder.run("decode sphere.ply -o x.ply").failed(1, "sphere.ply: byte 0: not a .uwm file (spec §3.2)");
    folder.write("newer.uwm", b"\x89UWM\r\n\x1A\n\x07\x00");
    let newer = "byte 8: written by format version 7; this decoder reads version 1 (spec §3.2)";
    folder.run("info newer.uwm").failed(1, &format!("newer.uwm: {newer}"));
    let run = folder.run("decode sphere.uwm -o x.ply --max-memory 1K");
    assert!(run.err.starts_with("unweld: sphere.uwm: limit reached: memory in bytes needs "), "{}", run.err);
    assert!(run.err.ends_with(", allowed 1024 (--max-memory allows more)\n"), "{}", run.err);
    assert_eq!(run.code, 1);
    assert_eq!(folder.run("encode sphere.ply -o x.uwm --max-memory 1K").code, 1);
    assert!(!folder.list().iter().any(|name| name.starts_with('x')));
}

impl super::Run {
    fn failed_after_output(&self, line: &str) {
        assert_eq!((self.err.as_str(), self.code), (format!("unweld: {line}\n").as_str(), 1));
    }
}

#[test]
fn faults_of_the_arguments() {
    let folder = Folder::with_sphere();
    for arguments in [
        "",
        "nonsense",
        "encode sphere.ply",
        "encode sphere.ply -o x.uwm --position-bits 7",
        "encode sphere.ply -o x.uwm --position-bits 25",
        "encode sphere.ply -o x.uwm --position-bits auto:0",
        "encode sphere.ply -o x.uwm --lattice-step 0",
        "encode sphere.ply -o x.uwm --lattice-step 1 --position-bits 12",
        "encode sphere.ply -o x.uwm --lattice-origin 1,2,3",
        "encode sphere.ply -o x.uwm --lattice-step 1 --lattice-origin 1,2",
        "encode sphere.ply -o x.uwm --weld=-1",
        "encode sphere.ply -o x.uwm --choices 0",
        "encode sphere.ply -o x.uwm --alpha nan",
        "encode sphere.ply -o x.uwm --beta=-1",
        "encode sphere.ply -o x.uwm --keyframes every:0",
        "encode sphere.ply -o x.uwm --method best",
        "encode sphere.ply -o x.uwm --weld near",
        "encode sphere.ply -o x.uwm --max-memory lots",
        "encode sphere.ply -o - --json",
        "encode sphere.ply -o x.uwm --jobs 0",
        "encode sphere.ply sphere.ply -o x.uwm",
        "encode sphere.ply sphere.ply -o sphere.uwm",
        "encode sphere.ply sphere.ply -o -",
        "encode . -o -",
        "encode - -o .",
        "encode - sphere.ply -o x",
        "encode -o x",
        "decode sphere.uwm",
        "decode sphere.uwm -o x.off",
        "decode sphere.uwm -o x.ply --level 1 --triangles 2",
        "decode sphere.uwm -o x.ply --error -1",
        "decode sphere.uwm -o x.ply --error mean:1",
        "decode sphere.uwm -o x.ply --operations 1 --error rms:1",
        "decode sphere.uwm -o x.ply --via keyframe --triangles 100",
        "decode sphere.uwm -o x.ply --via keyframe --operations 1",
        "decode sphere.uwm -o x.ply --via keyframe --max-bytes 9K",
        "decode sphere.uwm -o x.ply --via road",
        "info",
        "verify",
        "simplify sphere.ply -o x.ply",
        "simplify sphere.ply -o x.uwm --faces 9",
        "simplify sphere.ply -o - --faces 9 --json",
    ] {
        let run = folder.run(arguments);
        assert_eq!((run.code, run.out.len()), (2, 0), "{arguments}: {}", run.err);
        assert!(!run.err.is_empty(), "{arguments}");
    }
    assert!(!folder.list().iter().any(|name| name.starts_with('x')));
}

#[test]
fn help_and_version() {
    let folder = Folder::new();
    let version = folder.run("--version").succeeded();
    assert_eq!(version.text(), concat!("unweld ", env!("CARGO_PKG_VERSION"), "\n"));
    assert!(folder.run("help").succeeded().text().contains("EXAMPLES"));
    for command in ["encode", "decode", "info", "verify", "measure", "simplify", "view"] {
        let help = folder.run(&format!("help {command}")).succeeded();
        assert!(help.text().contains(&format!("EXAMPLES\n  unweld {command}")), "{command}");
    }
}

/// Every option with a number tells which numbers it takes.
#[test]
fn ranges_in_the_help() {
    let folder = Folder::new();
    let numbers = [
        "<N>",
        "<J>",
        "<K>",
        "<A>",
        "<B>",
        "<D>",
        "<S>",
        "<E>",
        "<R>",
        "<SECONDS>",
        "<DEGREES>",
        "<WxH>",
        "<J,…>",
    ];
    let told = [" to ", "or more", "at least", "any angle"];
    for command in
        ["encode", "decode", "info", "verify", "measure", "simplify", "view", "serve", "fetch", "demo"]
    {
        let help = folder.run(&format!("{command} --help")).succeeded();
        let text = help.text().split_once("Options:").unwrap().1.split("EXAMPLES").next().unwrap().to_owned();
        let mut options: Vec<String> = Vec::new();
        for line in text.lines() {
            match line.trim_start().starts_with('-') {
                true => options.push(line.to_owned()),
                false => options
                    .iter_mut()
                    .last()
                    .into_iter()
                    .for_each(|option| *option += &format!(" {}", line.trim())),
            }
        }
        assert!(options.len() > 2, "{command}: {text}");
        for option in options.iter().filter(|option| numbers.iter().any(|number| option.contains(number))) {
            assert!(told.iter().any(|words| option.contains(words)), "{command}: {option}");
        }
    }
}

#[test]
fn a_failure_leaves_the_older_file_and_nothing_else() {
    let folder = Folder::with_sphere();
    folder.write("old.uwm", "precious");
    folder.write("old.ply", "precious");
    folder.write("bad.ply", &folder.bytes("sphere.ply")[..3000]);
    let info = folder.info("sphere.uwm");
    let before_level_0 = levels(&info).last().unwrap()["offset"].as_u64().unwrap() as usize;
    folder.write("bad.uwm", &folder.bytes("sphere.uwm")[..before_level_0]);
    let before = folder.list();
    assert_eq!(folder.run("encode bad.ply -o old.uwm").code, 1);
    assert_eq!(folder.run("encode sphere.ply -o old.uwm --max-memory 9").code, 1);
    assert_eq!(folder.run("decode bad.uwm -o old.ply --level 0").code, 1);
    assert_eq!(folder.run("simplify bad.ply -o old.ply --faces 10").code, 1);
    assert_eq!(folder.bytes("old.uwm"), b"precious");
    assert_eq!(folder.bytes("old.ply"), b"precious");
    assert_eq!(folder.list(), before);
    folder.run("encode sphere.ply -o old.uwm").succeeded();
    folder.run("verify old.uwm sphere.ply").succeeded();
    assert_eq!(folder.list(), before);
}

#[cfg(unix)]
#[test]
fn odd_places() {
    use std::os::unix::ffi::OsStringExt;
    use std::os::unix::fs::{PermissionsExt, symlink};
    let folder = Folder::with_sphere();
    let odd = |end: &str| std::ffi::OsString::from_vec([b"odd\xFF\n", end.as_bytes()].concat());
    std::fs::copy(folder.path("sphere.ply"), folder.0.path().join(odd(".ply"))).unwrap();
    let quiet = |command: &str, from: &str, to: &str| {
        vec![command.into(), odd(from), "-o".into(), odd(to), "-q".into()]
    };
    run(folder.0.path(), quiet("encode", ".ply", ".uwm"), b"").succeeded();
    run(folder.0.path(), quiet("decode", ".uwm", ".obj"), b"").succeeded();
    let missing = run(folder.0.path(), quiet("decode", ".no", ".obj"), b"");
    missing.failed(1, "odd\u{FFFD}\\n.no: No such file or directory (os error 2)");

    // A link stays a link, a device a device; a file is open to others as the user's settings have it.
    symlink("target.uwm", folder.path("link.uwm")).unwrap();
    folder.write("target.uwm", "old");
    folder.run("encode sphere.ply -o link.uwm -q").succeeded();
    assert!(folder.path("link.uwm").is_symlink());
    folder.run("verify target.uwm sphere.ply -q").succeeded();
    folder.run("encode sphere.ply -o /dev/null -q").succeeded();
    assert!(!std::path::Path::new("/dev/null").is_file());
    folder.write("plain", "");
    let mode = |name: &str| std::fs::metadata(folder.path(name)).unwrap().permissions().mode();
    assert_eq!(mode("target.uwm"), mode("plain"));
    std::fs::create_dir(folder.path("dir.uwm")).unwrap();
    std::fs::create_dir(folder.path("dir.ply")).unwrap();
    folder.run("decode sphere.uwm -o dir.ply").failed(1, "dir.ply: is a directory");
    folder.run("info dir.uwm").failed(1, "dir.uwm: Is a directory (os error 21)");
}

#[cfg(unix)]
#[test]
fn a_reader_that_leaves_early_is_no_fault() {
    let folder = Folder::with_sphere();
    let program = env!("CARGO_BIN_EXE_unweld");
    let script = format!("set -o pipefail; '{program}' info sphere.uwm | true");
    let output =
        std::process::Command::new("bash").args(["-c", &script]).current_dir(folder.0.path()).output();
    let Ok(output) = output else { return eprintln!("skipped: no bash") };
    assert_eq!((output.status.code(), output.stderr.len()), (Some(0), 0));
}

#[test]
fn damage_is_refused_and_never_more() {
    let folder = Folder::with_sphere();
    let file = folder.bytes("sphere.uwm");
    for k in 0..24 {
        folder.write("bad.uwm", &file[..file.len() * k / 24]);
        let run = folder.run("verify bad.uwm");
        assert_eq!((run.code, run.err.lines().count()), (1, 1), "{k}: {}", run.err);
        assert!(
            run.err.contains(&format!("byte {}: the file is cut off", file.len() * k / 24)),
            "{}",
            run.err
        );
    }
    let mut damaged: Vec<Vec<u8>> = Vec::new();
    for k in 0..24 {
        let mut copy = file.clone();
        copy[file.len() * k / 24] ^= 1 << (k % 8);
        damaged.push(copy);
    }
    for (k, bytes) in damaged.iter().enumerate() {
        folder.write("bad.uwm", bytes);
        for command in
            ["verify bad.uwm", "decode bad.uwm -o x.ply", "view bad.uwm -o x.png", "encode bad.uwm -o x.uwm"]
        {
            let run = folder.run(command);
            assert_eq!((run.code, run.err.lines().count()), (1, 1), "{command} of {k}: {}", run.err);
        }
    }
}
