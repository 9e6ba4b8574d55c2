//! Bytes to requests, answers to bytes.

use std::io;

use axum::http::StatusCode;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_path_to_error::{Path, Segment};

use super::budget::Budget;
use super::error::Problem;
use super::paper::{Paper, Stopped};
use super::shape::Shape;
use super::wire::TOO_LONG;
use super::writer;
use crate::core::error::{Error, Fault};
use crate::core::work::checkpoint;

/// Reads a request.
///
/// # Errors
/// A problem with status 400, a pointer to the value at fault, and line and column.
pub fn from_bytes<T: DeserializeOwned>(body: &[u8]) -> Result<T, Problem> {
    // The fast way knows no path; only a failure is read again with one.
    serde_json::from_slice(body).or_else(|error| {
        checkpoint()?;
        Err(explain::<T>(body, &error))
    })
}

fn explain<T: DeserializeOwned>(body: &[u8], error: &serde_json::Error) -> Problem {
    if body.trim_ascii().is_empty() {
        return not_json("the body is empty; send a JSON object").with_position(1, 1);
    }
    if body.starts_with("\u{feff}".as_bytes()) {
        return not_json("the body starts with a byte order mark; leave it out").with_position(1, 1);
    }
    let mut deserializer = serde_json::Deserializer::from_slice(body);
    let pointer = match serde_path_to_error::deserialize::<_, T>(&mut deserializer) {
        Err(tracked) => pointer(tracked.path()),
        Ok(_) => String::new(), // the fault comes after the value
    };
    let text = error.to_string();
    let message = text.rsplit_once(" at line ").map_or(text.as_str(), |(message, _)| message);
    let (code, title) = kind_of(error, message);
    let status = if code == "too_large" { StatusCode::PAYLOAD_TOO_LARGE } else { StatusCode::BAD_REQUEST };
    Problem::at(status, code, title, pointer, in_json_terms(message)).with_position(error.line(), error.column().max(1))
}

fn not_json(detail: &str) -> Problem {
    Problem::at(StatusCode::BAD_REQUEST, "not_json", "The body is not JSON", String::new(), detail.into())
}

fn kind_of(error: &serde_json::Error, message: &str) -> (&'static str, &'static str) {
    const SHAPE: &str = "The JSON is not the shape of this request";
    match message {
        m if m.starts_with("unknown field") => ("unknown_field", SHAPE),
        m if m.starts_with("duplicate field") => ("duplicate_field", SHAPE),
        m if m.starts_with("unknown variant") => ("unknown_variant", SHAPE),
        m if m.starts_with(TOO_LONG) => ("too_large", "Beyond a limit"),
        m if m.starts_with("number out of range") => ("number_out_of_range", SHAPE),
        _ if error.is_data() => ("wrong_type", SHAPE),
        _ => ("not_json", "The body is not JSON"),
    }
}

/// What the parser says, in the words of JSON.
const WORDS: &[(&str, &str)] = &[
    ("a sequence", "an array"),
    ("sequence", "array"),
    ("a map", "an object"),
    ("map", "object"),
    ("f64", "a number"),
    ("floating point", "number"),
    ("variant", "value"),
    ("unexpected end of hex escape", "half of a surrogate pair stands alone in a \\u escape"),
    ("number out of range", "the number is out of range: doubles end at 1.8e308"),
    ("EOF while parsing a list", "the body ends in the middle of an array"),
    ("EOF while parsing an", "the body ends in the middle of an"),
    ("EOF while parsing a", "the body ends in the middle of a"),
    ("expected value", "expected a JSON value; NaN, Infinity and bare words are none"),
];

/// The parser's message in the words of JSON; what it quotes of the request stays as it is, but not at any length.
fn in_json_terms(message: &str) -> String {
    let ours = |text: &str| WORDS.iter().fold(text.to_owned(), |text, (from, to)| text.replace(from, to));
    let quote = |c| c == '`' || c == '"';
    match (message.find(quote), message.rfind(quote)) {
        (Some(first), Some(last)) => {
            format!("{}{}{}", ours(&message[..first]), shortened(&message[first..=last]), ours(&message[last + 1..]))
        }
        _ => ours(message),
    }
}

