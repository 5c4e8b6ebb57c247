//! `unweld encode` of several inputs and of folders.

use super::{Folder, Run, keys};
use serde_json::Value;
use unweld::mesh::shapes;

/// Meshes in a tree of folders, with files that are none between them:
/// `one.ply`, `in/b.ply`, `in/a.obj`, `in/deep/er/b.ply`, `in/.hidden.ply`, `in/.folder/c.ply`, `in/notes.txt`.
fn tree() -> Folder {
    let folder = Folder::new();
    for name in ["in/deep/er", "in/.folder"] {
        std::fs::create_dir_all(folder.path(name)).unwrap();
    }
    folder.mesh("one.ply", &shapes::bumpy_sphere(3, 1));
    folder.mesh("in/b.ply", &shapes::torus(8, 9));
    folder.write("in/a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nl 1 2\nf 1 2 3\nf 1 2 3\n");
    folder.mesh("in/deep/er/b.ply", &shapes::bumpy_sphere(2, 7));
    folder.mesh("in/.hidden.ply", &shapes::tetrahedron());
    folder.mesh("in/.folder/c.ply", &shapes::tetrahedron());
    folder.write("in/notes.txt", "v 0 0 0");
    folder
}

/// All files below a folder, as paths from there, sorted.
fn files(folder: &Folder, name: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut folders = vec![folder.path(name)];
    while let Some(next) = folders.pop() {
        for entry in std::fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            match path.is_dir() {
                true => folders.push(path),
                false => {
                    found.push(path.strip_prefix(folder.path(name)).unwrap().to_str().unwrap().to_owned())
                }
            }
        }
    }
    found.sort();
    found
}

fn words(run: &Run) -> Vec<Vec<&str>> {
    run.text().lines().map(|line| line.split_whitespace().collect()).collect()
}

#[test]
fn each_is_as_if_it_were_alone() {
    let folder = tree();
    let expected = ["a.uwm", "b.uwm", "deep/er/b.uwm", "one.uwm"];
    let inputs = ["in/a.obj", "in/b.ply", "in/deep/er/b.ply", "one.ply"];
    for (jobs, out) in [("--jobs 1", "alone"), ("--jobs 4", "together"), ("", "default")] {
        folder.run(&format!("encode one.ply in -o {out} --seed 3 {jobs} -q"));
        assert_eq!(files(&folder, out), expected);
        for (input, output) in inputs.iter().zip(expected) {
            folder.run(&format!("encode {input} -o single.uwm --seed 3 -q"));
            assert_eq!(folder.bytes(&format!("{out}/{output}")), folder.bytes("single.uwm"), "{input}");
        }
    }
}

#[test]
fn a_table_and_the_sums() {
    let folder = tree();
    let run = folder.run("encode one.ply in -o out/put --jobs 2");
    assert_eq!(run.code, 0, "{}", run.err);
    let lines = words(&run);
    assert_eq!(lines[0], ["input", "triangles", "bytes", "bits", "a", "vertex", "seconds", "result"]);
    let triangles = ["1,280", "2", "144", "320"];
    let mut sum = 0;
    for (k, name) in ["one.ply", "in/a.obj", "in/b.ply", "in/deep/er/b.ply"].into_iter().enumerate() {
        let line = &lines[k + 1];
        assert_eq!((line[0], line[1]), (name, triangles[k]));
        let output = ["one", "a", "b", "deep/er/b"][k];
        let bytes = folder.bytes(&format!("out/put/{output}.uwm")).len();
        assert_eq!(line[2].replace(',', ""), bytes.to_string());
        sum += bytes;
    }
    assert_eq!(lines[1][5..], ["a", "manifold"]);
    assert!(run.text().contains("  1 repeated triangle; dropped line elements (1)"), "{}", run.text());
    let sums = run.text().lines().find(|line| line.starts_with("  encoded")).unwrap();
    let start = "  encoded    4 of 4 inputs: 1,746 triangles, ";
    assert_eq!(sums.strip_prefix(start).unwrap().replace(',', ""), format!("{sum} bytes"));
    assert!(run.text().contains("\n  skipped    1 other file, 2 hidden files\n"), "{}", run.text());
    assert!(run.text().contains(" s, 2 inputs at a time\n"), "{}", run.text());
}

#[test]
fn it_goes_on_after_a_failure() {
    let folder = tree();
    folder.write("in/bad.ply", &folder.bytes("one.ply")[..999]);
    folder.write("in/deep/none.obj", "# nothing\n");
    let run = folder.run("encode in nowhere.ply one.ply -o out");
    let told = "unweld: in/a.obj: dropped line elements (1)\nunweld: 3 of 7 inputs failed\n";
    assert_eq!((run.code, run.err.as_str()), (1, told));
    assert_eq!(files(&folder, "out"), ["a.uwm", "b.uwm", "deep/er/b.uwm", "one.uwm"]);
    let lines = words(&run);
    let names: Vec<&str> = lines[1..8].iter().map(|line| line[0]).collect();
    let expected = [
        "in/a.obj",
        "in/b.ply",
        "in/bad.ply",
        "in/deep/er/b.ply",
        "in/deep/none.obj",
        "nowhere.ply",
        "one.ply",
    ];
    assert_eq!(names, expected);
    let result = |k: usize| lines[k + 1][2..].join(" ");
    let alone = folder.run("encode in/bad.ply -o x.uwm").err;
    assert_eq!(format!("unweld: in/bad.ply: {}\n", result(2).strip_prefix("failed: ").unwrap()), alone);
    assert_eq!(result(4), "failed: no triangles");
    assert_eq!(result(5), "failed: No such file or directory (os error 2)");
    assert!(run.text().contains("  encoded    4 of 7 inputs: "), "{}", run.text());
    let quiet = folder.run("encode in nowhere.ply one.ply -o out -q");
    assert_eq!((quiet.code, quiet.out.len()), (1, 0));
    let dropped = "unweld: in/a.obj: dropped line elements (1)\n";
    assert!(quiet.err.starts_with(&(dropped.to_owned() + &alone)), "{}", quiet.err);
    assert!(quiet.err.ends_with("unweld: 3 of 7 inputs failed\n"), "{}", quiet.err);
    assert_eq!(quiet.err.lines().count(), 5);
}

