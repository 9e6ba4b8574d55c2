//! Lists of numbers and of points: taken from what is serialised, and written in one go.

use std::io::{self, Write};
use std::thread;

use serde::ser::{self, Impossible, Serialize, SerializeTuple};

use super::paper::{Paper, Stopped};
use super::shape::{Layout, Precision, Shape};
use super::writer::{Unwritten, not_finite, other, refuse, refuse_compounds};
use crate::core::work;

/// A number (0 columns), or the coordinates of a point.
#[derive(Debug, Clone, Copy, Default)]
pub struct Row {
    values: [f64; WIDEST],
    pub columns: usize,
}

/// The most coordinates of a point, with one to spare.
const WIDEST: usize = 4;

impl Row {
    /// What an entry of a list is, if it is a number or a point.
    #[inline]
    pub fn of<T: ?Sized + Serialize>(entry: &T) -> Option<Self> {
        entry.serialize(Take).ok()
    }

    /// How many numbers.
    pub fn width(&self) -> usize {
        self.columns.max(1)
    }
}

/// Numbers row by row.
#[derive(Debug)]
pub struct Numbers {
    columns: usize,
    values: Vec<f64>,
}

/// As many numbers as are worth another thread: their text takes some hundred microseconds, a thread some ten.
const WORTH: usize = 8_192;
/// What a number takes in JSON, mostly; with its comma.
const DIGITS: usize = 21;
/// Numbers whose bytes are copied at once.
const BLOCK: usize = 512;

fn check_finite(values: &[f64]) -> Result<(), Unwritten> {
    // Not `all`, which would end early: so the loop takes many at once.
    let finite = values.iter().fold(true, |finite, value| finite & value.is_finite());
    if finite { Ok(()) } else { Err(not_finite()) }
}

/// Writes the bytes of numbers; how many.
pub fn write_raw(first: Row, rows: impl Iterator<Item = Option<Row>>, precision: Precision, paper: &mut Paper) -> Result<usize, Unwritten> {
    let mut block = Block { values: [0.0; BLOCK + WIDEST], length: 0, bytes: [0; 8 * (BLOCK + WIDEST)] };
    block.push(first);
    let mut count = 0;
    for row in rows {
        block.push(row.map_or_else(other, Ok)?);
        if block.length >= BLOCK {
            count += block.length;
            block.write(precision, paper)?;
        }
    }
    count += block.length;
    block.write(precision, paper).map(|()| count)
}

/// Up to [`BLOCK`] numbers and a row.
struct Block {
    values: [f64; BLOCK + WIDEST],
    length: usize,
    bytes: [u8; 8 * (BLOCK + WIDEST)],
}

impl Block {
    /// All that a row may have is copied, and what it has counts: a copy of unknown length is a call.
    #[inline]
    fn push(&mut self, row: Row) {
        self.values[self.length..self.length + WIDEST].copy_from_slice(&row.values);
        self.length += row.width();
    }

    /// Writes them and is empty.
    fn write(&mut self, precision: Precision, paper: &mut Paper) -> Result<(), Unwritten> {
        let values = &mut self.values[..self.length];
        if precision != Precision::Full {
            values.iter_mut().for_each(|value| *value = precision.round(*value));
        }
        check_finite(values)?;
        let width = if precision == Precision::Single {
            self.bytes.as_chunks_mut().0.iter_mut().zip(values).for_each(|(to, value)| *to = (*value as f32).to_le_bytes());
            4
        } else {
            self.bytes.as_chunks_mut().0.iter_mut().zip(values).for_each(|(to, value)| *to = value.to_le_bytes());
            8
        };
        paper.write_all(&self.bytes[..width * self.length])?;
        self.length = 0;
        Ok(())
    }
}

impl Numbers {
    /// Takes a whole list, whose length may be known.
    pub fn gather(first: Row, rows: impl Iterator<Item = Option<Row>>) -> Result<Self, Unwritten> {
        let mut values = Vec::with_capacity((1 + rows.size_hint().0) * first.width() + WIDEST);
        for row in std::iter::once(Some(first)).chain(rows) {
            let row = row.map_or_else(other, Ok)?;
            let length = values.len() + row.width();
            // As in a block.
            values.extend_from_slice(&row.values);
            values.truncate(length);
        }
        Ok(Numbers { columns: first.columns, values })
    }

    /// How many numbers or points.
    fn rows(&self) -> usize {
        self.values.len() / self.columns.max(1)
    }

