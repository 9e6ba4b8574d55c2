//! The contract over HTTP: routes, middleware, admission.

pub mod batch;
pub mod body;
pub mod budget;
pub mod call;
pub mod coding;
pub mod compressor;
pub mod handlers;
pub mod health;
pub mod keys;
pub mod logs;
pub mod metrics;
pub mod middleware;
pub mod negotiate;
pub mod observe;
pub mod page;
pub mod pool;
pub mod problem;
pub mod queue;
pub mod rates;
pub mod receive;
pub mod refusal;
pub mod request_id;
pub mod service;
pub mod settings;
mod threads;
pub mod traces;

use std::sync::{Arc, OnceLock};

use axum::Router;
use axum::http::{HeaderMap, HeaderValue, Method, Uri};
use axum::response::Response;
use axum::routing::get;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;
use utoipa_swagger_ui::SwaggerUi;

use crate::api::problem::{Problem, Status};
use crate::api::{sentences, specification};
use middleware::Middleware;
use service::Service;

/// Every route but those of the operations, registered together with its documentation.
fn routes() -> OpenApiRouter<Arc<Service>> {
    OpenApiRouter::with_openapi(specification::declared())
        .routes(routes!(batch::post))
        .routes(routes!(health::live))
        .routes(routes!(health::ready))
        .routes(routes!(health::metrics))
        .routes(routes!(page::index))
        .routes(routes!(page::icon))
        .routes(routes!(page::icon_ico))
}

/// The specification, with its examples.
pub fn openapi() -> utoipa::openapi::OpenApi {
    // The examples of answers are computed, which is not for every call.
    static COMPLETE: OnceLock<utoipa::openapi::OpenApi> = OnceLock::new();
    COMPLETE.get_or_init(|| specification::complete(routes().into_openapi())).clone()
}

/// The whole service: routes, documentation, and what is done around them.
pub fn service(service: &Arc<Service>, cors_origins: &[HeaderValue]) -> Middleware {
    let (router, api) = routes().split_for_parts();
    let paths = api.paths.paths.into_keys().chain([SPECIFICATION, JSON_ONLY].map(String::from));
    let router = router
        .with_state(service.clone())
        .route(JSON_ONLY, get(json_only_text))
        .merge(handlers::Handlers::all().routes(service))
        .merge(SwaggerUi::new("/docs").url(SPECIFICATION, openapi()))
        .route("/docs/swagger-initializer.js", get(page::initializer))
        .fallback(not_found)
        .method_not_allowed_fallback(method_not_allowed);
    Middleware::new(service, cors_origins, paths, router)
}

/// Where the specification is.
const SPECIFICATION: &str = "/openapi.json";

/// Where the specification for clients of JSON alone is.
const JSON_ONLY: &str = "/openapi-json.json";

async fn json_only_text() -> axum::Json<utoipa::openapi::OpenApi> {
    axum::Json(specification::json_only(openapi()))
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
    let detail = format!(
        "there is nothing at {}; the operations are listed at /docs and in /openapi.json",
        sentences::shortened(uri.path())
    );
    page::problem(&headers, Problem::new(Status::NOT_FOUND, "not_found", "Not found", detail))
}

async fn method_not_allowed(headers: HeaderMap, method: Method) -> Response {
    let detail = format!(
        "{} is not allowed here; see the Allow header. Operations take POST",
        sentences::shortened(method.as_str())
    );
    page::problem(
        &headers,
        Problem::new(
            Status::METHOD_NOT_ALLOWED,
            "method_not_allowed",
            "Method not allowed",
            detail,
        ),
    )
}
