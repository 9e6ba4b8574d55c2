//! A variant of a union.

use std::fmt;

use utoipa::openapi::{RefOr, Schema};

use crate::api::error::{Error, Fault, every};

/// A field as the specification describes it.
pub struct Part {
    /// Its name.
    pub name: &'static str,
    /// Its documentation.
    pub doc: &'static str,
    /// Its schema.
    pub schema: RefOr<Schema>,
}

impl fmt::Debug for Part {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(self.name)
    }
}

/// A variant of a union.
pub struct Variant {
    /// The value of the tag.
    pub text: &'static str,
    /// The name of its schema.
    pub schema_name: &'static str,
    /// Its documentation.
    pub doc: &'static str,
    /// The fields it must have.
    pub required: &'static [&'static str],
    /// The fields it may have.
    pub optional: &'static [&'static str],
    /// Fields of which exactly one is given, with the name of the schema for each choice; mostly
    /// none.
    pub either: &'static [(&'static str, &'static str)],
    /// The fields that it describes otherwise than the union does.
    pub own: fn() -> Vec<Part>,
}

impl Variant {
    /// The names of its schemas, each with the field chosen, where there is a choice.
    pub(super) fn forms(&self) -> Vec<(&'static str, Option<&'static str>)> {
        match self.either {
            [] => vec![(self.schema_name, None)],
            choices => {
                choices.iter().map(|(field, schema_name)| (*schema_name, Some(*field))).collect()
            }
        }
    }

    pub(super) fn has(&self, field: &str) -> bool {
        self.required.contains(&field) || self.optional.contains(&field)
    }

    /// The fault of an object without its tag.
    pub fn missing_tag(variants: &[Variant], field: &'static str) -> Error {
        let values = variants.iter().map(|variant| variant.text).collect::<Vec<_>>().join(", ");
        Fault::MissingTag { field, values }.into()
    }

    /// Checks that the fields present are those of variant number `kind`.
    ///
    /// # Errors
    /// [`Fault::ForeignField`] at each such field, [`Fault::Missing`] at the object.
    pub fn check(
        variants: &'static [Variant],
        kind: usize,
        present: &[&'static str],
    ) -> Result<(), Error> {
        let variant = &variants[kind];
        let foreign = |field: &'static str| {
            let owners = variants
                .iter()
                .filter(|v| v.has(field))
                .map(|v| v.text)
                .collect::<Vec<_>>()
                .join(", ");
            Error::from(Fault::ForeignField { field, of: variant.text, owners }).at(field)
        };
        let foreign = present
            .iter()
            .filter(|field| !variant.has(field))
            .map(|&field| Err::<(), _>(foreign(field)));
        let absent = variant.required.iter().filter(|field| !present.contains(field));
        every(absent.map(|field| Err(missing(field))).chain(foreign)).map(drop)
    }
}

/// The fault of an object without a field it needs.
pub fn missing(field: &'static str) -> Error {
    Fault::Missing { field }.into()
}
