//! One line of a batch.

use std::borrow::Cow;
use std::fmt;

use crate::api::problem::Status;
use crate::api::sentences;
use crate::core::context::Context;
use serde::de::{self, Deserializer, MapAccess, Unexpected, Visitor};
use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;

use crate::api::json;
use crate::api::problem::Problem;
use crate::api::wire::{Read, Reading, refuse, set_by, tolerant};

/// A line: which operation, its request, and what the client calls it.
#[derive(Debug, Default)]
pub struct Line<'a> {
    /// What the client calls it.
    pub id: Option<Id>,
    /// The name of the operation.
    pub op: Option<Cow<'a, str>>,
    /// Its request.
    pub body: Option<&'a RawValue>,
}

/// What a client calls a line: text or a whole number.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Id {
    /// A whole number.
    Number(i64),
    /// Text.
    Text(String),
}

const FIELDS: &[&str] = &["id", "op", "body"];
/// What every refusal of a line ends with.
const FORM: &str = "a line is {\"id\": text or whole number, \"op\": name, \"body\": the request}";

/// Why a line is refused, with its name as far as it could be read.
pub type Refusal = (Option<Id>, Box<Problem>);

impl<'a> Line<'a> {
    /// Reads a line.
    ///
    /// # Errors
    /// Not JSON; not an object; fields that are missing, unknown, repeated or of another type.
    pub fn read(
        context: &Context,
        text: &'a [u8],
        number: usize,
        max_depth: usize,
    ) -> Result<(Option<Id>, Cow<'a, str>, &'a RawValue), Refusal> {
        json::check_depth(text, max_depth).map_err(|problem| (None, problem.into()))?;
        let reading = Reading::new(context);
        match reading.from_slice(text) {
            Ok(Line { id, op: Some(op), body: Some(body) }) => Ok((id, op, body)),
            _ => Err(explain(&reading, text, number)),
        }
    }
}

fn explain(reading: &Reading, text: &[u8], number: usize) -> Refusal {
    let cut = match serde_json::from_slice::<&RawValue>(text) {
        Ok(cut) => cut,
        Err(error) => {
            let detail = format!(
                "{}; {FORM}",
                sentences::in_json_terms(&error).replace("the body ends", "the line ends")
            );
            let problem =
                Problem::new(Status::BAD_REQUEST, "not_json", "The line is not JSON", detail);
            return (None, problem.with_position(number, error.column().max(1)).into());
        }
    };
    let (line, mut misfits, _) = tolerant::read::<Line>(reading, cut);
    let line = line.unwrap_or_default();
    let is_object = cut.get().starts_with('{');
    for (name, is_there) in [("op", line.op.is_some()), ("body", line.body.is_some())] {
        let is_wrong = misfits.iter().any(|misfit| {
            misfit.pointer == format!("/{name}") || misfit.meant.as_deref() == Some(name)
        });
        if is_object && !is_there && !is_wrong {
            misfits.push(tolerant::Misfit::missing(name));
        }
    }
    let first = misfits.first().map_or("", |misfit| misfit.detail.as_str());
    let lead = Problem::new(
        Status::BAD_REQUEST,
        "bad_line",
        "The line is not an operation",
        format!("{first}; {FORM}"),
    );
    (line.id, lead.with_faults(misfits.into_iter().map(Into::into).collect()).into())
}

impl<'de: 'a, 'a> Read<'de> for Line<'a> {
    fn read<D: Deserializer<'de>>(reading: &Reading, deserializer: D) -> Result<Self, D::Error> {
        struct LineVisitor<'r>(&'r Reading<'r>);
        impl<'de> Visitor<'de> for LineVisitor<'_> {
            type Value = Line<'de>;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("an object with the fields `id`, `op` and `body`")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Line<'de>, A::Error> {
                let mut line = Line::default();
                while let Some(Text(key)) = map.next_key()? {
                    match &*key {
                        "id" => set_by(self.0, &mut line.id, "id", &mut map, A::next_value)?,
                        "op" => set_by(self.0, &mut line.op, "op", &mut map, |map| {
                            map.next_value().map(|Text(op)| op)
                        })?,
                        "body" => set_by(self.0, &mut line.body, "body", &mut map, A::next_value)?,
                        _ => refuse(self.0, &mut map, &key, FIELDS)?,
                    }
                }
                Ok(line)
            }
        }
        deserializer.deserialize_map(LineVisitor(reading))
    }
}

/// Text, of the line itself where it has no escapes.
struct Text<'a>(Cow<'a, str>);

impl<'de: 'a, 'a> Deserialize<'de> for Text<'a> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct TextVisitor;
        impl<'de> Visitor<'de> for TextVisitor {
            type Value = Text<'de>;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a string")
            }

            fn visit_borrowed_str<E: de::Error>(self, text: &'de str) -> Result<Text<'de>, E> {
                Ok(Text(Cow::Borrowed(text)))
            }

            fn visit_str<E: de::Error>(self, text: &str) -> Result<Text<'de>, E> {
                Ok(Text(Cow::Owned(text.to_owned())))
            }
        }
        deserializer.deserialize_str(TextVisitor)
    }
}

impl<'de> Deserialize<'de> for Id {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct IdVisitor;
        impl Visitor<'_> for IdVisitor {
            type Value = Id;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("text, or a whole number of at most 64 bits")
            }

            fn visit_i64<E: de::Error>(self, number: i64) -> Result<Id, E> {
                Ok(Id::Number(number))
            }

            fn visit_u64<E: de::Error>(self, number: u64) -> Result<Id, E> {
                i64::try_from(number)
                    .map(Id::Number)
                    .map_err(|_| E::invalid_value(Unexpected::Unsigned(number), &self))
            }

            fn visit_str<E: de::Error>(self, text: &str) -> Result<Id, E> {
                Ok(Id::Text(text.to_owned()))
            }
        }
        deserializer.deserialize_any(IdVisitor)
    }
}
