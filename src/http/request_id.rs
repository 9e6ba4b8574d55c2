//! The id of a request.

use axum::http::{HeaderName, HeaderValue};

/// The header that carries the id of a request, both ways.
pub const REQUEST_ID: HeaderName = HeaderName::from_static("x-request-id");

/// The id of a request, for what goes on after its answer has begun.
#[derive(Debug, Clone)]
pub struct RequestId(pub HeaderValue);

impl RequestId {
    /// Logs a panic that no status tells of.
    pub fn log_panic(&self, what: &str) {
        tracing::error!(request_id = self.0.to_str().unwrap_or(""), "panicked: {what}");
    }
}
