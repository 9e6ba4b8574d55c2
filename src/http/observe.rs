//! What is seen of every request: its id, its metrics, its log line, its span.

use std::sync::Arc;
use std::time::Instant;

use axum::body::HttpBody;
use axum::extract::{MatchedPath, Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode};
use axum::middleware::Next;
use axum::response::Response;
use prometheus_client::metrics::gauge::Gauge;
use uuid::Uuid;

use super::service::Service;
use crate::metrics::{Answered, Route};
use crate::traces::Parent;

/// The header that carries the id of a request, both ways.
pub const REQUEST_ID: HeaderName = HeaderName::from_static("x-request-id");

/// One more while it lives.
struct InFlight(Gauge);

impl InFlight {
    fn enter(gauge: &Gauge) -> Self {
        gauge.inc();
        InFlight(gauge.clone())
    }
}

impl Drop for InFlight {
    fn drop(&mut self) {
        self.0.dec();
    }
}

/// Counts, times and logs a request, and gives it an id.
pub async fn observe(State(service): State<Arc<Service>>, request: Request, next: Next) -> Response {
    let started = Instant::now();
    let _in_flight = InFlight::enter(&service.metrics.in_flight);
    let id = request_id(request.headers());
    let parent = Parent::of(request.headers());
    let route = request.extensions().get::<MatchedPath>().map_or("none", MatchedPath::as_str).to_owned();
    let method = known(request.method());
    let path = shortened(request.uri().path());
    let received = request.body().size_hint().exact();
    let mut span = service.traces.as_ref().map(|traces| traces.span(method, &route, parent.as_ref()));

    let mut response = next.run(request).await;

    let status = response.status();
    let seconds = started.elapsed().as_secs_f64();
    count(&service, &route, method, status, seconds, received, response.body().size_hint().exact());
    if let Some(span) = &mut span {
        span.end(status.as_u16());
    }
    let trace = span.map(|span| span.trace_id()).or(parent.map(|parent| parent.trace_id));
    let line = Line { id: id.to_str().unwrap_or(""), trace: trace.as_deref().unwrap_or(""), method, path: &path, status, seconds };
    line.log(&route);
    response.headers_mut().insert(REQUEST_ID, id);
    response
}

/// The id the client gave, if it is fit to be logged; else a new one.
fn request_id(headers: &HeaderMap) -> HeaderValue {
    let sane = |value: &&HeaderValue| (1..=128).contains(&value.len()) && value.as_bytes().iter().all(u8::is_ascii_graphic);
    let given = headers.get(&REQUEST_ID).filter(sane).cloned();
    given.unwrap_or_else(|| HeaderValue::from_str(&Uuid::new_v4().to_string()).unwrap_or(HeaderValue::from_static("none")))
}

/// The method, or one word for all that nobody knows: labels must be few.
fn known(method: &Method) -> &'static str {
    const KNOWN: [&str; 7] = ["GET", "POST", "HEAD", "OPTIONS", "PUT", "DELETE", "PATCH"];
    KNOWN.into_iter().find(|known| method == *known).unwrap_or("other")
}

fn shortened(path: &str) -> String {
    path.chars().take(200).collect()
}

fn count(service: &Service, route: &str, method: &str, status: StatusCode, seconds: f64, received: Option<u64>, sent: Option<u64>) {
    let metrics = &service.metrics;
    let answered = Answered { route: route.into(), method: method.into(), status: status.as_u16() };
    metrics.requests.get_or_create(&answered).inc();
    let route = Route { route: route.into() };
    metrics.duration.get_or_create(&route).observe(seconds);
    if route.route.starts_with("/v1/") {
        metrics.request_bytes.get_or_create(&route).observe(received.unwrap_or(0) as f64);
        metrics.answer_bytes.get_or_create(&route).observe(sent.unwrap_or(0) as f64);
    }
}

struct Line<'a> {
    id: &'a str,
    trace: &'a str,
    method: &'static str,
    path: &'a str,
    status: StatusCode,
    seconds: f64,
}

impl Line<'_> {
    /// Faults of ours are errors, a full service a warning; probes are of interest to few.
    fn log(&self, route: &str) {
        let Line { id: request_id, trace: trace_id, method, path, status, seconds } = *self;
        let status = status.as_u16();
        macro_rules! line {
            ($level:ident) => {
                tracing::$level!(request_id, trace_id, method, path, status, seconds, "answered")
            };
        }
        match status {
            500 => line!(error),
            501.. => line!(warn),
            _ if route.starts_with("/v1/") || route == "none" => line!(info),
            _ => line!(debug),
        }
    }
}
