//! `unweld fetch`: what it writes, what it says, how it goes on with what broke off.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use serde_json::Value;
use tokio::sync::oneshot;
use unweld::decoder::{Options as Decoding, Until, decode};
use unweld::formats::{Precision, write_ply};
use unweld::server::{Options, Server};
use unweld::store::Store;

use super::script::{Script, head_length, whole};
use super::{coded, exact_and_ordered, in_an_order};

pub struct Folder(pub tempfile::TempDir);

pub struct Run {
    pub code: i32,
    pub out: Vec<u8>,
    pub err: String,
}

impl Run {
    pub fn text(&self) -> String {
        String::from_utf8(self.out.clone()).unwrap()
    }

    fn failed(&self, code: i32, what: &str) {
        assert_eq!(self.code, code, "{}", self.err);
        assert!(self.err.contains(what), "{}", self.err);
    }

    pub fn succeeded(&self) -> &Self {
        assert_eq!(self.code, 0, "{}", self.err);
        self
    }
}

impl Folder {
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn bytes(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap()
    }

    fn list(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.0.path()).unwrap();
        let mut names: Vec<_> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    fn start(&self, arguments: &str) -> Child {
        Command::new(env!("CARGO_BIN_EXE_unweld"))
            .args(arguments.split_whitespace())
            .current_dir(self.0.path())
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    }

    pub fn run(&self, arguments: &str) -> Run {
        let output = self.start(arguments).wait_with_output().unwrap();
        let err = String::from_utf8(output.stderr).unwrap();
        Run { code: output.status.code().unwrap_or(-1), out: output.stdout, err }
    }
}

/// Our own server over a folder, until it is dropped.
struct Served {
    url: String,
    _stop: oneshot::Sender<()>,
}

fn serve(folder: &Path, options: Options) -> Served {
    let (stop, stopped) = oneshot::channel::<()>();
    let (told, address) = std::sync::mpsc::channel();
    let store = Store::open(folder.to_str().unwrap()).unwrap();
    std::thread::spawn(move || {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        runtime.block_on(async {
            let server = Server::bind("127.0.0.1:0".parse().unwrap(), store, options).await.unwrap();
            told.send(server.address().unwrap()).unwrap();
            server.run(async { drop(stopped.await) }).await;
        });
    });
    Served { url: format!("http://{}/meshes/a.uwm", address.recv().unwrap()), _stop: stop }
}

