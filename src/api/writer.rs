//! Answers to text: lists of numbers by [`number_text`](crate::api::number_text), the rest here.

use std::io::Write;

use serde::Serialize;

use crate::api::chunks::Buffer;
use crate::api::number_text::{NumberText, Numbers};
use crate::api::output::{Format, MAGIC, PREFIX, Precision};
use crate::api::rounded::{ROOM, Rounding};
use crate::api::unwritten::{Unwritten, not_finite};

/// Writes an answer.
///
/// # Errors
/// A number that is not finite; the buffer ends.
pub fn write(answer: &impl Written, format: Format, buffer: &mut Buffer) -> Result<(), Unwritten> {
    let raw = format.raw.then(|| Raw { header: Vec::new(), data: buffer.sibling(), count: 0 });
    let mut writer = Writer { format, raw, buffer, number_text: NumberText::default() };
    answer.write_to(&mut writer)?;
    writer.finish()
}

/// Where an answer goes: everything to the buffer, but in the raw format.
pub struct Writer<'a> {
    format: Format,
    raw: Option<Raw>,
    buffer: &'a mut Buffer,
    number_text: NumberText,
}

/// The header of the raw format, which grows beside its numbers, and how many these are.
struct Raw {
    header: Vec<u8>,
    data: Buffer,
    count: usize,
}

impl<'a> Writer<'a> {
    fn text(&mut self, text: &[u8]) -> Result<(), Unwritten> {
        match &mut self.raw {
            None => self.buffer.write_all(text)?,
            Some(raw) => raw.header.extend_from_slice(text),
        }
        Ok(())
    }

    /// The beginning of an object.
    pub fn object(&mut self) -> Result<Object<'_, 'a>, Unwritten> {
        self.text(b"{")?;
        Ok(Object { writer: self, first: true })
    }

    /// A list of anything but numbers and points, or a single row of numbers.
    pub fn list<'v, T: Written + 'v>(
        &mut self,
        items: impl IntoIterator<Item = &'v T>,
    ) -> Result<(), Unwritten> {
        self.text(b"[")?;
        for (i, item) in items.into_iter().enumerate() {
            self.text(if i == 0 { b"" } else { b"," })?;
            item.write_to(self)?;
        }
        self.text(b"]")
    }

    /// A value that is neither number nor list nor object.
    pub fn json(&mut self, value: &impl Serialize) -> Result<(), Unwritten> {
        let written = match &mut self.raw {
            None => serde_json::to_writer(&mut *self.buffer, value),
            Some(raw) => serde_json::to_writer(&mut raw.header, value),
        };
        written.map_err(Unwritten::from)
    }

    /// A number by itself.
    fn number(&mut self, value: f64) -> Result<(), Unwritten> {
        if !self.format.precision.round(value).is_finite() {
            return Err(not_finite());
        }
        let (mut buffer, mut room) = (zmij::Buffer::new(), [0; ROOM]);
        let text = match self.format.precision {
            Precision::Full => buffer.format_finite(value).as_bytes(),
            Precision::Single => buffer.format_finite(value as f32).as_bytes(),
            Precision::Digits(digits) => {
                let length = Rounding::to(digits).write(value, &mut room).ok_or_else(not_finite)?;
                &room[..length]
            }
        };
        self.text(text)
    }

    /// A list of numbers or of points.
    pub fn numbers(&mut self, numbers: Numbers) -> Result<(), Unwritten> {
        let precision = self.format.precision;
        if numbers.values.is_empty() {
            return self.text(b"[]");
        }
        let Some(raw) = &mut self.raw else {
            return numbers.write_json(self.format, &mut self.number_text, self.buffer);
        };
        let name = if precision == Precision::Single { "$f32" } else { "$f64" };
        numbers.write_raw(precision, &mut raw.data)?;
        write!(
            raw.header,
            "{{\"{name}\":[{},{},{}]}}",
            raw.count,
            numbers.rows(),
            numbers.columns
        )?;
        raw.count += numbers.values.len();
        Ok(())
    }

