//! One request to an operation: what is sent and wanted is settled, the body read, the computation
//! run where it belongs, the answer written and packed.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use axum::body::Body;
use axum::extract::Request;
use axum::http::{HeaderMap, HeaderValue, header};
use axum::response::{IntoResponse, Response};
use bytes::Bytes;
use tokio::time::Instant;

use super::coding::Coding;
use super::compressor::Packing;
use super::metrics::Reason;
use super::negotiate::{self, BodyFormat};
use super::pool::Failure;
use super::receive::{Received, SMALL, receive};
use super::refusal::{failed, refused};
use super::service::Service;
use crate::api::chunks::{Buffer, Chunks};
use crate::api::cost::{Cost, Costed};
use crate::api::json;
use crate::api::operations::{Operation, Output, OutputKind};
use crate::api::output::{Format, RAW};
use crate::api::problem::Problem;
use crate::api::wire::{Reading, raw};
use crate::core::context::Context;
use crate::http::threads;

/// Answers a request to an operation.
pub async fn answer<O: Operation>(service: Arc<Service>, request: Request) -> Response {
    answered::<O>(service, request).await.unwrap_or_else(IntoResponse::into_response)
}

async fn answered<O: Operation>(
    service: Arc<Service>,
    request: Request,
) -> Result<Response, Problem> {
    let offered: &[&'static str] = match O::Answer::KIND {
        OutputKind::Object => &["application/json", RAW],
        OutputKind::Picture => &["image/svg+xml"],
    };
    let sent = negotiate::sent(request.headers())?;
    let media_type = negotiate::wanted(request.headers(), offered)?;
    let format = Format { raw: media_type == RAW, ..negotiate::format(request.uri().query())? };
    // The raw format shrinks by a tenth only.
    let coding = if format.raw { None } else { service.coding(request.headers()) };
    let body = receive(request, &service).await?;
    let deadline = Instant::now() + service.deadline;
    let packing = coding.map(|coding| Packing { coding, service: service.clone(), deadline });
    let vary = service.vary();
    let computed = Computation { service, body, sent, format, deadline, packing: packing.clone() }
        .run::<O>()
        .await?;
    let packed = match packing {
        // What was computed where it arrived is packed on a worker all the same.
        Some(packing) => packing.on_a_worker(computed).await?,
        None => computed,
    };
    Ok(response(packed, media_type, vary, coding))
}

/// A body that has arrived, and what is to become of it.
struct Computation {
    service: Arc<Service>,
    body: Received,
    sent: BodyFormat,
    format: Format,
    deadline: Instant,
    packing: Option<Packing>,
}

impl Computation {
    async fn run<O: Operation>(self) -> Result<Chunks, Problem> {
        let Computation { service, body, sent, format, deadline, packing } = self;
        let written_by = service.clone();
        // With the body, where it is still there, faults come in its order.
        let written =
            move |context: &Context, request: O::Request, body: &[u8]| -> Result<Chunks, Problem> {
                let mut buffer = Buffer::new(context, &written_by.memory)
                    .side_by_side(1 + written_by.pool.idle(), threads::run);
                O::answer(context, request)
                    .map_err(|error| json::refused(error, body))?
                    .write(format, &mut buffer)?;
                Ok(buffer.finish())
            };
        let pack = move |context: &Context, chunks| match packing {
            Some(packing) => packing.pack(context, chunks),
            None => Ok(chunks),
        };
        let (max_depth, budget) = (service.max_depth, service.budget.clone());
        let result = if body.bytes.len() > SMALL {
            let cost = Cost::of_body(O::PATH, body.bytes.len());
            let job = move |context: &Context| {
                let request = read(context, &body.bytes, sent, max_depth);
                drop(body);
                let request: O::Request = request?;
                budget.await_room(context, request.cost().answer);
                written(context, request, &[]).and_then(|chunks| pack(context, chunks))
            };
            service.pool.compute(cost, deadline, job).await
        } else {
            let context = service.pool.context();
            let request: O::Request = read(&context, &body.bytes, sent, max_depth)?;
            if O::is_small(&request) {
                catch_unwind(AssertUnwindSafe(|| written(&context, request, &body.bytes)))
                    .map_err(|_| Failure::Panicked)
            } else {
                let cost = request.cost();
                let job = move |context: &Context| {
                    budget.await_room(context, cost.answer);
                    written(context, request, &body.bytes).and_then(|chunks| pack(context, chunks))
                };
                service.pool.compute(cost, deadline, job).await
            }
        };
        match result {
            Ok(Err(problem)) if problem.code() == "overloaded" => {
                Err(refused(&service, Reason::memory))
            }
            Ok(done) => done,
            Err(failure) => Err(failed(&service, failure)),
        }
    }
}

/// The answer as HTTP has it.
fn response(
    chunks: Chunks,
    media_type: &'static str,
    vary: HeaderValue,
    coding: Option<Coding>,
) -> Response {
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

fn read<Request: json::Request>(
    context: &Context,
    body: &Bytes,
    sent: BodyFormat,
    max_depth: usize,
) -> Result<Request, Problem> {
    let (text, numbers) = match sent {
        BodyFormat::Json => (&body[..], None),
        BodyFormat::Raw => raw::split(body).map(|(header, numbers)| (header, Some(numbers)))?,
    };
    json::check_depth(text, max_depth)?;
    json::read(&Reading::new(context).with_numbers(numbers.as_ref()), text)
}
