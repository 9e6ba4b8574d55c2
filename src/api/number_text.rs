//! Lists of numbers and of points, written in one go.

use std::io::{self, Write};

use crate::api::chunks::{Buffer, Stopped};
use crate::api::output::{Format, Layout, Precision};
use crate::api::rounded::{Block, LANES, ROOM, Rounding};
use crate::api::side::{Part, Run};
use crate::api::unwritten::{Unwritten, not_finite};
use crate::core::linear::lanes::are_finite;

/// Numbers row by row.
#[derive(Debug, Clone, Copy)]
pub struct Numbers<'a> {
    /// How many are in a row: the coordinates of a point; 0 for plain numbers.
    pub columns: usize,
    /// Row after row.
    pub values: &'a [f64],
}

/// As many numbers as are worth a part of their own: their text takes some hundred microseconds, a
/// thread some ten.
const WORTH: usize = 8_192;
/// What a number takes in JSON, mostly; with its comma.
const DIGITS: usize = 21;
/// Numbers whose bytes are written at once.
const BLOCK: usize = 4_096;

fn check_finite(values: &[f64]) -> Result<(), Unwritten> {
    if are_finite(values) { Ok(()) } else { Err(not_finite()) }
}

// The raw format is little-endian, and lists are sent as they are in memory.
const _: () = assert!(cfg!(target_endian = "little"));

impl Numbers<'_> {
    /// How many numbers or points.
    pub fn rows(&self) -> usize {
        self.values.len() / self.columns.max(1)
    }

    /// Writes the bytes of the numbers.
    pub fn write_raw(&self, precision: Precision, buffer: &mut Buffer) -> Result<(), Unwritten> {
        let width =
            if precision == Precision::Single { size_of::<f32>() } else { size_of::<f64>() };
        buffer.reserve(self.values.len() * width)?;
        let mut rounded = Vec::new();
        for values in self.values.chunks(BLOCK) {
            let values = precision.round_all(values, &mut rounded);
            check_finite(values)?;
            if precision == Precision::Single {
                let singles: Vec<f32> = values.iter().map(|value| *value as f32).collect();
                buffer.write_all(bytemuck::cast_slice(&singles))?;
            } else {
                buffer.write_all(bytemuck::cast_slice(values))?;
            }
        }
        Ok(())
    }

    /// Writes the list as JSON; a long one in several parts at once, where the buffer allows.
    pub fn write_json(
        &self,
        format: Format,
        number_text: &mut NumberText,
        buffer: &mut Buffer,
    ) -> Result<(), Unwritten> {
        buffer.write_all(b"[")?;
        let worth = self.values.len() / WORTH;
        match buffer.side() {
            Some(side) if worth > 1 => {
                self.write_parts(side.parts.min(worth), side.run, format, number_text, buffer)?;
            }
            _ => number_text.write(*self, format, buffer)?,
        }
        buffer.write_all(b"]").map_err(Unwritten::from)
    }

    /// The first part goes to the buffer, each other to one of its own, which is then added.
    fn write_parts(
        &self,
        parts: usize,
        run: Run,
        format: Format,
        number_text: &mut NumberText,
        buffer: &mut Buffer,
    ) -> Result<(), Unwritten> {
        let part = |values| Numbers { values, ..*self };
        let size = self.rows().div_ceil(parts) * self.columns.max(1);
        let mut parts = self.values.chunks(size).map(part);
        let first = parts.next().unwrap_or(part(&[]));
        let own = |part| buffer.paid_sibling().map(|own| (part, own, Ok(())));
        let mut others = parts.map(own).collect::<io::Result<Vec<_>>>()?;
        let mut written = Ok(());
        let write_first = || written = number_text.write(first, format, buffer);
        let mut jobs: Vec<Part> = vec![Box::new(write_first)];
        for (part, own, written) in &mut others {
            jobs.push(Box::new(move || *written = write_other(*part, format, own)));
        }
        run(jobs).map_err(|_| io::Error::other(Stopped::NoRoom))?;
        written?;
        for (_, own, written) in others {
            written?;
            buffer.append(own.finish());
        }
        Ok(())
    }
}

