//! The entries of a JSON object, read one by one.

use serde::de::{DeserializeSeed, Deserializer, Error as _, MapAccess};

use crate::api::wire::reading::{Read, Reading};

/// Reads the value of a field into its place, once. Where the reader goes on after a fault, the
/// place stays empty.
pub fn set<'de, T: Read<'de>, A: MapAccess<'de>>(
    reading: &Reading,
    place: &mut Option<T>,
    name: &'static str,
    map: &mut A,
) -> Result<(), A::Error> {
    set_by(reading, place, name, map, |map| map.next_value_seed(reading.seed()))
}

/// The same for a value that is read in its own way.
pub fn set_by<'de, T, A: MapAccess<'de>>(
    reading: &Reading,
    place: &mut Option<T>,
    name: &'static str,
    map: &mut A,
    read: impl FnOnce(&mut A) -> Result<T, A::Error>,
) -> Result<(), A::Error> {
    let read = match place {
        Some(_) => map.next_value_seed(Refusal::Repeated(name)),
        None => read(map).map(|value| *place = Some(value)),
    };
    go_on(reading, read)
}

/// Refuses a field that the object does not have.
pub fn refuse<'de, A: MapAccess<'de>>(
    reading: &Reading,
    map: &mut A,
    name: &str,
    known: &'static [&'static str],
) -> Result<(), A::Error> {
    go_on(reading, map.next_value_seed(Refusal::Unknown(name, known)))
}

/// A fault that the reader has noted does not end the object.
fn go_on<E>(reading: &Reading, read: Result<(), E>) -> Result<(), E> {
    if reading.goes_on() { Ok(()) } else { read }
}

/// Fails while the value is read, and not before, so that the place of the fault is this field.
enum Refusal<'a> {
    Repeated(&'static str),
    Unknown(&'a str, &'static [&'static str]),
}

impl<'de> DeserializeSeed<'de> for Refusal<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, _: D) -> Result<(), D::Error> {
        Err(match self {
            Refusal::Repeated(name) => D::Error::duplicate_field(name),
            Refusal::Unknown(name, known) => D::Error::unknown_field(name, known),
        })
    }
}
