//! Whole files, ranges, conditions, caching.

use super::{Served, folder_with, mesh};
use unweld::server::{MEDIA_TYPE, Options};
use unweld::store::Store;

#[test]
fn whole_files_and_heads() {
    let (file, _) = mesh();
    let folder = folder_with("a b.uwm", &file);
    let served = Served::folder(folder.path());
    let whole = served.get("/meshes/a%20b.uwm");
    assert_eq!((whole.status, &whole.body), (200, &file));
    assert_eq!(whole.header("content-type"), MEDIA_TYPE);
    assert_eq!(whole.header("accept-ranges"), "bytes");
    assert_eq!(whole.header("cache-control"), "public, max-age=60, must-revalidate");
    assert!(whole.header("etag").starts_with('"') && whole.header("etag").ends_with('"'));
    let head = served.ask("HEAD", "/meshes/a%20b.uwm", &["Range: bytes=0-1"]);
    assert_eq!((head.status, head.body.len()), (200, 0));
    assert_eq!(head.header("content-length"), file.len().to_string());
    assert_eq!(head.header("etag"), whole.header("etag"));
    assert_eq!(served.ask("POST", "/meshes/a%20b.uwm", &[]).status, 405);
    assert_eq!(served.get("/healthz").text(), "ok\n");
}

#[test]
fn one_range() {
    let (file, _) = mesh();
    let n = file.len();
    let folder = folder_with("a.uwm", &file);
    let served = Served::folder(folder.path());
    let cases = [
        ("0-0".to_owned(), 0..1),
        ("10-99".to_owned(), 10..100),
        ("100-".to_owned(), 100..n),
        ("-7".to_owned(), n - 7..n),
        (format!("-{}", 2 * n), 0..n),
        (format!("{}-{}", n - 1, u64::MAX), n - 1..n),
        (format!("5-6, {n}-"), 5..7),
    ];
    for (text, range) in cases {
        let part = served.ask("GET", "/meshes/a.uwm", &[&format!("Range: bytes={text}")]);
        assert_eq!((part.status, &part.body[..]), (206, &file[range.clone()]), "{text}");
        assert_eq!(part.header("content-range"), format!("bytes {}-{}/{n}", range.start, range.end - 1));
        assert_eq!(part.header("content-length"), range.len().to_string());
    }
    for text in [format!("{n}-"), format!("{n}-{}", n + 5), "0-,0-".to_owned()] {
        let none = served.ask("GET", "/meshes/a.uwm", &[&format!("Range: bytes={text}")]);
        none.refuses(416, "Range");
        assert_eq!(none.header("content-range"), format!("bytes */{n}"));
    }
    for text in ["bytes=9-3", "bytes=x", "items=0-1", "bytes=", "bytes=1", "bytes=99999999999999999999-"] {
        let all = served.ask("GET", "/meshes/a.uwm", &[&format!("Range: {text}")]);
        assert_eq!((all.status, all.body.len()), (200, n), "{text} says nothing");
    }
}

#[test]
fn several_ranges() {
    let (file, _) = mesh();
    let n = file.len();
    let folder = folder_with("a.uwm", &file);
    let served = Served::folder(folder.path());
    let answer = served.ask("GET", "/meshes/a.uwm", &["Range: bytes=50-59,0-9,-5"]);
    assert_eq!(
        (answer.status, answer.header("content-length")),
        (206, answer.body.len().to_string().as_str())
    );
    let boundary = answer.header("content-type").strip_prefix("multipart/byteranges; boundary=").unwrap();
    let mut expected = Vec::new();
    for range in [50..60, 0..10, n - 5..n] {
        let told = format!("bytes {}-{}/{n}", range.start, range.end - 1);
        let head = format!("\r\n--{boundary}\r\nContent-Type: {MEDIA_TYPE}\r\nContent-Range: {told}\r\n\r\n");
        expected.extend(head.bytes());
        expected.extend(&file[range]);
    }
    expected.extend(format!("\r\n--{boundary}--\r\n").bytes());
    assert_eq!(answer.body, expected);
}

#[test]
fn conditions() {
    let (file, contents) = mesh();
    let folder = folder_with("a.uwm", &file);
    let served = Served::folder(folder.path());
    let first = served.get("/meshes/a.uwm");
    let (tag, date) = (first.header("etag"), first.header("last-modified"));
    let old = "Tue, 01 Jan 2002 00:00:00 GMT";
    let cases = [
        (format!("If-None-Match: {tag}"), 304),
        (format!("If-None-Match: \"x\", W/{tag}"), 304),
        ("If-None-Match: *".to_owned(), 304),
        ("If-None-Match: \"x\"".to_owned(), 200),
        (format!("If-None-Match: \"x\"\r\nIf-Modified-Since: {date}"), 200),
        (format!("If-Modified-Since: {date}"), 304),
        (format!("If-Modified-Since: {old}"), 200),
        (format!("If-Match: {tag}"), 200),
        ("If-Match: *".to_owned(), 200),
        ("If-Match: \"x\"".to_owned(), 412),
        (format!("If-Match: W/{tag}"), 412),
        (format!("If-Unmodified-Since: {old}"), 412),
        (format!("If-Unmodified-Since: {date}"), 200),
        (format!("If-Match: {tag}\r\nIf-None-Match: {tag}"), 304),
        (format!("Range: bytes=0-1\r\nIf-Range: {tag}"), 206),
        ("Range: bytes=0-1\r\nIf-Range: \"x\"".to_owned(), 200),
        (format!("Range: bytes=0-1\r\nIf-Range: W/{tag}"), 200),
        (format!("Range: bytes=0-1\r\nIf-Range: {date}"), 200),
    ];
    let base = format!("/meshes/a/keyframe/{}", contents.base_level());
    for path in ["/meshes/a.uwm", "/meshes/a/levels", "/meshes/a/refine", &base] {
        for (lines, status) in &cases {
            let status = if path.ends_with("levels") && *status == 206 { 200 } else { *status };
            let answer = served.ask("GET", path, &[lines]);
            assert_eq!((answer.status, answer.header("etag")), (status, tag), "{path} {lines}");
            assert!(status != 304 || answer.body.is_empty());
        }
    }
}

#[test]
fn caching() {
    let (file, _) = mesh();
    let folder = folder_with("a.uwm", &file);
    let store = || Store::open(folder.path().to_str().unwrap()).unwrap();
    let served = Served::of(store(), Options { max_age: 0, ..Options::default() });
    let answer = served.get("/meshes/a/levels");
    assert_eq!(answer.header("cache-control"), "no-cache");
    let version = answer.json()["version"].as_str().unwrap().to_owned();
    assert_eq!(answer.header("etag"), format!("\"{version}\""));
    for path in ["a.uwm", "a/levels", "a/refine", "a/refine?to=3"] {
        let sign = if path.contains('?') { '&' } else { '?' };
        let pinned = served.get(&format!("/meshes/{path}{sign}v={version}"));
        assert_eq!(pinned.header("cache-control"), "public, max-age=31536000, immutable");
        let gone = served.get(&format!("/meshes/{path}{sign}v=another"));
        gone.refuses(410, "v");
        assert_eq!(gone.header("cache-control"), "no-store");
    }
    let served = Served::of(store(), Options { tokens: vec!["t".to_owned()], ..Options::default() });
    let answer = served.ask("GET", "/meshes/a.uwm", &["Authorization: Bearer t"]);
    assert_eq!(answer.header("cache-control"), "private, max-age=60, must-revalidate");
}
