//! The values that fields hold.

use std::marker::PhantomData;

use bytemuck::TransparentWrapper;
use serde::de::{Error as _, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use utoipa::openapi::RefOr;
use utoipa::openapi::schema::{ArrayBuilder, ObjectBuilder, Schema, Type};

use crate::api::error::{Error, Fault, Locate};
use crate::api::number_text::Numbers;
use crate::api::unwritten::Unwritten;
use crate::api::wire::length::{ITEMS, too_long};
use crate::api::wire::raw;
use crate::api::wire::reading::{Read, Reading};
use crate::api::writer::{Writer, Written};

/// Named schemas, as the specification collects them.
pub type Components = Vec<(String, RefOr<Schema>)>;

/// A JSON value as the specification describes it.
pub trait Described {
    /// The schema, or a reference to it.
    fn schema() -> RefOr<Schema>;

    /// Adds the schemas that [`Described::schema`] refers to.
    fn collect(_components: &mut Components) {}
}

/// A JSON value that a request may hold: how it is read.
pub trait Field: Described + for<'de> Read<'de> {
    /// Such values as rows of raw numbers, where a request may have them: those beginning at
    /// `start`.
    fn from_raw(_rows: raw::Rows) -> Option<Vec<Self>> {
        None
    }
}

/// Reads the items that are left of a list, and all of them where the reader goes on after a fault.
///
/// # Errors
/// The first item that is none; more than [`ITEMS`].
pub(super) fn read_each<'de, T, A>(
    reading: &Reading,
    seq: &mut A,
    mut take: impl FnMut(T),
) -> Result<(), A::Error>
where
    T: Read<'de>,
    A: SeqAccess<'de>,
{
    let (mut pace, mut count, mut fault) = (reading.pace(), 0, None);
    loop {
        match seq.next_element_seed(reading.seed()) {
            Ok(Some(_)) if count == ITEMS => return Err(too_long()),
            Ok(Some(item)) => take(item),
            Ok(None) => break,
            Err(error) if reading.goes_on() => fault = Some(error),
            Err(error) => return Err(error),
        }
        pace.step().map_err(A::Error::custom)?;
        count += 1;
    }
    fault.map_or(Ok(()), Err)
}

/// Values that `serde` reads.
macro_rules! read_by_serde {
    ($($type:ty),*) => {
        $(impl<'de> Read<'de> for $type {
            #[inline]
            fn read<D: Deserializer<'de>>(_: &Reading, deserializer: D) -> Result<Self, D::Error> {
                Self::deserialize(deserializer)
            }
        })*
    };
}

read_by_serde!(f64, i32, String, bool);

impl Described for f64 {
    fn schema() -> RefOr<Schema> {
        number().into()
    }
}

impl Field for f64 {
    fn from_raw(rows: raw::Rows) -> Option<Vec<f64>> {
        rows.numbers()
    }
}

impl Field for i32 {}

impl Described for i32 {
    fn schema() -> RefOr<Schema> {
        ObjectBuilder::new().schema_type(Type::Integer).into()
    }
}

impl Field for String {}

impl Described for String {
    fn schema() -> RefOr<Schema> {
        ObjectBuilder::new().schema_type(Type::String).into()
    }
}

impl Field for bool {}

impl Described for bool {
    fn schema() -> RefOr<Schema> {
        ObjectBuilder::new().schema_type(Type::Boolean).into()
    }
}

impl<T: Described> Described for Vec<T> {
    fn schema() -> RefOr<Schema> {
        ArrayBuilder::new().items(T::schema()).into()
    }

    fn collect(components: &mut Components) {
        T::collect(components);
    }
}

impl<T: Field> Field for Vec<T> {}

impl<'de, T: Field> Read<'de> for Vec<T> {
    fn read<D: Deserializer<'de>>(reading: &Reading, deserializer: D) -> Result<Self, D::Error> {
        struct List<'r, T>(&'r Reading<'r>, PhantomData<T>);
        impl<'de, T: Field> Visitor<'de> for List<'_, T> {
            type Value = Vec<T>;

            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("a sequence")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Vec<T>, A::Error> {
                let mut items = Vec::new();
                read_each(self.0, &mut seq, |item| items.push(item))?;
                Ok(items)
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Vec<T>, A::Error> {
                let rows = raw::rows(self.0, map)?;
                let fault = |()| {
                    A::Error::custom(rows.misfit("0: a list of plain numbers (only lists of numbers and of points may be raw)"))
                };
                T::from_raw(rows.clone()).ok_or(()).map_err(fault)
            }
        }
        raw::deserialize_list(reading, deserializer, List(reading, PhantomData))
    }
}

/// The schema of a double.
pub fn number() -> ObjectBuilder {
    ObjectBuilder::new().schema_type(Type::Number)
}

/// The schema of a whole number from `least` to `most`.
pub fn whole(least: usize, most: usize) -> ObjectBuilder {
    ObjectBuilder::new().schema_type(Type::Integer).minimum(Some(least)).maximum(Some(most))
}

/// The schema of a list with `least` to `most` items.
pub fn list<T: Described>(least: usize, most: usize) -> ArrayBuilder {
    ArrayBuilder::new().items(T::schema()).min_items(Some(least)).max_items(Some(most))
}

/// The value of a field that must be there.
///
/// # Errors
/// [`Fault::Missing`], placed at the object that lacks it.
pub fn need<T>(field: Option<T>, name: &'static str) -> Result<T, Error> {
    field.ok_or_else(|| Fault::Missing { field: name }.into())
}

