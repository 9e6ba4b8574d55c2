//! The specification, OpenAPI 3.1: of the operations it is made from their table; what a floor
//! above adds to it comes in as a base.

mod answers;
mod batch_lines;
mod flat;
mod json_only;
mod operation;
mod references;

use utoipa::OpenApi as _;
use utoipa::openapi::example::ExampleBuilder;
use utoipa::openapi::path::{Operation, Parameter, ParameterBuilder, ParameterIn};
use utoipa::openapi::request_body::RequestBody;
use utoipa::openapi::schema::{
    KnownFormat, ObjectBuilder, OneOfBuilder, Schema, SchemaFormat, Type,
};
use utoipa::openapi::security::{
    ApiKey, ApiKeyValue, HttpAuthScheme, HttpBuilder, SecurityRequirement, SecurityScheme,
};
use utoipa::openapi::{Content, OpenApi, RefOr, Response};

use crate::api::operations::{self, Example};
use crate::api::output;
use crate::api::problem::Problem;
use crate::api::wire;

pub use json_only::json_only;

#[derive(utoipa::OpenApi)]
#[openapi(
    info(
        title = "Springline",
        description = "Curves with shape parameters: curves a designer can bend without moving a control point. \
                       A curve goes in, a curve comes out: every operation takes and returns the same `Curve` object. \
                       Stateless: the same request gets the same bytes, so every request may be repeated.",
        license(name = "MIT OR Apache-2.0", identifier = "MIT OR Apache-2.0")
    ),
    components(schemas(Problem)),
    tags(
        (name = "Curves", description = "From a curve."),
        (name = "Points", description = "From points."),
        (name = "Surfaces", description = "From a tensor-product surface."),
        (name = "Many", description = "Many operations at once."),
        (name = "Service", description = "About the service itself.")
    )
)]
struct Specification;

/// What the operations and their objects declare, with examples of requests.
pub fn declared() -> OpenApi {
    let mut api = Specification::openapi();
    describe_keys(&mut api);
    for (path, item, schemas) in operations::each(&operation::Describe) {
        api.components.get_or_insert_default().schemas.extend(schemas);
        api.paths.paths.insert(path.into(), item);
    }
    api
}

/// The specification with what follows from the rest: examples of answers, flat answers, the lines
/// of batches.
pub fn complete(mut api: OpenApi) -> OpenApi {
    answers::show(&mut api);
    flat::describe(&mut api);
    batch_lines::describe(&mut api);
    api
}

fn describe_body(body: &mut RequestBody, examples: &[Example]) {
    if let Some(RefOr::T(content)) = body.content.get_mut("application/json") {
        for example in examples {
            let value = serde_json::from_str(example.body).ok();
            let shown = ExampleBuilder::new().summary(example.summary).value(value).build();
            content.examples.insert(example.name.into(), RefOr::T(shown));
        }
    }
    body.content.insert(output::RAW.into(), RefOr::T(raw_content()));
}

/// The raw format, of which a schema says nothing.
fn raw_content() -> Content {
    let text = "A JSON header in which lists of numbers are replaced by where their doubles are, and the doubles; see docs/formats.md.";
    Content::new(Some(
        ObjectBuilder::new()
            .schema_type(Type::String)
            .format(Some(SchemaFormat::KnownFormat(KnownFormat::Binary)))
            .description(Some(text)),
    ))
}

/// What every operation that answers with numbers takes in its address.
fn output_parameters() -> Vec<RefOr<Parameter>> {
    let parameter = |name: &str, text: &str, schema: RefOr<Schema>| {
        RefOr::T(
            ParameterBuilder::new()
                .name(name)
                .parameter_in(ParameterIn::Query)
                .description(Some(text))
                .schema(Some(schema))
                .build(),
        )
    };
    let precision = "`full` (the default): numbers parse back to the same double. `single`: as numbers of single precision. 1 to 17: rounded to so many significant digits.";
    let layout = "`nested` (the default): a list for each point. `flat`: one list for all coordinates. The raw format is always flat.";
    let names = |names: &[&str]| {
        ObjectBuilder::new().schema_type(Type::String).enum_values(Some(names.iter().copied()))
    };
    let precisions = OneOfBuilder::new().item(wire::whole(1, 17)).item(names(&["full", "single"]));
    vec![
        parameter("precision", precision, precisions.into()),
        parameter("layout", layout, names(&["nested", "flat"]).into()),
    ]
}

/// Either header, or neither where the operator has set no keys.
fn describe_keys(api: &mut OpenApi) {
    let components = api.components.get_or_insert_default();
    let bearer = HttpBuilder::new()
        .scheme(HttpAuthScheme::Bearer)
        .description(Some("An API key, where the operator has set any."));
    components.add_security_scheme("bearer", SecurityScheme::Http(bearer.build()));
    let key =
        ApiKeyValue::with_description("X-Api-Key", "An API key, where the operator has set any.");
    components.add_security_scheme("key", SecurityScheme::ApiKey(ApiKey::Header(key)));
    let none: [&str; 0] = [];
    let either = ["bearer", "key"].map(|name| SecurityRequirement::new(name, none));
    api.security = Some([SecurityRequirement::default()].into_iter().chain(either).collect());
}

/// The operation that is posted to this path.
fn posted<'a>(api: &'a mut OpenApi, path: &str) -> Option<&'a mut Operation> {
    api.paths.paths.get_mut(path)?.post.as_mut()
}

/// The answer of an operation with this status.
fn answer<'a>(operation: &'a mut Operation, status: &str) -> Option<&'a mut Response> {
    match operation.responses.responses.get_mut(status)? {
        RefOr::T(response) => Some(response),
        RefOr::Ref(_) => None,
    }
}

/// What an answer is in a media type.
fn content<'a>(response: &'a mut Response, media_type: &str) -> Option<&'a mut Content> {
    match response.content.get_mut(media_type)? {
        RefOr::T(content) => Some(content),
        RefOr::Ref(_) => None,
    }
}

/// The media type of answers in JSON.
const JSON: &str = "application/json";
