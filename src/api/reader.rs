//! JSON of good requests, read fast.
//!
//! It reads what most requests hold and gives up at the rest: escapes in strings, deep nesting, and
//! all that is wrong. Whoever calls it then reads again with `serde_json`, which knows what is
//! wrong and where. So it may refuse what is right, but must not take what is wrong. Numbers are
//! most of a long request; they are read in one pass, correctly rounded.

use std::fmt;

use serde::de::{
    self, DeserializeSeed, Deserializer, EnumAccess, MapAccess, SeqAccess, VariantAccess, Visitor,
};
use serde::forward_to_deserialize_any;

use crate::api::wire::{Read, Reading};

/// It is read otherwise.
#[derive(Debug)]
pub struct GivenUp;

impl fmt::Display for GivenUp {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("given up")
    }
}

impl std::error::Error for GivenUp {}

impl de::Error for GivenUp {
    fn custom<T: fmt::Display>(_: T) -> Self {
        GivenUp
    }
}

/// Less than what `serde_json` allows.
const DEPTH: usize = 64;

/// Reads a whole text.
///
/// # Errors
/// It is not JSON, not of this type, or not what this reader knows; nobody waits for it any more.
pub fn read<'de, T: Read<'de>>(reading: &Reading, text: &'de [u8]) -> Result<T, GivenUp> {
    let mut reader = Reader { text, at: 0, depth: 0 };
    let value = T::read(reading, &mut reader)?;
    reader.skip_space();
    if reader.at == text.len() { Ok(value) } else { Err(GivenUp) }
}

struct Reader<'de> {
    text: &'de [u8],
    at: usize,
    depth: usize,
}

impl<'de> Reader<'de> {
    #[inline]
    fn peek(&self) -> u8 {
        self.text.get(self.at).copied().unwrap_or(0)
    }

    #[inline]
    fn skip_space(&mut self) {
        while matches!(self.peek(), b' ' | b'\n' | b'\t' | b'\r') {
            self.at += 1;
        }
    }

    /// Takes this byte, after spaces.
    #[inline]
    fn take(&mut self, byte: u8) -> bool {
        self.skip_space();
        let is_next = self.peek() == byte;
        self.at += usize::from(is_next);
        is_next
    }

    fn word(&mut self, word: &str) -> Result<(), GivenUp> {
        let is_next = self.text[self.at..].starts_with(word.as_bytes());
        self.at += word.len();
        is_next.then_some(()).ok_or(GivenUp)
    }

