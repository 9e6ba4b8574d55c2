//! Reading on after a fault, so that a client learns of all that is wrong with a request at once.
//!
//! A reader of JSON cannot go on inside a value that it has refused. Here every value is first cut
//! out of the text, which is known to be JSON, and then read by itself: its fault is noted with its
//! place, and the next value is read.

use std::cell::{Cell, RefCell};
use std::fmt::{self, Display};

use serde::de::{
    self, DeserializeSeed, Deserializer, Expected, IntoDeserializer, MapAccess, SeqAccess,
    Unexpected, Visitor,
};
use serde::forward_to_deserialize_any;
use serde_json::value::RawValue;

use crate::api::json::{in_json_terms, shortened};
use crate::api::wire::field::TOO_LONG;
use crate::api::wire::reading::{Read, Reading};
use crate::core::error::GATHERED;

/// A value that is not what was expected.
#[derive(Debug, Clone, PartialEq)]
pub struct Misfit {
    /// Where, as a JSON Pointer.
    pub pointer: String,
    /// What is wrong, as a stable name.
    pub code: &'static str,
    /// What is wrong, in words.
    pub detail: String,
    /// The name that an unknown field was probably meant to have.
    pub meant: Option<String>,
}

impl Misfit {
    /// A field that the whole value lacks.
    pub fn missing(name: &str) -> Self {
        Misfit {
            pointer: String::new(),
            code: "missing_field",
            detail: format!("the field `{name}` is missing"),
            meant: None,
        }
    }
}

/// Reads what can be read of a JSON value, and what is wrong with the rest: the first faults, and
/// how many there are.
pub fn read<'de, T: Read<'de>>(
    reading: &Reading,
    text: &'de RawValue,
) -> (Option<T>, Vec<Misfit>, usize) {
    let notes = Notes::default();
    let value = notes.noted(T::read(&reading.going_on(), Value { text, notes: &notes }));
    (value.ok(), notes.found.take(), notes.count.get())
}

/// What has been found, and where the reader is.
#[derive(Default)]
struct Notes {
    found: RefCell<Vec<Misfit>>,
    count: Cell<usize>,
    path: RefCell<String>,
}

impl Notes {
    /// Reads one level further in.
    fn within<T>(
        &self,
        step: impl Display,
        read: impl FnOnce() -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        use fmt::Write;
        let length = self.path.borrow().len();
        let _ = write!(self.path.borrow_mut(), "/{step}");
        let result = self.noted(read());
        self.path.borrow_mut().truncate(length);
        result
    }

    /// Notes a fault where the reader is, unless it was noted further in.
    fn noted<T>(&self, result: Result<T, Failure>) -> Result<T, Failure> {
        result.map_err(|failure| {
            if let Failure::New { code, detail, meant } = failure {
                self.count.set(self.count.get() + 1);
                if self.found.borrow().len() < GATHERED {
                    let pointer = shortened(&self.path.borrow());
                    self.found.borrow_mut().push(Misfit { pointer, code, detail, meant });
                }
            }
            Failure::Noted
        })
    }
}

/// Why a value could not be read.
#[derive(Debug)]
enum Failure {
    /// It is known already.
    Noted,
    /// This is wrong with it.
    New { code: &'static str, detail: String, meant: Option<String> },
}

impl Failure {
    fn new(code: &'static str, detail: String) -> Self {
        Failure::New { code, detail, meant: None }
    }

    /// What the parser refuses of a text that is JSON: a number beyond a double, half of a
    /// surrogate pair.
    fn of_parser(error: &serde_json::Error) -> Self {
        let code = if error.to_string().starts_with("number out of range") {
            "number_out_of_range"
        } else {
            "not_json"
        };
        Failure::new(code, in_json_terms(error))
    }
}

impl Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Failure::Noted => f.write_str("noted"),
            Failure::New { detail, .. } => f.write_str(detail),
        }
    }
}

impl std::error::Error for Failure {}

