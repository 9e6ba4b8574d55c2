//! `GET /livez`, `GET /readyz` and `GET /metrics`.

use std::sync::Arc;

use axum::extract::State;
use axum::http::{HeaderMap, Uri, header};
use axum::response::{IntoResponse, Response};

use super::body::Json;
use super::service::Service;
use crate::api::problem::{Problem, Status};
use crate::http::metrics::MEDIA_TYPE;

crate::answer! {
    /// The state of the service.
    pub struct Health {
        /// `ok`.
        required status: HealthStatus,
    }
}

crate::names! {
    /// A state.
    pub enum HealthStatus {
        /// All is well.
        Ok = "ok",
    }
}

/// Whether the process answers
#[utoipa::path(get, path = "/livez", operation_id = "livez", tag = "Service", responses((status = 200, description = "It does.", body = Health)))]
pub async fn live() -> Json<Health> {
    Json(Health { status: HealthStatus::Ok })
}

/// Whether the service takes requests
///
/// A service that is full is ready: it says so request by request. One that stops is not.
#[utoipa::path(get, path = "/readyz", operation_id = "readyz", tag = "Service", responses(
    (status = 200, description = "It does.", body = Health),
    (status = 503, description = "It is about to stop.", body = Problem, content_type = "application/problem+json")
))]
pub async fn ready(State(service): State<Arc<Service>>) -> Result<Json<Health>, Problem> {
    if service.is_stopping() {
        let detail = "the service is about to stop; ask another instance";
        return Err(Problem::new(
            Status::SERVICE_UNAVAILABLE,
            "stopping",
            "The service is stopping",
            detail,
        ));
    }
    Ok(Json(Health { status: HealthStatus::Ok }))
}

/// What the service has counted
///
/// In the text format of OpenMetrics, which Prometheus reads. Where the setting `metrics-listen`
/// gives metrics an address of their own, they are answered there and not here.
#[utoipa::path(get, path = "/metrics", operation_id = "metrics", tag = "Service", responses(
    (status = 200, description = "The metrics.", body = String, content_type = "application/openmetrics-text"),
    (status = 401, description = "The service wants an API key.", body = Problem, content_type = "application/problem+json"),
    (status = 404, description = "They have an address of their own.", body = Problem, content_type = "application/problem+json")
))]
pub async fn metrics(
    State(service): State<Arc<Service>>,
    headers: HeaderMap,
    uri: Uri,
) -> Response {
    if service.metrics_elsewhere {
        return super::not_found(headers, uri).await;
    }
    text(State(service)).await
}

/// The metrics, wherever they are asked for.
pub async fn text(State(service): State<Arc<Service>>) -> Response {
    service.metrics.expected_wait.set(service.pool.expected_wait().as_secs_f64());
    ([(header::CONTENT_TYPE, MEDIA_TYPE)], service.metrics.text()).into_response()
}
