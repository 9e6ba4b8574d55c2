//! The core is pure: it knows nothing of HTTP, JSON, the network, files or the clock.

use std::fs;
use std::path::{Path, PathBuf};

const FORBIDDEN: &[&str] = &[
    "crate::api",
    "crate::draw",
    "crate::http",
    "crate::server",
    "thread_local!",
    "OnceLock",
    "LazyLock",
    "axum",
    "hyper",
    "tower",
    "serde",
    "utoipa",
    "tokio",
    "tracing",
    "std::io",
    "std::fs",
    "std::net",
    "std::env",
    "std::process",
    "std::thread",
    "std::time",
    "println!",
    "eprintln!",
];

/// The files of a folder, but for those that are compiled for tests alone.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries
        .filter(|path| !path.ends_with("tests.rs"))
        .flat_map(|path| if path.is_dir() { sources(&path) } else { vec![path] })
        .collect()
}

/// The lines of a file without its test module and its comments.
fn code(path: &Path) -> Vec<(usize, String)> {
    let text = fs::read_to_string(path).unwrap();
    let body = text.split("#[cfg(test)]").next().unwrap();
    let line = |(i, line): (usize, &str)| (i + 1, line.split("//").next().unwrap().to_owned());
    body.lines().enumerate().map(line).collect()
}

#[test]
fn the_core_is_pure() {
    let files = sources(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/src/core")));
    assert!(files.len() > 15, "found only {} files", files.len());
    let forbidden = |path: &PathBuf| {
        let lines = code(path)
            .into_iter()
            .filter(|(_, line)| FORBIDDEN.iter().any(|word| line.contains(word)));
        lines
            .map(|(number, line)| format!("{}:{number}: {}", path.display(), line.trim()))
            .collect::<Vec<_>>()
    };
    let found: Vec<_> = files.iter().flat_map(forbidden).collect();
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn the_core_has_no_way_to_panic_on_purpose() {
    let files = sources(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/src/core")));
    let words = ["unwrap()", "expect(", "panic!(", "unreachable!(", "todo!(", "unimplemented!("];
    let found: Vec<_> = files
        .iter()
        .flat_map(|path| code(path).into_iter().map(move |line| (path, line)))
        .filter(|(_, (_, line))| words.iter().any(|word| line.contains(word)))
        .collect();
    assert!(found.is_empty(), "{found:#?}");
}

/// Whoever calls the contract decides where it runs.
#[test]
fn the_contract_starts_no_threads() {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/src"));
    let files = ["api", "draw"].into_iter().flat_map(|floor| sources(&root.join(floor)));
    let lines = files.filter(|path| path.extension().is_some_and(|it| it == "rs"));
    let lines: Vec<_> = lines.flat_map(|path| code(&path)).collect();
    assert!(lines.len() > 5_000, "found only {} lines", lines.len());
    let starts = |line: &str| line.contains("thread::") || line.contains("rayon");
    let found: Vec<_> = lines.iter().filter(|(_, line)| starts(line)).collect();
    assert!(found.is_empty(), "{found:#?}");
}

/// Cargo holds the floors apart by features; this also where all of them are built.
#[test]
fn no_floor_imports_from_above() {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/src"));
    let floors = [["core", ""], ["api", "draw"], ["http", ""], ["server", ""]];
    let mut found = Vec::new();
    for (i, floor) in floors.iter().enumerate() {
        let above = || floors[i + 1..].iter().flatten().filter(|name| !name.is_empty());
        for path in
            floor.iter().filter(|name| !name.is_empty()).flat_map(|name| sources(&root.join(name)))
        {
            let upward =
                |line: &str| above().any(|name| line.contains(&format!("crate::{name}::")));
            if path.extension().is_some_and(|it| it == "rs") {
                found.extend(
                    code(&path)
                        .into_iter()
                        .filter(|(_, line)| upward(line))
                        .map(|line| (path.clone(), line)),
                );
            }
        }
    }
    assert!(found.is_empty(), "{found:#?}");
}

/// `arbitrary_precision` of serde_json breaks floats inside unions, and features unify across the
/// tree.
#[test]
fn json_numbers_are_doubles() {
    let number: serde_json::Number = "0.1".parse().unwrap();
    assert_eq!(number.as_f64(), Some(0.1));
    let long = "0.1000000000000000055511151231257827";
    assert_ne!(
        long.parse::<serde_json::Number>().unwrap().to_string(),
        long,
        "arbitrary_precision is on"
    );
}
