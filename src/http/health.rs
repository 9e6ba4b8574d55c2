//! `GET /livez` and `GET /readyz`.

use axum::Json;

crate::object! {
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
    Json(Health { status: Some(HealthStatus::Ok) })
}

/// Whether the service takes requests
#[utoipa::path(get, path = "/readyz", operation_id = "readyz", tag = "Service", responses((status = 200, description = "It does.", body = Health)))]
pub async fn ready() -> Json<Health> {
    Json(Health { status: Some(HealthStatus::Ok) })
}