    /// A string, behind its first quote.
    #[inline]
    fn string(&mut self) -> Result<&'de str, GivenUp> {
        let rest = &self.text[self.at..];
        let length =
            rest.iter().position(|byte| matches!(byte, b'"' | b'\\' | ..0x20)).ok_or(GivenUp)?;
        self.at += length + 1;
        if rest[length] != b'"' {
            return Err(GivenUp);
        }
        str::from_utf8(&rest[..length]).map_err(|_| GivenUp)
    }

    /// Digits, added to a number; how many.
    #[inline]
    fn digits(&mut self, number: &mut u64) -> usize {
        let start = self.at;
        while let Some(eight) = self.text.get(self.at..self.at + 8).and_then(eight_digits) {
            *number = number.wrapping_mul(100_000_000).wrapping_add(eight);
            self.at += 8;
        }
        while let digit @ 0..=9 = self.peek().wrapping_sub(b'0') {
            *number = number.wrapping_mul(10).wrapping_add(u64::from(digit));
            self.at += 1;
        }
        self.at - start
    }

    /// RFC 8259, section 6. Whole numbers are whole, as in `serde_json`.
    #[inline]
    fn number<V: Visitor<'de>>(&mut self, visitor: V) -> Result<V::Value, GivenUp> {
        let start = self.at;
        let is_negative = self.peek() == b'-';
        self.at += usize::from(is_negative);
        let (mut number, begins_with_0) = (0, self.peek() == b'0');
        let whole = self.digits(&mut number);
        if whole == 0 || (begins_with_0 && whole > 1) {
            return Err(GivenUp);
        }
        let mut places = 0;
        if self.peek() == b'.' {
            self.at += 1;
            places = self.digits(&mut number);
            if places == 0 {
                return Err(GivenUp);
            }
        } else if !matches!(self.peek(), b'e' | b'E') {
            return match whole {
                // Minus zero is no whole number.
                ..=18 if is_negative && number == 0 => visitor.visit_f64(-0.0),
                ..=18 if is_negative => visitor.visit_i64(-(number as i64)),
                ..=18 => visitor.visit_u64(number),
                _ => Err(GivenUp),
            };
        }
        let exponent = self.exponent()? - places as i64;
        let value = if whole + places <= 19 { exact(number, exponent) } else { None };
        match value {
            Some(size) => visitor.visit_f64(if is_negative { -size } else { size }),
            None => self.by_library(start).and_then(|value| visitor.visit_f64(value)),
        }
    }

    #[inline]
    fn exponent(&mut self) -> Result<i64, GivenUp> {
        if !matches!(self.peek(), b'e' | b'E') {
            return Ok(0);
        }
        self.at += 1;
        let is_negative = self.peek() == b'-';
        self.at += usize::from(is_negative || self.peek() == b'+');
        let mut number = 0;
        // No double needs more digits; others may.
        if !(1..=9).contains(&self.digits(&mut number)) {
            return Err(GivenUp);
        }
        Ok(if is_negative { -(number as i64) } else { number as i64 })
    }

    /// The number that begins there and has been looked at, by the standard library, which rounds
    /// correctly.
    #[inline]
    fn by_library(&self, start: usize) -> Result<f64, GivenUp> {
        let text = str::from_utf8(&self.text[start..self.at]).map_err(|_| GivenUp)?;
        text.parse().ok().filter(|value: &f64| value.is_finite()).ok_or(GivenUp)
    }

    fn nested<T>(
        &mut self,
        read: impl FnOnce(&mut Self) -> Result<T, GivenUp>,
    ) -> Result<T, GivenUp> {
        self.depth += 1;
        if self.depth > DEPTH {
            return Err(GivenUp);
        }
        let value = read(self)?;
        self.depth -= 1;
        Ok(value)
    }

    #[inline]
    fn list<V: Visitor<'de>>(&mut self, visitor: V) -> Result<V::Value, GivenUp> {
        let mut items = Items { reader: self, first: true, ended: false };
        let value = visitor.visit_seq(&mut items)?;
        if items.ended || items.reader.take(b']') { Ok(value) } else { Err(GivenUp) }
    }

    #[inline]
    fn object<V: Visitor<'de>>(&mut self, visitor: V) -> Result<V::Value, GivenUp> {
        let mut items = Items { reader: self, first: true, ended: false };
        let value = visitor.visit_map(&mut items)?;
        if items.ended || items.reader.take(b'}') { Ok(value) } else { Err(GivenUp) }
    }
}

/// The number that 8 bytes are, if they are digits; all taken at once (Lemire 2021a).
#[inline]
fn eight_digits(bytes: &[u8]) -> Option<u64> {
    let word = u64::from_le_bytes(bytes.try_into().ok()?);
    // The upper half of the byte of a digit is 3, and stays that when 6 is added.
    let upper = |word: u64| word & 0xf0f0_f0f0_f0f0_f0f0 == 0x3030_3030_3030_3030;
    if !(upper(word) && upper(word.wrapping_add(0x0606_0606_0606_0606))) {
        return None;
    }
    let ones = word & 0x0f0f_0f0f_0f0f_0f0f;
    let tens = (ones * 10 + (ones >> 8)) & 0x00ff_00ff_00ff_00ff;
    let hundreds = (tens * 100 + (tens >> 16)) & 0x0000_ffff_0000_ffff;
    Some((hundreds * 10_000 + (hundreds >> 32)) & 0xffff_ffff)
}

/// `number * 10^exponent` where one operation on doubles makes it, correctly rounded (Clinger
/// 1990).
#[inline]
fn exact(number: u64, exponent: i64) -> Option<f64> {
    const POWERS: [f64; 23] = [
        1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16,
        1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
    ];
    let power = POWERS.get(usize::try_from(exponent.unsigned_abs()).ok()?)?;
    let value = number as f64;
    (number <= 1 << 53).then(|| if exponent < 0 { value / power } else { value * power })
}

