//! `POST /v1/batch`.

use std::sync::Arc;
use std::time::Duration;

use axum::body::Body;
use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use bytes::Bytes;
use futures_util::{StreamExt, stream};
use http_body_util::BodyExt;
use tokio::sync::mpsc;
use tokio::task::JoinHandle;
use tokio::time::{Instant, sleep, timeout};

use super::error::{Problem, Problems};
use super::lines::{Cutter, Part};
use super::negotiate;
use super::paper::Sheets;
use super::pool::Failure;
use super::service::Service;
use super::shape::Shape;

/// The media type of lines of JSON.
pub const NDJSON: &str = "application/x-ndjson";
/// How long to wait for a place in the pool before asking again.
const RETRY: Duration = Duration::from_millis(2);

/// Marks an answer that takes as long as its client sends and reads.
#[derive(Debug, Clone, Copy)]
pub struct Streaming;

/// A part being computed; forgotten when nobody waits for it.
struct Underway(JoinHandle<Sheets>);

impl Drop for Underway {
    fn drop(&mut self) {
        self.0.abort();
    }
}

/// Many operations, one a line
///
/// Each line is `{"id": ..., "op": "evaluate", "body": {...}}`: `op` is the path of an operation after `/v1/`, `body` its request, `id` (a text or a
/// whole number, optional) comes back. The answer has a line for each, in the same order, while the batch is still being sent:
/// `{"line": 1, "id": ..., "answer": {...}}`, or `"problem"` in place of `answer`, and then the rest goes on. There is no limit to the number
/// of lines; each is at most as long as the body of a request may be. The same numbers as from single requests.
#[utoipa::path(
    post,
    path = "/v1/batch",
    operation_id = "batch",
    tag = "Many",
    request_body(content = String, content_type = "application/x-ndjson", description = "Lines of JSON, each an operation.",
        example = r#"{"id": "a", "op": "evaluate", "body": {"curve": {"family": "bezier", "control_points": [[0, 0], [1, 2], [3, 0]]}, "sampling": {"kind": "count", "count": 3}}}"#),
    responses((status = 200, description = "Lines of JSON, each an answer or a problem.", body = String, content_type = "application/x-ndjson"), Problems)
)]
pub async fn post(State(service): State<Arc<Service>>, request: Request) -> Response {
    let checked = check_media_type(request.headers()).and_then(|()| {
        negotiate::wanted(request.headers(), &[NDJSON, "application/jsonl"])?;
        negotiate::shape(request.uri().query())
    });
    let shape = match checked {
        Ok(shape) => shape,
        Err(problem) => return problem.into_response(),
    };
    // As many parts underway as keep every worker busy; the next is read when the first of them is sent.
    let (send, receive) = mpsc::channel(2 * service.pool.workers());
    tokio::spawn(read(request.into_body(), shape, service, send));
    let sheets = stream::unfold(receive, |mut receive: mpsc::Receiver<Underway>| async move {
        let mut underway = receive.recv().await?;
        let sheets = (&mut underway.0).await.unwrap_or_else(|_| Sheets::default());
        Some((stream::iter(sheets.into_iter().map(Ok::<Bytes, std::convert::Infallible>)), receive))
    });
    let body = Body::from_stream(sheets.flatten());
    let mut response = ([(header::CONTENT_TYPE, HeaderValue::from_static(NDJSON))], body).into_response();
    response.extensions_mut().insert(Streaming);
    response
}

fn check_media_type(headers: &HeaderMap) -> Result<(), Problem> {
    let essence = negotiate::essence(negotiate::content_type(headers));
    if [NDJSON, "application/jsonl", "application/ndjson"].contains(&essence.as_str()) {
        return Ok(());
    }
    let detail = format!("a batch is sent with the header Content-Type: {NDJSON}");
    Err(Problem::new(StatusCode::UNSUPPORTED_MEDIA_TYPE, "unsupported_media_type", "Unsupported media type", detail))
}

/// Reads the batch, and hands its parts out in order, until its end or until nobody takes them.
async fn read(mut body: Body, shape: Shape, service: Arc<Service>, send: mpsc::Sender<Underway>) {
    let mut cutter = Cutter::default();
    let hand_out = |part: Part| {
        let service = service.clone();
        send.send(Underway(tokio::spawn(async move { compute(part, shape, service).await })))
    };
    let broken = loop {
        let frame = tokio::select! {
            frame = timeout(service.body_time, body.frame()) => frame,
            () = send.closed() => return,
        };
        match frame {
            Ok(None) => break None,
            Ok(Some(Ok(frame))) => cutter.push(&frame.into_data().unwrap_or_default()),
            Ok(Some(Err(_))) => break Some(super::call::incomplete()),
            Err(_) => break Some(super::call::body_too_slow(&service)),
        }
        // What has arrived is answered without waiting for more.
        while let Some(part) = cutter.part().or_else(|| cutter.rest(false)) {
            if hand_out(part).await.is_err() {
                return;
            }
        }
        if cutter.pending() > service.max_body {
            break Some(super::call::too_large(&service));
        }
    };
    match broken {
        None => {
            if let Some(part) = cutter.rest(true) {
                let _ = hand_out(part).await;
            }
        }
        // The line that did not arrive whole has the problem in its place.
        Some(problem) => {
            let line = Part { text: b"-".to_vec(), first: cutter.line() };
            let _ = send.send(Underway(tokio::spawn(async move { line.refuse(&problem, &service.budget) }))).await;
        }
    }
}

/// Computes a part; where it is too slow or panics, line by line, so that each line has its own outcome.
async fn compute(part: Part, shape: Shape, service: Arc<Service>) -> Sheets {
    match attempt(&part, shape, &service).await {
        Ok(sheets) => sheets,
        Err(problem) if part.lines() == 1 => part.refuse(&problem, &service.budget),
        Err(_) => {
            let mut all = Sheets::default();
            for line in part.split() {
                let sheets = attempt(&line, shape, &service).await;
                all.extend(sheets.unwrap_or_else(|problem| line.refuse(&problem, &service.budget)));
            }
            all
        }
    }
}

async fn attempt(part: &Part, shape: Shape, service: &Arc<Service>) -> Result<Sheets, Problem> {
    loop {
        let (part, budget, max_depth) = (part.clone(), service.budget.clone(), service.max_depth);
        let job = move || part.answer(shape, max_depth, &budget);
        match service.pool.run(Instant::now() + service.deadline, job).await {
            Ok(sheets) => return sheets,
            Err(Failure::Full) => sleep(RETRY).await,
            Err(failure) => return Err(super::call::failed(service, failure)),
        }
    }
}