/// A part that is not the first, with the comma before it.
fn write_other(part: Numbers, format: Format, own: &mut Buffer) -> Result<(), Unwritten> {
    own.write_all(b",")?;
    NumberText::default().write(part, format, own)
}

/// What it takes to turn numbers to text; made once for many lists.
pub struct NumberText {
    texts: [zmij::Buffer; AT_ONCE],
    block: Block,
    line: Line,
}

impl Default for NumberText {
    fn default() -> Self {
        NumberText {
            texts: std::array::from_fn(|_| zmij::Buffer::new()),
            block: Block::default(),
            line: Line::new(),
        }
    }
}

impl NumberText {
    /// Whole rows, separated by commas.
    fn write(
        &mut self,
        numbers: Numbers,
        format: Format,
        buffer: &mut Buffer,
    ) -> Result<(), Unwritten> {
        buffer.reserve(numbers.values.len() * DIGITS)?;
        let mut commas =
            Commas::of(if format.layout == Layout::Nested { numbers.columns } else { 0 });
        for values in numbers.values.chunks(AT_ONCE) {
            check_finite(values)?;
            match format.precision {
                Precision::Full => self.write_shortest(values, &mut commas, |value| value),
                Precision::Single => {
                    let singles = values.iter().all(|value| (*value as f32).is_finite());
                    singles
                        .then(|| self.write_shortest(values, &mut commas, |value| value as f32))
                        .ok_or_else(not_finite)?;
                }
                Precision::Digits(digits) => {
                    self.write_rounded(values, &mut commas, Rounding::to(digits))
                        .ok_or_else(not_finite)?;
                }
            }
            buffer.write_all(&self.line.bytes[..self.line.length])?;
            self.line.length = 0;
        }
        buffer.write_all(if commas.width > 0 { b"]" } else { b"" }).map_err(Unwritten::from)
    }

    /// The shortest texts that parse back to the same numbers, all of which are finite.
    #[inline]
    fn write_shortest<F: zmij::Float>(
        &mut self,
        values: &[f64],
        commas: &mut Commas,
        convert: fn(f64) -> F,
    ) {
        let mut texts = [""; AT_ONCE];
        for ((text, buffer), value) in texts.iter_mut().zip(&mut self.texts).zip(values) {
            *text = buffer.format_finite(convert(*value));
        }
        for text in &texts[..values.len()] {
            self.line.put(commas.next());
            self.line.put_number(text.as_bytes());
        }
    }

    /// Rounded texts, or nothing where a number becomes too large.
    fn write_rounded(
        &mut self,
        values: &[f64],
        commas: &mut Commas,
        rounding: Rounding,
    ) -> Option<()> {
        self.block.round(rounding, values);
        for (i, value) in values.iter().enumerate() {
            self.line.put(commas.next());
            let room = &mut self.line.bytes[self.line.length..];
            self.line.length += self.block.write(rounding, i, *value, room)?;
        }
        Some(())
    }
}

/// How many numbers are turned to text before their texts are copied: a text that is copied at once
/// waits for its own stores.
const AT_ONCE: usize = LANES;
/// The longest text of a number, -2.2250738585072014e-308.
const LONGEST: usize = 24;

