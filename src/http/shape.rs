//! How numbers are written where a client asks for something other than plain JSON: rounded, flat, or raw.
//!
//! The raw format is a small JSON header in which each list of numbers is replaced by where its doubles are, and then the doubles:
//!
//! | bytes | |
//! |---|---|
//! | 0 to 7 | `SPRLINE1` in ASCII |
//! | 8 to 11 | the length of the header, an unsigned little-endian integer |
//! | 12 to 15 | zero |
//! | 16 and on | the header: the answer as JSON in UTF-8, padded with spaces so that what follows begins at a multiple of 8 |
//! | after it | the numbers, little-endian IEEE 754 |
//!
//! `{"$f64": [start, rows, columns]}` in the header stands for `rows` entries of `columns` doubles (0 columns: plain numbers) that begin
//! `start` doubles after the header; `$f32` the same with floats of 4 bytes, `start` counted in floats.

use std::io::{self, Write};

use serde::ser::{self, Impossible, Serialize, SerializeSeq, SerializeStruct, SerializeTuple};

use super::paper::Paper;

/// The media type of the raw format.
pub const RAW: &str = "application/vnd.springline.f64";
/// How the raw format begins.
pub const MAGIC: &[u8; 8] = b"SPRLINE1";
/// Bytes before the header.
pub const PREFIX: usize = 16;

/// How precise numbers are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Precision {
    /// So that they parse back to the same double.
    #[default]
    Full,
    /// As the nearest number of single precision.
    Single,
    /// With at most so many significant digits.
    Digits(u8),
}

/// How lists of points are laid out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Layout {
    /// One list for each point.
    #[default]
    Nested,
    /// One list for all coordinates.
    Flat,
}

/// What a client asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Shape {
    /// How precise.
    pub precision: Precision,
    /// How laid out; the raw format has a layout of its own.
    pub layout: Layout,
    /// Whether in the raw format.
    pub raw: bool,
}

impl Shape {
    /// Whether it is the JSON that everybody gets who asks for nothing.
    pub fn is_plain(&self) -> bool {
        *self == Shape::default()
    }
}

impl Precision {
    /// The number to be written.
    fn round(self, value: f64) -> f64 {
        match self {
            Precision::Full => value,
            Precision::Single => f64::from(value as f32),
            // Printing rounds correctly, and what is printed is a number.
            Precision::Digits(digits) => format!("{value:.*e}", usize::from(digits) - 1).parse().unwrap_or(value),
        }
    }
}

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

fn not_finite() -> Unwritten {
    Unwritten(io::Error::other("not a finite number"))
}

/// Writes an answer in a shape other than the plain one.
///
/// # Errors
/// A number that is not finite; the paper ends.
pub fn write<T: Serialize>(answer: &T, shape: Shape, paper: &mut Paper) -> Result<(), Unwritten> {
    let mut writer = Writer { shape, text: Vec::new(), data: paper.sibling(), count: 0, paper };
    answer.serialize(&mut writer)?;
    writer.finish()
}

/// Writes JSON, and numbers as they are wanted. In the raw format the paper takes the numbers, else everything.
struct Writer<'a> {
    shape: Shape,
    /// The header of the raw format; a sheet of JSON otherwise.
    text: Vec<u8>,
    /// The numbers of the raw format.
    data: Paper,
    /// How many there are.
    count: usize,
    paper: &'a mut Paper,
}

/// JSON is handed to the paper in pieces of this size.
const PIECE: usize = 16 * 1024;

impl Writer<'_> {
    fn text(&mut self, text: &[u8]) -> Result<(), Unwritten> {
        self.text.extend_from_slice(text);
        if !self.shape.raw && self.text.len() > PIECE {
            self.paper.write_all(&self.text)?;
            self.text.clear();
        }
        Ok(())
    }

    fn json(&mut self, value: &impl Serialize) -> Result<(), Unwritten> {
        let mut text = std::mem::take(&mut self.text);
        let written = serde_json::to_writer(&mut text, value);
        self.text = text;
        written?;
        self.text(b"")
    }

    /// A number in JSON.
    fn number(&mut self, value: f64) -> Result<(), Unwritten> {
        let value = self.shape.precision.round(value);
        if !value.is_finite() {
            return Err(not_finite());
        }
        match self.shape.precision {
            Precision::Single => self.json(&(value as f32)),
            _ => self.json(&value),
        }
    }

    /// A number among the raw ones.
    fn raw_number(&mut self, value: f64) -> Result<(), Unwritten> {
        let value = self.shape.precision.round(value);
        if !value.is_finite() {
            return Err(not_finite());
        }
        match self.shape.precision {
            Precision::Single => self.data.write_all(&(value as f32).to_le_bytes())?,
            _ => self.data.write_all(&value.to_le_bytes())?,
        }
        self.count += 1;
        Ok(())
    }

    fn finish(mut self) -> Result<(), Unwritten> {
        if self.shape.raw {
            let padding = (PREFIX + self.text.len()).next_multiple_of(8) - PREFIX - self.text.len();
            self.text.extend(std::iter::repeat_n(b' ', padding));
            let length = u32::try_from(self.text.len()).map_err(|_| not_finite())?;
            self.paper.write_all(MAGIC)?;
            self.paper.write_all(&length.to_le_bytes())?;
            self.paper.write_all(&[0; 4])?;
        }
        self.paper.write_all(&self.text)?;
        self.paper.append(self.data.finish());
        Ok(())
    }
}