    fn finish(self) -> Result<(), Unwritten> {
        let Some(Raw { mut header, data, .. }) = self.raw else { return Ok(()) };
        header.resize((PREFIX + header.len()).next_multiple_of(8) - PREFIX, b' ');
        let length = u32::try_from(header.len()).map_err(|_| not_finite())?;
        self.buffer.write_all(MAGIC)?;
        self.buffer.write_all(&length.to_le_bytes())?;
        self.buffer.write_all(&[0; 4])?;
        self.buffer.write_all(&header)?;
        self.buffer.append(data.finish());
        Ok(())
    }
}

/// A value that an answer may hold.
pub trait Written {
    /// Writes it.
    ///
    /// # Errors
    /// A number that is not finite; the buffer ends.
    fn write_to(&self, writer: &mut Writer) -> Result<(), Unwritten>;

    /// A list of such values as numbers, if they are: how many columns (0 for plain numbers), and
    /// row after row.
    fn numbers(_list: &[Self]) -> Option<Numbers<'_>>
    where
        Self: Sized,
    {
        None
    }
}

/// An object being written: its fields, one after the other.
pub struct Object<'a, 'b> {
    writer: &'a mut Writer<'b>,
    first: bool,
}

impl Object<'_, '_> {
    /// A field; the name needs no escapes.
    pub fn field(&mut self, name: &str, value: &impl Written) -> Result<(), Unwritten> {
        self.writer.text(if std::mem::take(&mut self.first) { b"\"" } else { b",\"" })?;
        self.writer.text(name.as_bytes())?;
        self.writer.text(b"\":")?;
        value.write_to(self.writer)
    }

    /// A field that may not be there.
    pub fn optional(&mut self, name: &str, value: &Option<impl Written>) -> Result<(), Unwritten> {
        value.as_ref().map_or(Ok(()), |value| self.field(name, value))
    }

    /// The end of the object.
    pub fn end(self) -> Result<(), Unwritten> {
        self.writer.text(b"}")
    }
}

impl<T: Written> Written for Vec<T> {
    fn write_to(&self, writer: &mut Writer) -> Result<(), Unwritten> {
        match T::numbers(self) {
            Some(numbers) => writer.numbers(numbers),
            None => writer.list(self),
        }
    }
}

impl Written for f64 {
    fn write_to(&self, writer: &mut Writer) -> Result<(), Unwritten> {
        writer.number(*self)
    }

    fn numbers(list: &[f64]) -> Option<Numbers<'_>> {
        Some(Numbers { columns: 0, values: list })
    }
}

impl Written for i32 {
    fn write_to(&self, writer: &mut Writer) -> Result<(), Unwritten> {
        writer.json(self)
    }
}

impl Written for bool {
    fn write_to(&self, writer: &mut Writer) -> Result<(), Unwritten> {
        writer.json(self)
    }
}

impl Written for String {
    fn write_to(&self, writer: &mut Writer) -> Result<(), Unwritten> {
        writer.json(self)
    }
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::*;
    use crate::api::memory;
    use crate::api::operations::TABLE;
    use crate::core::context::Context;

    /// The text of an answer, read by another program and written by it in the order it came in.
    #[test]
    fn answers_are_json_as_others_write_it() {
        for (entry, example) in TABLE
            .iter()
            .flat_map(|entry| entry.examples.iter().map(move |example| (entry, example)))
        {
            let mut buffer = Buffer::new(&Context::default(), &memory::limited(1 << 30));
            (entry.answer_json)(
                &Context::default(),
                example.body.as_bytes(),
                Format::default(),
                &mut buffer,
            )
            .unwrap();
            let text = String::from_utf8(buffer.finish().concat()).unwrap();
            let value: Value = serde_json::from_str(&text).unwrap();
            let mut lengths = [text.len(), value.to_string().len()];
            lengths.sort_unstable();
            assert_eq!(
                lengths[0], lengths[1],
                "{}: the same values take as many characters",
                example.name
            );
            let again: Value = serde_json::from_str(&value.to_string()).unwrap();
            assert_eq!(value, again, "{}", example.name);
        }
    }
}