/// What stands before a number, and how much of it counts.
type Before = (&'static [u8; 4], usize);
const NOTHING: Before = (b"    ", 0);
const OPEN: Before = (b"[   ", 1);
const COMMA: Before = (b",   ", 1);
const NEXT: Before = (b"],[ ", 3);

/// What separates numbers.
struct Commas {
    /// How many numbers are in a row; 0 for plain numbers.
    width: usize,
    column: usize,
    before: Before,
}

impl Commas {
    fn of(width: usize) -> Self {
        Commas { width, column: 0, before: if width > 0 { OPEN } else { NOTHING } }
    }

    /// What stands before the next number.
    #[inline]
    fn next(&mut self) -> Before {
        self.column += 1;
        let ends = self.column == self.width;
        self.column *= usize::from(!ends);
        std::mem::replace(&mut self.before, if ends { NEXT } else { COMMA })
    }
}

/// Text of numbers, copied in words of fixed size: where the compiler does not know the length,
/// each copy is a call.
struct Line {
    bytes: [u8; AT_ONCE * (LONGEST + 4) + ROOM],
    length: usize,
}

impl Line {
    fn new() -> Self {
        Line { bytes: [0; AT_ONCE * (LONGEST + 4) + ROOM], length: 0 }
    }

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::api::memory::{self, NoRoom};
    use crate::core::context::Context;

    /// One after the other, the last first.
    fn backwards(parts: Vec<Part>) -> Result<(), NoRoom> {
        parts.into_iter().rev().for_each(|part| part());
        Ok(())
    }

    fn values(count: usize) -> Vec<f64> {
        (0..count).map(|i| (i as f64 * 0.7).sin() * 10f64.powi(i as i32 % 40 - 20)).collect()
    }

    fn written(columns: usize, values: &[f64], format: Format, parts: usize) -> Vec<u8> {
        let budget = memory::limited(1 << 30);
        let mut buffer = Buffer::new(&Context::default(), &budget).side_by_side(parts, backwards);
        Numbers { columns, values }
            .write_json(format, &mut NumberText::default(), &mut buffer)
            .unwrap();
        buffer.finish().concat()
    }

    #[test]
    fn a_list_is_what_serde_json_writes_in_however_many_parts() {
        for rows in [1, 2, 3 * WORTH, 100_000] {
            let values = values(3 * rows);
            let nested: Vec<&[f64]> = values.chunks(3).collect();
            let (nested, flat) =
                (serde_json::to_vec(&nested).unwrap(), serde_json::to_vec(&values).unwrap());
            for parts in [1, 2, 3, 7] {
                let flattened = Format { layout: Layout::Flat, ..Format::default() };
                assert!(
                    written(3, &values, Format::default(), parts) == nested,
                    "{rows} rows, {parts} parts"
                );
                assert!(
                    written(3, &values, flattened, parts) == flat,
                    "{rows} rows, {parts} parts"
                );
                assert!(
                    written(0, &values, Format::default(), parts) == flat,
                    "{rows} rows, {parts} parts"
                );
            }
        }
    }

    #[test]
    fn what_is_not_finite_is_refused() {
        let mut buffer = Buffer::new(&Context::default(), &memory::unlimited());
        for (precision, value) in [
            (Precision::Full, f64::INFINITY),
            (Precision::Full, f64::NAN),
            (Precision::Single, 1e39),
        ] {
            let numbers = Numbers { columns: 2, values: &[1.0, value] };
            assert!(numbers.write_raw(precision, &mut buffer).is_err());
            assert!(
                numbers
                    .write_json(
                        Format { precision, ..Format::default() },
                        &mut NumberText::default(),
                        &mut buffer
                    )
                    .is_err()
            );
        }
    }

    #[test]
    fn a_budget_that_is_spent_ends_a_list_of_many_parts() {
        let budget = memory::limited(0);
        let mut buffer = Buffer::new(&Context::default(), &budget).side_by_side(2, backwards);
        let numbers = Numbers { columns: 3, values: &values(300_000) };
        assert!(
            numbers.write_json(Format::default(), &mut NumberText::default(), &mut buffer).is_err()
        );
    }

    #[test]
    fn parts_that_cannot_run_end_the_list() {
        let mut buffer =
            Buffer::new(&Context::default(), &memory::unlimited()).side_by_side(2, |_| Err(NoRoom));
        let numbers = Numbers { columns: 0, values: &values(2 * WORTH) };
        let found = numbers.write_json(Format::default(), &mut NumberText::default(), &mut buffer);
        assert_eq!(found.unwrap_err().to_string(), Stopped::NoRoom.to_string());
    }
}