impl de::Error for Failure {
    fn custom<T: Display>(message: T) -> Self {
        let detail = message.to_string();
        Failure::new(if detail.starts_with(TOO_LONG) { "too_large" } else { "wrong_type" }, detail)
    }

    fn invalid_type(found: Unexpected, expected: &dyn Expected) -> Self {
        Failure::new(
            "wrong_type",
            format!("this is {}; expected {}", in_words(found), expectation(expected)),
        )
    }

    fn invalid_value(found: Unexpected, expected: &dyn Expected) -> Self {
        Self::invalid_type(found, expected)
    }

    fn invalid_length(length: usize, expected: &dyn Expected) -> Self {
        let items = if length == 1 { "item" } else { "items" };
        Failure::new(
            "wrong_type",
            format!("this has {length} {items}; expected {}", expectation(expected)),
        )
    }

    fn unknown_variant(value: &str, known: &'static [&'static str]) -> Self {
        let meant = meant(value, known.iter().copied());
        let hint = meant.map_or(String::new(), |name| format!(" (did you mean `{name}`?)"));
        let known: Vec<String> = known.iter().map(|name| format!("`{name}`")).collect();
        Failure::new(
            "unknown_variant",
            format!("unknown value `{}`{hint}; allowed: {}", shortened(value), known.join(", ")),
        )
    }

    fn unknown_field(name: &str, known: &'static [&'static str]) -> Self {
        let meant = meant(name, known.iter().copied());
        let hint = meant.map_or(String::new(), |name| format!(" (did you mean `{name}`?)"));
        let detail = format!(
            "unknown field `{}`{hint}; the fields here are {}",
            shortened(name),
            known.join(", ")
        );
        Failure::New { code: "unknown_field", detail, meant: meant.map(str::to_owned) }
    }

    fn duplicate_field(name: &'static str) -> Self {
        Failure::new(
            "duplicate_field",
            format!("the field `{name}` was given before; give it once"),
        )
    }
}

/// The known name that is nearest to one that is not known, if it is near: a letter left out,
/// added, changed or swapped with its neighbour counts 1, and one in three letters may be wrong.
pub fn meant<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    const LONGEST: usize = 64;
    if name.len() > LONGEST {
        return None;
    }
    let distance = |other: &str| strsim::osa_distance(&name.to_lowercase(), other);
    let length = |other: &str| other.chars().count().max(name.chars().count());
    let near = known
        .map(|other| (distance(&other.to_lowercase()), other))
        .filter(|(d, other)| 3 * d <= length(other));
    near.min_by_key(|(distance, _)| *distance).map(|(_, other)| other)
}

/// What was found, in the words of JSON.
fn in_words(found: Unexpected) -> String {
    match found {
        Unexpected::Bool(value) => value.to_string(),
        Unexpected::Unsigned(value) => format!("the number {value}"),
        Unexpected::Signed(value) => format!("the number {value}"),
        Unexpected::Float(value) => format!("the number {value:?}"),
        Unexpected::Str(text) => format!("the string \"{}\"", shortened(text)),
        Unexpected::Unit => "null".into(),
        Unexpected::Seq => "an array".into(),
        Unexpected::Map => "an object".into(),
        other => other.to_string(),
    }
}

/// What was expected, in the words of JSON.
fn expectation(expected: &dyn Expected) -> String {
    match expected.to_string().as_str() {
        "f64" => "a number".into(),
        "a sequence" => "an array".into(),
        "a boolean" => "true or false".into(),
        other => other.into(),
    }
}

/// A value cut out of the text.
#[derive(Clone, Copy)]
struct Value<'de, 'n> {
    text: &'de RawValue,
    notes: &'n Notes,
}

impl<'de> Deserializer<'de> for Value<'de, '_> {
    type Error = Failure;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Failure> {
        let mut parser = serde_json::Deserializer::from_str(self.text.get());
        parser
            .deserialize_any(Opened { visitor, notes: self.notes })
            .unwrap_or_else(|error| Err(Failure::of_parser(&error)))
    }

