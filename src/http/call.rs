//! One call of an operation: the body read within its limits, the computation run where it belongs, the answer written.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::pin::{Pin, pin};
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::body::{Body, HttpBody};
use axum::extract::{FromRequest, Request};
use axum::http::{HeaderMap, HeaderValue, header};
use axum::response::{IntoResponse, Response};
use axum::routing::post;
use bytes::Bytes;
use futures_util::future::poll_immediate;
use http_body_util::BodyExt;
use tokio::time::{Instant, timeout};

use super::coding::Coding;
use super::negotiate::{self, BodyFormat};
use super::pool::Failure;
use super::service::Service;
use crate::api::chunks::{Buffer, Chunks};
use crate::api::cost::{Cost, Costed};
use crate::api::json;
use crate::api::memory::{NoRoom, Reservation};
use crate::api::operations::{self, Operation, Output, OutputKind, Visitor};
use crate::api::output::{Format, RAW};
use crate::api::problem::{Problem, Status};
use crate::api::wire::raw;
use crate::http::compressor::Packing;
use crate::http::metrics::Reason;

/// A body up to this size is read without being counted against the budget, and parsed where it arrives.
const SMALL: usize = 16 * 1024;

/// A body up to this size is read and thrown away when its request is refused, if it arrives within the time, so that the next
/// request can come on the same connection: to open another costs more than that.
const DISCARDED: u64 = 256 * 1024;
const DISCARDING: Duration = Duration::from_millis(5);

/// A request to an operation, its body read.
pub struct Call {
    service: Arc<Service>,
    body: Received,
    body_format: BodyFormat,
    headers: HeaderMap,
    format: Format,
    deadline: Instant,
    /// What is expected of it by its length alone.
    cost: Cost,
}

/// A body and the memory reserved for it.
struct Received {
    bytes: Bytes,
    _reservation: Reservation,
}

impl FromRequest<Arc<Service>> for Call {
    type Rejection = Problem;

    async fn from_request(request: Request, service: &Arc<Service>) -> Result<Self, Problem> {
        let body_format = negotiate::sent(request.headers())?;
        let format = negotiate::shape(request.uri().query())?;
        let declared = request.body().size_hint().exact();
        if declared.is_some_and(|bytes| bytes > service.max_body as u64) {
            return Err(too_large(service));
        }
        // A long body that would find no worker is refused before it is read.
        if declared.is_none_or(|bytes| bytes > SMALL as u64) {
            let cost = Cost::of_body(request.uri().path(), declared.unwrap_or(SMALL as u64) as usize);
            if !service.pool.has_room(&cost) {
                discard(request, declared).await;
                return Err(refused(service, Reason::queue));
            }
        }
        let (head, body) = request.into_parts();
        // Most bodies have come with their head: only the others are timed.
        let mut receiving = pin!(receive(body, declared, service));
        let body = match poll_immediate(&mut receiving).await {
            Some(body) => body?,
            None => timeout(service.body_time, receiving).await.map_err(|_| body_too_slow(service))??,
        };
        let cost = Cost::of_body(head.uri.path(), body.bytes.len());
        Ok(Call {
            service: service.clone(),
            body,
            body_format,
            headers: head.headers,
            format,
            deadline: Instant::now() + service.deadline,
            cost,
        })
    }
}

/// Reads a body that nobody wants, if that is soon done and the client does not wait to be asked for it.
async fn discard(request: Request, declared: Option<u64>) {
    if declared.is_some_and(|bytes| bytes <= DISCARDED) && !request.headers().contains_key(header::EXPECT) {
        let mut body = request.into_body();
        let reading = async { while let Some(Ok(_)) = body.frame().await {} };
        let _ = timeout(DISCARDING, reading).await;
    }
}

