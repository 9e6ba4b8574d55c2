//! Which schemas a schema refers to.

use utoipa::openapi::RefOr;
use utoipa::openapi::schema::{AdditionalProperties, ArrayItems, Ref, Schema};

/// Where schemas are.
const PREFIX: &str = "#/components/schemas/";

/// The name of the schema that a reference leads to.
pub fn name(reference: &Ref) -> &str {
    reference.ref_location.trim_start_matches(PREFIX)
}

/// The names of all schemas that a schema refers to.
pub fn names(schema: &RefOr<Schema>) -> Vec<&str> {
    let schema = match schema {
        RefOr::Ref(reference) => return vec![name(reference)],
        RefOr::T(schema) => schema,
    };
    match schema {
        Schema::Array(array) => match &array.items {
            ArrayItems::RefOrSchema(items) => names(items),
            ArrayItems::False => Vec::new(),
        },
        Schema::Object(object) => {
            let free = match object.additional_properties.as_deref() {
                Some(AdditionalProperties::RefOr(schema)) => names(schema),
                _ => Vec::new(),
            };
            object.properties.values().flat_map(names).chain(free).collect()
        }
        Schema::OneOf(union) => union.items.iter().flat_map(names).collect(),
        Schema::AnyOf(union) => union.items.iter().flat_map(names).collect(),
        Schema::AllOf(all) => all.items.iter().flat_map(names).collect(),
        _ => Vec::new(),
    }
}