#[test]
fn from_our_own_server() {
    let (file, contents) = coded(1);
    let (folder, store) = (Folder::new(), Folder::new());
    std::fs::write(store.path("a.uwm"), &file).unwrap();
    std::fs::write(folder.path("token"), "one\n").unwrap();
    let served = serve(store.0.path(), Options { tokens: vec!["one".to_owned()], ..Options::default() });
    let fetch = |arguments: &str| folder.run(&format!("fetch {} --token-file token {arguments}", served.url));
    folder
        .run(&format!("fetch {} -o a.uwm", served.url))
        .failed(1, "the server refuses: status 401 Unauthorized");
    fetch("-o a.uwm --header nonsense").failed(2, "NAME:VALUE in ASCII");

    let run = fetch("-o a.uwm");
    assert!(run.succeeded().err.is_empty() && folder.bytes("a.uwm") == file);
    let lines: Vec<String> = run.text().lines().map(str::to_owned).collect();
    let size = |n: u64| unweld_grouped(n);
    assert!(lines[0].starts_with(&format!(
        "{}: {} bytes, levels {} to 0, ",
        served.url,
        size(file.len() as u64),
        contents.base_level()
    )));
    assert_eq!(lines[1], format!("  table of contents: {} bytes", size(contents.header.table_end())));
    let base = contents.bytes(contents.steps(contents.base_level()));
    let triangles = contents.levels.last().unwrap().triangles;
    assert!(lines[2].starts_with(&format!(
        "  base: {} bytes; {triangles} triangles, error at most ",
        base.end - base.start
    )));
    assert!(lines.last().unwrap().ends_with("received in 1 request"));

    fetch("-o b.uwm --level 4 --quiet").succeeded();
    assert_eq!(folder.bytes("b.uwm"), file[..contents.bytes(contents.steps(4)).end as usize]);
    folder.run("decode b.uwm --level 4 -o b.ply").succeeded();
    fetch("-o c.ply --level 4").succeeded();
    assert_eq!(folder.bytes("b.ply"), folder.bytes("c.ply"));
    folder.run("decode a.uwm --level 3 --via keyframe -o d.obj").succeeded();
    let run = fetch("-o e.obj --level 3 --via keyframe");
    assert!(run.succeeded().text().contains("  keyframe of level "), "{}", run.text());
    assert_eq!(folder.bytes("d.obj"), folder.bytes("e.obj"));
    folder.run("decode a.uwm -o f.ply").succeeded();
    fetch("-o g.ply").succeeded();
    assert_eq!(folder.bytes("f.ply"), folder.bytes("g.ply"));

    let most = contents.bytes(contents.steps(0)).end - 1;
    let told: Value =
        serde_json::from_slice(&fetch(&format!("-o h.uwm --max-bytes {most} --json")).succeeded().out)
            .unwrap();
    let bytes = folder.bytes("h.uwm");
    assert!(bytes.len() as u64 <= most && file.starts_with(&bytes));
    assert_eq!(told["bytes"], bytes.len());
    let steps = told["steps"].as_array().unwrap().iter().map(|step| step["bytes"].as_u64().unwrap());
    assert_eq!(contents.header.table_end() + steps.sum::<u64>(), bytes.len() as u64);
    let next = contents.atoms.iter().find(|atom| atom.end() > bytes.len() as u64).unwrap();
    assert!(next.end() > most, "another atom would be too much");
    let level = told["level"].as_u64().unwrap() as u32;
    assert!(contents.bytes(contents.steps(level)).end <= most);
    let until = Until { level, ..Until::default() };
    let decoder = decode(&file, Decoding { until, ..Decoding::default() }).unwrap();
    assert!(decoder.mesh().table.triangle_count() as u64 <= told["triangles"].as_u64().unwrap());

    let largest = contents.levels[5].max_error;
    let told = fetch(&format!("-o i.uwm --error {largest} --json"));
    let told: Value = serde_json::from_slice(&told.succeeded().out).unwrap();
    assert!(told["max_error"].as_f64().unwrap() <= largest && told["level"].as_u64().unwrap() >= 5);

    let by_rms = fetch(&format!("-o j.uwm --error rms:{largest} --json"));
    let by_rms: Value = serde_json::from_slice(&by_rms.succeeded().out).unwrap();
    let coarsest = contents.levels.iter().rposition(|level| level.rms_error <= largest).unwrap();
    assert_eq!(by_rms["level"], coarsest);
    assert!(by_rms["level"].as_u64() > told["level"].as_u64(), "the measures lead to different levels");
    let triangles = contents.levels[5].triangles;
    fetch(&format!("-o k.ply --triangles {triangles}")).succeeded();
    folder.run("decode a.uwm --level 5 -o l.ply").succeeded();
    assert_eq!(folder.bytes("k.ply"), folder.bytes("l.ply"));

    let run = fetch("-o - --level 6");
    assert_eq!(run.succeeded().out, file[..contents.bytes(contents.steps(6)).end as usize]);
    let names = folder.list();
    assert!(names.iter().all(|name| !name.contains(".part") && !name.starts_with('.')), "{names:?}");
}

/// With commas between the thousands, below a million.
fn unweld_grouped(n: u64) -> String {
    if n < 1000 { n.to_string() } else { format!("{},{:03}", n / 1000, n % 1000) }
}

#[test]
fn an_exact_and_ordered_mesh_bit_for_bit() {
    let mesh = in_an_order();
    let mut expected = Vec::new();
    write_ply(&mesh, Precision::Float64, &mut expected).unwrap();
    let file = exact_and_ordered(&mesh);
    let served = file.clone();
    let script = Script::answers(move |_, asked| asked.answer(&served, "\"one\""));
    let (folder, url) = (Folder::new(), script.url());
    for options in
        ["", "--level 0", "--error 0", "--error rms:0", "--level 0 --via keyframe", "--max-bytes 1G"]
    {
        folder.run(&format!("fetch {url} -o out.ply -q {options}")).succeeded();
        assert!(folder.bytes("out.ply") == expected, "{options}");
        std::fs::remove_file(folder.path("out.ply")).unwrap();
    }
    for options in ["", "--level 0", "--error 0"] {
        folder.run(&format!("fetch {url} -o out.uwm -q {options}")).succeeded();
        assert!(folder.bytes("out.uwm") == file, "{options}");
        std::fs::remove_file(folder.path("out.uwm")).unwrap();
    }
}

