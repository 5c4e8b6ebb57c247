use super::*;
use object_store::ObjectStoreExt;
use object_store::memory::InMemory;

fn run<T>(future: impl Future<Output = T>) -> T {
    tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap().block_on(future)
}

#[test]
fn names_that_may_be() {
    for name in ["a.uwm", "a b/é%2F.uwm", "..a/b.uwm".trim_start_matches('.'), "a..uwm"] {
        assert_eq!(check_name(name), Ok(()), "{name}");
    }
    for name in [
        "",
        "a",
        "/a.uwm",
        "a//b.uwm",
        "../a.uwm",
        "a/../b.uwm",
        "./a.uwm",
        ".a.uwm",
        "a\0.uwm",
        "a\\b.uwm",
        ".uwm",
    ] {
        assert!(check_name(name).is_err(), "{name:?}");
    }
    assert!(check_name(&("a".repeat(1025) + ".uwm")).is_err());
}

#[test]
fn a_folder_and_its_versions() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("sub/é %2F.uwm");
    std::fs::create_dir(folder.path().join("sub")).unwrap();
    let content: Vec<u8> = (0..200_000u32).map(|i| (i % 251) as u8).collect();
    std::fs::write(&path, &content).unwrap();
    std::fs::write(folder.path().join(".hidden.uwm"), "x").unwrap();
    std::fs::write(folder.path().join("other.txt"), "x").unwrap();
    run(async {
        let store = Store::open(folder.path().to_str().unwrap()).unwrap();
        let name = "sub/é %2F.uwm";
        assert_eq!(store.names("", 9).await, Ok((vec![name.to_owned()], false)));
        assert_eq!(store.names(name, 9).await, Ok((vec![], false)));
        assert_eq!(store.object("other.uwm").await.unwrap_err(), Fault::Absent);
        std::fs::create_dir(folder.path().join("folder.uwm")).unwrap();
        assert_eq!(store.object("folder.uwm").await.unwrap_err(), Fault::Absent);
        assert_eq!(store.object(&("x".repeat(300) + ".uwm")).await.unwrap_err(), Fault::Absent);
        #[cfg(unix)]
        {
            // A pipe that nobody writes to does not hold it up.
            let pipe = folder.path().join("pipe.uwm");
            assert!(std::process::Command::new("mkfifo").arg(pipe).status().unwrap().success());
            assert_eq!(store.object("pipe.uwm").await.unwrap_err(), Fault::Absent);
        }
        let object = store.object(name).await.unwrap();
        assert_eq!(object.version.bytes, 200_000);
        assert_eq!(object.read(70_000..199_999).await.unwrap(), &content[70_000..199_999]);
        assert_eq!(object.read(5..5).await.unwrap(), b"");
        assert_eq!(object.read(199_999..200_001).await, Err(Fault::Changed));

        // Another file takes over the name: the open one stays.
        let other = folder.path().join("other");
        std::fs::write(&other, "short").unwrap();
        std::fs::rename(&other, &path).unwrap();
        assert_eq!(object.read(0..200_000).await.unwrap(), content);
        let later = store.object(name).await.unwrap();
        assert_ne!(later.version.tag, object.version.tag);
        // It is written to where it lies: what is read may be of either.
        std::fs::write(&path, "longer").unwrap();
        assert_eq!(later.read(0..5).await, Err(Fault::Changed));
    });
}

/// Other bytes of the same length under the same name, with the same time of their last change.
#[test]
#[cfg(unix)]
fn versions_that_only_their_bytes_tell_apart() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.uwm");
    let when = std::time::SystemTime::UNIX_EPOCH + Duration::from_secs(1_000_000_000);
    let write = |text: &str| {
        // In place: the file is the same one, too.
        std::fs::write(&path, text).unwrap();
        std::fs::File::options().write(true).open(&path).unwrap().set_modified(when).unwrap();
    };
    run(async {
        // Nothing is known from before.
        let store = Store::open(folder.path().to_str().unwrap()).unwrap().with_cache(0);
        let mut tags = BTreeSet::new();
        for k in 0..10 {
            write(&format!("text {k}"));
            let object = store.object("a.uwm").await.unwrap();
            assert_eq!(object.version.modified, when);
            assert_eq!(object.read(0..6).await.unwrap(), format!("text {k}").as_bytes());
            assert!(tags.insert(object.version.tag), "written at once after it was read");
        }
        // One that is open sees it as well.
        let object = store.object("a.uwm").await.unwrap();
        write("other");
        write("text z");
        assert_eq!(object.read(0..6).await, Err(Fault::Changed));
    });
}

#[test]
fn one_file_is_a_place() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.uwm", "b.uwm", "c.txt"] {
        std::fs::write(folder.path().join(name), name).unwrap();
    }
    run(async {
        let store = Store::open(folder.path().join("b.uwm").to_str().unwrap()).unwrap();
        assert_eq!(store.names("", 9).await, Ok((vec!["b.uwm".to_owned()], false)));
        assert_eq!(store.names("b.uwm", 9).await, Ok((vec![], false)));
        assert_eq!(store.object("b.uwm").await.unwrap().read(0..5).await.unwrap(), b"b.uwm");
        assert_eq!(store.object("a.uwm").await.unwrap_err(), Fault::Absent);
        // Another file that takes its place is the mesh from then on.
        std::fs::rename(folder.path().join("a.uwm"), folder.path().join("b.uwm")).unwrap();
        assert_eq!(store.object("b.uwm").await.unwrap().read(0..5).await.unwrap(), b"a.uwm");
    });
}

#[test]
fn an_object_store_and_its_versions() {
    run(async {
        let memory = Arc::new(InMemory::new());
        let store = Store::over(memory.clone());
        for name in ["b.uwm", "a/b.uwm", "c.uwm", "d.txt"] {
            memory.put(&Path::from(name), "first".into()).await.unwrap();
        }
        assert_eq!(store.names("", 2).await, Ok((vec!["a/b.uwm".into(), "b.uwm".into()], true)));
        assert_eq!(store.names("b.uwm", 2).await, Ok((vec!["c.uwm".into()], false)));
        let object = store.object("b.uwm").await.unwrap();
        assert_eq!(object.read(1..4).await.unwrap(), b"irs");
        memory.put(&Path::from("b.uwm"), "other".into()).await.unwrap();
        assert_eq!(object.read(1..4).await, Err(Fault::Changed));
    });
}

#[test]
fn places_that_are_none() {
    for (location, what) in [
        ("Cargo.toml", "neither a folder nor a .uwm file"),
        ("nowhere/at/all", "No such file or directory (os error 2)"),
        ("what://ever", "what:// wants a build with --features cloud"),
    ] {
        if cfg!(feature = "cloud") && location.contains("://") {
            continue;
        }
        assert_eq!(Store::open(location).unwrap_err().to_string(), what);
    }
    assert!(Store::open("memory:///").is_ok());
}
