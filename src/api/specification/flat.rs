//! Answers with `layout=flat`: the schemas of answers once more, with one list of numbers where
//! they have lists of points.

use std::collections::BTreeMap;

use utoipa::openapi::schema::{
    AnyOfBuilder, Array, ArrayBuilder, ArrayItems, Ref, Schema, SchemaType, Type,
};
use utoipa::openapi::{OpenApi, RefOr};

use super::references;
use crate::api::operations::TABLE;
use crate::api::wire::number;

type Schemas = BTreeMap<String, RefOr<Schema>>;

/// Every JSON answer may be flat.
pub fn describe(api: &mut OpenApi) {
    let mut schemas =
        api.components.as_ref().map(|components| components.schemas.clone()).unwrap_or_default();
    for entry in TABLE {
        let content =
            super::posted(api, entry.path).and_then(|operation| super::answer(operation, "200"));
        let Some(content) = content.and_then(|answer| super::content(answer, super::JSON)) else {
            continue;
        };
        let Some(nested) = content.schema.clone() else { continue };
        if let Some(flat) = flattened(&nested, &mut schemas) {
            let either = AnyOfBuilder::new().item(nested).item(flat);
            content.schema = Some(Schema::AnyOf(either.build()).into());
        }
    }
    if let Some(components) = api.components.as_mut() {
        components.schemas = schemas;
    }
}

/// One list for all coordinates.
fn numbers(description: Option<String>) -> RefOr<Schema> {
    let beside = description.map_or(String::new(), |text| format!("{text} "));
    let text = format!("{beside}All coordinates in one list, point after point.");
    ArrayBuilder::new().items(number()).description(Some(text)).into()
}

/// The schema with flat lists, if it has lists of points.
fn flattened(schema: &RefOr<Schema>, schemas: &mut Schemas) -> Option<RefOr<Schema>> {
    let schema = match schema {
        RefOr::Ref(reference) if references::name(reference) == "Points" => {
            let description = Some(reference.description.clone()).filter(|text| !text.is_empty());
            return Some(numbers(description));
        }
        RefOr::Ref(reference) => {
            let mut flat = Ref::from_schema_name(flat_name(references::name(reference), schemas)?);
            flat.description.clone_from(&reference.description);
            return Some(flat.into());
        }
        RefOr::T(schema) => schema,
    };
    match schema {
        Schema::Array(array) => flattened_list(array, schemas),
        Schema::Object(object) => {
            let mut flat = object.clone();
            let mut changed = false;
            for property in flat.properties.values_mut() {
                changed |= replace(property, schemas);
            }
            changed.then(|| Schema::Object(flat).into())
        }
        Schema::OneOf(union) => {
            let mut flat = union.clone();
            let changed =
                flat.items.iter_mut().fold(false, |changed, item| replace(item, schemas) | changed);
            for schema in flat.discriminator.iter_mut().flat_map(|told| told.mapping.values_mut()) {
                if let RefOr::Ref(new) = flattened(&Ref::new(schema.clone()).into(), schemas)? {
                    *schema = new.ref_location;
                }
            }
            changed.then(|| Schema::OneOf(flat).into())
        }
        _ => None,
    }
}

fn replace(schema: &mut RefOr<Schema>, schemas: &mut Schemas) -> bool {
    let flat = flattened(schema, schemas);
    let changed = flat.is_some();
    if let Some(flat) = flat {
        *schema = flat;
    }
    changed
}

fn flattened_list(list: &Array, schemas: &mut Schemas) -> Option<RefOr<Schema>> {
    let ArrayItems::RefOrSchema(items) = &list.items else { return None };
    if is_point(items) {
        return Some(numbers(list.description.clone()));
    }
    let mut flat = list.clone();
    flat.items = ArrayItems::RefOrSchema(Box::new(flattened(items, schemas)?));
    Some(Schema::Array(flat).into())
}

/// A point, or another array of so many doubles.
fn is_point(schema: &RefOr<Schema>) -> bool {
    match schema {
        RefOr::Ref(reference) => ["Point2", "Point3"].contains(&references::name(reference)),
        RefOr::T(Schema::Array(array)) => {
            let of_numbers = match &array.items {
                ArrayItems::RefOrSchema(items) => {
                    matches!(&**items, RefOr::T(Schema::Object(item)) if item.schema_type == SchemaType::Type(Type::Number))
                }
                ArrayItems::False => false,
            };
            of_numbers && array.min_items.is_some() && array.min_items == array.max_items
        }
        RefOr::T(_) => false,
    }
}

/// The name of the flat schema beside this one, which is made where it is not there yet.
fn flat_name(name: &str, schemas: &mut Schemas) -> Option<String> {
    let flat_name = format!("Flat{name}");
    if !schemas.contains_key(&flat_name) {
        let nested = schemas.get(name)?.clone();
        let flat = flattened(&nested, schemas)?;
        schemas.insert(flat_name.clone(), flat);
    }
    Some(flat_name)
}
