//! `unweld serve`: the address it tells, how it stops, what it refuses.

use super::Folder;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};

fn started(folder: &Folder, arguments: &str) -> (Child, String) {
    started_with(folder, arguments, &[])
}

pub fn started_with(folder: &Folder, arguments: &str, variables: &[(&str, &str)]) -> (Child, String) {
    let mut child = Command::new(env!("CARGO_BIN_EXE_unweld"))
        .args(format!("serve --addr 127.0.0.1:0 --json {arguments}").split_whitespace())
        .current_dir(folder.0.path())
        .envs(variables.iter().copied())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut line = String::new();
    BufReader::new(child.stdout.as_mut().unwrap()).read_line(&mut line).unwrap();
    let told: serde_json::Value = serde_json::from_str(&line).unwrap();
    (child, told["address"].as_str().unwrap().to_owned())
}

pub fn get(address: &str, path: &str, line: &str) -> Vec<u8> {
    let mut stream = TcpStream::connect(address).unwrap();
    write!(stream, "GET {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n{line}\r\n").unwrap();
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).unwrap();
    answer
}

#[test]
#[cfg(unix)]
fn it_serves_until_it_is_told_to_stop() {
    let folder = Folder::with_sphere();
    folder.write("tokens", "one\n\n two \n");
    let (mut child, address) = started(&folder, ". --token-file tokens --log info");
    assert!(get(&address, "/meshes/sphere.uwm", "").starts_with(b"HTTP/1.1 401 "));
    let answer = get(&address, "/meshes/sphere.uwm", "Authorization: Bearer two\r\n");
    assert!(answer.starts_with(b"HTTP/1.1 200 ") && answer.ends_with(&folder.bytes("sphere.uwm")));
    // A connection that is idle does not keep it.
    let _idle = TcpStream::connect(&address).unwrap();
    Command::new("kill").args(["-TERM", &child.id().to_string()]).status().unwrap();
    let mut log = String::new();
    child.stderr.take().unwrap().read_to_string(&mut log).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(0), "{log}");
    let lines: Vec<&str> = log.lines().filter(|line| line.contains("uri=/meshes/sphere.uwm")).collect();
    assert!(lines.len() == 2 && lines[0].contains("status=401") && lines[1].contains("status=200"), "{log}");
    assert!(!log.contains("two"), "tokens are not logged");
}

/// One file: it is listed alone, so that the page shows it.
#[test]
fn one_file() {
    let folder = Folder::with_sphere();
    let file = folder.bytes("sphere.uwm");
    std::fs::write(folder.path("other.uwm"), &file).unwrap();
    let (mut child, address) = started(&folder, "sphere.uwm");
    let text = |path: &str| String::from_utf8_lossy(&get(&address, path, "")).into_owned();
    let list = text("/meshes");
    let list: serde_json::Value = serde_json::from_str(list.split("\r\n\r\n").nth(1).unwrap()).unwrap();
    let names: Vec<_> = list["meshes"].as_array().unwrap().iter().map(|mesh| mesh["name"].clone()).collect();
    assert_eq!((names, &list["next"]), (vec!["sphere.uwm".into()], &serde_json::Value::Null));
    assert!(get(&address, "/meshes/sphere.uwm", "").ends_with(&file));
    assert!(text("/meshes/other.uwm").starts_with("HTTP/1.1 404 "));
    assert!(text("/meshes/sphere.ply").starts_with("HTTP/1.1 404 "));
    assert!(text("/").contains("viewer.js"));
    child.kill().unwrap();
    child.wait().unwrap();
}

/// What the options say arrives at the server.
#[test]
#[cfg(unix)]
fn links_origins_and_hosts() {
    let folder = Folder::with_sphere();
    std::fs::create_dir(folder.path("in")).unwrap();
    std::os::unix::fs::symlink("../sphere.uwm", folder.path("in/out.uwm")).unwrap();
    let origin = "Origin: http://localhost:5173\r\n";
    for (arguments, link, allowed) in [
        ("in", "404", false),
        ("in --follow-links --cors http://localhost:5173 --cors https://x.example", "200", true),
    ] {
        let (mut child, address) = started(&folder, arguments);
        let answer = String::from_utf8_lossy(&get(&address, "/meshes/out.uwm", origin)).into_owned();
        assert!(answer.starts_with(&format!("HTTP/1.1 {link} ")), "{answer}");
        let told = answer.contains("access-control-allow-origin: http://localhost:5173\r\n");
        assert_eq!(told, allowed, "{answer}");
        child.kill().unwrap();
        child.wait().unwrap();
    }
    let (mut child, address) = started(&folder, "in --host meshes.example");
    for (host, status) in [("meshes.example", "200"), ("evil.example", "421")] {
        let mut stream = TcpStream::connect(&address).unwrap();
        write!(stream, "GET /meshes HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n").unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        assert!(answer.starts_with(&format!("HTTP/1.1 {status} ")), "{answer}");
    }
    child.kill().unwrap();
    child.wait().unwrap();
}