/// A list: of numbers, of points, or of something else; its first entry decides.
struct List<'a, 'b> {
    writer: &'a mut Writer<'b>,
    rows: usize,
    kind: Kind,
}

#[derive(Clone, Copy)]
enum Kind {
    Empty,
    /// Numbers, from here on among the raw ones; so many to a row, 0 for plain numbers.
    Raw {
        start: usize,
        columns: usize,
    },
    /// Coordinates one after the other.
    Flat,
    /// Whatever it is, as JSON.
    Plain,
}

impl SerializeSeq for List<'_, '_> {
    type Ok = ();
    type Error = Unwritten;

    fn serialize_element<T: ?Sized + Serialize>(&mut self, value: &T) -> Result<(), Unwritten> {
        if let Kind::Empty = self.kind {
            self.kind = self.decide(value)?;
        }
        self.rows += 1;
        match self.kind {
            Kind::Raw { .. } => value.serialize(Numbers { each: &mut |value| self.writer.raw_number(value) }).map(drop),
            Kind::Flat => {
                let (writer, mut first) = (&mut *self.writer, self.rows == 1);
                let mut each = |value| {
                    writer.text(if std::mem::take(&mut first) { b"" } else { b"," })?;
                    writer.number(value)
                };
                value.serialize(Numbers { each: &mut each }).map(drop)
            }
            Kind::Empty | Kind::Plain => {
                self.writer.text(if self.rows == 1 { b"" } else { b"," })?;
                value.serialize(&mut *self.writer)
            }
        }
    }

    fn end(self) -> Result<(), Unwritten> {
        match self.kind {
            Kind::Empty => self.writer.text(b"[]"),
            Kind::Raw { start, columns } => {
                let name = if self.writer.shape.precision == Precision::Single { "$f32" } else { "$f64" };
                let text = format!("{{\"{name}\":[{start},{},{columns}]}}", self.rows);
                self.writer.text(text.as_bytes())
            }
            Kind::Flat | Kind::Plain => self.writer.text(b"]"),
        }
    }
}

impl List<'_, '_> {
    /// What the list is, by its first entry; begins it.
    fn decide<T: ?Sized + Serialize>(&mut self, first: &T) -> Result<Kind, Unwritten> {
        let mut count = 0;
        let columns = first.serialize(Numbers {
            each: &mut |_| {
                count += 1;
                Ok(())
            },
        });
        let kind = match (columns, self.writer.shape) {
            (Ok(columns), Shape { raw: true, .. }) => return Ok(Kind::Raw { start: self.writer.count, columns }),
            (Ok(1..), Shape { layout: Layout::Flat, .. }) => Kind::Flat,
            _ => Kind::Plain,
        };
        self.writer.text(b"[")?;
        Ok(kind)
    }
}

/// Takes the numbers of a number (0 columns) or of a point (as many as coordinates); refuses anything else.
struct Numbers<'a> {
    each: &'a mut dyn FnMut(f64) -> Result<(), Unwritten>,
}

/// The coordinates of a point.
struct Coordinates<'a> {
    numbers: Numbers<'a>,
    columns: usize,
}

impl SerializeTuple for Coordinates<'_> {
    type Ok = usize;
    type Error = Unwritten;

    fn serialize_element<T: ?Sized + Serialize>(&mut self, value: &T) -> Result<(), Unwritten> {
        value.serialize(Numbers { each: self.numbers.each })?;
        self.columns += 1;
        Ok(())
    }

    fn end(self) -> Result<usize, Unwritten> {
        Ok(self.columns)
    }
}

/// What no answer holds, or no list of numbers.
fn other<T>() -> Result<T, Unwritten> {
    Err(ser::Error::custom("not a number"))
}

macro_rules! refuse {
    ($ok:ty; $($name:ident($($type:ty),*))*) => {
        $(fn $name(self $(, _: $type)*) -> Result<$ok, Unwritten> { other() })*
    };
}

