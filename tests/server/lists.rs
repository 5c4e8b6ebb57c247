//! `GET /meshes`: what is in it, what is left out, and how much of it there is at a time.

use super::{Answer, Served, folder_with, mesh};
use flate2::read::GzDecoder;
use serde_json::json;
use std::fs;
use std::io::Read;
use unweld::server::Options;
use unweld::store::Store;

/// All names, in pages of so many.
fn names(served: &Served, limit: usize) -> Vec<String> {
    let (mut all, mut after) = (Vec::new(), String::new());
    loop {
        let list = served.get(&format!("/meshes?limit={limit}&after={}", after.replace(' ', "%20"))).json();
        let meshes = list["meshes"].as_array().unwrap();
        assert!(meshes.len() <= limit);
        all.extend(meshes.iter().map(|mesh| mesh["name"].as_str().unwrap().to_owned()));
        let Some(next) = list["next"].as_str() else { return all };
        assert!(next > after.as_str(), "it goes on");
        after = next.to_owned();
    }
}

#[test]
fn lists() {
    let (file, _) = mesh();
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("b")).unwrap();
    for name in ["c.uwm", "a.uwm", "b/x.uwm", "b/<i>.uwm", "d.txt"] {
        std::fs::write(folder.path().join(name), &file).unwrap();
    }
    let served = Served::folder(folder.path());
    let page = |path: &str| {
        let list = served.get(path).json();
        let names: Vec<_> = list["meshes"].as_array().unwrap().iter().map(|m| m["name"].clone()).collect();
        (json!(names), list["next"].clone())
    };
    assert_eq!(page("/meshes"), (json!(["a.uwm", "b/<i>.uwm", "b/x.uwm", "c.uwm"]), json!(null)));
    assert_eq!(page("/meshes?limit=3"), (json!(["a.uwm", "b/<i>.uwm", "b/x.uwm"]), json!("b/x.uwm")));
    assert_eq!(page("/meshes?limit=3&after=b/x.uwm"), (json!(["c.uwm"]), json!(null)));
    for limit in ["x", "", "-1", "0", "1001", "1e3", "99999999999999999999"] {
        served.get(&format!("/meshes?limit={limit}")).refuses(400, "limit");
    }
    for limit in [1, 1000] {
        assert_eq!(served.get(&format!("/meshes?limit={limit}")).status, 200);
    }
    served.get("/meshes?from=1").refuses(400, "from");
    assert_eq!(served.get("/meshes/b/%3Ci%3E.uwm").body, file);

    let store = Store::open(folder.path().to_str().unwrap()).unwrap();
    let silent = Served::of(store, Options { list: false, ..Options::default() });
    silent.get("/meshes").refuses(404, "");
    assert_eq!(silent.get("/meshes/a.uwm").body, file);
}

/// What has no name that a mesh may have, leads nowhere or in a circle, or cannot be read, is left out, and the rest is told.
#[test]
#[cfg(unix)]
fn what_cannot_be_told_is_left_out() {
    use std::os::unix::ffi::OsStrExt;
    use std::os::unix::fs::{PermissionsExt, symlink};
    let (file, _) = mesh();
    let place = tempfile::tempdir().unwrap();
    let root = place.path().join("in");
    fs::create_dir_all(root.join("b/c")).unwrap();
    fs::create_dir_all(root.join("closed")).unwrap();
    fs::create_dir_all(root.join("odd\ndir")).unwrap();
    fs::create_dir(place.path().join("side")).unwrap();
    for name in ["out.uwm", "side/x.uwm"] {
        fs::write(place.path().join(name), &file).unwrap();
    }
    let odd = std::ffi::OsStr::from_bytes(b"not\xffutf8.uwm");
    fs::write(root.join(odd), &file).unwrap();
    for name in [
        "a.uwm",
        "b/c/d.uwm",
        "z.uwm",
        "con\u{7}trol.uwm",
        "back\\slash.uwm",
        "odd\ndir/x.uwm",
        "closed/x.uwm",
    ] {
        fs::write(root.join(name), &file).unwrap();
    }
    symlink("loop.uwm", root.join("loop.uwm")).unwrap();
    symlink("nowhere.uwm", root.join("broken.uwm")).unwrap();
    symlink("..", root.join("b/up")).unwrap();
    symlink("../b", root.join("b/c/again")).unwrap();
    symlink("../out.uwm", root.join("out.uwm")).unwrap();
    symlink(place.path().join("side"), root.join("far")).unwrap();
    symlink("a.uwm", root.join("same.uwm")).unwrap();
    symlink("b/c", root.join("short")).unwrap();
    assert!(std::process::Command::new("mkfifo").arg(root.join("pipe.uwm")).status().unwrap().success());
    fs::set_permissions(root.join("closed"), fs::Permissions::from_mode(0o000)).unwrap();
    // Root reads it nevertheless.
    let open = fs::read_dir(root.join("closed")).is_ok();
    let mut expected = vec!["a.uwm", "b/c/d.uwm", "same.uwm", "short/d.uwm", "z.uwm"];
    if open {
        expected.insert(2, "closed/x.uwm");
    }
    let served = Served::folder(&root);
    for limit in [1000, 2] {
        assert_eq!(names(&served, limit), expected);
    }
    // What is told can be had, what is not told is not there.
    for name in &expected {
        assert_eq!(served.get(&format!("/meshes/{name}")).body, file, "{name}");
    }
    for name in ["out.uwm", "far/x.uwm", "broken.uwm", "loop.uwm", "pipe.uwm"] {
        served.get(&format!("/meshes/{name}")).refuses(404, "");
    }
    let store = || Store::open(root.to_str().unwrap()).unwrap().with_links();
    let served = Served::of(store(), Options::default());
    let told = names(&served, 1000);
    for name in ["out.uwm", "far/x.uwm"] {
        assert!(told.iter().any(|known| known == name), "{name} in {told:?}");
        assert_eq!(served.get(&format!("/meshes/{name}")).body, file, "{name}");
    }
    fs::set_permissions(root.join("closed"), fs::Permissions::from_mode(0o755)).unwrap();
}

