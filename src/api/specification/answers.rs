//! Examples of answers: what the operations answer to the examples of requests.

use crate::api::operations::TABLE;
use crate::api::problem::Status;
use crate::core::context::Context;
use serde_json::{Value, json};
use utoipa::openapi::example::ExampleBuilder;
use utoipa::openapi::{Content, OpenApi, RefOr};

use crate::api::chunks::Buffer;
use crate::api::memory::{self};
use crate::api::operations;
use crate::api::output::{Format, Precision};
use crate::api::problem::Problem;

/// Longer answers are not shown.
const LONGEST: usize = 6 * 1024;
/// Enough digits to show what a number is.
const DIGITS: u8 = 6;

/// Shows what each operation answers to its examples, and to a request that is refused.
pub fn show(api: &mut OpenApi) {
    for entry in TABLE {
        let (name, examples) = (entry.name(), entry.examples);
        let Some(operation) = super::posted(api, entry.path) else { continue };
        if let Some(content) =
            super::answer(operation, "200").and_then(|answer| super::content(answer, super::JSON))
        {
            for example in examples {
                let text = answered(name, example.body.as_bytes()).unwrap_or_default();
                if let Some(mut value) =
                    (text.len() <= LONGEST).then(|| serde_json::from_slice(&text).ok()).flatten()
                {
                    quieten(&mut value);
                    add(
                        content,
                        example.name,
                        &format!("{}: rounded to 6 digits, and below 1e-12 to 0", example.summary),
                        value,
                    );
                }
            }
        }
        let refused = examples.first().and_then(|example| refused(name, example.body));
        let content = super::answer(operation, "422")
            .and_then(|answer| super::content(answer, "application/problem+json"));
        if let Some((content, problem)) = content.zip(refused) {
            add(
                content,
                "refused",
                "A request that is JSON of the right shape, and yet cannot be answered",
                problem,
            );
        }
    }
}

/// Numbers that are nothing but rounding errors are not worth showing, and no two versions of the
/// service have the same.
fn quieten(value: &mut Value) {
    match value {
        Value::Number(number)
            if number.as_f64().is_some_and(|number| number != 0.0 && number.abs() < 1e-12) =>
        {
            *value = json!(0.0)
        }
        Value::Array(items) => items.iter_mut().for_each(quieten),
        Value::Object(fields) => fields.values_mut().for_each(quieten),
        _ => {}
    }
}

fn add(content: &mut Content, name: &str, summary: &str, value: Value) {
    let shown = ExampleBuilder::new().summary(summary).value(Some(value)).build();
    content.examples.insert(name.into(), RefOr::T(shown));
}

fn answered(name: &str, body: &[u8]) -> Result<Vec<u8>, Problem> {
    let mut buffer = Buffer::new(&Context::default(), &memory::unlimited());
    let format = Format { precision: Precision::Digits(DIGITS), ..Format::default() };
    let answer = operations::named(name).ok_or_else(Problem::internal)?;
    (answer.answer)(&Context::default(), body, format, &mut buffer)
        .map(|()| buffer.finish().concat())
}

/// The problem of an example that has been cut short.
fn refused(name: &str, body: &str) -> Option<Value> {
    let mut wrong: Value = serde_json::from_str(body).ok()?;
    if name == "basis" {
        wrong["order"] = json!(0);
    }
    cut_short(&mut wrong);
    let problem = answered(name, wrong.to_string().as_bytes()).err()?;
    let value = serde_json::to_value(&problem).ok()?;
    (value["status"] == Status::UNPROCESSABLE_ENTITY.0).then_some(value)
}

/// Leaves one point of the first list of points.
fn cut_short(value: &mut Value) -> bool {
    match value {
        Value::Object(fields) => fields.iter_mut().any(|(key, field)| match field {
            Value::Array(points)
                if ["points", "control_points", "control_net"].contains(&key.as_str()) =>
            {
                points.truncate(1);
                true
            }
            other => cut_short(other),
        }),
        Value::Array(items) => items.iter_mut().any(cut_short),
        _ => false,
    }
}