macro_rules! refuse_compounds {
    ($ok:ty) => {
        type SerializeTupleStruct = Impossible<$ok, Unwritten>;
        type SerializeTupleVariant = Impossible<$ok, Unwritten>;
        type SerializeMap = Impossible<$ok, Unwritten>;
        type SerializeStructVariant = Impossible<$ok, Unwritten>;

        fn serialize_tuple_struct(self, _: &'static str, _: usize) -> Result<Self::SerializeTupleStruct, Unwritten> {
            other()
        }
        fn serialize_tuple_variant(
            self,
            _: &'static str,
            _: u32,
            _: &'static str,
            _: usize,
        ) -> Result<Self::SerializeTupleVariant, Unwritten> {
            other()
        }
        fn serialize_map(self, _: Option<usize>) -> Result<Self::SerializeMap, Unwritten> {
            other()
        }
        fn serialize_struct_variant(
            self,
            _: &'static str,
            _: u32,
            _: &'static str,
            _: usize,
        ) -> Result<Self::SerializeStructVariant, Unwritten> {
            other()
        }
        fn serialize_newtype_variant<T: ?Sized + Serialize>(
            self,
            _: &'static str,
            _: u32,
            _: &'static str,
            _: &T,
        ) -> Result<$ok, Unwritten> {
            other()
        }
    };
}

impl<'a> ser::Serializer for Numbers<'a> {
    type Ok = usize;
    type Error = Unwritten;
    type SerializeSeq = Impossible<usize, Unwritten>;
    type SerializeTuple = Coordinates<'a>;
    type SerializeStruct = Impossible<usize, Unwritten>;

    refuse_compounds!(usize);
    refuse! { usize; serialize_bool(bool) serialize_i8(i8) serialize_i16(i16) serialize_i32(i32) serialize_i64(i64) serialize_u8(u8)
    serialize_u16(u16) serialize_u32(u32) serialize_u64(u64) serialize_f32(f32) serialize_char(char) serialize_str(&str)
    serialize_bytes(&[u8]) serialize_none() serialize_unit() serialize_unit_struct(&'static str)
    serialize_unit_variant(&'static str, u32, &'static str) }

    fn serialize_f64(self, value: f64) -> Result<usize, Unwritten> {
        (self.each)(value).map(|()| 0)
    }

    fn serialize_some<T: ?Sized + Serialize>(self, value: &T) -> Result<usize, Unwritten> {
        value.serialize(self)
    }

    fn serialize_newtype_struct<T: ?Sized + Serialize>(self, _: &'static str, value: &T) -> Result<usize, Unwritten> {
        value.serialize(self)
    }

    fn serialize_seq(self, _: Option<usize>) -> Result<Self::SerializeSeq, Unwritten> {
        other()
    }

    fn serialize_tuple(self, _: usize) -> Result<Coordinates<'a>, Unwritten> {
        Ok(Coordinates { numbers: self, columns: 0 })
    }

    fn serialize_struct(self, _: &'static str, _: usize) -> Result<Self::SerializeStruct, Unwritten> {
        other()
    }
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
        self.writer.json(&key)?;
        self.writer.text(b":")?;
        value.serialize(&mut *self.writer)
    }

    fn end(self) -> Result<(), Unwritten> {
        self.writer.text(b"}")
    }
}

/// A point or a pair by itself.
struct Pair<'a, 'b> {
    writer: &'a mut Writer<'b>,
    first: bool,
}

impl SerializeTuple for Pair<'_, '_> {
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

impl<'a, 'b> ser::Serializer for &'a mut Writer<'b> {
    type Ok = ();
    type Error = Unwritten;
    type SerializeSeq = List<'a, 'b>;
    type SerializeTuple = Pair<'a, 'b>;
    type SerializeStruct = Object<'a, 'b>;

    refuse_compounds!(());
    refuse! { (); serialize_i8(i8) serialize_i16(i16) serialize_u8(u8) serialize_u16(u16) serialize_f32(f32) serialize_char(char)
    serialize_bytes(&[u8]) serialize_none() serialize_unit() serialize_unit_struct(&'static str) }

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
        Ok(List { writer: self, rows: 0, kind: Kind::Empty })
    }

    fn serialize_tuple(self, _: usize) -> Result<Pair<'a, 'b>, Unwritten> {
        self.text(b"[")?;
        Ok(Pair { writer: self, first: true })
    }

    fn serialize_struct(self, _: &'static str, _: usize) -> Result<Object<'a, 'b>, Unwritten> {
        self.text(b"{")?;
        Ok(Object { writer: self, first: true })
    }
}
