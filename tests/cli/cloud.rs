//! `unweld serve` of an object store that speaks the protocol of S3: moto's server (PyPI: `moto[server]`), looked for on the path and as
//! `$UNWELD_MOTO`. Where there is none, the test says so and passes.

use super::Folder;
use super::serve::{get, started_with};
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// A server of objects, until it is dropped.
struct Moto(Child, String);

impl Moto {
    fn start() -> Option<Self> {
        let program = std::env::var("UNWELD_MOTO").unwrap_or_else(|_| "moto_server".to_owned());
        let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        let arguments = ["-H", "127.0.0.1", "-p", &port.to_string()];
        let child =
            Command::new(program).args(arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().ok()?;
        let moto = Self(child, format!("127.0.0.1:{port}"));
        for _ in 0..600 {
            if TcpStream::connect(&moto.1).is_ok() {
                return Some(moto);
            }
            std::thread::sleep(Duration::from_millis(100));
        }
        panic!("moto does not listen on {}", moto.1);
    }

    fn put(&self, path: &str, bytes: &[u8]) {
        let mut stream = TcpStream::connect(&self.1).unwrap();
        let head = format!(
            "PUT {path} HTTP/1.1\r\nHost: {}\r\nConnection: close\r\nx-amz-acl: public-read-write\r\nContent-Length: {}\r\n\r\n",
            self.1,
            bytes.len()
        );
        stream.write_all(&[head.as_bytes(), bytes].concat()).unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
    }
}

impl Drop for Moto {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn the_same_bytes_from_a_bucket_as_from_a_folder() {
    let Some(moto) = Moto::start() else {
        println!("skipped: no moto_server on the path and none in $UNWELD_MOTO");
        return;
    };
    let folder = Folder::with_sphere();
    let file = folder.bytes("sphere.uwm");
    moto.put("/bucket", b"");
    moto.put("/bucket/in/sphere.uwm", &file);
    let endpoint = format!("http://{}", moto.1);
    let variables = [
        ("AWS_ENDPOINT", endpoint.as_str()),
        ("AWS_ALLOW_HTTP", "true"),
        ("AWS_REGION", "us-east-1"),
        ("AWS_ACCESS_KEY_ID", "any"),
        ("AWS_SECRET_ACCESS_KEY", "any"),
    ];
    let (mut remote, bucket) = started_with(&folder, "s3://bucket/in", &variables);
    let (mut local, plain) = started_with(&folder, ".", &[]);
    let body = |answer: Vec<u8>| {
        let end = answer.windows(4).position(|w| w == b"\r\n\r\n").unwrap() + 4;
        (String::from_utf8_lossy(&answer[9..12]).into_owned(), answer[end..].to_vec())
    };
    for (path, line) in [
        ("/meshes/sphere.uwm", ""),
        ("/meshes/sphere.uwm", "Range: bytes=100-1999\r\n"),
        ("/meshes/sphere.uwm", "Range: bytes=0-9,-100\r\n"),
        ("/meshes/sphere/refine?max_bytes=4000", ""),
        ("/meshes/sphere/refine?from=3", ""),
        ("/meshes/sphere/keyframe/3", ""),
        ("/meshes/none.uwm", ""),
        ("/meshes/sphere.uwm", "If-Match: \"x\"\r\n"),
    ] {
        let ours = body(get(&bucket, path, line));
        let theirs = body(get(&plain, path, line));
        assert_eq!(ours.0, theirs.0, "{path} {line}");
        assert!(ours == theirs || ours.0 == "412", "{path} {line}");
    }
    let list: serde_json::Value = serde_json::from_slice(&body(get(&bucket, "/meshes", "")).1).unwrap();
    assert_eq!(list["meshes"][0]["name"], "sphere.uwm");
    // Another object under the name is another version.
    let tag = |answer: Vec<u8>| {
        let text = String::from_utf8_lossy(&answer).into_owned();
        text.lines().find_map(|line| line.strip_prefix("etag: ").map(str::to_owned)).unwrap()
    };
    let before = tag(get(&bucket, "/meshes/sphere.uwm", ""));
    moto.put("/bucket/in/sphere.uwm", &file[..file.len() - 1]);
    let held = format!("If-Match: {before}\r\n");
    assert_eq!(body(get(&bucket, "/meshes/sphere/levels", &held)).0, "412");
    assert_ne!(tag(get(&bucket, "/meshes/sphere.uwm", "")), before);
    for child in [&mut remote, &mut local] {
        child.kill().unwrap();
        child.wait().unwrap();
    }
}