    /// Writes the list as JSON; a long one on several threads, each its part.
    pub fn write_json(&self, shape: Shape, paper: &mut Paper) -> Result<(), Unwritten> {
        paper.write_all(b"[")?;
        let width = self.columns.max(1);
        let hands = paper.hands().min(self.values.len() / WORTH);
        if hands < 2 {
            write_part(&self.values, self.columns, shape, paper)?;
            return paper.write_all(b"]").map_err(Unwritten::from);
        }
        let mut parts = self.values.chunks(self.rows().div_ceil(hands) * width);
        let first = parts.next().unwrap_or_default();
        let cancel = work::current();
        let write = |part: &[f64], paper: &mut Paper| work::run(&cancel, || write_part(part, self.columns, shape, paper));
        thread::scope(|scope| {
            let mut others = Vec::new();
            for part in parts {
                let mut own = paper.paid_sibling()?;
                let write = &write;
                let spawned = thread::Builder::new().spawn_scoped(scope, move || {
                    own.write_all(b",")?;
                    write(part, &mut own).map(|()| own.finish())
                });
                others.push(spawned.map_err(|_| io::Error::other(Stopped::NoRoom))?);
            }
            write(first, paper)?;
            for other in others {
                paper.append(other.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))?);
            }
            paper.write_all(b"]").map_err(Unwritten::from)
        })
    }
}

/// Whole rows, separated by commas.
fn write_part(values: &[f64], columns: usize, shape: Shape, paper: &mut Paper) -> Result<(), Unwritten> {
    paper.expect(values.len() * DIGITS)?;
    let width = if shape.layout == Layout::Nested { columns } else { 0 };
    let single = shape.precision == Precision::Single;
    let mut buffers: [zmij::Buffer; AT_ONCE] = std::array::from_fn(|_| zmij::Buffer::new());
    let (mut line, mut before, mut column) = (Line::default(), if width > 0 { OPEN } else { NOTHING }, 0);
    for values in values.chunks(AT_ONCE) {
        let mut rounded = [0.0; AT_ONCE];
        rounded.iter_mut().zip(values).for_each(|(to, value)| *to = shape.precision.round(*value));
        let values = &rounded[..values.len()];
        check_finite(values)?;
        let mut texts = [""; AT_ONCE];
        for ((text, buffer), value) in texts.iter_mut().zip(&mut buffers).zip(values) {
            *text = if single { buffer.format_finite(*value as f32) } else { buffer.format_finite(*value) };
        }
        for text in &texts[..values.len()] {
            line.put(before);
            line.put_number(text.as_bytes());
            column += 1;
            before = if column == width { NEXT } else { COMMA };
            column *= usize::from(column != width);
        }
        paper.write_all(&line.bytes[..line.length])?;
        line.length = 0;
    }
    paper.write_all(if width > 0 { b"]" } else { b"" }).map_err(Unwritten::from)
}

/// How many numbers are turned to text before their texts are copied: a text that is copied at once waits for its own stores.
const AT_ONCE: usize = 24;
/// The longest text of a number, -2.2250738585072014e-308.
const LONGEST: usize = 24;

