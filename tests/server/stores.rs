//! Stores that fail, and meshes that change or are damaged.

use super::{Answer, Served, coded, folder_with, mesh};
use async_trait::async_trait;
use bytes::Bytes;
use futures_util::stream::{self, BoxStream, StreamExt};
use object_store::memory::InMemory;
use object_store::path::Path;
use object_store::{
    CopyOptions, GetOptions, GetResult, GetResultPayload, ListResult, MultipartUpload, ObjectMeta,
    ObjectStore, ObjectStoreExt, PutMultipartOptions, PutOptions, PutPayload, PutResult, Result,
};
use std::fmt;
use std::io::{Read, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use unweld::container::Contents;
use unweld::decoder::{Options as Decoding, decode};
use unweld::server::Options;
use unweld::store::Store;

/// Sends in small pieces, and fails at every `period`-th request and piece.
#[derive(Debug)]
struct Failing {
    inner: InMemory,
    period: u32,
    count: Arc<AtomicU32>,
}

impl Failing {
    fn with(period: u32, file: &[u8]) -> Arc<Self> {
        let failing = Self { inner: InMemory::new(), period, count: Arc::default() };
        failing.replace(file);
        Arc::new(failing)
    }

    fn replace(&self, file: &[u8]) {
        let runtime = tokio::runtime::Builder::new_current_thread().build().unwrap();
        runtime.block_on(self.inner.put(&Path::from("a.uwm"), file.to_vec().into())).unwrap();
    }
}

fn turn(count: &AtomicU32, period: u32) -> Result<()> {
    if (count.fetch_add(1, Ordering::Relaxed) + 1).is_multiple_of(period) {
        return Err(object_store::Error::Generic {
            store: "failing",
            source: "secret: it is its turn".into(),
        });
    }
    Ok(())
}

impl fmt::Display for Failing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Failing")
    }
}

#[async_trait]
impl ObjectStore for Failing {
    async fn get_opts(&self, location: &Path, options: GetOptions) -> Result<GetResult> {
        turn(&self.count, self.period)?;
        let got = self.inner.get_opts(location, options).await?;
        let (meta, range) = (got.meta.clone(), got.range.clone());
        let (attributes, extensions) = (got.attributes.clone(), got.extensions.clone());
        let (count, period) = (self.count.clone(), self.period);
        let pieces = got.into_stream().flat_map(move |bytes| {
            let count = count.clone();
            let bytes = bytes.unwrap();
            let cut: Vec<Bytes> = bytes.chunks(1000).map(Bytes::copy_from_slice).collect();
            stream::iter(cut).map(move |piece| turn(&count, period).map(|()| piece))
        });
        Ok(GetResult {
            payload: GetResultPayload::Stream(pieces.boxed()),
            meta,
            range,
            attributes,
            extensions,
        })
    }

    fn list(&self, prefix: Option<&Path>) -> BoxStream<'static, Result<ObjectMeta>> {
        match turn(&self.count, self.period) {
            Ok(()) => self.inner.list(prefix),
            Err(error) => stream::once(async { Err(error) }).boxed(),
        }
    }

    async fn put_opts(&self, location: &Path, payload: PutPayload, options: PutOptions) -> Result<PutResult> {
        self.inner.put_opts(location, payload, options).await
    }

    async fn put_multipart_opts(
        &self,
        location: &Path,
        options: PutMultipartOptions,
    ) -> Result<Box<dyn MultipartUpload>> {
        self.inner.put_multipart_opts(location, options).await
    }

    fn delete_stream(&self, locations: BoxStream<'static, Result<Path>>) -> BoxStream<'static, Result<Path>> {
        self.inner.delete_stream(locations)
    }

    async fn list_with_delimiter(&self, prefix: Option<&Path>) -> Result<ListResult> {
        self.inner.list_with_delimiter(prefix).await
    }

    async fn copy_opts(&self, from: &Path, to: &Path, options: CopyOptions) -> Result<()> {
        self.inner.copy_opts(from, to, options).await
    }
}

