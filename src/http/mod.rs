//! The edge: routes and the specification, each on one screen.

pub mod basis;
pub mod batch;
pub mod budget;
pub mod call;
pub mod coding;
pub mod continuity;
pub mod convert;
pub mod cost;
pub mod edge;
pub mod error;
pub mod evaluate;
pub mod fit;
pub mod health;
pub mod interpolate;
pub mod join;
pub mod json;
pub mod keys;
pub mod line;
pub mod lines;
pub mod negotiate;
pub mod numbers;
pub mod observe;
pub mod operations;
pub mod packer;
pub mod page;
pub mod paper;
pub mod pool;
pub mod queue;
pub mod rates;
pub mod reader;
pub mod render;
pub mod reshape;
pub mod rounded;
pub mod service;
pub mod shape;
pub mod specification;
pub mod subdivide;
pub mod surface_evaluate;
pub mod surface_subdivide;
pub mod surface_tessellate;
pub mod to_bspline;
pub mod wire;
pub mod writer;

use std::sync::Arc;

use axum::Router;
use axum::http::{HeaderMap, HeaderValue, StatusCode, Uri};
use axum::response::Response;
use axum::routing::get;
use utoipa::OpenApi;
use utoipa::openapi::example::ExampleBuilder;
use utoipa::openapi::path::{Parameter, ParameterBuilder, ParameterIn};
use utoipa::openapi::request_body::RequestBody;
use utoipa::openapi::schema::{KnownFormat, ObjectBuilder, OneOfBuilder, Schema, SchemaFormat, Type};
use utoipa::openapi::security::{ApiKey, ApiKeyValue, HttpAuthScheme, HttpBuilder, SecurityRequirement, SecurityScheme};
use utoipa::openapi::{Content, RefOr};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;
use utoipa_swagger_ui::SwaggerUi;

use edge::Edge;
use error::Problem;
use service::Service;
pub use specification::{json_only, openapi};

/// A request body that the specification shows and a test runs.
#[derive(Debug, Clone, Copy)]
pub struct Example {
    /// Its key in the specification.
    pub name: &'static str,
    /// What it shows.
    pub summary: &'static str,
    /// The JSON.
    pub body: &'static str,
}

impl Example {
    const fn new(name: &'static str, summary: &'static str, body: &'static str) -> Self {
        Example { name, summary, body }
    }
}

/// Every operation with its examples.
pub const OPERATIONS: &[(&str, &[Example])] = &[
    ("/v1/evaluate", evaluate::EXAMPLES),
    ("/v1/subdivide", subdivide::EXAMPLES),
    ("/v1/to-bspline", to_bspline::EXAMPLES),
    ("/v1/interpolate", interpolate::EXAMPLES),
    ("/v1/fit", fit::EXAMPLES),
    ("/v1/reshape", reshape::EXAMPLES),
    ("/v1/join", join::EXAMPLES),
    ("/v1/convert", convert::EXAMPLES),
    ("/v1/continuity", continuity::EXAMPLES),
    ("/v1/basis", basis::EXAMPLES),
    ("/v1/surfaces/evaluate", surface_evaluate::EXAMPLES),
    ("/v1/surfaces/subdivide", surface_subdivide::EXAMPLES),
    ("/v1/surfaces/tessellate", surface_tessellate::EXAMPLES),
    ("/v1/render", render::EXAMPLES),
];

#[derive(OpenApi)]
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

/// Every route, registered together with its documentation.
fn routes() -> OpenApiRouter<Arc<Service>> {
    OpenApiRouter::with_openapi(Specification::openapi())
        .routes(routes!(evaluate::post))
        .routes(routes!(subdivide::post))
        .routes(routes!(to_bspline::post))
        .routes(routes!(interpolate::post))
        .routes(routes!(fit::post))
        .routes(routes!(reshape::post))
        .routes(routes!(join::post))
        .routes(routes!(convert::post))
        .routes(routes!(continuity::post))
        .routes(routes!(basis::post))
        .routes(routes!(surface_evaluate::post))
        .routes(routes!(surface_subdivide::post))
        .routes(routes!(surface_tessellate::post))
        .routes(routes!(render::post))
        .routes(routes!(batch::post))
        .routes(routes!(health::live))
        .routes(routes!(health::ready))
        .routes(routes!(health::metrics))
        .routes(routes!(page::index))
        .routes(routes!(page::icon))
        .routes(routes!(page::icon_ico))
}

