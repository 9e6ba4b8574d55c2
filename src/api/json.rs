//! Bytes to requests, answers to bytes.

use std::io;

use crate::api::problem::Status;
use serde_json::value::RawValue;

use crate::api::chunks::{Buffer, Stopped};
use crate::api::error::{Error, Fault};
use crate::api::memory;
use crate::api::output::Format;
use crate::api::problem::{FoundFault, Problem};
use crate::api::reader;
use crate::api::sentences::in_json_terms;
use crate::api::wire::rank::ranks;
use crate::api::wire::tolerant::{self as tolerant, Misfit};
use crate::api::wire::{Read, Reading};
use crate::api::writer::{self, Written};
use crate::core;
use crate::core::context::Context;

/// What the body of an operation is.
pub trait Request: for<'de> Read<'de> {
    /// Checks every part by itself, as far as it is there.
    ///
    /// # Errors
    /// What is wrong with the parts; nothing is computed.
    fn check(self, context: &Context) -> Result<(), Error>;
}

/// Reads a request of JSON alone.
///
/// # Errors
/// As [`read`].
pub fn from_bytes<T: Request>(context: &Context, body: &[u8]) -> Result<T, Problem> {
    read(&Reading::new(context), body)
}

/// Reads a request.
///
/// # Errors
/// A problem with status 400, a pointer to each value at fault, and line and column of the first.
pub fn read<T: Request>(reading: &Reading, body: &[u8]) -> Result<T, Problem> {
    let context = reading.context();
    // The fast ways end at the first fault and do not know its place; only then the body is read
    // again.
    if let Ok(request) = reader::read(reading, body) {
        return Ok(request);
    }
    context.checkpoint()?;
    reading.from_slice(body).or_else(|error| {
        context.checkpoint()?;
        let problem = explain::<T>(reading, body, &error);
        context.checkpoint()?;
        Err(problem)
    })
}

fn explain<T: Request>(reading: &Reading, body: &[u8], error: &serde_json::Error) -> Problem {
    if body.trim_ascii().is_empty() {
        return not_json("the body is empty; send a JSON object").with_position(1, 1);
    }
    if body.starts_with("\u{feff}".as_bytes()) {
        return not_json("the body starts with a byte order mark; leave it out")
            .with_position(1, 1);
    }
    let text: &RawValue = match serde_json::from_slice(body) {
        Ok(text) => text,
        // The first reader stopped where the text breaks, or at a fault before.
        Err(later) => return broken(if error.is_data() { &later } else { error }),
    };
    let (request, misfits, count) = tolerant::read::<T>(reading, text);
    if misfits.is_empty() {
        return broken(error);
    }
    let semantic = request
        .and_then(|request| request.check(reading.context()).err())
        .map_or(Vec::new(), Error::each);
    let semantic: Vec<Error> =
        semantic.into_iter().filter(|error| !depends_on(error, &misfits)).collect();
    let total = count + semantic.len();
    let faults =
        misfits.into_iter().map(FoundFault::from).chain(semantic.into_iter().map(FoundFault::from));
    Problem::of_all(in_order(faults.collect(), text), total)
        .with_position(error.line(), error.column().max(1))
}

/// What the text itself breaks.
fn broken(error: &serde_json::Error) -> Problem {
    not_json(&in_json_terms(error)).with_position(error.line(), error.column().max(1))
}

fn not_json(detail: &str) -> Problem {
    Problem::at(
        Status::BAD_REQUEST,
        "not_json",
        "The body is not JSON",
        String::new(),
        detail.into(),
    )
}

/// Whether a fault of the mathematics only follows from values that could not be read.
fn depends_on(error: &Error, misfits: &[Misfit]) -> bool {
    let place = error.place.to_string();
    let inside = |pointer: &str, of: &str| {
        pointer.strip_prefix(of).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
    };
    let (Fault::Missing { field } | Fault::MissingTag { field, .. }) = &error.fault else {
        return misfits.iter().any(|misfit| inside(&misfit.pointer, &place));
    };
    // A field that is there but wrong is not missing, and neither is one whose name is misspelt.
    let is_it = |misfit: &Misfit, name: &str| {
        let parent = misfit.pointer.rsplit_once('/').map_or("", |(parent, _)| parent);
        inside(&misfit.pointer, &format!("{place}/{name}"))
            || (misfit.meant.as_deref() == Some(name) && parent == place)
    };
    misfits.iter().any(|misfit| field.split("` or `").any(|name| is_it(misfit, name)))
}

