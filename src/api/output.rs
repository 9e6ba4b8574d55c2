//! How an answer is written: which numbers, in which layout, as JSON or raw.
//!
//! The raw format is a small JSON header in which each list of numbers is replaced by where its
//! doubles are, and then the doubles:
//!
//! | bytes | |
//! |---|---|
//! | 0 to 7 | `SPRLINE1` in ASCII |
//! | 8 to 11 | the length of the header, an unsigned little-endian integer |
//! | 12 to 15 | zero |
//! | 16 and on | the header: the answer as JSON in UTF-8, padded with spaces so that what follows begins at a multiple of 8 |
//! | after it | the numbers, little-endian IEEE 754 |
//!
//! `{"$f64": [start, rows, columns]}` in the header stands for `rows` entries of `columns` doubles
//! (0 columns: plain numbers) that begin `start` doubles after the header; `$f32` the same with
//! floats of 4 bytes, `start` counted in floats.

use crate::api::rounded::Rounding;

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
    /// One list for each point
    #[default]
    Nested,
    /// One list for all coordinates
    Flat,
}

/// What a client asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Format {
    /// How precise.
    pub precision: Precision,
    /// How laid out; the raw format has a layout of its own.
    pub layout: Layout,
    /// Whether in the raw format.
    pub raw: bool,
}

impl Precision {
    /// The number to be written.
    pub fn round(self, value: f64) -> f64 {
        match self {
            Precision::Full => value,
            Precision::Single => f64::from(value as f32),
            Precision::Digits(digits) => Rounding::to(digits).round(value),
        }
    }

    /// The numbers to be written: those given, or others in `room`.
    pub fn round_all<'a>(self, values: &'a [f64], room: &'a mut Vec<f64>) -> &'a [f64] {
        if self == Precision::Full {
            return values;
        }
        room.clear();
        room.extend(values.iter().map(|&value| self.round(value)));
        room
    }
}
