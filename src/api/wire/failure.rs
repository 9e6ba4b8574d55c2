//! Why a value could not be read, in the words of JSON.

use std::fmt::{self, Display};

use serde::de::{self, Expected, Unexpected};

use crate::api::sentences::{in_json_terms, shortened};
use crate::api::wire::length::TOO_LONG;

/// Why a value could not be read.
#[derive(Debug)]
pub(super) enum Failure {
    /// It is known already.
    Noted,
    /// This is wrong with it.
    New { code: &'static str, detail: String, meant: Option<String> },
}

impl Failure {
    pub(super) fn new(code: &'static str, detail: String) -> Self {
        Failure::New { code, detail, meant: None }
    }

    /// What the parser refuses of a text that is JSON: a number beyond a double, half of a
    /// surrogate pair.
    pub(super) fn of_parser(error: &serde_json::Error) -> Self {
        let code = if error.to_string().starts_with("number out of range") {
            "number_out_of_range"
        } else {
            "not_json"
        };
        Failure::new(code, in_json_terms(error))
    }
}

impl Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Failure::Noted => f.write_str("noted"),
            Failure::New { detail, .. } => f.write_str(detail),
        }
    }
}

impl std::error::Error for Failure {}

impl de::Error for Failure {
    fn custom<T: Display>(message: T) -> Self {
        let detail = message.to_string();
        Failure::new(if detail.starts_with(TOO_LONG) { "too_large" } else { "wrong_type" }, detail)
    }

    fn invalid_type(found: Unexpected, expected: &dyn Expected) -> Self {
        Failure::new(
            "wrong_type",
            format!("this is {}; expected {}", in_words(found), expectation(expected)),
        )
    }

    fn invalid_value(found: Unexpected, expected: &dyn Expected) -> Self {
        Self::invalid_type(found, expected)
    }

    fn invalid_length(length: usize, expected: &dyn Expected) -> Self {
        let items = if length == 1 { "item" } else { "items" };
        Failure::new(
            "wrong_type",
            format!("this has {length} {items}; expected {}", expectation(expected)),
        )
    }

    fn unknown_variant(value: &str, known: &'static [&'static str]) -> Self {
        let meant = meant(value, known.iter().copied());
        let hint = meant.map_or(String::new(), |name| format!(" (did you mean `{name}`?)"));
        let known: Vec<String> = known.iter().map(|name| format!("`{name}`")).collect();
        Failure::new(
            "unknown_variant",
            format!("unknown value `{}`{hint}; allowed: {}", shortened(value), known.join(", ")),
        )
    }

    fn unknown_field(name: &str, known: &'static [&'static str]) -> Self {
        let meant = meant(name, known.iter().copied());
        let hint = meant.map_or(String::new(), |name| format!(" (did you mean `{name}`?)"));
        let detail = format!(
            "unknown field `{}`{hint}; the fields here are {}",
            shortened(name),
            known.join(", ")
        );
        Failure::New { code: "unknown_field", detail, meant: meant.map(str::to_owned) }
    }

    fn duplicate_field(name: &'static str) -> Self {
        Failure::new(
            "duplicate_field",
            format!("the field `{name}` was given before; give it once"),
        )
    }
}

/// The known name that is nearest to one that is not known, if it is near: a letter left out,
/// added, changed or swapped with its neighbour counts 1, and one in three letters may be wrong.
pub fn meant<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    const LONGEST: usize = 64;
    if name.len() > LONGEST {
        return None;
    }
    let distance = |other: &str| strsim::osa_distance(&name.to_lowercase(), other);
    let length = |other: &str| other.chars().count().max(name.chars().count());
    let near = known
        .map(|other| (distance(&other.to_lowercase()), other))
        .filter(|(d, other)| 3 * d <= length(other));
    near.min_by_key(|(distance, _)| *distance).map(|(_, other)| other)
}

/// What was found, in the words of JSON.
fn in_words(found: Unexpected) -> String {
    match found {
        Unexpected::Bool(value) => value.to_string(),
        Unexpected::Unsigned(value) => format!("the number {value}"),
        Unexpected::Signed(value) => format!("the number {value}"),
        Unexpected::Float(value) => format!("the number {value:?}"),
        Unexpected::Str(text) => format!("the string \"{}\"", shortened(text)),
        Unexpected::Unit => "null".into(),
        Unexpected::Seq => "an array".into(),
        Unexpected::Map => "an object".into(),
        other => other.to_string(),
    }
}

/// What was expected, in the words of JSON.
fn expectation(expected: &dyn Expected) -> String {
    match expected.to_string().as_str() {
        "f64" => "a number".into(),
        "a sequence" => "an array".into(),
        "a boolean" => "true or false".into(),
        other => other.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_names_are_meant_and_far_ones_are_not() {
        let known = ["control_points", "family", "beta", "knots", "u"];
        for (name, expected) in [
            ("control_point", Some("control_points")),
            ("controlPoints", Some("control_points")),
            ("Famliy", Some("family")),
            ("bta", Some("beta")),
            ("zzz", None),
            ("", None),
            ("gamma", None),
        ] {
            assert_eq!(meant(name, known.into_iter()), expected, "{name}");
        }
        assert_eq!(meant(&"x".repeat(1_000_000), known.into_iter()), None);
    }
}