    /// An object in the place of a list is one only where the reader asked for anything: see
    /// [`crate::api::wire::raw`].
    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Failure> {
        if self.text.get().starts_with('{') {
            return Err(de::Error::invalid_type(Unexpected::Map, &visitor));
        }
        self.deserialize_any(visitor)
    }

    /// Text that is to stay as it is.
    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        visitor: V,
    ) -> Result<V::Value, Failure> {
        let mut parser = serde_json::Deserializer::from_str(self.text.get());
        parser.deserialize_newtype_struct(name, visitor).map_err(|error| Failure::of_parser(&error))
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit unit_struct
        tuple tuple_struct map struct enum identifier ignored_any
    }
}

/// Looks at a value that the parser has opened, for a visitor that wants to hear of our faults, not
/// of the parser's.
struct Opened<'n, V> {
    visitor: V,
    notes: &'n Notes,
}

macro_rules! pass_on {
    ($($name:ident($type:ty))*) => {
        $(fn $name<E: de::Error>(self, value: $type) -> Result<Self::Value, E> {
            Ok(self.visitor.$name(value))
        })*
    };
}

impl<'de, V: Visitor<'de>> Visitor<'de> for Opened<'_, V> {
    type Value = Result<V::Value, Failure>;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        self.visitor.expecting(f)
    }

    pass_on! {
        visit_bool(bool)
        visit_i64(i64)
        visit_u64(u64)
        visit_f64(f64)
        visit_str(&str)
        visit_borrowed_str(&'de str)
    }

    fn visit_unit<E: de::Error>(self) -> Result<Self::Value, E> {
        Ok(self.visitor.visit_unit())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, inner: A) -> Result<Self::Value, A::Error> {
        let mut items = Items { inner, notes: self.notes, index: 0 };
        let value = self.visitor.visit_seq(&mut items);
        // What the visitor leaves, the parser must not find.
        while items.inner.next_element::<&RawValue>()?.is_some() {}
        Ok(value)
    }

    fn visit_map<A: MapAccess<'de>>(self, inner: A) -> Result<Self::Value, A::Error> {
        let mut entries = Entries { inner, notes: self.notes, key: None };
        let value = self.visitor.visit_map(&mut entries);
        if entries.key.take().is_some() {
            entries.inner.next_value::<&RawValue>()?;
        }
        while entries.inner.next_entry::<&RawValue, &RawValue>()?.is_some() {}
        Ok(value)
    }
}

/// The items of an array.
struct Items<'n, A> {
    inner: A,
    notes: &'n Notes,
    index: usize,
}

impl<'de, A: SeqAccess<'de>> SeqAccess<'de> for &mut Items<'_, A> {
    type Error = Failure;

    fn next_element_seed<T: DeserializeSeed<'de>>(
        &mut self,
        seed: T,
    ) -> Result<Option<T::Value>, Failure> {
        let Ok(Some(text)) = self.inner.next_element() else { return Ok(None) };
        let (index, notes) = (self.index, self.notes);
        self.index += 1;
        notes.within(index, || seed.deserialize(Value { text, notes })).map(Some)
    }
}

/// The entries of an object.
struct Entries<'n, A> {
    inner: A,
    notes: &'n Notes,
    key: Option<String>,
}

impl<'de, A: MapAccess<'de>> MapAccess<'de> for &mut Entries<'_, A> {
    type Error = Failure;

    fn next_key_seed<K: DeserializeSeed<'de>>(
        &mut self,
        seed: K,
    ) -> Result<Option<K::Value>, Failure> {
        // A key that is no text, for half a surrogate pair, ends the object: it has been refused as
        // a whole before.
        let Ok(Some(key)) = self.inner.next_key::<String>() else { return Ok(None) };
        let key = self.key.insert(key);
        seed.deserialize(key.as_str().into_deserializer()).map(Some)
    }

    fn next_value_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<T::Value, Failure> {
        let text = self.inner.next_value().map_err(|_| Failure::Noted)?;
        let key = self.key.take().unwrap_or_default().replace('~', "~0").replace('/', "~1");
        let notes = self.notes;
        notes.within(key, || seed.deserialize(Value { text, notes }))
    }
}

