//! A problem as an answer of HTTP.

use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};

use crate::api::problem::Problem;

impl IntoResponse for Problem {
    fn into_response(self) -> Response {
        let status = status(&self);
        // A struct of strings and numbers always serialises.
        let body = serde_json::to_vec(&self).unwrap_or_default();
        let kind = HeaderValue::from_static("application/problem+json");
        let mut response = (status, [(header::CONTENT_TYPE, kind)], body).into_response();
        match status {
            StatusCode::SERVICE_UNAVAILABLE => {
                response.headers_mut().insert(header::RETRY_AFTER, self.retry_after().into())
            }
            StatusCode::UNAUTHORIZED => response
                .headers_mut()
                .insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer")),
            _ => None,
        };
        response
    }
}

/// The status of its answer.
pub fn status(problem: &Problem) -> StatusCode {
    StatusCode::from_u16(problem.status().0).unwrap_or(StatusCode::INTERNAL_SERVER_ERROR)
}
