//! Reading on after a fault, so that a client learns of all that is wrong with a request at once.
//!
//! A reader of JSON cannot go on inside a value that it has refused. Here every value is first cut
//! out of the text, which is known to be JSON, and then read by itself: its fault is noted with its
//! place, and the next value is read.

use std::cell::{Cell, RefCell};
use std::fmt::{self, Display};

use serde::de::{
    self, DeserializeSeed, Deserializer, IntoDeserializer, MapAccess, SeqAccess, Unexpected,
    Visitor,
};
use serde::forward_to_deserialize_any;
use serde_json::value::RawValue;

use crate::api::problem::FoundFault;
use crate::api::sentences::shortened;
use crate::api::wire::failure::Failure;
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
impl From<Misfit> for FoundFault {
    fn from(Misfit { pointer, code, detail, .. }: Misfit) -> Self {
        FoundFault::unread(pointer, code, detail)
    }
}
