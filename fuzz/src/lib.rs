//! What holds for any bytes at all: one function per operation, and one for the core. Each panics where it does not hold.
//!
//! `cargo test --test fuzz` drives them with mutated examples, cargo-fuzz with whatever reaches new code.

mod curve;

pub use curve::curve;

use serde::Serialize;
use serde_json::Value;
use springline::api::json::{from_bytes, to_bytes};
use springline::api::problem::Problem;
use springline::core::error::Error;
use springline::http;

macro_rules! operations {
    ($($name:ident $path:literal $write:ident $check:ident),* $(,)?) => {
        $(#[doc = concat!("`POST ", $path, "`; whether it succeeds.")]
        pub fn $name(body: &[u8]) -> bool {
            holds(body, http::$name::operation, $write, $check)
        })*

        /// Every operation by its path.
        pub const OPERATIONS: &[(&str, fn(&[u8]) -> bool)] = &[$(($path, $name)),*];
    };
}

operations! {
    evaluate "/v1/evaluate" to_bytes is_json,
    subdivide "/v1/subdivide" to_bytes is_json,
    to_bspline "/v1/to-bspline" to_bytes is_json,
    interpolate "/v1/interpolate" to_bytes is_json,
    fit "/v1/fit" to_bytes is_json,
    reshape "/v1/reshape" to_bytes is_json,
    join "/v1/join" to_bytes is_json,
    convert "/v1/convert" to_bytes is_json,
    continuity "/v1/continuity" to_bytes is_json,
    basis "/v1/basis" to_bytes is_json,
    surface_evaluate "/v1/surfaces/evaluate" to_bytes is_json,
    surface_subdivide "/v1/surfaces/subdivide" to_bytes is_json,
    surface_tessellate "/v1/surfaces/tessellate" to_bytes is_json,
    render "/v1/render" to_text is_svg,
}

type Outcome = Result<Vec<u8>, Problem>;

fn holds<Request, Answer>(
    body: &[u8],
    operation: fn(Request) -> Result<Answer, Error>,
    write: fn(&Answer) -> Outcome,
    check: fn(&[u8]),
) -> bool
where
    Request: springline::api::json::Request + Serialize,
{
    let run = |body: &[u8]| write(&operation(from_bytes(body)?)?);
    let printed = from_bytes::<Request>(body).map(|request| to_bytes(&request).expect("a request that was read can be written"));
    let outcome = run(body);
    // Asked again, and where there is a request, in other words.
    let again = run(printed.as_deref().unwrap_or(body));
    assert_eq!(seen(&outcome), seen(&again), "the same request, another answer");
    match &outcome {
        Ok(answer) => check(answer),
        Err(problem) => is_documented(problem),
    }
    outcome.is_ok()
}

/// What a client sees.
fn seen(outcome: &Outcome) -> (bool, Vec<u8>) {
    let bytes = match outcome {
        Ok(answer) => answer.clone(),
        Err(problem) => serde_json::to_vec(problem).expect("a problem can be written"),
    };
    (outcome.is_ok(), bytes)
}

fn is_documented(problem: &Problem) {
    let problem = serde_json::to_value(problem).expect("a problem can be written");
    let status = problem["status"].as_u64();
    assert!([400, 413, 422].map(Some).contains(&status), "{problem}");
    assert!(problem["code"].as_str().is_some_and(|code| problem["type"] == format!("urn:springline:problem:{code}")), "{problem}");
    assert!(problem["detail"].as_str().is_some_and(|detail| !detail.is_empty()), "{problem}");
    assert!(!has_null(&problem), "{problem}");
    assert!(problem.to_string().len() < 8_000, "a problem that echoes what was sent: {problem}");
}

fn is_json(answer: &[u8]) {
    let answer: Value = serde_json::from_slice(answer).expect("the answer is JSON");
    assert!(answer.is_object() && !has_null(&answer), "{answer}");
}

fn has_null(value: &Value) -> bool {
    match value {
        Value::Null => true,
        Value::Array(items) => items.iter().any(has_null),
        Value::Object(fields) => fields.values().any(has_null),
        _ => false,
    }
}

#[allow(clippy::ptr_arg, reason = "what render answers with")]
fn to_text(answer: &String) -> Outcome {
    Ok(answer.clone().into_bytes())
}

/// Elements open and close, nothing of the request escapes into the markup, and every number is one.
fn is_svg(answer: &[u8]) {
    let text = std::str::from_utf8(answer).expect("the picture is UTF-8");
    assert!(text.starts_with("<svg ") && text.trim_end().ends_with("</svg>"), "{text}");
    let mut open = Vec::new();
    for tag in text.split('<').skip(1) {
        let (tag, rest) = tag.split_once('>').unwrap_or_else(|| panic!("<{tag} does not end"));
        let name = tag.split([' ', '/']).find(|name| !name.is_empty()).unwrap_or_default();
        match (tag.starts_with('/'), tag.ends_with('/')) {
            (true, _) => assert_eq!(open.pop(), Some(name), "{text}"),
            (false, false) => open.push(name),
            (false, true) => {}
        }
        assert!(!rest.contains('>'), "{rest}");
        assert!(tag.split('"').step_by(2).all(|outside| !outside.contains("NaN") && !outside.contains("inf")), "{tag}");
        assert!(!tag.contains(" d=\"") || !tag.contains("NaN") && !tag.contains("inf"), "{tag}");
    }
    assert!(open.is_empty(), "{open:?} do not close");
    assert!(!text.contains(|c: char| c.is_control() && c != '\n' && c != '\t'), "a control character in {text:?}");
    let entity = |rest: &str| ["amp;", "lt;", "gt;", "quot;", "#39;"].iter().any(|name| rest.starts_with(name));
    assert!(text.split('&').skip(1).all(entity), "{text}");
}
