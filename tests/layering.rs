//! The rooms of `src/` and who may import whom, as CONTRIBUTING.md has them; files stay short.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Each room, and the rooms that it may name. `error` and `limits` are open to all.
const ROOMS: &[(&str, &[&str])] = &[
    ("mesh", &[]),
    ("refine", &["mesh"]),
    ("simplify", &["refine", "mesh"]),
    ("reduce", &["mesh"]),
    ("gpu", &["reduce", "mesh"]),
    ("entropy", &[]),
    ("codec", &["refine", "mesh", "entropy"]),
    ("container", &["entropy::varint", "mesh::attributes", "mesh::lattice", "mesh::Lattice"]),
    ("encoder", &["simplify", "codec", "refine", "mesh", "container", "entropy"]),
    ("decoder", &["codec", "refine", "mesh", "container", "entropy"]),
    ("wasm", &["decoder", "container", "codec", "refine", "mesh"]),
    ("client", &["decoder", "container"]),
    ("formats", &["mesh"]),
    ("render", &["mesh"]),
    ("store", &[]),
    ("server", &["container", "store"]),
    ("fuzzing", &["mesh", "refine", "entropy", "codec", "container", "encoder", "decoder", "formats"]),
    ("error", &[]),
    ("limits", &[]),
    ("lib", &["*"]),
    // The command line is a crate of its own: for it the library is `unweld`, of which it sees what is public.
    ("main", &["*"]),
    ("cli", &["*"]),
];

const MAX_LINES: usize = 800;
const MAX_MEDIAN_LINES: usize = 250;

#[test]
fn every_room_imports_what_it_may() {
    let mut breaches = Vec::new();
    for (path, text) in sources().filter(|(path, _)| !path.ends_with("tests.rs")) {
        let room = room_of(&path);
        let Some((_, allowed)) = ROOMS.iter().find(|(name, _)| *name == room) else {
            panic!("{} belongs to no room", path.display());
        };
        for name in imports(&text) {
            if !may(&room, allowed, &name) {
                breaches.push(format!("{}: {room} may not import crate::{name}", path.display()));
            }
        }
        if leaves_by_super(&path, &text) {
            breaches.push(format!("{}: a chain of super:: leaves the room", path.display()));
        }
    }
    assert!(breaches.is_empty(), "{}", breaches.join("\n"));
}

#[test]
fn files_are_short_and_safe() {
    let mut lengths: Vec<usize> = Vec::new();
    for (path, text) in sources() {
        let lines = text.lines().count();
        assert!(lines <= MAX_LINES, "{} has {lines} lines, allowed {MAX_LINES}", path.display());
        lengths.push(lines);
        assert!(!words(&stripped(&text)).any(|word| word == "unsafe"), "{} says unsafe", path.display());
    }
    lengths.sort_unstable();
    let median = lengths[lengths.len() / 2];
    assert!(median <= MAX_MEDIAN_LINES, "the median file has {median} lines, allowed {MAX_MEDIAN_LINES}");
}

#[test]
fn the_rooms_are_all_there() {
    let found: BTreeSet<String> = sources().map(|(path, _)| room_of(&path)).collect();
    assert!(found.len() >= 12, "{found:?}");
    assert!(sources().any(|(_, text)| imports(&text).contains("mesh::Vertex")));
}

#[test]
fn the_parser_of_imports() {
    let text = r#"
        //! Says `use crate::not::this`.
        use crate::mesh::{Corner, table::{self, Row as R}, index};
        pub(super) use crate::error::Error;
        fn f() { let x = crate::limits::MAX; /* crate::nor::this */ "crate::nor::that"; '"'; crate::a::B::c() }
        #[cfg(test)]
        mod tests { use crate::encoder::Encoder; fn g() { { } } }
        #[cfg(any(test, feature = "encode"))]
        use crate::simplify::Options;
        #[cfg(test)]
        use crate::decoder::Decoder;
        fn after() { crate::last::one }
    "#;
    let expected = [
        "a::B",
        "error::Error",
        "last::one",
        "limits::MAX",
        "mesh::Corner",
        "mesh::index",
        "mesh::table",
        "simplify::Options",
    ];
    assert_eq!(imports(text).into_iter().collect::<Vec<_>>(), expected);
}

#[test]
fn a_breach_is_seen() {
    assert!(may("codec", &["mesh"], "mesh::Corner") && may("codec", &["mesh"], "codec::walk"));
    assert!(may("codec", &[], "error::Error") && may("container", &["mesh::lattice"], "mesh::lattice"));
    assert!(!may("codec", &["mesh"], "simplify::Options"));
    assert!(!may("container", &["mesh::lattice"], "mesh::CornerTable"));
    assert_eq!(room_of(Path::new("src/mesh/topology/weld.rs")), "mesh");
    assert_eq!(room_of(Path::new("src/main.rs")), "main");
    assert!(leaves_by_super(Path::new("src/decoder.rs"), "use super::mesh;"));
    assert!(leaves_by_super(Path::new("src/decoder/mod.rs"), "use super::mesh;"));
    assert!(leaves_by_super(Path::new("src/decoder/log.rs"), "use super::super::mesh;"));
    assert!(!leaves_by_super(
        Path::new("src/decoder/log.rs"),
        "use super::Delta; #[cfg(test)] mod tests { use super::super::x; }"
    ));
}

