//! What a browser sees where it did not ask for numbers: the first page, pages for what is not
//! there, the icon.

use std::sync::LazyLock;

use axum::http::{HeaderMap, HeaderValue, header};
use axum::response::{IntoResponse, Response};

use crate::api::json;
use crate::api::operations::Operation;
use crate::api::operations::render::{self, Render};
use crate::api::problem::Problem;
use crate::core::context::Context;
use crate::draw::escape;
use crate::http::body::Json;
use crate::http::negotiate;

crate::answer! {
    /// What this service is, and where it says more.
    pub struct Index {
        /// `springline`.
        required name: String,
        /// The version that runs.
        required version: String,
        /// The path of the interactive documentation.
        required documentation: String,
        /// The path of the specification.
        required specification: String,
    }
}

const HTML: &str = "text/html";
const STYLE: &str = include_str!("page/page.css");
const ICON_SVG: &[u8] = include_bytes!("page/favicon.svg");
const ICON_ICO: &[u8] = include_bytes!("page/favicon.ico");
/// Starts Swagger UI; in place of its own.
const INITIALIZER: &str = include_str!("page/swagger-initializer.js");

/// What a browser shows at the address of the service; the picture is drawn by the service itself.
static FIRST: LazyLock<String> = LazyLock::new(|| {
    let [call, drawn] = [
        include_str!("../../openapi/examples/evaluate-cheng-figure-3.json"),
        render::EXAMPLES[0].body,
    ]
    .map(str::trim);
    let context = &Context::default();
    // Without its picture the page says the same.
    let picture = json::from_bytes(context, drawn.as_bytes())
        .ok()
        .and_then(|request| Render::compute(context, request).ok())
        .unwrap_or_default();
    let body = format!(
        "<h1>Springline</h1>
<p>Curves with shape parameters, over HTTP: curves a designer can bend without moving a control point.</p>
{picture}
<ul>
<li><a href=\"/docs/\">Every operation, with examples to try</a></li>
<li><a href=\"/openapi.json\">The specification</a> (OpenAPI 3.1)</li>
</ul>
<p>An operation takes a POST with JSON and answers with JSON:</p>
<pre>curl -s localhost:8080/v1/evaluate -H 'content-type: application/json' -d '{}'</pre>
<p>Version {}. Running it, other formats, errors and limits: see README.md and docs/ of the source.</p>",
        escape(call),
        env!("CARGO_PKG_VERSION"),
    );
    page("Springline", &body)
});

fn page(title: &str, body: &str) -> String {
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{}</title>\n\
         <link rel=\"icon\" type=\"image/svg+xml\" href=\"/favicon.svg\">\n<style>\n{STYLE}</style>\n</head>\n<body>\n{body}\n</body>\n</html>\n",
        escape(title)
    )
}

/// Whether a person looks: a browser likes HTML better than anything, programs take anything.
fn is_person(headers: &HeaderMap, otherwise: &'static str) -> bool {
    negotiate::wanted(headers, &[otherwise, HTML]).is_ok_and(|best| best == HTML)
}

fn shown(mut response: Response) -> Response {
    response.headers_mut().insert(header::VARY, HeaderValue::from_static("accept"));
    response
}

fn html(text: String) -> Response {
    ([(header::CONTENT_TYPE, HeaderValue::from_static("text/html; charset=utf-8"))], text)
        .into_response()
}

/// What this service is
///
/// A page for browsers, JSON for programs, by `Accept`.
#[utoipa::path(get, path = "/", operation_id = "index", tag = "Service", responses(
    (status = 200, description = "What it is.", content((Index = "application/json"), (String = "text/html")))
))]
pub async fn index(headers: HeaderMap) -> Response {
    if is_person(&headers, "application/json") {
        return shown(html(FIRST.clone()));
    }
    let [name, version, documentation, specification] =
        ["springline", env!("CARGO_PKG_VERSION"), "/docs", "/openapi.json"].map(str::to_owned);
    shown(Json(Index { name, version, documentation, specification }).into_response())
}

/// A problem as the client reads it: a page for browsers, the problem itself for programs.
pub fn problem(headers: &HeaderMap, problem: Problem) -> Response {
    if !is_person(headers, "application/problem+json") {
        return shown(problem.into_response());
    }
    let (title, detail) = problem.text();
    let body = format!(
        "<h1>{}</h1>\n<p>{}</p>\n<p><a href=\"/docs/\">Every operation, with examples to try</a> · <a href=\"/\">What this is</a></p>",
        escape(title),
        escape(detail)
    );
    let mut response = html(page(title, &body));
    *response.status_mut() = super::problem::status(&problem);
    shown(response)
}

/// The icon
#[utoipa::path(get, path = "/favicon.svg", operation_id = "icon", tag = "Service", responses(
    (status = 200, description = "A picture.", body = String, content_type = "image/svg+xml")
))]
pub async fn icon() -> Response {
    kept("image/svg+xml", ICON_SVG)
}

/// The icon, for browsers that look for this name
#[utoipa::path(get, path = "/favicon.ico", operation_id = "iconIco", tag = "Service", responses(
    (status = 200, description = "A picture of 32 by 32 pixels.", body = Vec<u8>, content_type = "image/x-icon")
))]
pub async fn icon_ico() -> Response {
    kept("image/x-icon", ICON_ICO)
}

/// The script that starts the interactive documentation.
pub async fn initializer() -> Response {
    kept("text/javascript", INITIALIZER.as_bytes())
}

/// A file that a browser may keep for a day.
fn kept(media_type: &'static str, bytes: &'static [u8]) -> Response {
    let headers = [(header::CONTENT_TYPE, media_type), (header::CACHE_CONTROL, "max-age=86400")];
    (headers.map(|(name, value)| (name, HeaderValue::from_static(value))), bytes).into_response()
}