impl<'de> Deserializer<'de> for &mut Reader<'de> {
    type Error = GivenUp;

    #[inline]
    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, GivenUp> {
        self.skip_space();
        match self.peek() {
            b'-' | b'0'..=b'9' => return self.number(visitor),
            b't' => return self.word("true").and_then(|()| visitor.visit_bool(true)),
            b'f' => return self.word("false").and_then(|()| visitor.visit_bool(false)),
            _ => {}
        }
        let first = self.peek();
        self.at += 1;
        match first {
            b'"' => visitor.visit_borrowed_str(self.string()?),
            b'[' => self.nested(|reader| reader.list(visitor)),
            b'{' => self.nested(|reader| reader.object(visitor)),
            _ => Err(GivenUp),
        }
    }

    #[inline]
    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        visitor: V,
    ) -> Result<V::Value, GivenUp> {
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, GivenUp> {
        if self.take(b'"') { visitor.visit_enum(Name(self.string()?)) } else { Err(GivenUp) }
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 u8 u16 u32 u64 f32 f64 char str string bytes byte_buf option unit unit_struct seq tuple tuple_struct map
        struct identifier ignored_any
    }
}

/// What stands in brackets.
struct Items<'a, 'de> {
    reader: &'a mut Reader<'de>,
    first: bool,
    ended: bool,
}

impl Items<'_, '_> {
    /// Whether there is one more before this end.
    #[inline]
    fn has_next(&mut self, end: u8) -> Result<bool, GivenUp> {
        let first = std::mem::take(&mut self.first);
        if self.ended || self.reader.take(end) {
            self.ended = true;
            return Ok(false);
        }
        if first || self.reader.take(b',') { Ok(true) } else { Err(GivenUp) }
    }
}

impl<'de> SeqAccess<'de> for Items<'_, 'de> {
    type Error = GivenUp;

    #[inline]
    fn next_element_seed<T: DeserializeSeed<'de>>(
        &mut self,
        seed: T,
    ) -> Result<Option<T::Value>, GivenUp> {
        if !self.has_next(b']')? {
            return Ok(None);
        }
        seed.deserialize(&mut *self.reader).map(Some)
    }
}

impl<'de> MapAccess<'de> for Items<'_, 'de> {
    type Error = GivenUp;

    #[inline]
    fn next_key_seed<K: DeserializeSeed<'de>>(
        &mut self,
        seed: K,
    ) -> Result<Option<K::Value>, GivenUp> {
        if !self.has_next(b'}')? {
            return Ok(None);
        }
        if !self.reader.take(b'"') {
            return Err(GivenUp);
        }
        seed.deserialize(Name(self.reader.string()?)).map(Some)
    }

    #[inline]
    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, GivenUp> {
        if !self.reader.take(b':') {
            return Err(GivenUp);
        }
        seed.deserialize(&mut *self.reader)
    }
}

/// A key, or the name of a value.
struct Name<'de>(&'de str);

impl<'de> Deserializer<'de> for Name<'de> {
    type Error = GivenUp;

    #[inline]
    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, GivenUp> {
        visitor.visit_borrowed_str(self.0)
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 u8 u16 u32 u64 f32 f64 char str string bytes byte_buf option unit unit_struct newtype_struct seq tuple
        tuple_struct map struct enum identifier ignored_any
    }
}

impl<'de> EnumAccess<'de> for Name<'de> {
    type Error = GivenUp;
    type Variant = Self;

    fn variant_seed<V: DeserializeSeed<'de>>(self, seed: V) -> Result<(V::Value, Self), GivenUp> {
        Ok((seed.deserialize(Name(self.0))?, self))
    }
}