fn may(room: &str, allowed: &[&str], name: &str) -> bool {
    let first = name.split("::").next().unwrap_or(name);
    let open = first == room || ["error", "limits", "Error", "Result"].contains(&first);
    open || allowed.iter().any(|&rule| rule == "*" || rule == first || rule == name)
}

/// Whether so many `super::` follow each other that they come to the root of the crate.
fn leaves_by_super(path: &Path, text: &str) -> bool {
    let below = path.components().skip_while(|c| c.as_os_str() != "src").count() - 1;
    let depth = if path.file_stem().is_some_and(|stem| stem == "mod") { below - 1 } else { below };
    without_tests(&stripped(text)).contains(&"super::".repeat(depth.max(1)))
}

/// The room of a file: the folder or the file right below `src`.
fn room_of(path: &Path) -> String {
    let below = path.components().skip_while(|c| c.as_os_str() != "src").nth(1);
    let name = below.map(|c| c.as_os_str().to_string_lossy().into_owned()).unwrap_or_default();
    name.trim_end_matches(".rs").to_owned()
}

/// All files, as paths from `src`, with their text.
fn sources() -> impl Iterator<Item = (PathBuf, String)> {
    let mut files = Vec::new();
    collect(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"), &mut files);
    files.sort();
    files.into_iter().map(|path| {
        let text = fs::read_to_string(&path).expect("a source file is text");
        let from_src = path.components().skip_while(|c| c.as_os_str() != "src").collect();
        (from_src, text)
    })
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("the folder of the sources is there") {
        let path = entry.expect("it can be listed").path();
        if path.is_dir() {
            collect(&path, files);
        } else if path.extension().is_some_and(|e| e == "rs") {
            files.push(path);
        }
    }
}

/// The paths behind `crate::`, to their second segment, outside tests, comments and literals.
fn imports(text: &str) -> BTreeSet<String> {
    let text = without_tests(&stripped(text));
    let mut found = BTreeSet::new();
    for (at, word) in text.match_indices("crate::") {
        if !text[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_' || c == '$') {
            let rest = &text[at + word.len()..];
            let first = identifier(rest);
            match rest[first.len()..].strip_prefix("::") {
                Some(tail) if tail.starts_with('{') => {
                    found.extend(heads(&tail[1..]).iter().map(|second| format!("{first}::{second}")));
                }
                Some(tail) => drop(found.insert(format!("{first}::{}", identifier(tail)))),
                None => drop(found.insert(first.to_owned())),
            }
        }
    }
    found
}

/// The first identifiers of the items of a `{}` list whose opening brace has been read.
fn heads(list: &str) -> Vec<&str> {
    let mut heads = Vec::new();
    let (mut depth, mut fresh) = (0, true);
    for (at, c) in list.char_indices() {
        match c {
            '{' => depth += 1,
            '}' if depth == 0 => break,
            '}' => depth -= 1,
            ',' if depth == 0 => fresh = true,
            c if fresh && (c.is_alphabetic() || c == '_') => {
                heads.push(identifier(&list[at..]));
                fresh = false;
            }
            _ => {}
        }
    }
    heads
}

fn identifier(text: &str) -> &str {
    text.split(|c: char| !c.is_alphanumeric() && c != '_').next().unwrap_or("")
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !c.is_alphanumeric() && c != '_')
}

/// The text without what `#[cfg(test)]` stands before: to the end of the line's `;`, or of the block.
fn without_tests(text: &str) -> String {
    let mut kept = String::new();
    let mut rest = text;
    let next =
        |rest: &str| ["#[cfg(test)]", "#[cfg(all(test"].iter().filter_map(|mark| rest.find(mark)).min();
    while let Some(at) = next(rest) {
        kept.push_str(&rest[..at]);
        rest = &rest[at..];
        let mut depth = 0;
        let end = rest.char_indices().find_map(|(at, c)| {
            depth += i32::from(c == '{') - i32::from(c == '}');
            (depth == 0 && (c == '}' || c == ';')).then_some(at + 1)
        });
        rest = &rest[end.unwrap_or(rest.len())..];
    }
    kept + rest
}

/// The text without comments and the contents of literals.
fn stripped(text: &str) -> String {
    let mut kept = String::new();
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        let skipped = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if let Some(comment) = rest.strip_prefix("/*") {
            comment.find("*/").map_or(rest.len(), |end| end + 4)
        } else if let Some(literal) = rest.strip_prefix("r#\"") {
            literal.find("\"#").map_or(rest.len(), |end| end + 5)
        } else if c == '"' {
            literal(rest)
        } else if rest.starts_with("'\"'") || rest.starts_with("'{'") || rest.starts_with("'}'") {
            3
        } else {
            kept.push(c);
            rest = &rest[c.len_utf8()..];
            continue;
        };
        rest = &rest[skipped..];
    }
    kept
}

/// Bytes of the string literal that the text begins with.
fn literal(text: &str) -> usize {
    let mut escaped = false;
    for (at, c) in text.char_indices().skip(1) {
        match c {
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            '"' => return at + 1,
            _ => {}
        }
    }
    text.len()
}
