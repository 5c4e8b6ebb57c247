//! Clients that go away, take nothing, send nothing, or send too much.

use super::{Answer, PATIENCE, Served, folder_with, mesh};
use std::io::{Read, Write};
use std::net::{Shutdown, TcpStream};
use std::path::Path;
use std::time::Duration;
use unweld::server::Options;
use unweld::store::Store;

/// A file that is larger than all that the system holds for a connection: 256 MiB, none of them on the disk.
fn large(folder: &Path) -> u64 {
    let file = std::fs::File::create(folder.join("large.uwm")).unwrap();
    file.set_len(LARGE).unwrap();
    LARGE
}

fn serve(folder: &Path, options: Options) -> Served {
    Served::of(Store::open(folder.to_str().unwrap()).unwrap(), options)
}

#[test]
fn a_client_goes_in_mid_body() {
    let (file, _) = mesh();
    let folder = folder_with("a.uwm", &file);
    large(folder.path());
    let served = serve(folder.path(), Options::default());
    for _ in 0..5 {
        let mut stream = served.connect();
        stream.write_all(b"GET /meshes/large.uwm HTTP/1.1\r\nHost: localhost\r\n\r\n").unwrap();
        stream.read_exact(&mut [0; 1000]).unwrap();
        stream.shutdown(Shutdown::Both).unwrap();
    }
    served.wait_for("unweld_unfinished_bodies_total", 5);
    // The one that asks.
    served.wait_for("unweld_connections", 1);
    assert_eq!(served.get("/meshes/a.uwm").body, file);
}

#[test]
fn a_client_takes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let length = large(folder.path());
    let served = serve(folder.path(), Options { stall: Duration::from_millis(300), ..Options::default() });
    let mut stream = served.connect();
    stream.write_all(b"GET /meshes/large.uwm HTTP/1.1\r\nHost: localhost\r\n\r\n").unwrap();
    // It is given up, and until then no more is read than the system takes: the connection holds its pieces, not the file.
    served.wait_for("unweld_unfinished_bodies_total", 1);
    let sent = served.counted("unweld_body_bytes_total");
    assert!(sent > 0 && sent < length / 4, "{sent} bytes");
    served.wait_for("unweld_connections", 1);
    let mut rest = Vec::new();
    let _ = stream.read_to_end(&mut rest);
    assert!((rest.len() as u64) < length, "it ends early, and the client can tell by the length");
}