/// The faults in the order in which their values stand in the text; what is missing, where the
/// object that lacks it ends.
fn in_order(faults: Vec<FoundFault>, text: &RawValue) -> Vec<FoundFault> {
    let pointers: Vec<String> = faults.iter().map(|fault| fault.pointer().to_owned()).collect();
    let ranks = ranks(text, &pointers);
    let mut order: Vec<usize> = (0..faults.len()).collect();
    order.sort_by_key(|&i| if faults[i].is_absence() { ranks[i].end } else { ranks[i].start });
    let mut taken: Vec<Option<FoundFault>> = faults.into_iter().map(Some).collect();
    order.into_iter().filter_map(|i| taken[i].take()).collect()
}

/// The problem of an operation that failed, its faults in the order of the body.
pub fn refused(error: Error, body: &[u8]) -> Problem {
    let faults: Vec<FoundFault> = error.each().into_iter().map(FoundFault::from).collect();
    let total = faults.len();
    match serde_json::from_slice(body) {
        Ok(text) if total > 1 => Problem::of_all(in_order(faults, text), total),
        _ => Problem::of_all(faults, total),
    }
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
    Err(Problem::at(
        Status::PAYLOAD_TOO_LARGE,
        "too_large",
        "Beyond a limit",
        String::new(),
        detail,
    ))
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
/// [`Overflow`](core::fault::Fault::Overflow) where a number is infinite or not a number: JSON has
/// neither, and `null` is no number. What [`not_written`] says where the buffer ends.
pub fn write(answer: &impl Written, format: Format, buffer: &mut Buffer) -> Result<(), Problem> {
    writer::write(answer, format, buffer).map_err(|error| not_written(error.0))
}

/// The same in one piece, for whoever sends it nowhere.
///
/// # Errors
/// [`Overflow`](core::fault::Fault::Overflow), as [`write()`].
pub fn to_bytes(answer: &impl Written) -> Result<Vec<u8>, Problem> {
    let mut buffer = Buffer::new(&Context::default(), &memory::unlimited());
    write(answer, Format::default(), &mut buffer).map(|()| buffer.finish().concat())
}

/// Why a text could not be written to its end.
pub fn not_written(error: io::Error) -> Problem {
    match error.get_ref().and_then(|error| error.downcast_ref()) {
        Some(Stopped::NoRoom) => Problem::overloaded("the memory for bodies and answers is in use"),
        Some(Stopped::Cancelled) => Error::from(core::fault::Fault::Cancelled).into(),
        None => Error::from(core::fault::Fault::Overflow).into(),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;
    use crate::api::operations::interpolate::InterpolateRequest;
    use crate::core::cancellation::Cancellation;

    fn written(numbers: &[f64]) -> Result<Vec<u8>, Problem> {
        let mut buffer = Buffer::new(&Context::default(), &memory::limited(0));
        write(&numbers.to_vec(), Format::default(), &mut buffer).map(|()| buffer.finish().concat())
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

    /// How often reading a good request asks whether anybody waits for it.
    fn asked(body: &str) -> usize {
        let asked = Arc::new(AtomicUsize::new(0));
        let counter = asked.clone();
        let cancellation = Cancellation::when(move || {
            counter.fetch_add(1, Ordering::Relaxed);
            false
        });
        let context = Context::until(&cancellation);
        assert!(from_bytes::<InterpolateRequest>(&context, body.as_bytes()).is_ok());
        asked.load(Ordering::Relaxed)
    }

    #[test]
    fn reading_again_asks_as_often_as_reading_once() {
        let points = vec!["[1,2]"; 6_400].join(",");
        let fast = asked(&format!(r#"{{"report":"full","points":[{points}]}}"#));
        // The fast reader gives up at the escape, before it has read a point.
        let again = asked(&format!(r#"{{"report":"\u0066ull","points":[{points}]}}"#));
        assert!(fast >= 100, "{fast}");
        assert!(again >= fast, "{again} < {fast}");
    }

    #[test]
    fn brackets_in_strings_are_no_depth() {
        assert_eq!(depth(br#"{"a\"[[[": [[1], 2], "b\\": {}}"#), 3);
        assert!(check_depth(b"[[[]]]", 3).is_ok());
        assert!(check_depth(b"[[[]]]", 2).is_err());
    }
}