async fn receive(mut body: Body, declared: Option<u64>, service: &Service) -> Result<Received, Problem> {
    let mut reservation = Reservation::of(&service.memory);
    let mut reserve = |bytes: usize| match bytes {
        ..=SMALL => Ok(()),
        _ => reservation.grow_to(bytes).map_err(|NoRoom| refused(service, Reason::memory)),
    };
    // The length is checked by now, and the budget keeps what is only promised.
    let expected = declared.unwrap_or(0) as usize;
    reserve(expected)?;
    let mut collected: Option<Vec<u8>> = None;
    while let Some(frame) = body.frame().await {
        let Ok(data) = frame.map_err(|_| incomplete())?.into_data() else { continue };
        if collected.is_none() && data.len() as u64 == declared.unwrap_or(u64::MAX) {
            return Ok(Received { bytes: data, _reservation: reservation });
        }
        let collected = collected.get_or_insert_with(|| Vec::with_capacity(expected));
        let needed = collected.len() + data.len();
        if needed > service.max_body {
            return Err(too_large(service));
        }
        if needed > collected.capacity() {
            let capacity = (2 * collected.capacity()).max(needed).max(SMALL).min(service.max_body);
            reserve(capacity)?;
            collected.reserve_exact(capacity - collected.len());
        }
        collected.extend_from_slice(&data);
    }
    Ok(Received { bytes: collected.unwrap_or_default().into(), _reservation: reservation })
}

pub(super) fn incomplete() -> Problem {
    Problem::new(Status::BAD_REQUEST, "unreadable_body", "The body could not be read", "the body ended before all of it arrived")
}

pub(super) fn too_large(service: &Service) -> Problem {
    let detail = format!("the body exceeds {} bytes; send the data in parts", service.max_body);
    Problem::new(Status::PAYLOAD_TOO_LARGE, "too_large", "Beyond a limit", detail)
}

pub(super) fn body_too_slow(service: &Service) -> Problem {
    let detail = format!("the body did not arrive within {} s; send it faster, or in parts", service.body_time.as_secs_f64());
    Problem::new(Status::REQUEST_TIMEOUT, "body_timeout", "The body took too long", detail)
}

/// There is no room now; counts it.
fn refused(service: &Service, reason: Reason) -> Problem {
    service.metrics.shed(reason);
    match reason {
        Reason::memory => Problem::overloaded("the memory for bodies and answers is in use"),
        _ => Problem::overloaded("all workers are busy, and what waits for them is too much").for_about(service.pool.retry()),
    }
}

/// Answers a call.
pub type Handler = fn(Call) -> Pin<Box<dyn Future<Output = Response> + Send>>;

