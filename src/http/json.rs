//! Bytes to requests, answers to bytes.

use std::io;

use axum::body::Bytes;
use axum::extract::rejection::BytesRejection;
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::ser::Formatter;
use serde_path_to_error::{Path, Segment};

use super::error::Problem;
use crate::core::error::{Error, Fault};

/// Answers one operation: reads the request, runs the operation away from the threads that serve connections,
/// writes the answer as JSON.
pub async fn respond<Request, Answer>(
    headers: HeaderMap,
    body: Result<Bytes, BytesRejection>,
    operation: fn(Request) -> Result<Answer, Error>,
) -> Response
where
    Request: DeserializeOwned + 'static,
    Answer: Serialize + 'static,
{
    respond_as("application/json", headers, body, operation, to_bytes).await
}

/// The same for an operation whose answer is a picture.
pub async fn respond_svg<Request>(
    headers: HeaderMap,
    body: Result<Bytes, BytesRejection>,
    operation: fn(Request) -> Result<String, Error>,
) -> Response
where
    Request: DeserializeOwned + 'static,
{
    respond_as("image/svg+xml", headers, body, operation, |text| Ok(text.clone().into_bytes())).await
}

async fn respond_as<Request, Answer>(
    media_type: &'static str,
    headers: HeaderMap,
    body: Result<Bytes, BytesRejection>,
    operation: fn(Request) -> Result<Answer, Error>,
    write: fn(&Answer) -> Result<Vec<u8>, Problem>,
) -> Response
where
    Request: DeserializeOwned + 'static,
    Answer: 'static,
{
    let work = move || -> Result<Vec<u8>, Problem> {
        check_media_type(&headers)?;
        let body = body.map_err(|rejection| unreadable(&rejection))?;
        write(&operation(from_bytes(&body)?)?)
    };
    match tokio::task::spawn_blocking(work).await {
        Ok(Ok(bytes)) => ([(header::CONTENT_TYPE, HeaderValue::from_static(media_type))], bytes).into_response(),
        Ok(Err(problem)) => problem.into_response(),
        Err(_panicked) => Problem::internal().into_response(),
    }
}

fn check_media_type(headers: &HeaderMap) -> Result<(), Problem> {
    let given = headers.get(header::CONTENT_TYPE).and_then(|value| value.to_str().ok()).unwrap_or("");
    let essence = given.split(';').next().unwrap_or("").trim().to_ascii_lowercase();
    if essence == "application/json" || (essence.starts_with("application/") && essence.ends_with("+json")) {
        return Ok(());
    }
    let was = if given.is_empty() { "no Content-Type was sent".to_owned() } else { format!("the Content-Type is {given}") };
    let detail = format!("{was}; send the header Content-Type: application/json");
    Err(Problem::new(StatusCode::UNSUPPORTED_MEDIA_TYPE, "unsupported_media_type", "Unsupported media type", detail))
}

fn unreadable(rejection: &BytesRejection) -> Problem {
    if rejection.status() == StatusCode::PAYLOAD_TOO_LARGE {
        return super::error::body_too_large();
    }
    Problem::new(StatusCode::BAD_REQUEST, "unreadable_body", "The body could not be read", "the body ended before all of it arrived")
}

/// Reads a request.
///
/// # Errors
/// A problem with status 400, a pointer to the value at fault, and line and column.
pub fn from_bytes<T: DeserializeOwned>(body: &[u8]) -> Result<T, Problem> {
    // The fast way knows no path; only a failure is read again with one.
    serde_json::from_slice(body).map_err(|error| explain::<T>(body, &error))
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
    Problem::at(StatusCode::BAD_REQUEST, code, title, pointer, in_json_terms(message)).with_position(error.line(), error.column().max(1))
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
fn shortened(text: &str) -> String {
    const KEPT: usize = 200;
    let count = text.chars().count();
    if count <= 2 * KEPT {
        return text.to_owned();
    }
    let (start, end): (String, String) = (text.chars().take(KEPT).collect(), text.chars().skip(count - KEPT).collect());
    format!("{start} [...] {end}")
}

/// A path as a JSON Pointer.
fn pointer(path: &Path) -> String {
    let step = |segment: &Segment| match segment {
        Segment::Seq { index } => format!("/{index}"),
        Segment::Map { key } => format!("/{}", key.replace('~', "~0").replace('/', "~1")),
        Segment::Enum { .. } | Segment::Unknown => String::new(),
    };
    path.iter().map(step).collect()
}

/// Writes an answer.
///
/// # Errors
/// [`Fault::Overflow`] where a number is infinite or not a number: JSON has neither, and `null` is no number.
pub fn to_bytes<T: Serialize>(answer: &T) -> Result<Vec<u8>, Problem> {
    let mut bytes = Vec::with_capacity(1024);
    match answer.serialize(&mut serde_json::Serializer::with_formatter(&mut bytes, Strict)) {
        Ok(()) => Ok(bytes),
        Err(_not_finite) => Err(Error::from(Fault::Overflow).into()),
    }
}

/// Writes compact JSON, but never `null`: no answer has one, so it could only stand for a number that overflowed.
struct Strict;

impl Formatter for Strict {
    fn write_null<W: ?Sized + io::Write>(&mut self, _: &mut W) -> io::Result<()> {
        Err(io::Error::other("not a finite number"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_overflowed_are_refused() {
        assert!(to_bytes(&vec![1.0, f64::INFINITY]).is_err());
        assert!(to_bytes(&vec![f64::NAN]).is_err());
        assert_eq!(to_bytes(&vec![0.1, -0.0, 5e-324]).unwrap(), b"[0.1,-0.0,5e-324]");
    }
}
