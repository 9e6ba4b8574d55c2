//! Answers to text: a serialiser that hands lists of numbers to [`numbers`](crate::api::number_text) and writes the rest itself.

use std::io::{self, Write};

use serde::ser::{self, Impossible, Serialize, SerializeSeq, SerializeStruct, SerializeTuple};

use crate::api::chunks::Buffer;
use crate::api::number_text::{NumberText, Numbers};
use crate::api::output::{Format, MAGIC, PREFIX, Precision};
use crate::api::rounded::{ROOM, Rounding};

/// Why an answer cannot be written.
#[derive(Debug)]
pub struct Unwritten(pub io::Error);

impl std::fmt::Display for Unwritten {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.fmt(f)
    }
}

impl std::error::Error for Unwritten {}

impl ser::Error for Unwritten {
    fn custom<T: std::fmt::Display>(message: T) -> Self {
        Unwritten(io::Error::other(message.to_string()))
    }
}

impl From<io::Error> for Unwritten {
    fn from(error: io::Error) -> Self {
        Unwritten(error)
    }
}

impl From<serde_json::Error> for Unwritten {
    fn from(error: serde_json::Error) -> Self {
        Unwritten(error.into())
    }
}

/// Neither JSON nor the raw format has numbers that are not finite.
pub(super) fn not_finite() -> Unwritten {
    Unwritten(io::Error::other("not a finite number"))
}

/// Writes an answer.
///
/// # Errors
/// A number that is not finite; the buffer ends.
pub fn write<T: Serialize>(answer: &T, format: Format, buffer: &mut Buffer) -> Result<(), Unwritten> {
    let raw = format.raw.then(|| Raw { header: Vec::new(), data: buffer.sibling(), count: 0 });
    let mut writer = Writer { format, raw, buffer, number_text: NumberText::default(), columns: 0 };
    answer.serialize(&mut writer)?;
    writer.finish()
}

/// Everything goes to the buffer, but in the raw format.
struct Writer<'a> {
    format: Format,
    raw: Option<Raw>,
    buffer: &'a mut Buffer,
    number_text: NumberText,
    /// Of the numbers that come next.
    columns: usize,
}

/// The header of the raw format, which grows beside its numbers, and how many these are.
struct Raw {
    header: Vec<u8>,
    data: Buffer,
    count: usize,
}