#[test]
fn a_store_that_fails_every_third_time() {
    let (file, contents) = mesh();
    let served = Served::of(Store::over(Failing::with(3, &file)), Options::default());
    for _ in 0..4 {
        assert_eq!(served.get("/meshes/a.uwm").body, file);
        assert_eq!(served.get("/meshes/a/levels").json()["atoms"], contents.atoms.len());
        assert_eq!(served.get("/meshes").json()["meshes"][0]["name"], "a.uwm");
        let refined = served.get("/meshes/a/refine?to=5");
        let end = contents.bytes(contents.steps(5)).end as usize;
        assert_eq!(refined.body, &file[..end]);
    }
    assert!(served.counted("unweld_store_retries_total") > 4);
}

#[test]
fn a_store_that_always_fails() {
    let (file, _) = mesh();
    let served = Served::of(Store::over(Failing::with(1, &file)), Options::default());
    for path in ["/meshes/a.uwm", "/meshes/a/levels", "/meshes/a/refine", "/meshes/a/keyframe/0", "/meshes"] {
        let answer = served.get(path);
        answer.refuses(503, "");
        assert_eq!((answer.header("retry-after"), answer.header("cache-control")), ("2", "no-store"));
        assert_eq!(answer.json()["detail"], "the store fails", "why is for the log");
    }
    assert_eq!(served.get("/healthz").status, 200);
}

#[test]
fn a_store_that_answers_and_then_sends_nothing() {
    let (file, _) = mesh();
    // The question for the version goes well, the next five attempts do not.
    let failing = Failing::with(2, &file);
    let served = Served::of(Store::over(failing), Options::default());
    let answer = served.get("/meshes/a.uwm");
    assert_eq!(answer.status, 503, "known before the head is sent");
}

/// A file that is replaced while a client takes it: the client gets the old one to its end.
#[test]
fn replaced_in_a_folder_by_another_file() {
    let folder = tempfile::tempdir().unwrap();
    let (old, new) = (vec![b'a'; 32 << 20], vec![b'b'; 32 << 20]);
    let path = folder.path().join("a.uwm");
    std::fs::write(&path, &old).unwrap();
    let served = Served::folder(folder.path());
    let (mut stream, mut bytes) = begun(&served);
    std::fs::write(folder.path().join("other"), &new).unwrap();
    std::fs::rename(folder.path().join("other"), &path).unwrap();
    stream.read_to_end(&mut bytes).unwrap();
    let first = Answer::of(&bytes);
    assert!(first.body == old);
    let second = served.get("/meshes/a.uwm");
    assert!(second.body == new && second.header("etag") != first.header("etag"));
}

/// A file that is written to where it lies cannot be told to its end: the client gets less than was promised.
#[test]
fn replaced_in_a_folder_in_place() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.uwm");
    std::fs::write(&path, vec![b'a'; 32 << 20]).unwrap();
    let served = Served::folder(folder.path());
    let (mut stream, mut bytes) = begun(&served);
    std::thread::sleep(std::time::Duration::from_millis(50));
    std::fs::write(&path, vec![b'b'; 32 << 20]).unwrap();
    let _ = stream.read_to_end(&mut bytes);
    let answer = Answer::of(&bytes);
    assert!(answer.body.len() < 32 << 20 && answer.body.iter().all(|&b| b == b'a'));
}

/// An answer of which the first bytes have been read.
fn begun(served: &Served) -> (std::net::TcpStream, Vec<u8>) {
    let mut stream = served.connect();
    stream.write_all(b"GET /meshes/a.uwm HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n").unwrap();
    let mut bytes = vec![0; 1000];
    stream.read_exact(&mut bytes).unwrap();
    (stream, bytes)
}

#[test]
fn replaced_in_a_session() {
    let ((old, contents), (new, _)) = (coded(1), coded(2));
    let store = Failing::with(u32::MAX, &old);
    let served = Served::of(Store::over(store.clone()), Options::default());
    let first = served.get("/meshes/a/refine?to=9");
    let tag = first.header("etag").to_owned();
    store.replace(&new);
    let held = format!("If-Match: {tag}");
    for path in ["refine?from=9&to=5", "levels", "keyframe/0"] {
        let answer = served.ask("GET", &format!("/meshes/a/{path}"), &[&held]);
        answer.refuses(412, "");
        assert_ne!(answer.header("etag"), tag, "the version to start over with");
    }
    served.get(&format!("/meshes/a/refine?from=9&v={}", tag.trim_matches('"'))).refuses(410, "v");
    let range = served.ask("GET", "/meshes/a.uwm", &["Range: bytes=100-199", &format!("If-Range: {tag}")]);
    assert_eq!((range.status, &range.body), (200, &new), "all of the new one, not a part that fits nothing");
    // A client that looks at the tag sees it, too.
    let next = served.get("/meshes/a/refine?from=9&to=5");
    assert_ne!(next.header("etag"), tag);
    let again = served.get("/meshes/a/refine");
    assert_eq!(again.header("etag"), next.header("etag"));
    decode(&again.body, Decoding::default()).map(drop).unwrap_or_else(|e| only_cut_off(&e.to_string()));
    assert!(contents.base_level() >= 9);
}

