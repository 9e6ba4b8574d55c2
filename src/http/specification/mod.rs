//! What the specification says beyond the declarations of objects and paths.

mod answers;
mod batch_lines;
mod flat;
mod json_only;
mod references;

use std::sync::OnceLock;

use utoipa::openapi::path::Operation;
use utoipa::openapi::{Content, OpenApi, RefOr, Response};

use super::OPERATIONS;

pub use json_only::json_only;

/// The specification, OpenAPI 3.1, with its examples.
pub fn openapi() -> OpenApi {
    // The examples of answers are computed, which is not for every call.
    static COMPLETE: OnceLock<OpenApi> = OnceLock::new();
    let complete = || {
        let mut api = super::declared();
        answers::show(&mut api);
        flat::describe(&mut api);
        batch_lines::describe(&mut api);
        api
    };
    COMPLETE.get_or_init(complete).clone()
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
