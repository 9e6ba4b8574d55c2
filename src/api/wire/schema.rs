//! The schemas of declared objects.

use utoipa::openapi::RefOr;
use utoipa::openapi::schema::{
    AdditionalProperties, Discriminator, ObjectBuilder, OneOfBuilder, Ref, Schema, Type,
};

use crate::api::wire::variant::{Part, Variant};

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