/// The parsed value of a field that must be there.
///
/// # Errors
/// [`Fault::Missing`] at the object; what is wrong with the value, at its field.
pub fn part<T, U, E: Into<Error>>(
    field: Option<T>,
    name: &'static str,
    parse: impl FnOnce(T) -> Result<U, E>,
) -> Result<U, Error> {
    parse(need(field, name)?).at(name)
}

/// A count. Any JSON number without a fraction: `3` and `3.0` are the same number.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Whole(pub usize);

impl Whole {
    /// Beyond this doubles skip integers.
    const MOST: f64 = 9_007_199_254_740_992.0;
}

impl<'de> Read<'de> for Whole {
    fn read<D: Deserializer<'de>>(_: &Reading, deserializer: D) -> Result<Self, D::Error> {
        struct WholeVisitor;
        impl Visitor<'_> for WholeVisitor {
            type Value = Whole;

            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("a whole number, 0 or more")
            }

            fn visit_u64<E: serde::de::Error>(self, value: u64) -> Result<Whole, E> {
                usize::try_from(value).map(Whole).map_err(E::custom)
            }

            fn visit_f64<E: serde::de::Error>(self, value: f64) -> Result<Whole, E> {
                let whole = (0.0..=Whole::MOST).contains(&value) && value.fract() == 0.0;
                if whole {
                    Ok(Whole(value as usize))
                } else {
                    Err(E::invalid_type(serde::de::Unexpected::Float(value), &self))
                }
            }
        }
        deserializer.deserialize_any(WholeVisitor)
    }
}

impl Written for Whole {
    fn write_to(&self, writer: &mut Writer) -> Result<(), Unwritten> {
        writer.json(&self.0)
    }
}

impl Field for Whole {}

impl Described for Whole {
    fn schema() -> RefOr<Schema> {
        ObjectBuilder::new().schema_type(Type::Integer).minimum(Some(0)).into()
    }
}

/// Exactly `N` values of one kind, as an array.
#[derive(Debug, Clone, Copy, PartialEq, Eq, TransparentWrapper)]
#[repr(transparent)]
pub struct Tuple<T, const N: usize>(pub [T; N]);

impl<'de, T: Field, const N: usize> Read<'de> for Tuple<T, N> {
    fn read<D: Deserializer<'de>>(reading: &Reading, deserializer: D) -> Result<Self, D::Error> {
        // A list first: a reader of N values would take one too many for broken JSON.
        let values = Vec::read(reading, deserializer)?;
        let wrong = |values: Vec<T>| {
            serde::de::Error::invalid_length(values.len(), &format!("an array of {N}").as_str())
        };
        values.try_into().map(Tuple).map_err(wrong)
    }
}

impl<T: Written, const N: usize> Written for Tuple<T, N> {
    fn write_to(&self, writer: &mut Writer) -> Result<(), Unwritten> {
        writer.list(&self.0)
    }

    fn numbers(list: &[Self]) -> Option<Numbers<'_>> {
        let numbers = T::numbers(Self::peel_slice(list).as_flattened())?;
        (numbers.columns == 0).then_some(Numbers { columns: N, ..numbers })
    }
}

impl<T: Described, const N: usize> Described for Tuple<T, N> {
    fn schema() -> RefOr<Schema> {
        list::<T>(N, N).into()
    }

    fn collect(components: &mut Components) {
        T::collect(components);
    }
}

impl<T: Field, const N: usize> Field for Tuple<T, N> {}

/// Declares an enum of names: `names! { pub enum Form { Auto = "auto", .. } }`.
#[macro_export]
#[doc(hidden)]
macro_rules! names {
    ($(#[doc = $doc:literal])* $vis:vis enum $name:ident { $($(#[doc = $vdoc:literal])* $variant:ident = $text:literal),* $(,)? }) => {
        $(#[doc = $doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        $vis enum $name { $($(#[doc = $vdoc])* $variant),* }

        impl $crate::api::writer::Written for $name {
            fn write_to(&self, writer: &mut $crate::api::writer::Writer) -> Result<(), $crate::api::unwritten::Unwritten> {
                writer.json(&match self { $($name::$variant => $text),* })
            }
        }

        impl<'de> $crate::api::wire::Read<'de> for $name {
            fn read<D: serde::Deserializer<'de>>(
                _: &$crate::api::wire::Reading,
                deserializer: D,
            ) -> Result<Self, D::Error> {
                const NAMES: &[&str] = &[$($text),*];
                struct NameVisitor;
                impl serde::de::Visitor<'_> for NameVisitor {
                    type Value = $name;

                    fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                        f.write_str("one of ")?;
                        f.write_str(&NAMES.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", "))
                    }

                    fn visit_str<E: serde::de::Error>(self, name: &str) -> Result<$name, E> {
                        match name {
                            $($text => Ok($name::$variant),)*
                            _ => Err(E::unknown_variant(name, NAMES)),
                        }
                    }
                }
                deserializer.deserialize_str(NameVisitor)
            }
        }

        impl $crate::api::wire::Field for $name {}

        impl $crate::api::wire::Described for $name {
            fn schema() -> utoipa::openapi::RefOr<utoipa::openapi::schema::Schema> {
                $crate::api::wire::one_of(&[$($text),*])
            }
        }
    };
}
