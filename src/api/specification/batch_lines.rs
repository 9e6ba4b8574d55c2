//! The lines of batches, which are no body of one schema.

use serde_json::json;
use utoipa::openapi::extensions::Extensions;
use utoipa::openapi::request_body::RequestBody;
use utoipa::openapi::schema::{
    AdditionalProperties, AnyOfBuilder, Discriminator, ObjectBuilder, OneOfBuilder, Ref, Schema,
    Type,
};
use utoipa::openapi::{Content, OpenApi, RefOr};

use crate::api::lines::NDJSON;
use crate::api::operations::TABLE;
use crate::api::wire::{constant, whole};

/// The schemas of a line in and of a line out, and where they apply.
pub fn describe(api: &mut OpenApi) {
    let mut named: Vec<(String, RefOr<Schema>)> = vec![("LineId".into(), id())];
    let mut requests = OneOfBuilder::new()
        .description(Some("A line of a batch: an operation, told by its `op`, and its request."));
    let mut answers = AnyOfBuilder::new().description(Some(
        "The answer of the operation of the line; of render, the picture as a string.",
    ));
    let mut mapping = Vec::new();
    for entry in TABLE {
        let op = entry.name();
        let Some(operation) = super::posted(api, entry.path) else { continue };
        let Some(request) = request(operation.request_body.as_ref()) else { continue };
        let name = format!("{}Line", pascal(operation.operation_id.as_deref().unwrap_or_default()));
        named.push((name.clone(), line(op, request)));
        mapping.push((op, format!("#/components/schemas/{name}")));
        requests = requests.item(Ref::from_schema_name(name));
        let answer =
            super::answer(operation, "200").and_then(|answer| super::content(answer, super::JSON));
        if let Some(schema) = answer.and_then(|content| content.schema.clone()) {
            answers = answers.item(schema);
        }
    }
    let answers = answers.item(ObjectBuilder::new().schema_type(Type::String));
    named.push((
        "BatchLine".into(),
        requests.discriminator(Some(Discriminator::with_mapping("op", mapping))).into(),
    ));
    let answered =
        outcome("The answer to a line.", "answer", Schema::AnyOf(answers.build()).into());
    let problem = Ref::builder()
        .ref_location_from_schema_name("Problem")
        .description(Some("Why the line has no answer."));
    let refused = outcome("A line that has no answer, and why.", "problem", problem.build().into());
    named.extend([("AnsweredLine".into(), answered), ("RefusedLine".into(), refused)]);
    let either = OneOfBuilder::new()
        .item(Ref::from_schema_name("AnsweredLine"))
        .item(Ref::from_schema_name("RefusedLine"));
    named.push((
        "BatchAnswer".into(),
        either.description(Some("A line of the answer to a batch.")).into(),
    ));
    api.components.get_or_insert_default().schemas.extend(named);
    apply(api);
}

/// Says of the lines which schema they have; a media type of lines has no keyword for that in
/// OpenAPI 3.1.
fn apply(api: &mut OpenApi) {
    let Some(operation) = super::posted(api, "/v1/batch") else { return };
    operation.parameters = Some(super::output_parameters());
    if let Some(RefOr::T(content)) = request_content(operation.request_body.as_mut()) {
        content.extensions = Some(item_schema("BatchLine"));
    }
    if let Some(content) =
        super::answer(operation, "200").and_then(|answer| super::content(answer, NDJSON))
    {
        content.extensions = Some(item_schema("BatchAnswer"));
    }
}

fn item_schema(name: &str) -> Extensions {
    [("x-item-schema", json!({"$ref": format!("#/components/schemas/{name}")}))]
        .into_iter()
        .collect()
}

fn request_content(body: Option<&mut RefOr<RequestBody>>) -> Option<&mut RefOr<Content>> {
    match body? {
        RefOr::T(body) => body.content.get_mut(NDJSON),
        RefOr::Ref(_) => None,
    }
}

fn request(body: Option<&RefOr<RequestBody>>) -> Option<RefOr<Schema>> {
    let RefOr::T(body) = body? else { return None };
    let RefOr::T(content) = body.content.get(super::JSON)? else { return None };
    content.schema.clone()
}

/// What the client calls a line.
fn id() -> RefOr<Schema> {
    let id = OneOfBuilder::new()
        .item(ObjectBuilder::new().schema_type(Type::String))
        .item(ObjectBuilder::new().schema_type(Type::Integer));
    id.description(Some("What the client calls the line; it comes back with the answer.")).into()
}

fn named_id() -> Ref {
    Ref::builder()
        .ref_location_from_schema_name("LineId")
        .description(Some("What the client calls the line."))
        .build()
}

fn line(op: &str, request: RefOr<Schema>) -> RefOr<Schema> {
    let text = format!("A line of a batch for the operation {op}.");
    let request = match request {
        RefOr::Ref(mut reference) => {
            reference.description = "The request.".into();
            RefOr::Ref(reference)
        }
        other => other,
    };
    object(&text)
        .property("id", named_id())
        .property("op", constant(op).description(Some(format!("Always `{op}`."))))
        .property("body", request)
        .required("op")
        .required("body")
        .into()
}

fn outcome(text: &str, name: &str, what: RefOr<Schema>) -> RefOr<Schema> {
    let number = whole(1, usize::MAX >> 11)
        .description(Some("The number of the line in the batch, 1 or more."));
    object(text)
        .property("line", number)
        .property("id", named_id())
        .property(name, what)
        .required("line")
        .required(name)
        .into()
}

fn object(text: &str) -> ObjectBuilder {
    ObjectBuilder::new()
        .schema_type(Type::Object)
        .description(Some(text))
        .additional_properties(Some(AdditionalProperties::<Schema>::FreeForm(false)))
}

fn pascal(name: &str) -> String {
    let mut letters = name.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}