#[test]
fn what_cannot_be_had() {
    let (file, contents) = coded(1);
    let served = file.clone();
    let script = Script::answers(move |_, asked| asked.answer(&served, "\"one\""));
    let (folder, url, base) = (Folder::new(), script.url(), contents.base_level());
    std::fs::write(folder.path("old.uwm"), "old").unwrap();
    let fetch = |arguments: &str| folder.run(&format!("fetch {url} {arguments}"));
    fetch("-o old.uwm --level 999")
        .failed(1, &format!("there is no level 999: the levels are 0 (finest) to {base} (base)"));
    let least = contents.base_end();
    fetch(&format!("-o old.uwm --max-bytes {}", least - 1))
        .failed(1, &format!("a.uwm: the base needs {least} bytes, --max-bytes allows {}", least - 1));
    fetch("-o a.png").failed(2, "a.png: the name must end in .uwm, .ply, .obj, .stl, .glb or .gltf");
    fetch("-o a.uwm --level 1 --max-bytes 5K").failed(2, "cannot be used with");
    fetch("-o a.uwm --via keyframe").failed(2, "--via keyframe leads to a level, and to a mesh");
    fetch("-o nowhere/a.uwm").failed(1, "nowhere/a.uwm: ");
    folder.run("fetch ftp://example.org/a.uwm -o a.uwm").failed(2, "an address such as");
    folder.run("fetch a.uwm -o a.uwm").failed(2, "an address such as");
    folder
        .run("fetch http://127.0.0.1:1/a.uwm?key=secret -o a.uwm --retries 0")
        .failed(1, "http://127.0.0.1:1/a.uwm: ");
    let page =
        Script::answers(|_, _| b"HTTP/1.1 200 OK\r\nContent-Length: 15\r\n\r\n<!doctype html>".to_vec());
    folder
        .run(&format!("fetch {} -o a.uwm", page.url()))
        .failed(1, "a.uwm: byte 0: not a .uwm file (spec §3.2)");
    assert_eq!((folder.list(), folder.bytes("old.uwm")), (vec!["old.uwm".to_owned()], b"old".to_vec()));
}

#[test]
fn a_byte_that_is_wrong() {
    let (file, contents) = coded(1);
    let (served, atom) = (file.clone(), contents.atoms[7]);
    let script = Script::answers(move |number, asked| {
        let mut file = served.clone();
        if number == 0 {
            file[atom.offset as usize] ^= 1;
        }
        asked.answer(&file, "\"one\"")
    });
    let folder = Folder::new();
    let command = format!("fetch {} -o a.uwm", script.url());
    let run = folder.run(&command);
    run.failed(
        1,
        &format!(
            "bytes {} to {}: byte {}: atom 7 (",
            unweld_grouped(atom.offset),
            unweld_grouped(atom.end() - 1),
            atom.offset
        ),
    );
    assert_eq!(folder.list(), ["a.uwm.part", "a.uwm.part.json"]);
    assert_eq!(folder.bytes("a.uwm.part"), file[..atom.offset as usize], "what is sound stays");
    folder.run(&command).succeeded();
    assert_eq!((folder.list(), folder.bytes("a.uwm")), (vec!["a.uwm".to_owned()], file));
}

/// Kills the command once it has some of the file.
fn kill_midway(folder: &Folder, command: &str) {
    let mut child = folder.start(command);
    let some =
        |folder: &Folder| std::fs::metadata(folder.path("a.uwm.part")).is_ok_and(|part| part.len() > 3000);
    while !some(folder) {
        std::thread::sleep(Duration::from_millis(5));
        assert!(child.try_wait().unwrap().is_none(), "it ended");
    }
    child.kill().unwrap();
    child.wait().unwrap();
    assert_eq!(folder.list(), ["a.uwm.part", "a.uwm.part.json"]);
}

/// A server whose first answer stops behind 5,000 bytes and goes no further; the others are as `answer` makes them.
fn stalls_first(
    file: Vec<u8>,
    answer: impl Fn(&super::script::Asked) -> Vec<u8> + Send + Sync + 'static,
) -> Script {
    Script::play(move |number, asked, stream| {
        if number > 0 {
            let _ = stream.write_all(&answer(asked));
            return;
        }
        let answer = asked.answer(&file, "\"one\"");
        stream.write_all(&answer[..head_length(&answer) + 5000]).unwrap();
        std::thread::sleep(Duration::from_secs(600));
    })
}

#[test]
fn a_command_that_was_killed_goes_on() {
    let (file, _) = coded(1);
    let served = file.clone();
    let script = stalls_first(file.clone(), move |asked| asked.answer(&served, "\"one\""));
    let folder = Folder::new();
    let command = format!("fetch {} -o a.uwm", script.url());
    kill_midway(&folder, &command);
    let run = folder.run(&command);
    run.succeeded();
    assert!(run.err.contains("a.uwm.part: going on behind "), "{}", run.err);
    assert_eq!((folder.list(), folder.bytes("a.uwm")), (vec!["a.uwm".to_owned()], file));
    let asked = script.asked();
    assert!(asked.len() == 2 && asked[1].range().0 > 2000, "{:?}", asked[1]);
    assert_eq!(asked[1].header("if-range"), "\"one\"");
}