/// What answers the calls of each operation, by its path.
pub struct Handlers(Vec<(&'static str, Handler)>);

struct ToHandler;

impl Visitor for ToHandler {
    type Made = (&'static str, Handler);

    fn visit<O: Operation>(&self) -> (&'static str, Handler) {
        (O::PATH, |call| Box::pin(call.answer::<O>()))
    }
}

impl Handlers {
    /// Of every operation.
    pub fn all() -> Self {
        Handlers(operations::each(&ToHandler))
    }

    /// What answers at this path, if it is that of an operation: the router would find the same with more detours.
    pub fn at(&self, path: &str) -> Option<Handler> {
        self.0.iter().find(|(known, _)| *known == path).map(|(_, handler)| *handler)
    }

    /// The same as routes, so that the router knows what else is allowed where.
    pub fn routes(self, service: &Arc<Service>) -> Router {
        let route = |router: Router<Arc<Service>>, (path, handler): (&'static str, Handler)| router.route(path, post(handler));
        self.0.into_iter().fold(Router::new(), route).with_state(service.clone())
    }
}

impl Call {
    async fn answer<O: Operation>(mut self) -> Response {
        let offered: &[&'static str] = match O::Answer::KIND {
            OutputKind::Object => &["application/json", RAW],
            OutputKind::Picture => &["image/svg+xml"],
        };
        let media_type = match negotiate::wanted(&self.headers, offered) {
            Ok(media_type) => media_type,
            Err(problem) => return problem.into_response(),
        };
        self.format.raw = media_type == RAW;
        let (packing, vary) = (self.packing(), self.service.vary());
        let coding = packing.as_ref().map(|packing| packing.coding);
        let computed = self.compute::<O>(packing.clone()).await;
        let packed = match (computed, packing) {
            // What was computed where it arrived is packed on a worker all the same.
            (Ok(chunks), Some(packing)) => packing.on_a_worker(chunks).await,
            (computed, _) => computed,
        };
        match packed {
            Ok(chunks) => answered(chunks, media_type, vary, coding),
            Err(problem) => problem.into_response(),
        }
    }

    /// Whether the answer is to be packed. The raw format shrinks by a tenth only.
    fn packing(&self) -> Option<Packing> {
        let coding = if self.format.raw { None } else { self.service.coding(&self.headers) };
        coding.map(|coding| Packing { coding, service: self.service.clone(), deadline: self.deadline })
    }

    async fn compute<O: Operation>(self, packing: Option<Packing>) -> Result<Chunks, Problem> {
        let Call { service, body, body_format, format, deadline, cost, .. } = self;
        let written_by = service.clone();
        // With the body, where it is still there, faults come in its order.
        let written = move |request: O::Request, body: &[u8]| -> Result<Chunks, Problem> {
            let mut buffer = Buffer::new(&written_by.memory).with_threads(1 + written_by.pool.idle());
            O::compute(request).map_err(|error| json::refused(error, body))?.write(format, &mut buffer)?;
            Ok(buffer.finish())
        };
        let pack = move |chunks| match packing {
            Some(packing) => packing.pack(chunks),
            None => Ok(chunks),
        };
        let (max_depth, budget) = (service.max_depth, service.budget.clone());
        let result = if body.bytes.len() > SMALL {
            let job = move || {
                let request = read(&body.bytes, body_format, max_depth);
                drop(body);
                let request: O::Request = request?;
                budget.await_room(request.cost().answer);
                written(request, &[]).and_then(pack)
            };
            service.pool.compute(cost, deadline, job).await
        } else {
            let request: O::Request = read(&body.bytes, body_format, max_depth)?;
            if O::is_small(&request) {
                catch_unwind(AssertUnwindSafe(|| written(request, &body.bytes))).map_err(|_| Failure::Panicked)
            } else {
                let cost = request.cost();
                let job = move || {
                    budget.await_room(cost.answer);
                    written(request, &body.bytes).and_then(pack)
                };
                service.pool.compute(cost, deadline, job).await
            }
        };
        match result {
            Ok(Err(problem)) if problem.code() == "overloaded" => Err(refused(&service, Reason::memory)),
            Ok(done) => done,
            Err(failure) => Err(failed(&service, failure)),
        }
    }
}

/// The answer as HTTP has it.
fn answered(chunks: Chunks, media_type: &'static str, vary: HeaderValue, coding: Option<Coding>) -> Response {
    // With room for what the middleware adds.
    let mut headers = HeaderMap::with_capacity(12);
    headers.insert(header::CONTENT_TYPE, HeaderValue::from_static(media_type));
    headers.insert(header::VARY, vary);
    headers.insert(header::CONTENT_LENGTH, chunks.len().into());
    if let Some(coding) = coding.filter(|_| chunks.is_packed()) {
        headers.insert(header::CONTENT_ENCODING, coding.header());
    }
    let mut response = Response::new(Body::from(chunks));
    *response.headers_mut() = headers;
    response
}

fn read<Request: json::Request>(body: &Bytes, body_format: BodyFormat, max_depth: usize) -> Result<Request, Problem> {
    let read = |text: &[u8]| {
        json::check_depth(text, max_depth)?;
        json::from_bytes(text)
    };
    match body_format {
        BodyFormat::Json => read(body),
        BodyFormat::Raw => raw::read(body, read),
    }
}

/// The problem of a computation without a result; counts it.
pub(super) fn failed(service: &Service, failure: Failure) -> Problem {
    match failure {
        Failure::Full => refused(service, Reason::queue),
        Failure::Deadline => {
            let detail =
                format!("the answer was not ready within {} s; ask for less at once, or try again later", service.deadline.as_secs_f64());
            Problem::new(Status::GATEWAY_TIMEOUT, "deadline", "The deadline has passed", detail)
        }
        Failure::Panicked => {
            service.metrics.panics.inc();
            Problem::internal()
        }
    }
}
