//! No module imports, directly or through others, one that imports it.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

type Module = Vec<String>;

fn sources(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.flat_map(|path| if path.is_dir() { sources(&path) } else { vec![path] }).collect()
}

/// `src/core/fit/mod.rs` is `core::fit`.
fn module(root: &Path, path: &Path) -> Module {
    let steps = path.strip_prefix(root).unwrap().with_extension("");
    let steps = steps.iter().map(|step| step.to_str().unwrap().to_owned());
    steps.filter(|step| step != "mod").collect()
}

/// What the code says outside its tests, without comments and texts.
fn code(path: &Path) -> String {
    let text = fs::read_to_string(path).unwrap();
    let body = text.split("#[cfg(test)]").next().unwrap();
    let bare = |line: &str| line.split("//").next().unwrap().split('"').step_by(2).collect();
    body.lines().map(bare).collect::<Vec<String>>().join("\n")
}

/// The paths of a `use`, with the braces multiplied out.
fn expanded(prefix: &str, tree: &str) -> Vec<String> {
    let mut depth = 0;
    let parts = tree.split(|c: char| {
        depth += i32::from(c == '{') - i32::from(c == '}');
        c == ',' && depth == 0
    });
    let paths = parts.map(str::trim).filter(|part| !part.is_empty()).flat_map(|part| {
        match part
            .split_once('{')
            .and_then(|(before, rest)| Some((before, rest.rsplit_once('}')?.0)))
        {
            Some((before, inside)) => expanded(&format!("{prefix}{before}"), inside),
            None => vec![format!("{prefix}{part}")],
        }
    });
    paths.collect()
}

/// Every path that the code imports or writes out.
fn paths(code: &str) -> Vec<String> {
    let uses = code.split("use ").skip(1).filter_map(|rest| rest.split_once(';'));
    let mut paths: Vec<_> = uses.flat_map(|(tree, _)| expanded("", tree)).collect();
    for start in ["crate::", "super::"] {
        paths.extend(code.match_indices(start).map(|(i, _)| {
            let end = |c: char| !(c.is_alphanumeric() || c == '_' || c == ':');
            code[i..].split(end).next().unwrap().to_owned()
        }));
    }
    paths
}

/// The module that a path of another one leads to, if it is one of ours and none around it.
fn target(modules: &BTreeMap<Module, PathBuf>, from: &Module, path: &str) -> Option<Module> {
    let words = path.split("::").map(|word| word.split_whitespace().next().unwrap_or_default());
    let mut here = from.clone();
    for (i, word) in words.enumerate() {
        match word {
            "crate" if i == 0 => here.clear(),
            "super" => {
                here.pop();
            }
            "self" => {}
            // A path without a root is a module of this one, or a crate.
            word => here.push(word.to_owned()),
        }
    }
    while !here.is_empty() && !modules.contains_key(&here) {
        here.pop();
    }
    let is_around = from.starts_with(&here);
    (!here.is_empty() && !is_around).then_some(here)
}

/// The first circle that a walk from here meets.
fn circle(
    imports: &BTreeMap<Module, BTreeSet<Module>>,
    way: &mut Vec<Module>,
    done: &mut BTreeSet<Module>,
) -> Option<Vec<Module>> {
    let here = way.last().unwrap().clone();
    for next in &imports[&here] {
        if let Some(i) = way.iter().position(|module| module == next) {
            return Some(way[i..].to_vec());
        }
        if !done.contains(next) {
            way.push(next.clone());
            let found = circle(imports, way, done);
            if found.is_some() {
                return found;
            }
            way.pop();
        }
    }
    done.insert(here);
    None
}

#[test]
fn no_module_imports_in_a_circle() {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/src"));
    let files =
        sources(root).into_iter().filter(|path| path.extension().is_some_and(|e| e == "rs"));
    let is_test = |path: &PathBuf| path.file_stem().is_some_and(|stem| stem == "tests");
    let modules: BTreeMap<Module, PathBuf> =
        files.filter(|path| !is_test(path)).map(|path| (module(root, &path), path)).collect();
    let of = |(from, path): (&Module, &PathBuf)| {
        let found = paths(&code(path)).into_iter().filter_map(|to| target(&modules, from, &to));
        (from.clone(), found.collect::<BTreeSet<_>>())
    };
    let imports: BTreeMap<_, _> = modules.iter().map(of).collect();
    let count: usize = imports.values().map(BTreeSet::len).sum();
    assert!(count > 500, "only {count} imports were found");
    let mut done = BTreeSet::new();
    for module in imports.keys() {
        if let Some(circle) = circle(&imports, &mut vec![module.clone()], &mut done) {
            panic!("{:#?}", circle.iter().map(|step| step.join("::")).collect::<Vec<_>>());
        }
    }
}
