//! The server as clients have it: over TCP, with stores and clients that do what they should not.
#![cfg(all(feature = "server", feature = "encode"))]

mod access;
mod answers;
mod clients;
mod described;
mod lists;
mod refine;
mod sets;
mod stores;

use std::collections::HashMap;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::Path;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

use tokio::sync::oneshot;
use unweld::container::{Contents, parse_contents};
use unweld::encoder::{Encoder, Keyframes, Options as Encoding};
use unweld::mesh::shapes;
use unweld::server::{Options, Server};
use unweld::store::Store;

/// A server on a free port, until it is dropped.
struct Served {
    address: SocketAddr,
    stop: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

/// What came back.
#[derive(Debug)]
struct Answer {
    status: u16,
    headers: HashMap<String, String>,
    body: Vec<u8>,
}

impl Served {
    fn of(store: Store, options: Options) -> Self {
        Self::at("127.0.0.1:0", store, options)
    }

    fn at(address: &str, store: Store, options: Options) -> Self {
        let wanted: SocketAddr = address.parse().unwrap();
        let (stop, stopped) = oneshot::channel::<()>();
        let (told, address) = std::sync::mpsc::channel();
        let thread = std::thread::spawn(move || {
            let runtime =
                tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build().unwrap();
            runtime.block_on(async {
                let server = Server::bind(wanted, store, options).await.unwrap();
                told.send(server.address().unwrap()).unwrap();
                server.run(async { drop(stopped.await) }).await;
            });
        });
        Self { address: address.recv().unwrap(), stop: Some(stop), thread: Some(thread) }
    }

    fn folder(folder: &Path) -> Self {
        Self::of(Store::open(folder.to_str().unwrap()).unwrap(), Options::default())
    }

    /// One request on a connection of its own; `lines` stand behind the first line of the head.
    fn ask(&self, method: &str, path: &str, lines: &[&str]) -> Answer {
        let mut stream = self.connect();
        let lines: String = lines.iter().map(|line| format!("{line}\r\n")).collect();
        write!(stream, "{method} {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n{lines}\r\n")
            .unwrap();
        Answer::read(&mut stream)
    }

    fn get(&self, path: &str) -> Answer {
        self.ask("GET", path, &[])
    }

    fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(self.address).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        stream
    }

    /// The value of a counter.
    fn counted(&self, name: &str) -> u64 {
        let text = self.get("/metrics").text();
        let line = text.lines().find_map(|line| line.strip_prefix(&format!("{name} ")).map(str::to_owned));
        line.unwrap_or_else(|| panic!("{name} is not in {text}")).parse().unwrap()
    }

    /// Waits until a counter has a value.
    fn wait_for(&self, name: &str, value: u64) {
        for _ in 0..1000 {
            if self.counted(name) == value {
                return;
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        panic!("{name} is {}, not {value}", self.counted(name));
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        drop(self.stop.take());
        let ended = self.thread.take().unwrap().join();
        if !std::thread::panicking() {
            ended.unwrap();
        }
    }
}

impl Answer {
    /// Reads until the connection ends.
    fn read(stream: &mut TcpStream) -> Self {
        let mut bytes = Vec::new();
        // A connection that is broken off ends the body, too.
        let _ = stream.read_to_end(&mut bytes);
        Self::of(&bytes)
    }

    fn of(bytes: &[u8]) -> Self {
        let end = bytes.windows(4).position(|w| w == b"\r\n\r\n").expect("an answer has a head");
        let head = std::str::from_utf8(&bytes[..end]).unwrap();
        let mut lines = head.lines();
        let status = lines.next().unwrap().split(' ').nth(1).unwrap().parse().unwrap();
        let headers =
            lines.map(|line| line.split_once(": ").unwrap()).map(|(k, v)| (k.to_lowercase(), v.to_owned()));
        Self { status, headers: headers.collect(), body: bytes[end + 4..].to_vec() }
    }

    fn header(&self, name: &str) -> &str {
        self.headers.get(name).map_or("", String::as_str)
    }

    fn text(&self) -> String {
        String::from_utf8(self.body.clone()).unwrap()
    }

    fn json(&self) -> serde_json::Value {
        serde_json::from_slice(&self.body).unwrap_or_else(|e| panic!("{e}: {self:?}"))
    }

    /// A refusal with this status that names this field.
    fn refuses(&self, status: u16, field: &str) {
        assert_eq!(self.status, status, "{self:?}");
        assert_eq!(self.header("content-type"), "application/problem+json");
        let problem = self.json();
        assert_eq!(problem["status"], status);
        assert_eq!(problem["field"].as_str().unwrap_or(""), field, "{problem}");
        assert!(problem["detail"].as_str().is_some_and(|text| !text.is_empty()));
    }
}

/// A mesh of 5,120 triangles with keyframes, and what is in it.
fn mesh() -> (Vec<u8>, Arc<Contents>) {
    coded(1)
}

fn coded(seed: u64) -> (Vec<u8>, Arc<Contents>) {
    let options = Encoding { keyframes: Keyframes::Every(4), ..Encoding::default() };
    let file = Encoder::new(options).encode_to_vec(&shapes::bumpy_sphere(4, seed)).unwrap();
    let contents = parse_contents(&file).unwrap().unwrap();
    (file, contents)
}

fn folder_with(name: &str, bytes: &[u8]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join(name), bytes).unwrap();
    folder
}

/// How long an answer may take before a test gives up.
const PATIENCE: Duration = Duration::from_secs(60);