/// Where in a text a value begins and ends, among others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rank {
    /// Its beginning.
    pub start: usize,
    /// Its end.
    pub end: usize,
}

/// The ranks of the values at these places, in the order of the text; of those that are nowhere,
/// the last.
pub fn ranks(text: &RawValue, pointers: &[String]) -> Vec<Rank> {
    let mut ranks = vec![Rank { start: usize::MAX, end: usize::MAX }; pointers.len()];
    rank(text, "", pointers, &mut 0, &mut ranks);
    ranks
}

/// Goes where a pointer leads, and only there.
fn rank(text: &RawValue, at: &str, pointers: &[String], next: &mut usize, ranks: &mut [Rank]) {
    let start = *next;
    *next += 1;
    rank_inside(text, at, pointers, next, ranks);
    for (pointer, rank) in pointers.iter().zip(ranks) {
        if pointer == at && rank.start == usize::MAX {
            *rank = Rank { start, end: *next };
        }
    }
    *next += 1;
}

fn rank_inside(
    text: &RawValue,
    at: &str,
    pointers: &[String],
    next: &mut usize,
    ranks: &mut [Rank],
) {
    let within = format!("{at}/");
    let inside: Vec<&str> =
        pointers.iter().filter_map(|pointer| pointer.strip_prefix(&within)).collect();
    let leads = |step: &str| {
        inside.iter().any(|rest| {
            rest.strip_prefix(step).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
        })
    };
    if inside.is_empty() {
        return;
    }
    let mut step_in = |step: String, value: &RawValue| {
        if leads(&step) {
            rank(value, &format!("{within}{step}"), pointers, next, ranks);
        }
    };
    let mut parser = serde_json::Deserializer::from_str(text.get());
    // Neither an array nor an object has nothing inside.
    let _ = parser.deserialize_any(Walk(&mut step_in));
}

/// Hands out what is in an array or an object, with its step.
struct Walk<'a>(&'a mut dyn FnMut(String, &RawValue));

impl<'de> Visitor<'de> for Walk<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("an array or an object")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<(), A::Error> {
        let mut index = 0_usize;
        while let Some(value) = seq.next_element()? {
            (self.0)(index.to_string(), value);
            index += 1;
        }
        Ok(())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        while let Some((key, value)) = map.next_entry::<String, &RawValue>()? {
            (self.0)(key.replace('~', "~0").replace('/', "~1"), value);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_names_are_meant_and_far_ones_are_not() {
        let known = ["control_points", "family", "beta", "knots", "u"];
        for (name, expected) in [
            ("control_point", Some("control_points")),
            ("controlPoints", Some("control_points")),
            ("Famliy", Some("family")),
            ("bta", Some("beta")),
            ("zzz", None),
            ("", None),
            ("gamma", None),
        ] {
            assert_eq!(meant(name, known.into_iter()), expected, "{name}");
        }
        assert_eq!(meant(&"x".repeat(1_000_000), known.into_iter()), None);
    }

    #[test]
    fn places_are_ranked_as_they_come() {
        let text: &RawValue = serde_json::from_str(r#"{"b": [1, {"c/d": 2}], "a": 3}"#).unwrap();
        let pointers = ["/a", "", "/b/1/c~1d", "/b", "/b/0", "/nowhere"].map(String::from);
        let ranks = ranks(text, &pointers);
        let mut order: Vec<usize> = (0..6).collect();
        order.sort_by_key(|&i| ranks[i].start);
        assert_eq!(order, [1, 3, 4, 2, 0, 5]);
        order.sort_by_key(|&i| ranks[i].end);
        assert_eq!(order, [4, 2, 3, 0, 1, 5]);
    }
}