/// What paths and objects declare, with examples of requests.
fn declared() -> utoipa::openapi::OpenApi {
    let mut api = routes().into_openapi();
    describe_keys(&mut api);
    for (path, examples) in OPERATIONS {
        let Some(operation) = api.paths.paths.get_mut(*path).and_then(|item| item.post.as_mut()) else { continue };
        if let Some(RefOr::T(body)) = operation.request_body.as_mut() {
            describe_body(body, examples);
        }
        if let Some(RefOr::T(answer)) = operation.responses.responses.get_mut("200")
            && answer.content.contains_key("application/json")
        {
            answer.content.insert(shape::RAW.into(), RefOr::T(raw_content()));
            operation.parameters = Some(shape_parameters());
        }
    }
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
    body.content.insert(shape::RAW.into(), RefOr::T(raw_content()));
}

/// The raw format, of which a schema says nothing.
fn raw_content() -> Content {
    let text = "A JSON header in which lists of numbers are replaced by where their doubles are, and the doubles; see docs/formats.md.";
    Content::new(Some(
        ObjectBuilder::new().schema_type(Type::String).format(Some(SchemaFormat::KnownFormat(KnownFormat::Binary))).description(Some(text)),
    ))
}

/// What every operation that answers with numbers takes in its address.
fn shape_parameters() -> Vec<RefOr<Parameter>> {
    let parameter = |name: &str, text: &str, schema: RefOr<Schema>| {
        RefOr::T(ParameterBuilder::new().name(name).parameter_in(ParameterIn::Query).description(Some(text)).schema(Some(schema)).build())
    };
    let precision = "`full` (the default): numbers parse back to the same double. `single`: as numbers of single precision. 1 to 17: rounded to so many significant digits.";
    let layout = "`nested` (the default): a list for each point. `flat`: one list for all coordinates. The raw format is always flat.";
    let names = |names: &[&str]| ObjectBuilder::new().schema_type(Type::String).enum_values(Some(names.iter().copied()));
    let precisions = OneOfBuilder::new().item(wire::whole(1, 17)).item(names(&["full", "single"]));
    vec![parameter("precision", precision, precisions.into()), parameter("layout", layout, names(&["nested", "flat"]).into())]
}

/// Either header, or neither where the operator has set no keys.
fn describe_keys(api: &mut utoipa::openapi::OpenApi) {
    let components = api.components.get_or_insert_default();
    let bearer = HttpBuilder::new().scheme(HttpAuthScheme::Bearer).description(Some("An API key, where the operator has set any."));
    components.add_security_scheme("bearer", SecurityScheme::Http(bearer.build()));
    let key = ApiKeyValue::with_description("X-Api-Key", "An API key, where the operator has set any.");
    components.add_security_scheme("key", SecurityScheme::ApiKey(ApiKey::Header(key)));
    let none: [&str; 0] = [];
    let either = ["bearer", "key"].map(|name| SecurityRequirement::new(name, none));
    api.security = Some([SecurityRequirement::default()].into_iter().chain(either).collect());
}

/// The whole service: routes, documentation, and what is done around them.
pub fn service(service: &Arc<Service>, cors_origins: &[HeaderValue]) -> Edge {
    let (router, api) = routes().split_for_parts();
    let paths = api.paths.paths.into_keys().chain([SPECIFICATION, JSON_ONLY].map(String::from));
    let router = router
        .with_state(service.clone())
        .route(JSON_ONLY, get(json_only_text))
        .merge(SwaggerUi::new("/docs").url(SPECIFICATION, openapi()))
        .route("/docs/swagger-initializer.js", get(page::initializer))
        .fallback(not_found)
        .method_not_allowed_fallback(method_not_allowed);
    Edge::new(service, cors_origins, paths, router)
}

/// Where the specification is.
const SPECIFICATION: &str = "/openapi.json";

/// Where the specification for clients of JSON alone is.
const JSON_ONLY: &str = "/openapi-json.json";

async fn json_only_text() -> axum::Json<utoipa::openapi::OpenApi> {
    axum::Json(json_only())
}

/// What is answered on the address of the metrics.
pub fn metrics_router(service: &Arc<Service>) -> Router {
    Router::new()
        .route("/metrics", get(health::text))
        .route("/livez", get(health::live))
        .route("/readyz", get(health::ready))
        .fallback(not_found)
        .with_state(service.clone())
}

async fn not_found(headers: HeaderMap, uri: Uri) -> Response {
    let detail = format!("there is nothing at {}; the operations are listed at /docs and in /openapi.json", json::shortened(uri.path()));
    page::problem(&headers, Problem::new(StatusCode::NOT_FOUND, "not_found", "Not found", detail))
}

async fn method_not_allowed(headers: HeaderMap, method: axum::http::Method) -> Response {
    let detail = format!("{} is not allowed here; see the Allow header. Operations take POST", json::shortened(method.as_str()));
    page::problem(&headers, Problem::new(StatusCode::METHOD_NOT_ALLOWED, "method_not_allowed", "Method not allowed", detail))
}