#[test]
fn what_cannot_be_served() {
    let folder = Folder::new();
    folder.write("empty", "\n \n");
    folder.write("odd", "good\nä\n");
    folder.write("file.uwm", "x");
    folder.run("serve nowhere").failed(1, "nowhere: No such file or directory (os error 2)");
    folder.write("file.txt", "x");
    folder.run("serve file.txt").failed(1, "file.txt: neither a folder nor a .uwm file");
    folder.run("serve file.uwm").failed(1, "file.uwm: byte 0: not a .uwm file (spec §3.2)");
    for (arguments, what) in [
        (
            "--cors example.org",
            "--cors example.org: no origin; one is like https://example.org or http://localhost:5173",
        ),
        ("--cors * --cors http://a.example", "--cors * stands alone"),
        ("--host localhost:8080", "--host localhost:8080: a name without port, or *"),
    ] {
        let run = folder.run(&format!("serve . {arguments}"));
        assert!(run.code == 2 && run.err.contains(what), "{}", run.err);
    }
    folder.run("serve . --token-file none").failed(1, "none: No such file or directory (os error 2)");
    let odd = "odd: line 2: a token has letters, digits and signs of ASCII only";
    folder.run("serve . --token-file odd").failed(1, odd);
    let run = folder.run("serve . --token-file empty");
    assert!(run.code == 2 && run.err.contains("empty: there is no token in it"), "{}", run.err);
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap();
    let run = folder.run(&format!("serve . --addr {address}"));
    run.failed(1, &format!("{address}: Address already in use (os error 98)"));
    #[cfg(not(feature = "cloud"))]
    folder.run("serve s3://bucket/x").failed(1, "s3://bucket/x: s3:// wants a build with --features cloud");
}

#[test]
#[cfg(unix)]
fn killed_and_started_again() {
    let folder = Folder::with_sphere();
    let file = folder.bytes("sphere.uwm");
    let (mut child, address) = started(&folder, ".");
    let mut stream = TcpStream::connect(&address).unwrap();
    stream.write_all(b"GET /meshes/sphere.uwm HTTP/1.1\r\nHost: localhost\r\n\r\n").unwrap();
    let mut begun = vec![0; 1000];
    stream.read_exact(&mut begun).unwrap();
    // SIGKILL.
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(TcpStream::connect(&address).is_err(), "nobody is there");
    let text = String::from_utf8_lossy(&begun).into_owned();
    let tag = text.lines().find_map(|line| line.strip_prefix("etag: ")).unwrap();
    let received = begun.len() - (begun.windows(4).position(|four| four == b"\r\n\r\n").unwrap() + 4);

    let (mut child, address) = started(&folder, ".");
    let rest =
        get(&address, "/meshes/sphere.uwm", &format!("Range: bytes={received}-\r\nIf-Range: {tag}\r\n"));
    assert!(rest.starts_with(b"HTTP/1.1 206 "), "the version is still the same");
    let whole = [&begun[begun.len() - received..], &rest[rest.len() - (file.len() - received)..]].concat();
    assert!(whole == file);
    child.kill().unwrap();
    child.wait().unwrap();
}

#[test]
#[cfg(target_os = "linux")]
fn ten_thousand_idle_connections() {
    use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
    let limit = getrlimit(Resource::Nofile);
    setrlimit(Resource::Nofile, Rlimit { current: limit.maximum, maximum: limit.maximum }).unwrap();
    let files = limit.maximum.map_or(usize::MAX, |n| n as usize);
    let count = 10_000.min(files.saturating_sub(500));
    if count < 10_000 {
        eprintln!("only {count} connections: {files} files may be open");
    }
    let folder = Folder::with_sphere();
    let (mut child, address) = started(&folder, ". --timeout 2");
    // Those that find no place wait until others have been idle for too long.
    let connect =
        || -> Vec<TcpStream> { (0..count / 8).map(|_| TcpStream::connect(&address).unwrap()).collect() };
    let idle: Vec<Vec<TcpStream>> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..8).map(|_| scope.spawn(connect)).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    assert!(get(&address, "/meshes/sphere.uwm", "").ends_with(&folder.bytes("sphere.uwm")));
    let status = std::fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap();
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap();
    let kilobytes: u64 = peak.trim().trim_end_matches(" kB").parse().unwrap();
    // 4,096 connections at a time, each with less than 32 KiB, beside what the program takes.
    assert!(kilobytes < 200 << 10, "{kilobytes} kB");
    drop(idle);
    child.kill().unwrap();
    child.wait().unwrap();
}