/// The beginning and the end of a long text.
pub(super) fn shortened(text: &str) -> String {
    const KEPT: usize = 200;
    let count = text.chars().count();
    if count <= 2 * KEPT {
        return text.to_owned();
    }
    let (start, end): (String, String) = (text.chars().take(KEPT).collect(), text.chars().skip(count - KEPT).collect());
    format!("{start} [...] {end}")
}

/// A path as a JSON Pointer; a long unknown key in it is not echoed whole.
fn pointer(path: &Path) -> String {
    let step = |segment: &Segment| match segment {
        Segment::Seq { index } => format!("/{index}"),
        Segment::Map { key } => format!("/{}", key.replace('~', "~0").replace('/', "~1")),
        Segment::Enum { .. } | Segment::Unknown => String::new(),
    };
    shortened(&path.iter().map(step).collect::<String>())
}

/// Refuses JSON nested deeper than this. The parser has its own end at 127.
///
/// # Errors
/// Status 413.
pub fn check_depth(body: &[u8], most: usize) -> Result<(), Problem> {
    if most >= MAX_DEPTH || depth(body) <= most {
        return Ok(());
    }
    let detail = format!("the JSON is nested deeper than {most} levels");
    Err(Problem::at(StatusCode::PAYLOAD_TOO_LARGE, "too_large", "Beyond a limit", String::new(), detail))
}

/// What the parser itself allows.
pub const MAX_DEPTH: usize = 127;

/// How deep brackets nest, those in strings left out.
fn depth(body: &[u8]) -> usize {
    let (mut open, mut deepest, mut in_string, mut escaped) = (0_usize, 0, false, false);
    for byte in body {
        match (in_string, byte) {
            (true, _) if escaped => escaped = false,
            (true, b'\\') => escaped = true,
            (_, b'"') => in_string = !in_string,
            (false, b'[' | b'{') => open += 1,
            (false, b']' | b'}') => open = open.saturating_sub(1),
            _ => {}
        }
        deepest = deepest.max(open);
    }
    deepest
}

/// Writes an answer.
///
/// # Errors
/// [`Fault::Overflow`] where a number is infinite or not a number: JSON has neither, and `null` is no number. What
/// [`not_written`] says where the paper ends.
pub fn write<T: Serialize>(answer: &T, shape: Shape, paper: &mut Paper) -> Result<(), Problem> {
    writer::write(answer, shape, paper).map_err(|error| not_written(error.0))
}

/// The same in one piece, for whoever sends it nowhere.
///
/// # Errors
/// [`Fault::Overflow`], as [`write()`].
pub fn to_bytes<T: Serialize>(answer: &T) -> Result<Vec<u8>, Problem> {
    let mut paper = Paper::new(&Budget::unlimited());
    write(answer, Shape::default(), &mut paper).map(|()| paper.finish().concat())
}

/// Why a text could not be written to its end.
pub fn not_written(error: io::Error) -> Problem {
    match error.get_ref().and_then(|error| error.downcast_ref()) {
        Some(Stopped::NoRoom) => Problem::overloaded("the memory for bodies and answers is in use"),
        Some(Stopped::Cancelled) => Error::from(Fault::Cancelled).into(),
        None => Error::from(Fault::Overflow).into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(numbers: &[f64]) -> Result<Vec<u8>, Problem> {
        let mut paper = Paper::new(&Budget::new(0, std::sync::Arc::default()));
        write(&numbers, Shape::default(), &mut paper).map(|()| paper.finish().concat())
    }

    #[test]
    fn numbers_that_overflowed_are_refused() {
        assert!(written(&[1.0, f64::INFINITY]).unwrap_err().to_string().contains("overflow"));
        assert!(written(&[f64::NAN]).is_err());
        assert_eq!(written(&[0.1, -0.0, 5e-324]).unwrap(), b"[0.1,-0.0,5e-324]");
    }

    #[test]
    fn an_answer_without_room_is_refused_as_that() {
        let problem = written(&vec![0.1; 100_000]).unwrap_err();
        assert!(problem.to_string().contains("overloaded"), "{problem}");
    }

    #[test]
    fn brackets_in_strings_are_no_depth() {
        assert_eq!(depth(br#"{"a\"[[[": [[1], 2], "b\\": {}}"#), 3);
        assert!(check_depth(b"[[[]]]", 3).is_ok());
        assert!(check_depth(b"[[[]]]", 2).is_err());
    }
}