#[test]
fn a_command_that_was_killed_and_a_server_without_ranges() {
    let (file, _) = coded(1);
    let served = file.clone();
    let script = stalls_first(file.clone(), move |_| whole(&served, "\"one\""));
    let folder = Folder::new();
    let command = format!("fetch {} -o a.uwm", script.url());
    kill_midway(&folder, &command);
    folder.run(&command).succeeded();
    assert_eq!((folder.list(), folder.bytes("a.uwm")), (vec!["a.uwm".to_owned()], file));
}

#[test]
fn a_file_that_was_replaced_meanwhile_is_begun_anew() {
    let ((one, _), (two, _)) = (coded(1), coded(2));
    let served = two.clone();
    let script = stalls_first(one, move |asked| asked.answer(&served, "\"two\""));
    let folder = Folder::new();
    let command = format!("fetch {} -o a.uwm", script.url());
    kill_midway(&folder, &command);
    let run = folder.run(&command);
    run.succeeded();
    assert!(run.err.contains("the file was replaced: beginning anew"), "{}", run.err);
    assert_eq!((folder.list(), folder.bytes("a.uwm")), (vec!["a.uwm".to_owned()], two));
}

#[test]
fn a_part_that_is_damaged_or_of_something_else() {
    let (file, contents) = coded(1);
    let served = file.clone();
    let script = stalls_first(file.clone(), move |asked| asked.answer(&served, "\"one\""));
    let folder = Folder::new();
    let command = format!("fetch {} -o a.uwm", script.url());
    kill_midway(&folder, &command);
    let mut part = folder.bytes("a.uwm.part");
    let atom = contents.atoms[2];
    part[atom.offset as usize] ^= 1;
    std::fs::write(folder.path("a.uwm.part"), part).unwrap();
    folder.run(&command).succeeded();
    assert_eq!(folder.bytes("a.uwm"), file);
    // The atom before it is asked for again, too, to hear of the version.
    assert_eq!(script.asked()[1].range().0, contents.atoms[1].offset as usize);

    std::fs::write(folder.path("a.uwm.part"), "my thesis").unwrap();
    folder
        .run(&command)
        .failed(1, "a.uwm.part: this file is in the way, and nothing tells what it is part of");
    assert_eq!(folder.bytes("a.uwm.part"), b"my thesis");
}

#[test]
#[cfg(unix)]
fn two_at_once_and_an_interruption() {
    let (file, _) = coded(1);
    let script = stalls_first(file, |_| unreachable!("the second does not ask"));
    let folder = Folder::new();
    let command = format!("fetch {} -o a.uwm", script.url());
    let mut child = folder.start(&command);
    while !std::fs::metadata(folder.path("a.uwm.part")).is_ok_and(|part| part.len() > 3000) {
        std::thread::sleep(Duration::from_millis(5));
        assert!(child.try_wait().unwrap().is_none(), "it ended");
    }
    folder.run(&command).failed(1, "a.uwm.part: another unweld is at work on it");
    Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    let output = child.wait_with_output().unwrap();
    let err = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(
        err.contains("interrupted (a.uwm.part has what came; the same command goes on with it)"),
        "{err}"
    );
}

/// While it comes, and after, nobody may read what nobody could read before.
#[test]
#[cfg(unix)]
fn what_is_replaced_keeps_its_access() {
    use std::fs::{Permissions, metadata, set_permissions};
    use std::os::unix::fs::{MetadataExt, PermissionsExt};
    let (file, _) = coded(1);
    let served = file.clone();
    let script = stalls_first(file.clone(), move |asked| asked.answer(&served, "\"one\""));
    let folder = Folder::new();
    let mode = |name: &str| metadata(folder.path(name)).unwrap().mode() & 0o777;
    std::fs::write(folder.path("a.uwm"), "old").unwrap();
    set_permissions(folder.path("a.uwm"), Permissions::from_mode(0o600)).unwrap();
    let command = format!("fetch {} -o a.uwm", script.url());
    let mut child = folder.start(&command);
    while !metadata(folder.path("a.uwm.part")).is_ok_and(|part| part.len() > 3000) {
        std::thread::sleep(Duration::from_millis(5));
        assert!(child.try_wait().unwrap().is_none(), "it ended");
    }
    assert_eq!(
        (mode("a.uwm.part"), mode("a.uwm.part.json"), folder.bytes("a.uwm")),
        (0o600, 0o600, b"old".to_vec())
    );
    child.kill().unwrap();
    child.wait().unwrap();
    folder.run(&command).succeeded();
    assert_eq!(
        (folder.list(), folder.bytes("a.uwm"), mode("a.uwm")),
        (vec!["a.uwm".to_owned()], file, 0o600)
    );
}
