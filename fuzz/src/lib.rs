//! What holds for any bytes at all: one law for every operation, and one for the core. Each panics
//! where it does not hold.
//!
//! `cargo test --test service fuzz::` drives them with mutated examples, cargo-fuzz with whatever
//! reaches new code.

mod curve;

pub use curve::curve;

use serde_json::Value;
use springline::api::chunks::Buffer;
use springline::api::json::{from_bytes, to_bytes};
use springline::api::memory;
use springline::api::operations::{self, Operation, Output, OutputKind, Visitor};
use springline::api::output::Format;
use springline::api::problem::Problem;
use springline::core::context::Context;

/// What must hold for any body of an operation; whether the operation succeeds.
pub type Law = fn(&[u8]) -> bool;

struct Laws;

impl Visitor for Laws {
    type Made = (&'static str, Law);

    fn visit<O: Operation>(&self) -> Self::Made {
        (O::PATH, holds::<O>)
    }
}

/// The law of every operation, with its path.
pub fn laws() -> Vec<(&'static str, Law)> {
    operations::each(&Laws)
}

type Outcome = Result<Vec<u8>, Problem>;

fn holds<O: Operation>(body: &[u8]) -> bool {
    let run = |body: &[u8]| {
        written(&O::compute(&Context::default(), from_bytes(&Context::default(), body)?)?)
    };
    let printed = from_bytes::<O::Request>(&Context::default(), body)
        .map(|request| to_bytes(&request).expect("a request that was read can be written"));
    let outcome = run(body);
    // Asked again, and where there is a request, in other words.
    let again = run(printed.as_deref().unwrap_or(body));
    assert_eq!(seen(&outcome), seen(&again), "the same request, another answer");
    match &outcome {
        Ok(answer) if O::Answer::KIND == OutputKind::Picture => is_svg(answer),
        Ok(answer) => is_json(answer),
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
    assert!(
        problem["code"]
            .as_str()
            .is_some_and(|code| problem["type"] == format!("urn:springline:problem:{code}")),
        "{problem}"
    );
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

fn written(answer: &impl Output) -> Outcome {
    let mut buffer = Buffer::new(&Context::default(), &memory::unlimited());
    answer.write(Format::default(), &mut buffer).map(|()| buffer.finish().concat())
}

/// Elements open and close, nothing of the request escapes into the markup, and every number is
/// one.
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
        assert!(
            tag.split('"')
                .step_by(2)
                .all(|outside| !outside.contains("NaN") && !outside.contains("inf")),
            "{tag}"
        );
        assert!(!tag.contains(" d=\"") || !tag.contains("NaN") && !tag.contains("inf"), "{tag}");
    }
    assert!(open.is_empty(), "{open:?} do not close");
    assert!(
        !text.contains(|c: char| c.is_control() && c != '\n' && c != '\t'),
        "a control character in {text:?}"
    );
    let entity = |rest: &str| {
        ["amp;", "lt;", "gt;", "quot;", "#39;"].iter().any(|name| rest.starts_with(name))
    };
    assert!(text.split('&').skip(1).all(entity), "{text}");
}
