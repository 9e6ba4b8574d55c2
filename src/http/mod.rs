//! The edge: routes, middleware and the specification, each on one screen.

pub mod basis;
pub mod continuity;
pub mod convert;
pub mod error;
pub mod evaluate;
pub mod fit;
pub mod health;
pub mod interpolate;
pub mod join;
pub mod json;
pub mod render;
pub mod reshape;
pub mod subdivide;
pub mod surface_evaluate;
pub mod surface_subdivide;
pub mod surface_tessellate;
pub mod to_bspline;
pub mod wire;

use axum::Router;
use axum::extract::{DefaultBodyLimit, Request};
use axum::http::{HeaderValue, StatusCode, Uri, header};
use axum::middleware::{Next, from_fn};
use axum::response::{IntoResponse, Response};
use tower::ServiceBuilder;
use tower_http::catch_panic::CatchPanicLayer;
use tower_http::set_header::SetResponseHeaderLayer;
use utoipa::OpenApi;
use utoipa::openapi::RefOr;
use utoipa::openapi::example::ExampleBuilder;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;
use utoipa_swagger_ui::SwaggerUi;

use error::Problem;

/// The largest request body: what 100,000 interpolated 3D points become fits.
pub const MAX_BODY_BYTES: usize = 32 * 1024 * 1024;

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
        (name = "Service", description = "About the service itself.")
    )
)]
struct Specification;

/// Every route, registered together with its documentation.
fn routes() -> OpenApiRouter {
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
        .routes(routes!(health::live))
        .routes(routes!(health::ready))
}

/// The specification, OpenAPI 3.1, with its examples.
pub fn openapi() -> utoipa::openapi::OpenApi {
    let mut api = routes().into_openapi();
    for (path, examples) in OPERATIONS {
        let operation = api.paths.paths.get_mut(*path).and_then(|item| item.post.as_mut());
        let Some(RefOr::T(body)) = operation.and_then(|operation| operation.request_body.as_mut()) else { continue };
        let Some(RefOr::T(content)) = body.content.get_mut("application/json") else { continue };
        for example in *examples {
            let value = serde_json::from_str(example.body).ok();
            let shown = ExampleBuilder::new().summary(example.summary).value(value).build();
            content.examples.insert(example.name.into(), RefOr::T(shown));
        }
    }
    api
}

/// The service: routes, docs, and the middleware around them, outermost first.
pub fn router() -> Router {
    let (router, _) = routes().split_for_parts();
    let middleware = ServiceBuilder::new()
        .layer(SetResponseHeaderLayer::if_not_present(header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff")))
        .layer(CatchPanicLayer::custom(|_| Problem::internal().into_response()))
        .layer(from_fn(problems_only))
        .layer(from_fn(refuse_declared_size))
        .layer(DefaultBodyLimit::max(MAX_BODY_BYTES));
    router
        .merge(SwaggerUi::new("/docs").url("/openapi.json", openapi()))
        .fallback(not_found)
        .method_not_allowed_fallback(method_not_allowed)
        .layer(middleware)
}

/// Refuses a body by its declared size, so that nobody sends what will not be read.
async fn refuse_declared_size(request: Request, next: Next) -> Response {
    let declared = request.headers().get(header::CONTENT_LENGTH).and_then(|value| value.to_str().ok()?.parse::<u64>().ok());
    match declared {
        Some(bytes) if bytes > MAX_BODY_BYTES as u64 => error::body_too_large().into_response(),
        _ => next.run(request).await,
    }
}

/// The docs answer an unknown file in plain text; this service answers every error as a problem.
async fn problems_only(uri: Uri, request: Request, next: Next) -> Response {
    let response = next.run(request).await;
    let missing = response.status() == StatusCode::NOT_FOUND && response.headers().get(header::CONTENT_TYPE).is_none();
    if missing { not_found(uri).await.into_response() } else { response }
}

async fn not_found(uri: Uri) -> Problem {
    let detail = format!("there is nothing at {}; the operations are listed at /docs and in /openapi.json", uri.path());
    Problem::new(StatusCode::NOT_FOUND, "not_found", "Not found", detail)
}

async fn method_not_allowed(method: axum::http::Method) -> Problem {
    let detail = format!("{method} is not allowed here; see the Allow header. Operations take POST");
    Problem::new(StatusCode::METHOD_NOT_ALLOWED, "method_not_allowed", "Method not allowed", detail)
}