#[test]
fn the_json_of_several() {
    let folder = tree();
    folder.write("bad.ply", "ply\nnonsense\n");
    let run = folder.run("encode one.ply bad.ply in -o out --json --jobs 3");
    assert_eq!(run.code, 1);
    let object: Value = serde_json::from_slice(&run.out).unwrap();
    assert_eq!(keys(&object), ["failed", "files", "jobs", "peak_bytes", "seconds", "skipped"]);
    assert_eq!((&object["failed"], &object["jobs"]), (&1.into(), &3.into()));
    assert_eq!(object["skipped"], serde_json::json!({"hidden": 2, "others": 1}));
    let files = object["files"].as_array().unwrap();
    let paths: Vec<&str> = files.iter().map(|file| file["path"].as_str().unwrap()).collect();
    assert_eq!(paths, ["one.ply", "bad.ply", "in/a.obj", "in/b.ply", "in/deep/er/b.ply"]);
    assert_eq!(keys(&files[1]), ["error", "path"]);
    let error = files[1]["error"].as_str().unwrap();
    assert!(error.starts_with("bad.ply: "), "{error}");
    assert_eq!(run.err, format!("unweld: {error}\nunweld: 1 of 5 inputs failed\n"));
    assert_eq!(files[4]["output"], "out/deep/er/b.uwm");
    let single = folder.run("encode one.ply -o one.uwm --json").json();
    for key in keys(&single).into_iter().filter(|key| !["peak_bytes", "seconds"].contains(key)) {
        assert_eq!(files[0][key], single[key], "{key}");
    }
}

#[test]
fn two_that_would_become_one_keep_their_whole_names_or_are_refused_before_any_work() {
    let folder = tree();
    let run = folder.run("encode in in/deep/er -o out");
    assert_eq!(run.code, 2);
    let clash =
        "in/b.ply and in/deep/er/b.ply would both become out/b.ply.uwm: encode them into different folders\n";
    assert!(run.err.contains(clash), "{}", run.err);
    assert!(!folder.path("out").exists());
    folder.write("one.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    folder.run("encode one.ply one.obj -o both").succeeded();
    assert!(folder.path("both/one.ply.uwm").exists() && folder.path("both/one.obj.uwm").exists());
    assert!(!folder.path("both/one.uwm").exists());
    // The same file, twice or by another name, is one.
    let object = folder.run("encode one.ply ./one.ply in in/../in/b.ply -o out --json").json();
    assert_eq!(object["files"].as_array().unwrap().len(), 4);
}

#[test]
fn one_input_into_a_folder() {
    let folder = tree();
    folder.run("encode one.ply -o plain.uwm").succeeded();
    let run = folder.run("encode one.ply -o in").succeeded();
    assert!(run.text().starts_with("one.ply -> in/one.uwm\n"), "{}", run.text());
    folder.run("encode one.ply -o new/er/").succeeded();
    for name in ["in/one.uwm", "new/er/one.uwm"] {
        assert_eq!(folder.bytes(name), folder.bytes("plain.uwm"));
    }
}

#[test]
fn faults() {
    let folder = tree();
    std::fs::create_dir(folder.path("empty")).unwrap();
    folder.run("encode empty -o out").failed(1, "empty: there is no mesh");
    let run = folder.run("encode in one.ply -o one.ply");
    assert_eq!(run.code, 2);
    let text = "several inputs, or a folder, go to a folder, and one.ply is the name of a file\n";
    assert!(run.err.contains(text), "{}", run.err);
    let run = folder.run("encode - one.ply -o out");
    assert!(run.err.contains("standard input has no name to go by in a folder\n"), "{}", run.err);
    assert!(!folder.path("out").exists());
    // A folder of the right name is one.
    std::fs::create_dir(folder.path("all.uwm")).unwrap();
    assert_eq!(folder.run("encode in one.ply -o all.uwm -q").code, 0);
    // What is in the way of one result is no fault of the others.
    folder.write("all.uwm/deep/er/c", "");
    std::fs::create_dir(folder.path("in/deep/er/c")).unwrap();
    folder.mesh("in/deep/er/c/d.ply", &shapes::tetrahedron());
    let run = folder.run("encode in -o all.uwm -q");
    assert_eq!((run.code, run.err.lines().count()), (1, 3), "{}", run.err);
    assert!(run.err.contains("\nunweld: all.uwm/deep/er/c: "), "{}", run.err);
}

#[cfg(unix)]
#[test]
fn links_to_files_are_followed_and_those_to_folders_are_not() {
    let folder = tree();
    std::os::unix::fs::symlink("../in", folder.path("in/deep/again")).unwrap();
    std::os::unix::fs::symlink("../one.ply", folder.path("in/linked.ply")).unwrap();
    std::os::unix::fs::symlink("nowhere.ply", folder.path("in/broken.ply")).unwrap();
    let object = folder.run("encode in -o out --json").json();
    assert_eq!(files(&folder, "out"), ["a.uwm", "b.uwm", "deep/er/b.uwm", "linked.uwm"]);
    assert_eq!(object["skipped"]["others"], 3);
}