impl Writer<'_> {
    fn text(&mut self, text: &[u8]) -> Result<(), Unwritten> {
        match &mut self.raw {
            None => self.buffer.write_all(text)?,
            Some(raw) => raw.header.extend_from_slice(text),
        }
        Ok(())
    }

    fn json(&mut self, value: &impl Serialize) -> Result<(), Unwritten> {
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
    fn numbers(&mut self, numbers: Numbers) -> Result<(), Unwritten> {
        let precision = self.format.precision;
        if numbers.values.is_empty() {
            return self.text(b"[]");
        }
        let Some(raw) = &mut self.raw else { return numbers.write_json(self.format, &mut self.number_text, self.buffer) };
        let name = if precision == Precision::Single { "$f32" } else { "$f64" };
        numbers.write_raw(precision, &mut raw.data)?;
        write!(raw.header, "{{\"{name}\":[{},{},{}]}}", raw.count, numbers.rows(), numbers.columns)?;
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

/// A list of anything but numbers and points, or a single row of numbers.
struct List<'a, 'b> {
    writer: &'a mut Writer<'b>,
    first: bool,
}

impl SerializeTuple for List<'_, '_> {
    type Ok = ();
    type Error = Unwritten;

    fn serialize_element<T: ?Sized + Serialize>(&mut self, value: &T) -> Result<(), Unwritten> {
        self.writer.text(if std::mem::take(&mut self.first) { b"" } else { b"," })?;
        value.serialize(&mut *self.writer)
    }

    fn end(self) -> Result<(), Unwritten> {
        self.writer.text(b"]")
    }
}

impl SerializeSeq for List<'_, '_> {
    type Ok = ();
    type Error = Unwritten;

    fn serialize_element<T: ?Sized + Serialize>(&mut self, value: &T) -> Result<(), Unwritten> {
        SerializeTuple::serialize_element(self, value)
    }

    fn end(self) -> Result<(), Unwritten> {
        SerializeTuple::end(self)
    }
}

/// What no answer holds.
fn other<T>() -> Result<T, Unwritten> {
    Err(ser::Error::custom("no part of an answer"))
}

macro_rules! refuse {
    ($($name:ident($($type:ty),*) -> $ok:ty;)*) => {
        $(fn $name(self $(, _: $type)*) -> Result<$ok, Unwritten> { other() })*
    };
}

/// An object.
struct Object<'a, 'b> {
    writer: &'a mut Writer<'b>,
    first: bool,
}

impl SerializeStruct for Object<'_, '_> {
    type Ok = ();
    type Error = Unwritten;

    fn serialize_field<T: ?Sized + Serialize>(&mut self, key: &'static str, value: &T) -> Result<(), Unwritten> {
        self.writer.text(if std::mem::take(&mut self.first) { b"" } else { b"," })?;
        // Names of fields need no escapes.
        self.writer.text(b"\"")?;
        self.writer.text(key.as_bytes())?;
        self.writer.text(b"\":")?;
        value.serialize(&mut *self.writer)
    }

    fn end(self) -> Result<(), Unwritten> {
        self.writer.text(b"}")
    }
}

impl<'a, 'b> ser::Serializer for &'a mut Writer<'b> {
    type Ok = ();
    type Error = Unwritten;
    type SerializeSeq = List<'a, 'b>;
    type SerializeTuple = List<'a, 'b>;
    type SerializeStruct = Object<'a, 'b>;

    type SerializeTupleStruct = Impossible<(), Unwritten>;
    type SerializeTupleVariant = Impossible<(), Unwritten>;
    type SerializeMap = Impossible<(), Unwritten>;
    type SerializeStructVariant = Impossible<(), Unwritten>;

    refuse! {
        serialize_i8(i8) -> ();
        serialize_i16(i16) -> ();
        serialize_u8(u8) -> ();
        serialize_u16(u16) -> ();
        serialize_f32(f32) -> ();
        serialize_char(char) -> ();
        serialize_none() -> ();
        serialize_unit() -> ();
        serialize_unit_struct(&'static str) -> ();
        serialize_tuple_struct(&'static str, usize) -> Self::SerializeTupleStruct;
        serialize_tuple_variant(&'static str, u32, &'static str, usize) -> Self::SerializeTupleVariant;
        serialize_map(Option<usize>) -> Self::SerializeMap;
        serialize_struct_variant(&'static str, u32, &'static str, usize) -> Self::SerializeStructVariant;
    }

    /// So that lists of numbers come as [`write_numbers`](crate::api::wire::write_numbers) has them.
    fn is_human_readable(&self) -> bool {
        false
    }

    /// Only [`write_numbers`](crate::api::wire::write_numbers) has variants with values.
    fn serialize_newtype_variant<T: ?Sized + Serialize>(
        self,
        _: &'static str,
        columns: u32,
        _: &'static str,
        rows: &T,
    ) -> Result<(), Unwritten> {
        self.columns = columns as usize;
        rows.serialize(self)
    }

    fn serialize_bytes(self, rows: &[u8]) -> Result<(), Unwritten> {
        let values = bytemuck::try_cast_slice(rows).or_else(|_| other())?;
        self.numbers(Numbers { columns: self.columns, values })
    }

    fn serialize_bool(self, value: bool) -> Result<(), Unwritten> {
        self.json(&value)
    }

    fn serialize_i32(self, value: i32) -> Result<(), Unwritten> {
        self.json(&value)
    }

    fn serialize_i64(self, value: i64) -> Result<(), Unwritten> {
        self.json(&value)
    }

    fn serialize_u32(self, value: u32) -> Result<(), Unwritten> {
        self.json(&value)
    }

    fn serialize_u64(self, value: u64) -> Result<(), Unwritten> {
        self.json(&value)
    }

    fn serialize_f64(self, value: f64) -> Result<(), Unwritten> {
        self.number(value)
    }

    fn serialize_str(self, value: &str) -> Result<(), Unwritten> {
        self.json(&value)
    }

    fn serialize_unit_variant(self, _: &'static str, _: u32, variant: &'static str) -> Result<(), Unwritten> {
        self.json(&variant)
    }

    fn serialize_some<T: ?Sized + Serialize>(self, value: &T) -> Result<(), Unwritten> {
        value.serialize(self)
    }

    fn serialize_newtype_struct<T: ?Sized + Serialize>(self, _: &'static str, value: &T) -> Result<(), Unwritten> {
        value.serialize(self)
    }

    fn serialize_seq(self, _: Option<usize>) -> Result<List<'a, 'b>, Unwritten> {
        self.text(b"[")?;
        Ok(List { writer: self, first: true })
    }

    fn serialize_tuple(self, length: usize) -> Result<List<'a, 'b>, Unwritten> {
        self.serialize_seq(Some(length))
    }

    fn serialize_struct(self, _: &'static str, _: usize) -> Result<Object<'a, 'b>, Unwritten> {
        self.text(b"{")?;
        Ok(Object { writer: self, first: true })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::api::memory;
    use crate::api::operations::{basis, continuity, convert, evaluate, fit, interpolate, subdivide, surface_evaluate, surface_tessellate};

    fn written<T: Serialize>(answer: &T) -> String {
        let mut buffer = Buffer::new(&memory::limited(1 << 30));
        write(answer, Format::default(), &mut buffer).unwrap();
        String::from_utf8(buffer.finish().concat()).unwrap()
    }

    #[test]
    fn answers_are_what_serde_json_writes() {
        macro_rules! compare {
            ($($module:ident)*) => {$(
                for example in $module::EXAMPLES {
                    let answer = $module::operation(serde_json::from_str(example.body).unwrap()).unwrap();
                    assert_eq!(written(&answer), serde_json::to_string(&answer).unwrap(), "{}", example.name);
                }
            )*};
        }
        compare!(basis continuity convert evaluate fit interpolate subdivide surface_evaluate surface_tessellate);
    }
}
