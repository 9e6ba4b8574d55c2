//! What is seen of every request: its id, its metrics, its log line, its span.

use std::collections::HashMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::Instant;

use axum::body::HttpBody;
use axum::extract::Request;
use axum::http::{HeaderMap, HeaderValue, Method, StatusCode, Uri};
use axum::response::Response;
use prometheus_client::metrics::gauge::Gauge;
use uuid::{Builder, Uuid};

use super::request_id::{REQUEST_ID, RequestId};
use super::service::Service;
use crate::http::logs::LogLine;
use crate::http::metrics::{OfRoute, UNKNOWN};
use crate::http::traces::{Parent, Span};

/// Counts, times and logs requests, and gives them ids.
pub struct Observer {
    service: Arc<Service>,
    /// The metrics of each route, looked up once: labels are strings, and a look-up for each
    /// request hashes them all.
    routes: HashMap<String, OnceLock<OfRoute>>,
    ids: Ids,
}

/// What is known of a request until it is answered.
pub struct Seen {
    started: Instant,
    _in_flight: InFlight,
    id: HeaderValue,
    parent: Option<Parent>,
    span: Option<Span>,
    method: &'static str,
    uri: Uri,
    received: Option<u64>,
}

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

/// Ids that nobody else gives: random where the process starts, and counted on from there.
struct Ids {
    start: u128,
    given: AtomicU64,
}

impl Ids {
    fn next(&self) -> HeaderValue {
        let number = u128::from(self.given.fetch_add(1, Ordering::Relaxed));
        let id =
            Builder::from_random_bytes(self.start.wrapping_add(number).to_be_bytes()).into_uuid();
        HeaderValue::from_str(id.hyphenated().encode_lower(&mut Uuid::encode_buffer()))
            .unwrap_or(HeaderValue::from_static("none"))
    }
}

impl Observer {
    /// For a service with routes at these paths.
    pub fn new(service: &Arc<Service>, paths: impl Iterator<Item = String>) -> Self {
        let routes = paths
            .chain([DOCS.into(), UNKNOWN.into()])
            .map(|path| (path, OnceLock::new()))
            .collect();
        let ids = Ids { start: Uuid::new_v4().as_u128(), given: AtomicU64::new(0) };
        Observer { service: service.clone(), routes, ids }
    }

    /// A request has come.
    pub fn begin(&self, request: &Request) -> Seen {
        let parent = Parent::of(request.headers());
        let method = known(request.method());
        let span = self
            .service
            .traces
            .as_ref()
            .map(|traces| traces.span(method, self.route(request.uri()).0, parent.as_ref()));
        Seen {
            started: Instant::now(),
            _in_flight: InFlight::enter(&self.service.metrics.in_flight),
            id: given_id(request.headers()).unwrap_or_else(|| self.ids.next()),
            parent,
            span,
            method,
            uri: request.uri().clone(),
            received: request.body().size_hint().exact(),
        }
    }

    /// It is answered.
    pub fn end(&self, mut seen: Seen, response: &mut Response) {
        let status = response.status();
        let seconds = seen.started.elapsed().as_secs_f64();
        let (route, metrics) = self.route(&seen.uri);
        if let Some(metrics) = metrics {
            let metrics = metrics.get_or_init(|| self.service.metrics.of_route(route));
            let (received, sent) =
                (seen.received.unwrap_or(0), response.body().size_hint().exact().unwrap_or(0));
            metrics.answered(
                &self.service.metrics,
                seen.method,
                status.as_u16(),
                seconds,
                [received, sent],
            );
        }
        if let Some(span) = &mut seen.span {
            span.end(status.as_u16());
        }
        seen.log(route, status, seconds);
        response.headers_mut().insert(REQUEST_ID, seen.id);
    }

    /// The route of an address, as the specification writes it, and its metrics.
    fn route(&self, uri: &Uri) -> (&str, Option<&OnceLock<OfRoute>>) {
        let path = if uri.path().starts_with(DOCS) { DOCS } else { uri.path() };
        let found = self.routes.get_key_value(path).or_else(|| self.routes.get_key_value(UNKNOWN));
        found.map_or((UNKNOWN, None), |(route, metrics)| (route, Some(metrics)))
    }
}

/// The pages of the documentation count as one.
const DOCS: &str = "/docs";

/// The id the client gave, if it is fit to be logged.
fn given_id(headers: &HeaderMap) -> Option<HeaderValue> {
    let sane = |value: &&HeaderValue| {
        (1..=128).contains(&value.len()) && value.as_bytes().iter().all(u8::is_ascii_graphic)
    };
    headers.get(&REQUEST_ID).filter(sane).cloned()
}

/// The method, or one word for all that nobody knows: labels must be few.
fn known(method: &Method) -> &'static str {
    const KNOWN: [&str; 7] = ["POST", "GET", "HEAD", "OPTIONS", "PUT", "DELETE", "PATCH"];
    KNOWN.into_iter().find(|known| method == *known).unwrap_or("other")
}

impl Seen {
    /// The id of the request.
    pub fn id(&self) -> RequestId {
        RequestId(self.id.clone())
    }

    /// Faults of ours are errors, a full service a warning; probes are of interest to few.
    fn log(&self, route: &str, status: StatusCode, seconds: f64) {
        let (request_id, method) = (self.id.to_str().unwrap_or(""), self.method);
        let of_span = self.span.as_ref().map(Span::trace_id);
        let trace_id = of_span
            .as_deref()
            .or(self.parent.as_ref().map(|parent| &*parent.trace_id))
            .unwrap_or_default();
        let path = beginning(self.uri.path());
        let status = status.as_u16();
        macro_rules! line {
            ($level:ident) => {
                if tracing::enabled!(tracing::Level::$level) {
                    let (level, message) = (stringify!($level), "answered");
                    let answered = LogLine {
                        level,
                        message,
                        request_id,
                        trace_id,
                        method,
                        path,
                        status,
                        seconds,
                    };
                    if !answered.log() {
                        tracing::event!(
                            tracing::Level::$level,
                            request_id,
                            trace_id,
                            method,
                            path,
                            status,
                            seconds,
                            "{message}"
                        );
                    }
                }
            };
        }
        match status {
            500 => line!(ERROR),
            501.. => line!(WARN),
            _ if route.starts_with("/v1/") || route == UNKNOWN => line!(INFO),
            _ => line!(DEBUG),
        }
    }
}

/// As much of a path as is logged.
fn beginning(path: &str) -> &str {
    if path.len() <= 200 {
        return path;
    }
    path.char_indices().nth(200).map_or(path, |(end, _)| &path[..end])
}
