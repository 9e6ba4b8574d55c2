//! JSON objects, declared once: the macros, and the functions that do their work.

use std::fmt;

use serde::de::{DeserializeSeed, Deserializer, Error as _, MapAccess};
use utoipa::openapi::RefOr;
use utoipa::openapi::schema::{
    AdditionalProperties, Discriminator, ObjectBuilder, OneOfBuilder, Ref, Schema, Type,
};

use crate::api::error::{Error, Fault, every};
use crate::api::wire::reading::{Read, Reading};

/// Declares a JSON object: `required` or `optional` fields, each with its documentation, its type
/// and, where the type alone does not say enough, its schema.
///
/// The struct has an `Option` for every field; unknown and repeated fields are refused by name, and
/// so is `null`; fields without a value are not written.
#[macro_export]
#[doc(hidden)]
macro_rules! object {
    ($(#[doc = $doc:literal])* pub struct $name:ident {
        $($(#[doc = $fdoc:literal])* $need:ident $field:ident: $type:ty $(= $schema:expr)?),* $(,)?
    }) => {
        $crate::object_type! { $(#[doc = $doc])* $name { $($(#[doc = $fdoc])* $field: $type),* } }
        $crate::described! { $(#[doc = $doc])* $name { $($(#[doc = $fdoc])* $need $field: $type $(= $schema)?),* } }
    };
}

/// Declares a JSON object whose fields depend on a tag: all fields once, then the variants, each
/// with the name of its schema, the fields it requires and allows, in `either [..]` those of which
/// exactly one is given, each with the name of the schema of that choice, and, in `where { .. }`,
/// those that it describes otherwise.
///
/// The struct is flat, so that a fault anywhere inside keeps its exact place; `kind` checks that
/// the fields present are those of the variant. The schema is a `oneOf` with a discriminator.
#[macro_export]
#[doc(hidden)]
macro_rules! union {
    ($(#[doc = $doc:literal])* pub struct $name:ident by $tag:ident: $kind:ident {
        $($(#[doc = $fdoc:literal])* $field:ident: $type:ty $(= $schema:expr)?),* $(,)?
    }
    $($(#[doc = $vdoc:literal])* $text:literal $variant:ident as $schema_name:ident: [$($required:ident),*] [$($optional:ident),*]
        $(either [$($choice:ident as $choice_schema:ident),*])?
        $(where { $($(#[doc = $odoc:literal])* $own:ident = $oschema:expr),* $(,)? })?;)*) => {
        $crate::names! { #[doc = "The variants."] pub enum $kind { $($(#[doc = $vdoc])* $variant = $text),* } }

        $crate::object_type! { $(#[doc = $doc])* $name {
            #[doc = "Which variant this is."] $tag: $kind,
            $($(#[doc = $fdoc])* $field: $type),*
        } }

        impl $name {
            const VARIANTS: &[$crate::api::wire::Variant] = &[$($crate::api::wire::Variant {
                text: $text,
                schema_name: stringify!($schema_name),
                doc: concat!($($vdoc, "\n"),*),
                required: &[$(stringify!($required)),*],
                optional: &[$(stringify!($optional)),*],
                either: &[$($((stringify!($choice), stringify!($choice_schema))),*)?],
                own: || vec![$($($crate::part!($(#[doc = $odoc])* $own: () = $oschema)),*)?],
            }),*];

            /// An empty object of this variant, to be filled for an answer.
            pub fn of(kind: $kind) -> Self {
                Self { $tag: Some(kind), ..Self::default() }
            }

            /// The variant, once it is known that its required fields are there and no foreign
            /// ones.
            ///
            /// # Errors
            /// A missing tag or field, or a field of another variant.
            pub fn kind(&self) -> Result<$kind, $crate::api::error::Error> {
                let kind = self.tag()?;
                $crate::api::wire::Variant::check(Self::VARIANTS, kind as usize, &self.present()[1..])?;
                Ok(kind)
            }

            /// The variant, whatever fields are there.
            fn tag(&self) -> Result<$kind, $crate::api::error::Error> {
                self.$tag.ok_or_else(|| $crate::api::wire::Variant::missing_tag(Self::VARIANTS, stringify!($tag)))
            }

            fn parts() -> Vec<$crate::api::wire::Part> {
                vec![$($crate::part!($(#[doc = $fdoc])* $field: $type $(= $schema)?)),*]
            }
        }

        impl $crate::api::wire::Field for $name {}

        impl $crate::api::wire::Described for $name {
            fn schema() -> utoipa::openapi::RefOr<utoipa::openapi::schema::Schema> {
                utoipa::openapi::schema::Ref::from_schema_name(stringify!($name)).into()
            }

            fn collect(components: &mut Vec<(String, utoipa::openapi::RefOr<utoipa::openapi::schema::Schema>)>) {
                $crate::api::wire::union_schema(
                    stringify!($name), concat!($($doc, "\n"),*), stringify!($tag), Self::VARIANTS, &Self::parts(), components,
                );
                Self::collect_parts(components);
            }
        }
    };
}

/// The struct behind `object!` and `union!`, with its reading and writing.
#[macro_export]
#[doc(hidden)]
macro_rules! object_type {
    ($(#[doc = $doc:literal])* $name:ident { $($(#[doc = $fdoc:literal])* $field:ident: $type:ty),* }) => {
        $(#[doc = $doc])*
        #[derive(Debug, Clone, Default)]
        pub struct $name {
            $($(#[doc = $fdoc])* pub $field: Option<$type>),*
        }

        impl $crate::api::writer::Written for $name {
            fn write_to(&self, writer: &mut $crate::api::writer::Writer) -> Result<(), $crate::api::writer::Unwritten> {
                let mut object = writer.object()?;
                $(object.optional(stringify!($field), &self.$field)?;)*
                object.end()
            }
        }

        impl<'de> $crate::api::wire::Read<'de> for $name {
            fn read<D: serde::Deserializer<'de>>(
                reading: &$crate::api::wire::Reading,
                deserializer: D,
            ) -> Result<Self, D::Error> {
                struct ObjectVisitor<'r>(&'r $crate::api::wire::Reading<'r>);
                impl<'de> serde::de::Visitor<'de> for ObjectVisitor<'_> {
                    type Value = $name;

                    fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                        f.write_str(concat!("an object with the fields", $(" `", stringify!($field), "`"),*))
                    }

                    fn visit_map<A: serde::de::MapAccess<'de>>(self, mut map: A) -> Result<$name, A::Error> {
                        // A list of objects may take long to read.
                        self.0.checkpoint::<A::Error>()?;
                        let mut object = $name::default();
                        while let Some(key) = map.next_key::<String>()? {
                            match key.as_str() {
                                $(stringify!($field) => $crate::api::wire::set(
                                    self.0, &mut object.$field, stringify!($field), &mut map,
                                )?,)*
                                _ => $crate::api::wire::refuse(
                                    self.0, &mut map, &key, &[$(stringify!($field)),*],
                                )?,
                            }
                        }
                        Ok(object)
                    }
                }
                deserializer.deserialize_map(ObjectVisitor(reading))
            }
        }

        impl $name {
            #[allow(dead_code, reason = "only unions and tests ask which fields are present")]
            fn present(&self) -> Vec<&'static str> {
                [$(self.$field.is_some().then_some(stringify!($field))),*].into_iter().flatten().collect()
            }

            fn collect_parts(components: &mut Vec<(String, utoipa::openapi::RefOr<utoipa::openapi::schema::Schema>)>) {
                $(<$type as $crate::api::wire::Described>::collect(components);)*
                let _ = components;
            }
        }
    };
}

/// One declared field.
#[macro_export]
#[doc(hidden)]
macro_rules! part {
    ($(#[doc = $doc:literal])* $field:ident: $type:ty = $schema:expr) => {
        $crate::api::wire::Part { name: stringify!($field), doc: concat!($($doc, "\n"),*), schema: $schema.into() }
    };
    ($(#[doc = $doc:literal])* $field:ident: $type:ty) => {
        $crate::part!($(#[doc = $doc])* $field: $type = <$type as $crate::api::wire::Described>::schema())
    };
}

/// Whether a field is required.
#[macro_export]
#[doc(hidden)]
macro_rules! required {
    (required) => {
        true
    };
    (optional) => {
        false
    };
}

/// A declared object that is also a field of others; `answer` where only answers hold it.
#[macro_export]
#[doc(hidden)]
macro_rules! nested {
    ($name:ident) => {
        $crate::nested!(answer $name);
        impl $crate::api::wire::Field for $name {}
    };
    (answer $name:ident) => {
        impl $crate::api::wire::Described for $name {
            fn schema() -> utoipa::openapi::RefOr<utoipa::openapi::schema::Schema> {
                utoipa::openapi::schema::Ref::from_schema_name(stringify!($name)).into()
            }

            fn collect(components: &mut Vec<(String, utoipa::openapi::RefOr<utoipa::openapi::schema::Schema>)>) {
                components.push((stringify!($name).into(), <Self as utoipa::PartialSchema>::schema()));
                Self::collect_parts(components);
            }
        }
    };
}

/// Declares a JSON object that only answers hold: a required field is there, an optional one may
/// be.
#[macro_export]
#[doc(hidden)]
macro_rules! answer {
    ($(#[doc = $doc:literal])* pub struct $name:ident {
        $($(#[doc = $fdoc:literal])* $need:ident $field:ident: $type:ty $(= $schema:expr)?),* $(,)?
    }) => {
        $(#[doc = $doc])*
        #[derive(Debug, Clone)]
        pub struct $name {
            $($(#[doc = $fdoc])* pub $field: $crate::held!($need $type)),*
        }

        impl $crate::api::writer::Written for $name {
            fn write_to(&self, writer: &mut $crate::api::writer::Writer) -> Result<(), $crate::api::writer::Unwritten> {
                let mut object = writer.object()?;
                $($crate::write_field!($need object self $field);)*
                object.end()
            }
        }

        impl $name {
            fn collect_parts(components: &mut Vec<(String, utoipa::openapi::RefOr<utoipa::openapi::schema::Schema>)>) {
                $(<$type as $crate::api::wire::Described>::collect(components);)*
                let _ = components;
            }
        }

        $crate::described! { $(#[doc = $doc])* $name { $($(#[doc = $fdoc])* $need $field: $type $(= $schema)?),* } }
    };
}

/// The type of a field of an answer.
#[macro_export]
#[doc(hidden)]
macro_rules! held {
    (required $type:ty) => { $type };
    (optional $type:ty) => { Option<$type> };
}

/// Writes a field of an answer.
#[macro_export]
#[doc(hidden)]
macro_rules! write_field {
    (required $object:ident $self:ident $field:ident) => {
        $object.field(stringify!($field), &$self.$field)?
    };
    (optional $object:ident $self:ident $field:ident) => {
        $object.optional(stringify!($field), &$self.$field)?
    };
}

/// The schema of a declared object.
#[macro_export]
#[doc(hidden)]
macro_rules! described {
    ($(#[doc = $doc:literal])* $name:ident { $($(#[doc = $fdoc:literal])* $need:ident $field:ident: $type:ty $(= $schema:expr)?),* }) => {
        impl utoipa::PartialSchema for $name {
            fn schema() -> utoipa::openapi::RefOr<utoipa::openapi::schema::Schema> {
                $crate::api::wire::schema_of(concat!($($doc, "\n"),*), None, &Self::parts(), &[], |name| match name {
                    $(stringify!($field) => Some($crate::required!($need)),)*
                    _ => None,
                })
            }
        }

        impl utoipa::ToSchema for $name {
            fn name() -> std::borrow::Cow<'static, str> {
                stringify!($name).into()
            }

            fn schemas(components: &mut Vec<(String, utoipa::openapi::RefOr<utoipa::openapi::schema::Schema>)>) {
                Self::collect_parts(components);
            }
        }

        impl $name {
            fn parts() -> Vec<$crate::api::wire::Part> {
                vec![$($crate::part!($(#[doc = $fdoc])* $field: $type $(= $schema)?)),*]
            }
        }
    };
}

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

/// The fault of an object without a field it needs.
pub fn missing(field: &'static str) -> Error {
    Fault::Missing { field }.into()
}

/// A field as the specification describes it.
pub struct Part {
    /// Its name.
    pub name: &'static str,
    /// Its documentation.
    pub doc: &'static str,
    /// Its schema.
    pub schema: RefOr<Schema>,
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
    fn forms(&self) -> Vec<(&'static str, Option<&'static str>)> {
        match self.either {
            [] => vec![(self.schema_name, None)],
            choices => {
                choices.iter().map(|(field, schema_name)| (*schema_name, Some(*field))).collect()
            }
        }
    }

    fn has(&self, field: &str) -> bool {
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

/// The schema of text that is always the same.
pub fn constant(value: &str) -> ObjectBuilder {
    // OpenAPI 3.1 has the keyword from JSON Schema; the builder has not.
    let keyword = [("const", value)].into_iter().collect();
    ObjectBuilder::new().schema_type(Type::String).extensions(Some(keyword))
}

/// The schema of text that is one of these.
pub fn one_of(names: &[&str]) -> RefOr<Schema> {
    match names {
        [only] => constant(only).into(),
        several => ObjectBuilder::new()
            .schema_type(Type::String)
            .enum_values(Some(several.iter().copied()))
            .into(),
    }
}

/// The closed schema of an object; `tag` adds a property with one allowed value; `own` replaces
/// parts of the same name. `required` answers `None` for fields that the object does not have.
pub fn schema_of(
    doc: &str,
    tag: Option<(&str, &str)>,
    parts: &[Part],
    own: &[Part],
    required: impl Fn(&str) -> Option<bool>,
) -> RefOr<Schema> {
    let mut object = ObjectBuilder::new().schema_type(Type::Object).description(Some(tidy(doc)));
    if let Some((name, value)) = tag {
        object = object
            .property(name, constant(value).description(Some(format!("Always `{value}`."))))
            .required(name);
    }
    for part in parts {
        let Some(required) = required(part.name) else { continue };
        let part = own.iter().find(|own| own.name == part.name).unwrap_or(part);
        object = object.property(part.name, described(part.schema.clone(), part.doc));
        if required {
            object = object.required(part.name);
        }
    }
    object.additional_properties(Some(AdditionalProperties::FreeForm(false))).into()
}

/// Adds the schema of each variant, and of their union under its own name.
pub fn union_schema(
    name: &str,
    doc: &str,
    tag: &str,
    variants: &[Variant],
    parts: &[Part],
    components: &mut Vec<(String, RefOr<Schema>)>,
) {
    let reference = |variant: &Variant| format!("#/components/schemas/{}", variant.schema_name);
    let mapping = variants.iter().map(|variant| (variant.text, reference(variant)));
    // A value that several schemas share maps to none; the constants in the schemas tell the
    // variants apart all the same.
    let is_told = variants.iter().all(|variant| variant.either.is_empty());
    let discriminator = is_told.then(|| Discriminator::with_mapping(tag, mapping));
    let mut union = OneOfBuilder::new().description(Some(tidy(doc))).discriminator(discriminator);
    for variant in variants {
        for (schema_name, chosen) in variant.forms() {
            let required = |field: &str| match chosen {
                Some(chosen) if variant.either.iter().any(|(other, _)| *other == field) => {
                    (field == chosen).then_some(true)
                }
                _ => variant.has(field).then(|| variant.required.contains(&field)),
            };
            let schema = schema_of(
                variant.doc,
                Some((tag, variant.text)),
                parts,
                &(variant.own)(),
                required,
            );
            components.push((schema_name.into(), schema));
            union = union.item(Ref::from_schema_name(schema_name));
        }
    }
    components.push((name.into(), union.into()));
}

/// A schema with the documentation of the field that has it.
fn described(schema: RefOr<Schema>, doc: &str) -> RefOr<Schema> {
    let text = tidy(doc);
    match schema {
        RefOr::Ref(mut reference) => {
            reference.description = text;
            RefOr::Ref(reference)
        }
        RefOr::T(Schema::Object(mut object)) => {
            object.description = Some(text);
            RefOr::T(Schema::Object(object))
        }
        RefOr::T(Schema::Array(mut array)) => {
            array.description = Some(text);
            RefOr::T(Schema::Array(array))
        }
        RefOr::T(Schema::OneOf(mut union)) => {
            union.description = Some(text);
            RefOr::T(Schema::OneOf(union))
        }
        other => other,
    }
}

/// Documentation lines as one paragraph.
fn tidy(doc: &str) -> String {
    doc.split_whitespace().collect::<Vec<_>>().join(" ")
}

impl fmt::Debug for Part {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(self.name)
    }
}
