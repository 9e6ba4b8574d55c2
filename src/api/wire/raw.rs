//! Requests in the raw format (see [`crate::api::output`]): lists of numbers and of points may
//! stand after the header.

use crate::api::problem::Status;
use bytes::Bytes;
use serde::de::{Deserializer, Error as _, MapAccess, Visitor};

use crate::api::output::{MAGIC, PREFIX};
use crate::api::problem::Problem;
use crate::api::wire::length::{ITEMS, too_long};
use crate::api::wire::reading::Reading;
use crate::core::point::Point;

/// Header and numbers of a raw request.
///
/// # Errors
/// Status 400: not the raw format.
pub fn split(body: &Bytes) -> Result<(&[u8], Bytes), Problem> {
    let (header, numbers) = parts(body).ok_or_else(|| {
        let detail =
            "the body is not in the raw format: it begins with 16 bytes, which are the magic SPRLINE1, the length of the header and zeros; \
             the header, which is JSON, and then numbers of 8 bytes follow";
        Problem::new(Status::BAD_REQUEST, "not_raw", "The body is not in the raw format", detail)
    })?;
    Ok((header, body.slice_ref(numbers)))
}

fn parts(body: &[u8]) -> Option<(&[u8], &[u8])> {
    let (prefix, rest) = body.split_at_checked(PREFIX)?;
    let length = u32::from_le_bytes(prefix[8..12].try_into().ok()?);
    let (header, numbers) = rest.split_at_checked(usize::try_from(length).ok()?)?;
    (prefix.starts_with(MAGIC) && prefix[12..] == [0; 4]).then_some((header, numbers))
}

/// Reads a list: an array, and in a raw request also what stands for one.
pub fn deserialize_list<'de, D: Deserializer<'de>, V: Visitor<'de>>(
    reading: &Reading,
    deserializer: D,
    visitor: V,
) -> Result<V::Value, D::Error> {
    let is_raw = reading.numbers().is_some();
    if is_raw {
        deserializer.deserialize_any(visitor)
    } else {
        deserializer.deserialize_seq(visitor)
    }
}

/// Numbers in rows.
#[derive(Clone)]
pub struct Rows {
    bytes: Bytes,
    columns: usize,
}

/// What `{"$f64": [start, rows, columns]}` stands for.
///
/// # Errors
/// Another object; numbers that are not there.
pub fn rows<'de, A: MapAccess<'de>>(reading: &Reading, mut map: A) -> Result<Rows, A::Error> {
    let key: Option<String> = map.next_key()?;
    if key.as_deref() != Some("$f64") {
        return Err(A::Error::custom(
            "expected an array, or an object of the form {\"$f64\": [start, rows, columns]}",
        ));
    }
    let [start, rows, columns]: [usize; 3] = map.next_value()?;
    if map.next_key::<String>()?.is_some() {
        return Err(A::Error::custom("an object with `$f64` has no other field"));
    }
    if rows > ITEMS {
        return Err(too_long());
    }
    let from = start.checked_mul(8);
    let to = rows
        .checked_mul(columns.max(1))
        .and_then(|count| count.checked_mul(8))
        .and_then(|length| from?.checked_add(length));
    let held = reading.numbers().cloned().unwrap_or_default();
    match from.zip(to) {
        Some((from, to)) if to <= held.len() => Ok(Rows { bytes: held.slice(from..to), columns }),
        _ => Err(A::Error::custom(beyond(held.len() / 8, (start, rows, columns)))),
    }
}

/// Why numbers are not there.
fn beyond(held: usize, (start, rows, columns): (usize, usize, usize)) -> String {
    let numbers = if held == 1 { "number follows" } else { "numbers follow" };
    let wanted = if columns == 0 {
        format!("{rows} numbers")
    } else {
        format!("{rows} rows of {columns} numbers")
    };
    format!(
        "{wanted} from number {start} on are asked for, but {held} {numbers} the header; the first of them is number 0"
    )
}

impl Rows {
    /// Why they are not what was expected.
    pub fn misfit(&self, expected: &str) -> String {
        match self.all().position(|number| !number.is_finite()) {
            Some(i) => format!("number {i} of these is infinite or not a number; JSON has neither"),
            None => format!("these numbers have {} columns; expected {expected}", self.columns),
        }
    }

    fn all(&self) -> impl Iterator<Item = f64> {
        self.bytes.as_chunks().0.iter().map(|bytes| f64::from_le_bytes(*bytes))
    }

    /// Plain numbers, if they are finite; infinities cannot be written in JSON either.
    pub fn numbers(&self) -> Option<Vec<f64>> {
        let fits = self.columns == 0 && self.all().all(f64::is_finite);
        fits.then(|| self.all().collect())
    }

    /// Points, if they have as many coordinates.
    pub fn points<const D: usize>(&self) -> Option<Vec<Point<D>>> {
        let fits = self.columns == D && self.all().all(f64::is_finite);
        let point = |row: &[[u8; 8]]| Point(std::array::from_fn(|i| f64::from_le_bytes(row[i])));
        fits.then(|| self.bytes.as_chunks().0.chunks_exact(D).map(point).collect())
    }
}
