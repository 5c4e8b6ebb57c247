//! A plain file server, as it is found everywhere.

use std::net::{TcpListener, TcpStream};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use serde_json::Value;

use super::coded;
use super::command::Folder;

struct Nginx(Child);

impl Drop for Nginx {
    fn drop(&mut self) {
        let _ = (self.0.kill(), self.0.wait());
    }
}

/// nginx over a folder; `None` where there is none.
fn nginx(folder: &Folder, extra: &str) -> Option<(Nginx, String)> {
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let root = folder.0.path().display();
    let config = format!(
        "daemon off; master_process off; pid {root}/pid; error_log {root}/log;
        events {{}}
        http {{
            access_log off; client_body_temp_path {root}/1; proxy_temp_path {root}/2; fastcgi_temp_path {root}/3;
            uwsgi_temp_path {root}/4; scgi_temp_path {root}/5;
            server {{ listen 127.0.0.1:{port}; root {root}; {extra} }}
        }}"
    );
    std::fs::write(folder.path("config"), config).unwrap();
    let program = if std::path::Path::new("/usr/sbin/nginx").exists() { "/usr/sbin/nginx" } else { "nginx" };
    let started = Command::new(program)
        .arg("-c")
        .arg(folder.path("config"))
        .arg("-e")
        .arg(folder.path("log"))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn();
    let Ok(child) = started else {
        eprintln!("skipped: there is no nginx");
        return None;
    };
    let mut nginx = Nginx(child);
    while TcpStream::connect(("127.0.0.1", port)).is_err() {
        assert!(nginx.0.try_wait().unwrap().is_none(), "{}", String::from_utf8_lossy(&folder.bytes("log")));
        std::thread::sleep(Duration::from_millis(10));
    }
    Some((nginx, format!("http://127.0.0.1:{port}/a.uwm")))
}

#[test]
fn ranges() {
    let (file, contents) = coded(1);
    let (store, folder) = (Folder::new(), Folder::new());
    std::fs::write(store.path("a.uwm"), &file).unwrap();
    let Some((_nginx, url)) = nginx(&store, "") else { return };
    folder.run(&format!("fetch {url} -o a.uwm")).succeeded();
    assert_eq!(folder.bytes("a.uwm"), file);
    let run = folder.run(&format!("fetch {url} -o b.uwm --level 2 --json"));
    let told: Value = serde_json::from_slice(&run.succeeded().out).unwrap();
    let end = contents.bytes(contents.steps(2)).end;
    assert_eq!(folder.bytes("b.uwm"), file[..end as usize]);
    assert_eq!(told["received_bytes"], end.max(told["received_bytes"].as_u64().unwrap().min(16384)));
    folder.run(&format!("fetch {url} -o c.ply --level 1 --via keyframe")).succeeded();
    folder.run("decode a.uwm -o d.ply --level 1 --via keyframe").succeeded();
    assert_eq!(folder.bytes("c.ply"), folder.bytes("d.ply"));

    // What a killed command leaves: some of the file, and of which version it is.
    let half = contents.atoms[contents.atoms.len() / 2].offset as usize;
    let note =
        |tag: &Value| serde_json::json!({ "address": url, "tag": tag, "bytes": file.len() }).to_string();
    let leave = |bytes: &[u8], tag: &Value| {
        std::fs::write(folder.path("e.uwm.part"), bytes).unwrap();
        std::fs::write(folder.path("e.uwm.part.json"), note(tag)).unwrap();
    };
    leave(&file[..half], &told["etag"]);
    let run = folder.run(&format!("fetch {url} -o e.uwm --json"));
    let resumed: Value = serde_json::from_slice(&run.succeeded().out).unwrap();
    assert_eq!(folder.bytes("e.uwm"), file);
    let received = resumed["received_bytes"].as_u64().unwrap();
    assert_eq!(received + resumed["resumed_bytes"].as_u64().unwrap(), file.len() as u64);
    // Another file is there now.
    let (other, _) = coded(2);
    leave(&file[..half], &told["etag"]);
    std::fs::write(store.path("new"), &other).unwrap();
    std::fs::rename(store.path("new"), store.path("a.uwm")).unwrap();
    let run = folder.run(&format!("fetch {url} -o e.uwm"));
    assert!(run.succeeded().err.contains("beginning anew"), "{}", run.err);
    assert_eq!(folder.bytes("e.uwm"), other);
}

#[test]
fn without_ranges() {
    let (file, contents) = coded(1);
    let (store, folder) = (Folder::new(), Folder::new());
    std::fs::write(store.path("a.uwm"), &file).unwrap();
    let Some((_nginx, url)) = nginx(&store, "max_ranges 0;") else { return };
    folder.run(&format!("fetch {url} -o b.uwm --level 5")).succeeded();
    assert_eq!(folder.bytes("b.uwm"), file[..contents.bytes(contents.steps(5)).end as usize]);
    folder.run(&format!("fetch {url} -o c.obj --level 0 --via keyframe")).succeeded();
    std::fs::write(folder.path("a.uwm"), &file).unwrap();
    folder.run("decode a.uwm -o d.obj --level 0 --via keyframe").succeeded();
    assert_eq!(folder.bytes("c.obj"), folder.bytes("d.obj"));
}
