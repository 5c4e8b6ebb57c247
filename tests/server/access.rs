//! Who is served, and what is told.

use super::{Answer, Served, folder_with, mesh};
use std::io::Write;
use unweld::server::{Options, Origins};
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
}

#[test]
fn pages_from_elsewhere_read_what_they_may() {
    let (file, _) = mesh();
    let folder = folder_with("a.uwm", &file);
    let served = |address: &str, origins: Origins| {
        let options = Options { origins, tokens: vec!["token".to_owned()], ..Options::default() };
        Served::at(address, Store::open(folder.path().to_str().unwrap()).unwrap(), options)
    };
    let (one, other) = ("http://localhost:5173", "https://evil.example");
    let these = Origins::parse([one, "https://example.org"]).unwrap();
    // The address, what was asked for, and what a page of either origin is told.
    let cases = [
        ("127.0.0.1:0", Origins::Usual, ["", ""]),
        ("[::1]:0", Origins::Usual, ["", ""]),
        ("0.0.0.0:0", Origins::Usual, ["*", "*"]),
        ("127.0.0.1:0", Origins::Any, ["*", "*"]),
        ("127.0.0.1:0", these.clone(), [one, ""]),
        ("0.0.0.0:0", these, [one, ""]),
        ("0.0.0.0:0", Origins::parse(["none"]).unwrap(), ["", ""]),
    ];
    for (address, origins, told) in cases {
        let served = served(address, origins);
        for (origin, told) in [one, other].into_iter().zip(told) {
            let origin = format!("Origin: {origin}");
            let preflight = [
                origin.as_str(),
                "Access-Control-Request-Method: GET",
                "Access-Control-Request-Headers: range,authorization",
            ];
            let preflight = served.ask("OPTIONS", "/meshes/a.uwm", &preflight);
            assert_eq!(preflight.header("access-control-allow-origin"), told, "{address} {origin}");
            let headers = preflight.header("access-control-allow-headers");
            assert!(told.is_empty() || headers.contains("range") && headers.contains("authorization"));
            for (path, token, status) in [
                ("/meshes/a.uwm", "Authorization: Bearer token", 200),
                ("/meshes/a.uwm", "Authorization: Bearer wrong", 401),
                ("/meshes/none.uwm", "Authorization: Bearer token", 404),
                ("/healthz", "X: y", 200),
            ] {
                let answer = served.ask("GET", path, &[&origin, token]);
                assert_eq!((answer.status, answer.header("access-control-allow-origin")), (status, told));
            }
        }
    }
}

/// A name of somebody else's that leads to the address of the server makes a page of theirs one of the server's own, for a browser.
#[test]
fn a_server_for_this_machine_answers_to_its_own_names() {
    let folder = tempfile::tempdir().unwrap();
    let served = |address: &str, hosts: &[&str]| {
        let hosts = hosts.iter().map(|host| (*host).to_owned()).collect();
        let store = Store::open(folder.path().to_str().unwrap()).unwrap();
        Served::at(address, store, Options { hosts, ..Options::default() })
    };
    let ask = |served: &Served, path: &str, lines: &[&str]| {
        let mut stream = served.connect();
        let lines: String = lines.iter().map(|line| format!("{line}\r\n")).collect();
        write!(stream, "GET {path} HTTP/1.1\r\n{lines}Connection: close\r\n\r\n").unwrap();
        Answer::read(&mut stream)
    };
    let (local, named, open) =
        (served("127.0.0.1:0", &[]), served("[::1]:0", &["meshes.example"]), served("0.0.0.0:0", &[]));
    let any = served("127.0.0.1:0", &["*"]);
    for (host, statuses) in [
        ("localhost", [200, 200, 200, 200]),
        ("LocalHost:8080", [200, 200, 200, 200]),
        ("127.0.0.1:1", [200, 200, 200, 200]),
        ("[::1]:65535", [200, 200, 200, 200]),
        ("meshes.example", [421, 200, 200, 200]),
        ("evil.example:8080", [421, 421, 200, 200]),
        ("192.168.0.9", [421, 421, 200, 200]),
    ] {
        for (served, status) in [&local, &named, &open, &any].into_iter().zip(statuses) {
            for path in ["/", "/meshes", "/metrics", "/healthz", "/openapi.json", "/none"] {
                let answer = ask(served, path, &[&format!("Host: {host}")]);
                if status == 421 {
                    answer.refuses(421, "Host");
                } else {
                    assert_eq!(answer.status, if path == "/none" { 404 } else { status }, "{host} {path}");
                }
            }
        }
    }
    // A host in the first line, as for a proxy, is one as well.
    assert_eq!(ask(&local, "http://localhost/meshes", &["Host: localhost"]).status, 200);
    ask(&local, "http://evil.example/meshes", &["Host: localhost"]).refuses(421, "Host");
    for served in [&local, &named, &open, &any] {
        ask(served, "/meshes", &[]).refuses(400, "Host");
        ask(served, "/meshes", &["Host: localhost", "Host: localhost"]).refuses(400, "Host");
        ask(served, "/meshes", &["Host: localhost", "host: evil.example"]).refuses(400, "Host");
        ask(served, "/meshes", &["Host: a b"]).refuses(400, "Host");
        ask(served, "/meshes", &["Host: user@localhost"]).refuses(400, "Host");
    }
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
        let policy: Vec<&str> = plain.header("content-security-policy").split("; ").collect();
        assert!(policy.contains(&"frame-ancestors 'self'"), "{policy:?}");
        let tag = format!("If-None-Match: {}", plain.header("etag"));
        assert_eq!(served.ask("GET", name, &[&tag]).status, 304, "{name}");
    }
    let module = served.get("/unweld.wasm");
    assert_eq!((&module.body[..4], module.header("content-type")), (&b"\0asm"[..], "application/wasm"));
    assert_eq!(served.ask("POST", "/viewer.js", &[]).status, 405);
}
