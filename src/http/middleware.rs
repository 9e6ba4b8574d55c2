//! What is done to every request before its route is looked for, and to every answer after.
//!
//! One function rather than a layer for each concern: a layer clones and boxes what it wraps, for
//! every request anew, which cost more than computing a small answer.

use std::convert::Infallible;
use std::panic::AssertUnwindSafe;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};

use axum::Router;
use axum::extract::Request;
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode, header};
use axum::response::{IntoResponse, Response};
use futures_util::FutureExt;
use tower::{Layer, ServiceExt, service_fn};
use tower_http::cors::{AllowOrigin, CorsLayer};

use super::handlers::Handlers;
use crate::api::problem::{Problem, Status};
use crate::http::batch;
use crate::http::observe::Observer;
use crate::http::request_id::REQUEST_ID;
use crate::http::service::Service;

/// The service as a connection meets it.
#[derive(Clone)]
pub struct Middleware(Arc<Inside>);

struct Inside {
    service: Arc<Service>,
    observer: Observer,
    cors: Option<CorsLayer>,
    handlers: Handlers,
    router: Router,
}

impl Middleware {
    /// Around these routes; pages of these origins may call from a browser.
    pub fn new(
        service: &Arc<Service>,
        cors_origins: &[HeaderValue],
        paths: impl Iterator<Item = String>,
        router: Router,
    ) -> Self {
        let observer = Observer::new(service, paths);
        Middleware(Arc::new(Inside {
            service: service.clone(),
            observer,
            cors: cors(cors_origins),
            handlers: Handlers::all(),
            router,
        }))
    }
}

impl tower::Service<Request> for Middleware {
    type Response = Response;
    type Error = Infallible;
    type Future = Pin<Box<dyn Future<Output = Result<Response, Infallible>> + Send>>;

    fn poll_ready(&mut self, _: &mut Context<'_>) -> Poll<Result<(), Infallible>> {
        Poll::Ready(Ok(()))
    }

    fn call(&mut self, request: Request) -> Self::Future {
        let inside = self.0.clone();
        Box::pin(async move { Ok(inside.answer(request).await) })
    }
}

impl Inside {
    async fn answer(self: Arc<Self>, mut request: Request) -> Response {
        let seen = self.observer.begin(&request);
        let is_page = request.uri().path().starts_with("/docs");
        if request.uri().path() == batch::PATH {
            request.extensions_mut().insert(seen.id());
        }
        let mut response = match &self.cors {
            None => self.route(request).await,
            Some(cors) => {
                let inside = self.clone();
                let route = service_fn(move |request| {
                    let inside = inside.clone();
                    async move { Ok::<_, Infallible>(inside.route(request).await) }
                });
                // What few need is in a box, so that what all need is small to move.
                Box::pin(cors.layer(route).oneshot(request))
                    .await
                    .unwrap_or_else(|never| match never {})
            }
        };
        add_security_headers(response.headers_mut(), is_page);
        self.observer.end(seen, &mut response);
        response
    }

    /// Asks for the key, finds the route, and answers what panics or finds nothing.
    async fn route(&self, request: Request) -> Response {
        if let Err(problem) = self.admit(&request) {
            return problem.into_response();
        }
        // The documentation answers an unknown file in plain text; this service answers every error
        // as a problem.
        let page = request
            .uri()
            .path()
            .starts_with("/docs")
            .then(|| (request.headers().clone(), request.uri().clone()));
        let answered = AssertUnwindSafe(self.dispatch(request)).catch_unwind().await;
        let Ok(response) = answered else {
            self.service.metrics.panics.inc();
            return Problem::internal().into_response();
        };
        match page {
            Some((headers, uri)) if response.status() == StatusCode::NOT_FOUND => {
                crate::http::not_found(headers, uri).await
            }
            _ => response,
        }
    }

    /// Operations are answered without the router, whose way of layers and boxes costs as much as a
    /// small computation.
    async fn dispatch(&self, request: Request) -> Response {
        let handler = (request.method() == Method::POST)
            .then(|| self.handlers.at(request.uri().path()))
            .flatten();
        let Some(handler) = handler else {
            return Box::pin(self.router.clone().oneshot(request))
                .await
                .unwrap_or_else(|never| match never {});
        };
        handler(self.service.clone(), request).await
    }

    /// Operations and metrics ask for a key where keys are set; probes and documentation do not.
    fn admit(&self, request: &Request) -> Result<(), Problem> {
        let keys = &self.service.keys;
        let open = !keys.are_required()
            || !matches!(request.uri().path(), path if path.starts_with("/v1/") || path == "/metrics");
        if open || keys.admit(request.headers()) {
            Ok(())
        } else {
            Err(unauthorized(request.headers()))
        }
    }
}

fn unauthorized(headers: &HeaderMap) -> Problem {
    let given = headers.contains_key(header::AUTHORIZATION) || headers.contains_key("x-api-key");
    let what = if given { "the API key is not known" } else { "no API key was sent" };
    let detail =
        format!("{what}; send a valid one as Authorization: Bearer KEY, or as X-Api-Key: KEY");
    Problem::new(Status::UNAUTHORIZED, "unauthorized", "An API key is needed", detail)
}

/// Headers that keep a browser from doing more with an answer than reading it.
fn add_security_headers(headers: &mut HeaderMap, is_page: bool) {
    let policy = if is_page {
        "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; frame-ancestors 'none'"
    } else {
        "default-src 'none'; img-src 'self'; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    };
    headers.insert(header::CONTENT_SECURITY_POLICY, HeaderValue::from_static(policy));
    headers.insert(header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    headers.insert(header::REFERRER_POLICY, HeaderValue::from_static("no-referrer"));
    if !is_page {
        headers.entry(header::CACHE_CONTROL).or_insert(HeaderValue::from_static("no-store"));
    }
}

/// Which pages of other origins may call from a browser: none unless they are named.
fn cors(origins: &[HeaderValue]) -> Option<CorsLayer> {
    let origin = match origins {
        [] => return None,
        [only] if only == "*" => AllowOrigin::any(),
        several => AllowOrigin::list(several.iter().cloned()),
    };
    let sent = [
        "content-type",
        "accept",
        "authorization",
        "x-api-key",
        "x-request-id",
        "traceparent",
        "tracestate",
    ];
    let read = [REQUEST_ID, header::RETRY_AFTER];
    let layer = CorsLayer::new().allow_origin(origin).allow_methods([Method::GET, Method::POST]);
    let two_hours = std::time::Duration::from_secs(7_200);
    Some(
        layer
            .allow_headers(sent.map(HeaderName::from_static))
            .expose_headers(read)
            .max_age(two_hours),
    )
}
