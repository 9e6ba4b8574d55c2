//! Citations and the list of references belong together: every key that is cited is in
//! docs/references.md, and every key of the list is cited.
//!
//! A citation is a name or two and a year, `Lee 1989`, `Yang and Zeng 2009`, or for three authors
//! and more `Cheng et al. 2021`. The name may have a particle, `de Boor 1978`.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

const ROOT: &str = env!("CARGO_MANIFEST_DIR");
const LIST: &str = "docs/references.md";
const PARTICLES: &[&str] = &["de", "do", "van", "von", "Van", "Von"];

fn files(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries
        .flat_map(|path| if path.is_dir() { files(&path, extension) } else { vec![path] })
        .filter(|path| path.extension().is_some_and(|it| it == extension))
        .collect()
}

/// The words of a file, lines joined where a comment or a string goes on.
fn words(text: &str) -> Vec<&str> {
    let lines = text.lines().map(|line| line.trim_start().trim_end_matches('\\'));
    let bare = lines.map(|line| line.trim_start_matches(['/', '!']));
    bare.flat_map(str::split_whitespace)
        .map(|word| word.trim_start_matches(['(', '"', '*', '[']))
        .collect()
}

/// A year with perhaps a letter, without what follows it.
fn year(word: &str) -> Option<&str> {
    let end = word.find(|c: char| !c.is_ascii_alphanumeric()).unwrap_or(word.len());
    let year = &word[..end];
    let digits = year.trim_end_matches(|c: char| c.is_ascii_lowercase());
    let number = digits.parse::<u32>().is_ok_and(|number| (1850..2100).contains(&number));
    (number && digits.len() == 4 && year.len() <= 5).then_some(year)
}

fn is_name(word: &str) -> bool {
    word.len() > 1
        && word.starts_with(char::is_uppercase)
        && word.chars().all(|c| c.is_alphabetic() || c == '-')
}

/// The last name in these words, with its particle.
fn name<'a>(words: &'a [&'a str]) -> Option<(&'a [&'a str], String)> {
    let (last, before) = words.split_last()?;
    if !is_name(last) {
        return None;
    }
    match before.split_last() {
        Some((particle, rest)) if PARTICLES.contains(particle) => {
            Some((rest, format!("{particle} {last}")))
        }
        _ => Some((before, (*last).to_owned())),
    }
}

/// The citation that ends in this word.
fn citation(words: &[&str]) -> Option<String> {
    let (last, before) = words.split_last()?;
    let year = year(last)?;
    if let [names @ .., "et", "al."] = before {
        let (_, first) = name(names)?;
        return Some(format!("{first} et al. {year}"));
    }
    let (rest, second) = name(before)?;
    if let [names @ .., "and"] = rest
        && let Some((_, first)) = name(names)
    {
        return Some(format!("{first} and {second} {year}"));
    }
    Some(format!("{second} {year}"))
}

/// Every citation of a text.
fn citations(text: &str) -> BTreeSet<String> {
    let words = words(text);
    (0..words.len()).filter_map(|end| citation(&words[..=end])).collect()
}

/// Where authors are named without a year: with others, or before a formula or figure of theirs.
fn undated(text: &str, authors: &BTreeSet<String>) -> Vec<String> {
    let words = words(text);
    let dated = |next: &str| next.starts_with(char::is_numeric);
    let part = |next: &str| ["eq.", "Figure", "Table", "Theorem", "Proposition"].contains(&next);
    let bare = |pair: &[&str]| match pair {
        [word, next] => {
            (word.starts_with("al.") && !dated(next)) || (authors.contains(*word) && part(next))
        }
        _ => false,
    };
    let places = words.windows(2).enumerate().filter(|(_, pair)| bare(pair)).map(|(i, _)| i);
    places.map(|i| words[i.saturating_sub(2)..words.len().min(i + 3)].join(" ")).collect()
}

/// The keys of the list: the first column, below its heading.
fn keys() -> BTreeSet<String> {
    let text = fs::read_to_string(Path::new(ROOT).join(LIST)).unwrap();
    let rows = text.lines().filter_map(|line| line.strip_prefix("| "));
    let keys = rows.filter_map(|row| row.split_once(" |").map(|(key, _)| key.to_owned()));
    let keys: Vec<_> = keys.filter(|key| key != "key").collect();
    assert!(keys.is_sorted_by_key(|key| key.to_lowercase()), "{keys:#?}");
    let distinct: BTreeSet<_> = keys.iter().cloned().collect();
    assert_eq!(distinct.len(), keys.len(), "a key occurs twice");
    distinct
}

/// The names in the keys.
fn authors() -> BTreeSet<String> {
    let is_author = |word: &String| is_name(word);
    keys().iter().flat_map(|key| key.split(' ').map(str::to_owned)).filter(is_author).collect()
}

/// The files that cite: the sources, and the pages but for the list.
fn citing() -> BTreeMap<String, String> {
    let sources = files(&Path::new(ROOT).join("src"), "rs");
    let pages = files(&Path::new(ROOT).join("docs"), "md");
    let named = sources.into_iter().chain(pages).map(|path| {
        let name = path.strip_prefix(ROOT).unwrap().display().to_string();
        (name.replace('\\', "/"), fs::read_to_string(&path).unwrap())
    });
    named.filter(|(name, _)| name != LIST).collect()
}

#[test]
fn every_citation_is_in_the_list_of_references() {
    let keys = keys();
    let unknown = |(name, text): (&String, &String)| {
        let missing: Vec<_> = citations(text).difference(&keys).cloned().collect();
        (!missing.is_empty()).then(|| format!("{name}: {missing:?}"))
    };
    let unknown: Vec<_> = citing().iter().filter_map(unknown).collect();
    assert!(unknown.is_empty(), "not in {LIST}: {unknown:#?}");
}

#[test]
fn every_reference_of_the_list_is_cited() {
    let cited: BTreeSet<_> = citing().values().flat_map(|text| citations(text)).collect();
    let idle: Vec<_> = keys().difference(&cited).cloned().collect();
    assert!(idle.is_empty(), "cited nowhere: {idle:?}");
}

#[test]
fn no_citation_lacks_its_year() {
    let authors = authors();
    let found = |(name, text): (&String, &String)| {
        let places = undated(text, &authors).into_iter();
        places.map(|place| format!("{name}: {place}")).collect::<Vec<_>>()
    };
    let undated: Vec<_> = citing().iter().flat_map(found).collect();
    assert!(undated.is_empty(), "{undated:#?}");
}

#[test]
fn citations_are_found_by_their_form() {
    let text = "/// The blossom (Ramshaw 1987): see Yang and Zeng\n    /// 2009, de Boor 1978, IV (7), \
                Golub and Van Loan 2013;\n//! Cheng et al.\n//! 2021 eq. (3). \"Of Lemire 2021a \\\n  \
                Lee 1989.\" These are 2000 points of 1958; up to 2048.";
    let expected = [
        "Cheng et al. 2021",
        "Golub and Van Loan 2013",
        "Lee 1989",
        "Lemire 2021a",
        "Ramshaw 1987",
        "Yang and Zeng 2009",
        "de Boor 1978",
    ];
    assert_eq!(citations(text).into_iter().collect::<Vec<_>>(), expected);
    let text = "as in Cheng et al. eq. 3, Cheng et al. 2021 and Chen\n/// eq. 7; Chen 2013 eq. 8";
    let expected = ["Cheng et al. eq. 3,", "2021 and Chen eq. 7;"];
    assert_eq!(undated(text, &authors()), expected);
}