/// Names have nothing beside them.
impl<'de> VariantAccess<'de> for Name<'de> {
    type Error = GivenUp;

    fn unit_variant(self) -> Result<(), GivenUp> {
        Ok(())
    }

    fn newtype_variant_seed<T: DeserializeSeed<'de>>(self, _: T) -> Result<T::Value, GivenUp> {
        Err(GivenUp)
    }

    fn tuple_variant<V: Visitor<'de>>(self, _: usize, _: V) -> Result<V::Value, GivenUp> {
        Err(GivenUp)
    }

    fn struct_variant<V: Visitor<'de>>(
        self,
        _: &'static [&'static str],
        _: V,
    ) -> Result<V::Value, GivenUp> {
        Err(GivenUp)
    }
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::*;
    use crate::api::operations::TABLE;
    use crate::core::context::Context;

    /// xorshift64, so that every run checks the same texts.
    fn random() -> impl FnMut() -> usize {
        let mut state = 0x9e37_79b9_7f4a_7c15_u64;
        move || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as usize
        }
    }

    /// Any JSON, of which this reader must make the same as `serde_json`.
    struct Any(Value);

    impl<'de> Read<'de> for Any {
        fn read<D: Deserializer<'de>>(_: &Reading, deserializer: D) -> Result<Self, D::Error> {
            de::Deserialize::deserialize(deserializer).map(Any)
        }
    }

    /// Whether it was read; if so, `serde_json` must read the same.
    fn agrees(text: &[u8]) -> bool {
        let context = Context::default();
        let Ok(Any(value)) = read(&Reading::new(&context), text) else { return false };
        let theirs: Value = serde_json::from_slice(text)
            .unwrap_or_else(|error| panic!("{error}: {}", String::from_utf8_lossy(text)));
        assert_eq!(
            format!("{value:?}"),
            format!("{theirs:?}"),
            "{}",
            String::from_utf8_lossy(text)
        );
        true
    }

    #[test]
    fn what_is_read_is_what_serde_json_reads() {
        let mut next = random();
        let bytes = b"{}[],:\"\\0123456789.-+eE tfn\n\x1f\xff";
        for example in TABLE.iter().flat_map(|entry| entry.examples) {
            assert!(agrees(example.body.as_bytes()), "{}", example.name);
            for _ in 0..2_000 {
                let mut text = example.body.as_bytes().to_vec();
                for _ in 0..=next() % 3 {
                    let (at, byte) = (next() % text.len(), bytes[next() % bytes.len()]);
                    match next() % 3 {
                        0 => text[at] = byte,
                        1 => text.insert(at, byte),
                        _ => drop(text.remove(at)),
                    }
                }
                agrees(&text);
            }
        }
    }

    #[test]
    fn numbers_are_those_of_serde_json() {
        let mut next = random();
        for _ in 0..100_000 {
            let value = f64::from_bits((next() as u64) << 11 | next() as u64 & 0x7ff);
            let digits = next();
            let texts = [
                format!("{value:?}"),
                format!("{:.*e}", next() % 25, value),
                format!("{digits}.{}e{}", next(), (next() % 700) as i64 - 350),
                format!("-0.{digits}"),
                format!("{}", digits >> (next() % 50)),
                format!("{digits}{digits}"),
            ];
            for text in texts {
                let is_finite = text.parse::<f64>().is_ok_and(f64::is_finite);
                let is_long = text.len() > 18 && text.bytes().all(|byte| byte.is_ascii_digit());
                assert_eq!(agrees(text.as_bytes()), is_finite && !is_long, "{text}");
            }
        }
        for text in [
            "-0",
            "0",
            "-0.0",
            "999999999999999999",
            "-999999999999999999",
            "1e22",
            "9007199254740993.0",
            "1E+2",
        ] {
            assert!(agrees(text.as_bytes()), "{text}");
        }
        for text in [
            "01",
            "-",
            "1.",
            ".5",
            "+1",
            "1e",
            "1e+",
            "NaN",
            "Infinity",
            "1e999",
            "00",
            "-01",
            "0x1",
            "1_0",
            "1 2",
            "18446744073709551615",
        ] {
            assert!(!agrees(text.as_bytes()), "{text}");
        }
    }

    #[test]
    fn eight_digits_are_eight_digits() {
        let mut next = random();
        for _ in 0..100_000 {
            let number = next() % 100_000_000;
            let mut text = format!("{number:08}").into_bytes();
            assert_eq!(eight_digits(&text), Some(number as u64));
            let byte = (next() % 256) as u8;
            text[next() % 8] = byte;
            assert_eq!(eight_digits(&text).is_some(), byte.is_ascii_digit());
        }
    }

    #[test]
    fn deep_nesting_is_left_to_others() {
        let nested = |depth: usize| "[".repeat(depth) + &"]".repeat(depth);
        assert!(agrees(nested(DEPTH).as_bytes()));
        assert!(!agrees(nested(100_000).as_bytes()));
    }
}
