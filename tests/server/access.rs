//! Who is served, and what is told.

use super::{Served, folder_with, mesh};
use serde_json::json;
use unweld::server::Options;
use unweld::store::Store;

#[test]
fn tokens() {
    let (file, _) = mesh();
    let folder = folder_with("a.uwm", &file);
    let options =
        Options { tokens: vec!["first-token".to_owned(), "second".to_owned()], ..Options::default() };
    let served = Served::of(Store::open(folder.path().to_str().unwrap()).unwrap(), options);
    for path in [
        "/meshes",
        "/meshes/a.uwm",
        "/meshes/a/levels",
        "/metrics",
        "/openapi.json",
        "/meshes/none.uwm",
        "/none",
    ] {
        for line in [
            "X: y",
            "Authorization: Bearer",
            "Authorization: Bearer firs",
            "Authorization: Bearer first-token2",
            "Authorization: Basic second",
            "Authorization: Bearer  second",
        ] {
            let answer = served.ask("GET", path, &[line]);
            answer.refuses(401, "Authorization");
            assert_eq!(answer.header("www-authenticate"), "Bearer");
        }
    }
    for line in ["Authorization: Bearer first-token", "authorization: bearer second"] {
        assert_eq!(served.ask("GET", "/meshes/a.uwm", &[line]).body, file);
    }
    assert_eq!(served.get("/healthz").status, 200);
    let preflight = served.ask(
        "OPTIONS",
        "/meshes/a.uwm",
        &[
            "Origin: http://there",
            "Access-Control-Request-Method: GET",
            "Access-Control-Request-Headers: range,authorization",
        ],
    );
    assert_eq!((preflight.status, preflight.header("access-control-allow-origin")), (200, "*"));
    assert!(preflight.header("access-control-allow-headers").contains("range"));
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
    let names = |path: &str| {
        let list = served.get(path).json();
        let names: Vec<_> = list["meshes"].as_array().unwrap().iter().map(|m| m["name"].clone()).collect();
        (json!(names), list["next"].clone())
    };
    assert_eq!(names("/meshes"), (json!(["a.uwm", "b/<i>.uwm", "b/x.uwm", "c.uwm"]), json!(null)));
    assert_eq!(names("/meshes?limit=3"), (json!(["a.uwm", "b/<i>.uwm", "b/x.uwm"]), json!("b/x.uwm")));
    assert_eq!(names("/meshes?limit=3&after=b/x.uwm"), (json!(["c.uwm"]), json!(null)));
    served.get("/meshes?limit=x").refuses(400, "limit");
    served.get("/meshes?from=1").refuses(400, "from");
    assert_eq!(served.get("/meshes/b/%3Ci%3E.uwm").body, file);

    let store = Store::open(folder.path().to_str().unwrap()).unwrap();
    let silent = Served::of(store, Options { list: false, ..Options::default() });
    silent.get("/meshes").refuses(404, "");
    assert_eq!(silent.get("/meshes/a.uwm").body, file);
}

#[test]
fn the_page_is_for_everybody_and_needs_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let options = Options { tokens: vec!["token".to_owned()], ..Options::default() };
    let served = Served::of(Store::open(folder.path().to_str().unwrap()).unwrap(), options);
    let page = served.get("/");
    assert_eq!((page.status, page.header("content-type")), (200, "text/html; charset=utf-8"));
    let text = page.text();
    let linked: Vec<&str> =
        text.split(['"', '\'']).filter(|part| part.ends_with(".js") || part.ends_with(".css")).collect();
    assert_eq!(linked, ["style.css", "viewer.js"]);
    assert!(!text.contains("://"), "nothing from elsewhere");
    for name in ["/style.css", "/viewer.js", "/worker.js", "/unweld.wasm"] {
        let plain = served.get(name);
        let packed = served.ask("GET", name, &["Accept-Encoding: gzip, br"]);
        assert_eq!(
            (plain.status, packed.status, packed.header("content-encoding")),
            (200, 200, "br"),
            "{name}"
        );
        assert!(
            packed.body.len() < plain.body.len()
                && plain.header("content-security-policy").starts_with("default-src 'self'")
        );
        let tag = format!("If-None-Match: {}", plain.header("etag"));
        assert_eq!(served.ask("GET", name, &[&tag]).status, 304, "{name}");
    }
    let module = served.get("/unweld.wasm");
    assert_eq!((&module.body[..4], module.header("content-type")), (&b"\0asm"[..], "application/wasm"));
    assert_eq!(served.ask("POST", "/viewer.js", &[]).status, 405);
}