/// Where the folder itself is gone, nobody is told where it was.
#[test]
fn refusals_tell_no_paths() {
    let place = tempfile::tempdir().unwrap();
    let root = place.path().join("very_secret");
    fs::create_dir(&root).unwrap();
    let served = Served::folder(&root);
    assert_eq!(served.get("/meshes").json(), json!({ "meshes": [], "next": null }));
    fs::remove_dir(&root).unwrap();
    fs::write(&root, "a file by now").unwrap();
    for path in ["/meshes", "/meshes/a.uwm", "/meshes/a/levels"] {
        let answer = served.get(path);
        assert!(answer.status == 503 || answer.status == 404, "{path}: {answer:?}");
        assert!(
            !answer.text().contains("secret") && !answer.text().contains("os error"),
            "{path}: {answer:?}"
        );
    }
}

#[test]
fn meshes_that_come_and_go() {
    let (file, _) = mesh();
    let folder = folder_with("a.uwm", &file);
    let served = Served::folder(folder.path());
    let until = |expected: &[&str]| {
        // At once, as a rule; a folder that has taken long to look through is looked through less often.
        for _ in 0..500 {
            if names(&served, 1000) == expected {
                return;
            }
            std::thread::sleep(std::time::Duration::from_millis(20));
        }
        panic!("{:?}, not {expected:?}", names(&served, 1000));
    };
    until(&["a.uwm"]);
    fs::create_dir_all(folder.path().join("new/deep")).unwrap();
    fs::write(folder.path().join("new/deep/b.uwm"), &file).unwrap();
    until(&["a.uwm", "new/deep/b.uwm"]);
    fs::write(folder.path().join("new/deep/c.uwm"), &file).unwrap();
    fs::remove_file(folder.path().join("a.uwm")).unwrap();
    until(&["new/deep/b.uwm", "new/deep/c.uwm"]);
    fs::rename(folder.path().join("new"), folder.path().join("old")).unwrap();
    until(&["old/deep/b.uwm", "old/deep/c.uwm"]);
}

/// Pages of a large folder come to all its meshes, each once; compressed for who reads that.
#[test]
fn a_large_folder() {
    let folder = tempfile::tempdir().unwrap();
    let mut expected: Vec<String> = (0..3000).map(|k| format!("{}/{k}.uwm", k % 10)).collect();
    for name in &expected {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, "none").unwrap();
    }
    expected.sort();
    let served = Served::folder(folder.path());
    assert_eq!(names(&served, 999), expected);
    let plain = served.get("/meshes");
    assert_eq!((plain.header("vary"), plain.header("content-encoding")), ("Accept-Encoding", ""));
    let packed = served.ask("GET", "/meshes", &["Accept-Encoding: br;q=1, gzip;q=0.5"]);
    assert_eq!((packed.header("vary"), packed.header("content-encoding")), ("Accept-Encoding", "gzip"));
    assert_eq!(packed.header("content-length"), packed.body.len().to_string());
    let mut text = Vec::new();
    GzDecoder::new(&packed.body[..]).read_to_end(&mut text).unwrap();
    assert!(text == plain.body && packed.body.len() < text.len() / 2);
    // Bytes of meshes are sent as they are.
    let file: Answer = served.ask("GET", &format!("/meshes/{}", expected[0]), &["Accept-Encoding: gzip"]);
    assert_eq!((file.header("content-encoding"), &file.body[..]), ("", &b"none"[..]));
}