/// What stands before a number, and how much of it counts.
type Before = (&'static [u8; 4], usize);
const NOTHING: Before = (b"    ", 0);
const OPEN: Before = (b"[   ", 1);
const COMMA: Before = (b",   ", 1);
const NEXT: Before = (b"],[ ", 3);

/// Text of numbers, copied in words of fixed size: where the compiler does not know the length, each copy is a call.
struct Line {
    bytes: [u8; AT_ONCE * (LONGEST + 4)],
    length: usize,
}

impl Default for Line {
    fn default() -> Self {
        Line { bytes: [0; AT_ONCE * (LONGEST + 4)], length: 0 }
    }
}

impl Line {
    #[inline]
    fn put(&mut self, (bytes, length): Before) {
        self.bytes[self.length..self.length + 4].copy_from_slice(bytes);
        self.length += length;
    }

    /// Copies the beginning and the end, which may overlap.
    #[inline]
    fn put_number(&mut self, text: &[u8]) {
        let to = &mut self.bytes[self.length..self.length + text.len()];
        let end = text.len().saturating_sub(8);
        if text.len() >= 16 {
            to[..16].copy_from_slice(&text[..16]);
            to[end..].copy_from_slice(&text[end..]);
        } else if text.len() >= 8 {
            to[..8].copy_from_slice(&text[..8]);
            to[end..].copy_from_slice(&text[end..]);
        } else {
            to.iter_mut().zip(text).for_each(|(to, byte)| *to = *byte);
        }
        self.length += text.len();
    }
}

/// Takes a number or a point; refuses anything else.
struct Take;

impl SerializeTuple for Row {
    type Ok = Row;
    type Error = Unwritten;

    #[inline]
    fn serialize_element<T: ?Sized + Serialize>(&mut self, value: &T) -> Result<(), Unwritten> {
        let number = value.serialize(Take)?;
        let to = self.values.get_mut(self.columns).map_or_else(other, Ok)?;
        *to = number.values[0];
        self.columns += 1;
        if number.columns == 0 { Ok(()) } else { other() }
    }

    #[inline]
    fn end(self) -> Result<Row, Unwritten> {
        Ok(self)
    }
}

impl ser::Serializer for Take {
    type Ok = Row;
    type Error = Unwritten;
    type SerializeSeq = Impossible<Row, Unwritten>;
    type SerializeTuple = Row;
    type SerializeStruct = Impossible<Row, Unwritten>;

    refuse_compounds!(Row);
    refuse! { Row; serialize_bool(bool) serialize_i8(i8) serialize_i16(i16) serialize_i32(i32) serialize_i64(i64) serialize_u8(u8)
    serialize_u16(u16) serialize_u32(u32) serialize_u64(u64) serialize_f32(f32) serialize_char(char) serialize_str(&str)
    serialize_bytes(&[u8]) serialize_none() serialize_unit() serialize_unit_struct(&'static str)
    serialize_unit_variant(&'static str, u32, &'static str) }

    #[inline]
    fn serialize_f64(self, value: f64) -> Result<Row, Unwritten> {
        Ok(Row { values: [value, 0.0, 0.0, 0.0], columns: 0 })
    }

    #[inline]
    fn serialize_some<T: ?Sized + Serialize>(self, value: &T) -> Result<Row, Unwritten> {
        value.serialize(self)
    }

    #[inline]
    fn serialize_newtype_struct<T: ?Sized + Serialize>(self, _: &'static str, value: &T) -> Result<Row, Unwritten> {
        value.serialize(self)
    }

    fn serialize_seq(self, _: Option<usize>) -> Result<Self::SerializeSeq, Unwritten> {
        other()
    }

    #[inline]
    fn serialize_tuple(self, _: usize) -> Result<Row, Unwritten> {
        Ok(Row::default())
    }

    fn serialize_struct(self, _: &'static str, _: usize) -> Result<Self::SerializeStruct, Unwritten> {
        other()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::http::budget::Budget;

    fn numbers(columns: usize, rows: usize) -> Numbers {
        let values = (0..rows * columns.max(1)).map(|i| (i as f64 * 0.7).sin() * 10f64.powi(i as i32 % 40 - 20)).collect();
        Numbers { columns, values }
    }

    fn written(numbers: &Numbers, shape: Shape, hands: usize) -> Vec<u8> {
        let budget = Budget::new(1 << 30, std::sync::Arc::default());
        let mut paper = Paper::new(&budget).with_hands(hands);
        numbers.write_json(shape, &mut paper).unwrap();
        paper.finish().concat()
    }

    #[test]
    fn a_list_is_what_serde_json_writes_however_many_write_it() {
        for rows in [1, 2, 3 * WORTH, 100_000] {
            let points = numbers(3, rows);
            let nested: Vec<&[f64]> = points.values.chunks(3).collect();
            let (nested, flat) = (serde_json::to_vec(&nested).unwrap(), serde_json::to_vec(&points.values).unwrap());
            for hands in [1, 2, 3, 7] {
                assert!(written(&points, Shape::default(), hands) == nested, "{rows} rows, {hands} hands");
                assert!(written(&points, Shape { layout: Layout::Flat, ..Shape::default() }, hands) == flat, "{rows} rows, {hands} hands");
                assert!(
                    written(&Numbers { columns: 0, ..numbers(3, rows) }, Shape::default(), hands) == flat,
                    "{rows} rows, {hands} hands"
                );
            }
        }
    }

    #[test]
    fn what_is_no_number_is_refused() {
        assert!(Row::of(&"text").is_none() && Row::of(&7u64).is_none());
        assert!(Row::of(&vec![1.0]).is_none() && Row::of(&[[1.0, 2.0]]).is_none() && Row::of(&[0.0; 5]).is_none());
        let point = Row::of(&[1.0, f64::INFINITY]).unwrap();
        assert_eq!((point.columns, point.values), (2, [1.0, f64::INFINITY, 0.0, 0.0]));
        let mut paper = Paper::new(&Budget::unlimited());
        for precision in [Precision::Full, Precision::Single] {
            assert!(write_raw(point, std::iter::empty(), precision, &mut paper).is_err());
            let numbers = Numbers::gather(point, std::iter::empty()).unwrap();
            assert!(numbers.write_json(Shape { precision, ..Shape::default() }, &mut paper).is_err());
        }
    }

    #[test]
    fn a_budget_that_is_spent_ends_a_list_of_many_hands() {
        let budget = Budget::new(0, std::sync::Arc::default());
        let mut paper = Paper::new(&budget).with_hands(2);
        assert!(numbers(3, 100_000).write_json(Shape::default(), &mut paper).is_err());
    }
}