/// What `refine` leaves out are metadata and keyframes.
fn only_cut_off(fault: &str) {
    assert!(fault.contains("the file is cut off"), "{fault}");
}

fn damaged(at: u64, file: &[u8]) -> Vec<u8> {
    let mut bytes = file.to_vec();
    bytes[at as usize] ^= 1;
    bytes
}

fn atom_in_the_middle(contents: &Contents) -> usize {
    contents.steps(contents.base_level() / 2).start
}

#[test]
fn damaged_meshes_are_served_and_the_client_names_the_atom() {
    let (file, contents) = mesh();
    let index = atom_in_the_middle(&contents);
    let atom = contents.atoms[index];
    let folder = folder_with("a.uwm", &damaged(atom.offset, &file));
    let served = Served::folder(folder.path());
    let bytes = served.get("/meshes/a.uwm").body;
    let fault = decode(&bytes, Decoding::default()).err().unwrap().to_string();
    let named = format!("byte {}: atom {index} ({:?}, level {})", atom.offset, atom.kind, atom.level);
    assert!(fault.starts_with(&named), "{fault}");
    // So does a client that asks for those atoms only.
    let part = served.get(&format!("/meshes/a/refine?from={}&to=0", atom.level + 1)).body;
    assert_eq!(part[0], file[atom.offset as usize] ^ 1);
    assert!(contents.check(index, &part[..atom.length as usize]).is_err());
}

#[test]
fn truncated_meshes() {
    let (file, contents) = mesh();
    let index = atom_in_the_middle(&contents);
    let atom = contents.atoms[index];
    let cut = atom.end() as usize - 1;
    let folder = folder_with("a.uwm", &file[..cut]);
    let served = Served::folder(folder.path());
    assert_eq!(served.get("/meshes/a.uwm").body, &file[..cut]);
    let answer = served.get("/meshes/a/refine");
    answer.refuses(500, "");
    let named = format!(
        "atom {index} ({:?}, level {}) is cut off: the file has {cut} of {} bytes",
        atom.kind,
        atom.level,
        file.len()
    );
    assert_eq!(answer.json()["detail"], named);
    // What is there can be had.
    let before = served.get(&format!("/meshes/a/refine?to={}", atom.level + 1));
    assert_eq!(before.body, &file[..contents.bytes(contents.steps(atom.level + 1)).end as usize]);
    // And files that are none are told as such, beside the others.
    std::fs::write(folder.path().join("b.uwm"), &file).unwrap();
    std::fs::write(folder.path().join("c.uwm"), b"solid x").unwrap();
    std::fs::write(folder.path().join("d.uwm"), b"").unwrap();
    std::fs::write(folder.path().join("e.uwm"), damaged(80, &file)).unwrap();
    served.get("/meshes/c/levels").refuses(500, "");
    let list = served.get("/meshes").json();
    let errors: Vec<_> =
        list["meshes"].as_array().unwrap().iter().map(|m| m["error"].as_str().unwrap_or("")).collect();
    let expected = [
        "",
        "",
        "byte 0: not a .uwm file (spec §3.2)",
        "byte 0: the file is cut off: at least 16 bytes are missing (spec §3.1)",
        "byte 0: header and table of contents do not match their checksum (spec §3.4)",
    ];
    assert_eq!(errors, expected);
}

#[test]
fn a_restart_changes_nothing() {
    let (file, _) = mesh();
    let folder = folder_with("a.uwm", &file);
    let served = Served::folder(folder.path());
    let before = served.get("/meshes/a/refine?to=6");
    drop(served);
    let served = Served::folder(folder.path());
    let held = format!("If-Match: {}", before.header("etag"));
    let rest = served.ask("GET", "/meshes/a/refine?from=6", &[&held]);
    assert_eq!(rest.status, 200);
    let bytes = [before.body, rest.body].concat();
    assert_eq!(bytes, &file[..bytes.len()]);
}