#[test]
fn a_slow_client_gets_it_all() {
    let folder = tempfile::tempdir().unwrap();
    let content: Vec<u8> = (0..3_000_000u32).flat_map(u32::to_le_bytes).collect();
    std::fs::write(folder.path().join("a.uwm"), &content).unwrap();
    let served = serve(folder.path(), Options { stall: Duration::from_secs(20), ..Options::default() });
    let mut stream = served.connect();
    stream.write_all(b"GET /meshes/a.uwm HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n").unwrap();
    let (mut all, mut piece) = (Vec::new(), vec![0; 300_000]);
    loop {
        let count = stream.read(&mut piece).unwrap();
        if count == 0 {
            break;
        }
        all.extend_from_slice(&piece[..count]);
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(Answer::of(&all).body == content);
}

/// A socket whose system keeps little of what has come for whoever does not read it.
fn narrow(served: &Served) -> TcpStream {
    let socket = socket2::Socket::new(socket2::Domain::IPV4, socket2::Type::STREAM, None).unwrap();
    socket.set_recv_buffer_size(16 << 10).unwrap();
    socket.connect(&served.address.into()).unwrap();
    let stream = TcpStream::from(socket);
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    stream
}

/// Four kilobytes a second, with a twentieth of the usual patience, so twenty times as fast. All the while the client takes something, so it may
/// stay, however much the system could have kept for it.
#[test]
fn four_kilobytes_a_second_are_something() {
    let folder = tempfile::tempdir().unwrap();
    let content: Vec<u8> = (0..3_000_000u32).flat_map(u32::to_le_bytes).collect();
    std::fs::write(folder.path().join("a.uwm"), &content).unwrap();
    let served = serve(folder.path(), Options { stall: Duration::from_secs(3), ..Options::default() });
    let mut stream = narrow(&served);
    stream.write_all(b"GET /meshes/a.uwm HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n").unwrap();
    let (mut all, mut piece) = (Vec::new(), vec![0; 20_000]);
    for _ in 0..28 {
        stream.read_exact(&mut piece).unwrap();
        all.extend_from_slice(&piece);
        std::thread::sleep(Duration::from_millis(250));
    }
    assert_eq!(served.counted("unweld_unfinished_bodies_total"), 0);
    stream.read_to_end(&mut all).unwrap();
    assert!(Answer::of(&all).body == content);
}

/// What a client takes is seen when it has taken little: 128 KiB make room for more.
#[test]
#[cfg(target_os = "linux")]
fn what_is_taken_is_seen() {
    let folder = tempfile::tempdir().unwrap();
    large(folder.path());
    let served = serve(folder.path(), Options { stall: PATIENCE, ..Options::default() });
    let mut stream = narrow(&served);
    stream.write_all(b"GET /meshes/large.uwm HTTP/1.1\r\nHost: localhost\r\n\r\n").unwrap();
    for _ in 0..10 {
        let before = at_rest(&served);
        stream.read_exact(&mut [0; 128 << 10]).unwrap();
        let more = (0..1000).any(|_| {
            std::thread::sleep(Duration::from_millis(10));
            served.counted("unweld_body_bytes_total") > before
        });
        assert!(more, "{before} bytes were handed on, and no more since");
    }
}

/// How many bytes have been handed on, once no more are.
fn at_rest(served: &Served) -> u64 {
    let mut sent = 0;
    for _ in 0..1000 {
        let now = served.counted("unweld_body_bytes_total");
        if now == sent && sent > 0 {
            return sent;
        }
        sent = now;
        std::thread::sleep(Duration::from_millis(100));
    }
    panic!("{sent} bytes, and more");
}

/// Clients that take nothing cost little, and nobody else notices them.
#[test]
#[cfg(target_os = "linux")]
fn a_thousand_clients_take_nothing() {
    use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
    let limit = getrlimit(Resource::Nofile);
    setrlimit(Resource::Nofile, Rlimit { current: limit.maximum, maximum: limit.maximum }).unwrap();
    let count = 1000.min(limit.maximum.map_or(1000, |files| files.saturating_sub(500) / 2));
    let (file, _) = mesh();
    let folder = folder_with("a.uwm", &file);
    large(folder.path());
    let served = serve(folder.path(), Options { stall: PATIENCE, ..Options::default() });
    let stalled: Vec<TcpStream> = (0..count)
        .map(|_| {
            let mut stream = narrow(&served);
            stream.write_all(b"GET /meshes/large.uwm HTTP/1.1\r\nHost: localhost\r\n\r\n").unwrap();
            stream
        })
        .collect();
    // Those, and the one that asks.
    served.wait_for("unweld_connections", count + 1);
    let sent = at_rest(&served);
    // Each has a piece in hand and one in the buffer of the connection (64 KiB each), and with the system less than 256 KiB on either side.
    let bound = count * (384 << 10);
    assert!(sent >= count && sent < bound, "{sent} bytes, at most {bound} for {count} clients");
    for _ in 0..100 {
        assert_eq!(served.get("/healthz").text(), "ok\n");
    }
    assert_eq!(served.get("/meshes/a.uwm").body, file);
    assert_eq!(served.counted("unweld_unfinished_bodies_total"), 0);
    drop(stalled);
    served.wait_for("unweld_unfinished_bodies_total", count);
}

/// Whoever is idle makes room at once, not when a time is over: there is none here.
#[test]
fn idle_connections_make_room() {
    let (file, _) = mesh();
    let folder = folder_with("a.uwm", &file);
    large(folder.path());
    let options = Options { connections: 4, idle: 10 * PATIENCE, ..Options::default() };
    let served = serve(folder.path(), options);
    // One has an answer under way: it stays.
    let mut busy = narrow(&served);
    busy.write_all(b"GET /meshes/large.uwm HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
        .unwrap();
    let mut begun = vec![0; 1000];
    busy.read_exact(&mut begun).unwrap();
    let mut idle: Vec<_> = (0..40).map(|_| served.connect()).collect();
    // Some have begun to speak, and some have been answered already.
    for stream in &mut idle[..10] {
        stream.write_all(b"GET /meshes/a.uwm HTTP/1.1\r\nHost").unwrap();
    }
    for stream in &mut idle[10..20] {
        stream.write_all(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n").unwrap();
    }
    for _ in 0..10 {
        assert_eq!(served.get("/meshes/a.uwm").body, file);
    }
    // The longest idle ones went: all but the last few.
    for mut stream in idle.drain(..36) {
        let mut rest = Vec::new();
        let _ = stream.read_to_end(&mut rest);
    }
    std::io::copy(&mut busy, &mut std::io::sink())
        .map(|rest| assert_eq!(rest + 1000, LARGE + head(&begun)))
        .unwrap();
}

/// The bytes of the head of an answer that begins so.
fn head(begun: &[u8]) -> u64 {
    begun.windows(4).position(|four| four == b"\r\n\r\n").unwrap() as u64 + 4
}

/// Where nobody is idle, whoever comes waits, and is served in its turn.
#[test]
fn those_with_an_answer_under_way_keep_their_place() {
    let (file, _) = mesh();
    let folder = folder_with("a.uwm", &file);
    large(folder.path());
    let served = serve(folder.path(), Options { connections: 2, stall: PATIENCE, ..Options::default() });
    let busy: Vec<TcpStream> = (0..2)
        .map(|_| {
            let mut stream = narrow(&served);
            stream.write_all(b"GET /meshes/large.uwm HTTP/1.1\r\nHost: localhost\r\n\r\n").unwrap();
            stream.read_exact(&mut [0; 100]).unwrap();
            stream
        })
        .collect();
    let mut next = served.connect();
    next.write_all(b"GET /meshes/a.uwm HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n").unwrap();
    next.set_read_timeout(Some(Duration::from_millis(300))).unwrap();
    assert!(next.read(&mut [0; 1]).is_err(), "it waits");
    next.set_read_timeout(Some(PATIENCE)).unwrap();
    drop(busy);
    assert_eq!(Answer::read(&mut next).body, file);
}

#[test]
fn a_body_that_nobody_wants() {
    let (file, _) = mesh();
    let folder = folder_with("a.uwm", &file);
    let served = serve(folder.path(), Options { idle: Duration::from_millis(500), ..Options::default() });
    let mut stream = served.connect();
    stream
        .write_all(b"GET /meshes/a.uwm HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1000000000\r\n\r\nabc")
        .unwrap();
    let answer = Answer::read(&mut stream);
    assert_eq!((answer.status, &answer.body), (200, &file));
}

#[test]
fn names_that_lead_out() {
    let (file, _) = mesh();
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("in")).unwrap();
    std::fs::write(folder.path().join("secret.uwm"), &file).unwrap();
    std::fs::write(folder.path().join("in/.hidden.uwm"), &file).unwrap();
    std::fs::write(folder.path().join("in/notes.txt"), &file).unwrap();
    let served = Served::folder(&folder.path().join("in"));
    let absolute = folder.path().join("secret.uwm");
    let absolute = absolute.to_str().unwrap();
    let names = [
        "../secret.uwm".to_owned(),
        "%2e%2e/secret.uwm".to_owned(),
        "%2E%2E%2Fsecret.uwm".to_owned(),
        "..%2fsecret.uwm".to_owned(),
        "..%5csecret.uwm".to_owned(),
        "x/../../secret.uwm".to_owned(),
        "./../secret.uwm".to_owned(),
        "..;/secret.uwm".to_owned(),
        "%252e%252e/secret.uwm".to_owned(),
        absolute.to_owned(),
        absolute.replace('/', "%2f"),
        format!("/{absolute}"),
        "a%00.uwm".to_owned(),
        "../secret.uwm%00.uwm".to_owned(),
        "%ff.uwm".to_owned(),
        ".hidden.uwm".to_owned(),
        "%c0%ae%c0%ae/secret.uwm".to_owned(),
        "../secret/levels".to_owned(),
        "%2e%2e/secret/refine".to_owned(),
        "../secret/keyframe/0".to_owned(),
        ".uwm".to_owned(),
        "a".repeat(5000) + ".uwm",
    ];
    for name in names {
        let answer = served.get(&format!("/meshes/{name}"));
        // Encoded twice it is a name like any other, of nothing.
        let (status, field) = if name.contains("%25") { (404, "") } else { (400, "name") };
        answer.refuses(status, field);
    }
    for path in ["/../secret.uwm", "/meshes/notes.txt", "/in/notes.txt", "/meshes/"] {
        let status = served.get(path).status;
        assert!(status == 404 || status == 400, "{path} {status}");
    }
    assert_eq!(served.get("/meshes").json()["meshes"], serde_json::json!([]));
}

#[test]
fn heads_without_measure() {
    let (file, _) = mesh();
    let folder = folder_with("a.uwm", &file);
    let served = Served::folder(folder.path());
    let refused = |head: Vec<u8>| {
        let mut stream = served.connect();
        // The server may hang up before all is written.
        let _ = stream.write_all(&head);
        let mut bytes = Vec::new();
        let _ = stream.read_to_end(&mut bytes);
        let first = String::from_utf8_lossy(&bytes).lines().next().unwrap_or("").to_owned();
        let statuses = [" 400 ", " 414 ", " 416 ", " 431 "];
        assert!(first.is_empty() || statuses.iter().any(|status| first.contains(status)), "{first}");
    };
    let megabyte = "a".repeat(1 << 20);
    refused(format!("GET /meshes/a.uwm HTTP/1.1\r\nHost: localhost\r\nX: {megabyte}\r\n\r\n").into());
    refused(format!("GET /meshes/{megabyte} HTTP/1.1\r\nHost: localhost\r\n\r\n").into());
    refused(format!("GET /meshes/a.uwm HTTP/1.1\r\n{}\r\n", "X: y\r\n".repeat(100_000)).into());
    refused(b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03".repeat(1000));
    let ranges: Vec<String> = (0..10_000).map(|k| format!("{k}-{k}")).collect();
    // More than a head may hold, and more than are looked for: either is told.
    refused(
        format!(
            "GET /meshes/a.uwm HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\nRange: bytes={}\r\n\r\n",
            ranges.join(",")
        )
        .into(),
    );
    for (count, status) in [(5_000, 416), (17, 416), (16, 206)] {
        let line = format!("Range: bytes={}", ranges[..count].join(","));
        assert_eq!(served.ask("GET", "/meshes/a.uwm", &[&line]).status, status, "{count} ranges");
    }
    assert_eq!(served.get("/meshes/a.uwm").body, file);
}

#[test]
fn a_stop_lets_answers_end() {
    let folder = tempfile::tempdir().unwrap();
    let content: Vec<u8> = (0..8_000_000u32).flat_map(u32::to_le_bytes).collect();
    std::fs::write(folder.path().join("a.uwm"), &content).unwrap();
    let mut served = Served::folder(folder.path());
    let mut stream = served.connect();
    stream.write_all(b"GET /meshes/a.uwm HTTP/1.1\r\nHost: localhost\r\n\r\n").unwrap();
    let mut start = vec![0; 100_000];
    stream.read_exact(&mut start).unwrap();
    drop(served.stop.take());
    let mut rest = Vec::new();
    stream.read_to_end(&mut rest).unwrap();
    start.extend(rest);
    assert!(Answer::of(&start).body == content);
    let ended = std::time::Instant::now();
    drop(served);
    assert!(ended.elapsed() < PATIENCE, "it does not wait for connections that are idle");
}

const LARGE: u64 = 256 << 20;
