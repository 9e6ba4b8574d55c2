//! `POST /v1/batch`.

use std::io;
use std::panic::AssertUnwindSafe;
use std::sync::Arc;
use std::time::Duration;

use axum::body::Body;
use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderValue, header};
use axum::response::{IntoResponse, Response};
use bytes::Bytes;
use futures_util::{FutureExt, Stream, StreamExt, TryStreamExt, stream};
use http_body_util::BodyExt;
use tokio::sync::mpsc;
use tokio::task::{JoinError, JoinHandle};
use tokio::time::{Instant, sleep, timeout};

use super::negotiate;
use super::pool::Failure;
use super::request_id::RequestId;
use super::service::Service;
use crate::api::chunks::Chunks;
use crate::api::cost::Cost;
use crate::api::lines::{BatchPart, Cutter, NDJSON};
use crate::api::output::Format;
use crate::api::problem::{Problem, Problems, Status};
use crate::core::context::Context;
use crate::http::compressor::{Packer, Refused, hand_over};

/// Where batches are sent.
pub const PATH: &str = "/v1/batch";
/// How long to wait for a place in the pool before asking again.
const RETRY: Duration = Duration::from_millis(2);

/// Marks an answer that takes as long as its client sends and reads.
#[derive(Debug, Clone, Copy)]
pub struct Streaming;

/// A part being computed; forgotten when nobody waits for it.
struct Underway(JoinHandle<Chunks>);

impl Drop for Underway {
    fn drop(&mut self) {
        self.0.abort();
    }
}

/// What all parts of a batch share.
#[derive(Clone)]
struct Batch {
    service: Arc<Service>,
    format: Format,
    id: RequestId,
}

/// Many operations, one a line
///
/// Each line is `{"id": ..., "op": "evaluate", "body": {...}}`: `op` is the path of an operation
/// after `/v1/`, `body` its request, `id` (a text or a whole number, optional) comes back. The
/// answer has a line for each, in the same order, while the batch is still being sent: `{"line": 1,
/// "id": ..., "answer": {...}}`, or `"problem"` in place of `answer`, and then the rest goes on.
/// There is no limit to the number of lines; each is at most as long as the body of a request may
/// be. The same numbers as from single requests.
#[utoipa::path(
    post,
    path = "/v1/batch",
    operation_id = "batch",
    tag = "Many",
    request_body(content = String, content_type = "application/x-ndjson", description = "Lines of JSON, each an operation.",
        example = r#"{"id": "a", "op": "evaluate", "body": {"curve": {"family": "bezier", "control_points": [[0, 0], [1, 2], [3, 0]]}, "sampling": {"kind": "count", "count": 3}}}
{"id": "b", "op": "basis", "body": {"basis": {"family": "alpha-beta-bezier", "alpha": 0.5, "beta": 2}, "order": 3, "count": 3}}
"#),
    responses((status = 200, description = "Lines of JSON, each an answer or a problem.", body = String, content_type = "application/x-ndjson"), Problems)
)]
pub async fn post(State(service): State<Arc<Service>>, request: Request) -> Response {
    let checked = check_media_type(request.headers()).and_then(|()| {
        negotiate::wanted(request.headers(), &[NDJSON, "application/jsonl"])?;
        negotiate::format(request.uri().query())
    });
    let format = match checked {
        Ok(format) => format,
        Err(problem) => return problem.into_response(),
    };
    let id =
        request.extensions().get().cloned().unwrap_or(RequestId(HeaderValue::from_static("none")));
    let packer = service
        .coding(request.headers())
        .and_then(|coding| Packer::new(coding, None, &service.memory));
    let coding = packer.as_ref().map(Packer::coding);
    // As many parts underway as keep every worker busy; the next is read when the first of them is
    // sent.
    let (send, parts) = mpsc::channel(2 * service.pool.workers());
    let batch = Batch { service, format, id };
    let reader = tokio::spawn(read(request.into_body(), batch.clone(), send));
    let mut response = Body::from_stream(
        Answers { parts, reader: Some(reader), packer, batch: batch.clone() }.stream(),
    )
    .into_response();
    let headers = response.headers_mut();
    headers.insert(header::CONTENT_TYPE, HeaderValue::from_static(NDJSON));
    headers.insert(header::VARY, batch.service.vary());
    if let Some(coding) = coding {
        headers.insert(header::CONTENT_ENCODING, coding.header());
    }
    response.extensions_mut().insert(Streaming);
    response
}

/// The answers on their way.
struct Answers {
    parts: mpsc::Receiver<Underway>,
    reader: Option<JoinHandle<()>>,
    packer: Option<Packer>,
    batch: Batch,
}

/// Ends an answer without its end, so that the client does not take what it has for all.
fn cut_off(why: &str) -> io::Error {
    io::Error::other(why)
}

impl Answers {
    /// Chunk by chunk. Whoever compresses or sends may ask again after the end.
    fn stream(self) -> impl Stream<Item = io::Result<Bytes>> {
        let chunks = stream::try_unfold(self, |mut answers| async move {
            let next = answers.next().await?;
            Ok::<_, io::Error>(
                next.map(|chunks| (stream::iter(chunks.into_iter().map(Ok)), answers)),
            )
        });
        chunks.try_flatten().fuse()
    }

    /// What is sent next; nothing at the end.
    async fn next(&mut self) -> io::Result<Option<Vec<Bytes>>> {
        if let Some(mut underway) = self.parts.recv().await {
            let chunks = self.joined((&mut underway.0).await)?;
            return self.packed(chunks).await.map(|chunks| Some(chunks.into_iter().collect()));
        }
        if let Some(reader) = self.reader.take() {
            self.joined(reader.await)?;
        }
        let Some(packer) = self.packer.take() else { return Ok(None) };
        packer.finish().map(|end| Some(vec![end.into()]))
    }

    fn joined<T>(&self, joined: Result<T, JoinError>) -> io::Result<T> {
        joined.map_err(|_| {
            self.batch.panicked("a batch; its answer is cut off");
            cut_off("a part of the batch is lost")
        })
    }

    async fn packed(&mut self, mut chunks: Chunks) -> io::Result<Chunks> {
        let Some(mut packer) = self.packer.take() else { return Ok(chunks) };
        let service = &self.batch.service;
        loop {
            let job = |context: &Context, (mut packer, chunks): (Packer, Chunks)| {
                let packed = packer.pack(context, chunks);
                (packer, packed)
            };
            match hand_over(&service.pool, Instant::now() + service.deadline, (packer, chunks), job)
                .await
            {
                Ok((packer, packed)) => {
                    self.packer = Some(packer);
                    return packed.map_err(|problem| cut_off(problem.code()));
                }
                Err(Refused::Full(again)) => (packer, chunks) = again,
                Err(Refused::Failed(failure)) => {
                    return Err(cut_off(self.batch.failed(failure).code()));
                }
            }
            sleep(RETRY).await;
        }
    }
}

impl Batch {
    fn panicked(&self, what: &str) {
        self.service.panicked(&self.id, what);
    }

    /// As for a single request; what that one's status would tell is logged.
    fn failed(&self, failure: Failure) -> Problem {
        if failure == Failure::Panicked {
            self.id.log_panic("a computation of a batch");
        }
        super::refusal::failed(&self.service, failure)
    }
}

fn check_media_type(headers: &HeaderMap) -> Result<(), Problem> {
    negotiate::check_uncompressed(headers)?;
    let essence = negotiate::essence(negotiate::content_type(headers));
    if [NDJSON, "application/jsonl", "application/ndjson"].contains(&essence.as_str()) {
        return Ok(());
    }
    let detail = format!("a batch is sent with the header Content-Type: {NDJSON}");
    Err(Problem::new(
        Status::UNSUPPORTED_MEDIA_TYPE,
        "unsupported_media_type",
        "Unsupported media type",
        detail,
    ))
}

/// Reads the batch, and hands its parts out in order, until its end or until nobody takes them.
async fn read(mut body: Body, batch: Batch, send: mpsc::Sender<Underway>) {
    let mut cutter = Cutter::default();
    let service = &batch.service;
    let hand_out = |part: BatchPart| {
        let batch = batch.clone();
        send.send(Underway(tokio::spawn(async move {
            guarded(&part, &batch, compute(&part, &batch)).await
        })))
    };
    let broken = loop {
        let frame = tokio::select! {
            frame = timeout(service.body_time, body.frame()) => frame,
            () = send.closed() => return,
        };
        match frame {
            Ok(None) => break None,
            Ok(Some(Ok(frame))) => cutter.push(&frame.into_data().unwrap_or_default()),
            Ok(Some(Err(_))) => break Some(super::receive::incomplete()),
            Err(_) => break Some(super::receive::too_slow(service)),
        }
        // What has arrived is answered without waiting for more.
        while let Some(part) = cutter.part().or_else(|| cutter.rest(false)) {
            if hand_out(part).await.is_err() {
                return;
            }
        }
        if cutter.pending() > service.max_body {
            break Some(super::receive::too_large(service));
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
            let line = BatchPart { text: b"-".to_vec(), first: cutter.line() };
            let budget = service.memory.clone();
            let _ = send
                .send(Underway(tokio::spawn(async move { line.refuse(&problem, &budget) })))
                .await;
        }
    }
}

/// What was computed; after a panic the problem in the place of every line.
async fn guarded(
    part: &BatchPart,
    batch: &Batch,
    computed: impl Future<Output = Chunks>,
) -> Chunks {
    AssertUnwindSafe(computed).catch_unwind().await.unwrap_or_else(|_| {
        batch.panicked("a batch; its lines have the problem in their place");
        part.refuse(&Problem::internal(), &batch.service.memory)
    })
}

/// Computes a part; where it is too slow or panics, line by line, so that each line has its own
/// outcome.
async fn compute(part: &BatchPart, batch: &Batch) -> Chunks {
    let budget = &batch.service.memory;
    match attempt(part, batch).await {
        Ok(chunks) => chunks,
        Err(problem) if part.lines() == 1 => part.refuse(&problem, budget),
        Err(_) => {
            let mut all = Chunks::default();
            for line in part.split() {
                let chunks = attempt(&line, batch).await;
                all.extend(chunks.unwrap_or_else(|problem| line.refuse(&problem, budget)));
            }
            all
        }
    }
}

async fn attempt(part: &BatchPart, batch: &Batch) -> Result<Chunks, Problem> {
    let (service, format) = (&batch.service, batch.format);
    loop {
        let bytes = part.text.len();
        let (part, budget, max_depth) = (part.clone(), service.memory.clone(), service.max_depth);
        let job = move |context: &Context| part.answer(context, format, max_depth, &budget);
        let cost = Cost::of_batch(bytes);
        match service.pool.compute(cost, Instant::now() + service.deadline, job).await {
            Ok(chunks) => return chunks,
            Err(Failure::Full) => sleep(RETRY).await,
            Err(failure) => return Err(batch.failed(failure)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::api::memory;
    use crate::core::limits::Limits;
    use crate::http::settings::Settings;

    fn settings() -> Settings {
        let second = Duration::from_secs(1);
        Settings {
            workers: 2,
            queue: 8,
            patience: second,
            limits: Limits::default(),
            memory: 1 << 24,
            api_keys: Vec::new(),
            api_keys_file: None,
            otlp_endpoint: None,
            max_body: 1 << 20,
            max_depth: 64,
            body_time: second,
            deadline: second,
            compression: false,
            metrics_elsewhere: false,
        }
    }

    fn batch() -> Batch {
        let service = Service::start(&settings()).unwrap();
        Batch {
            service,
            format: Format::default(),
            id: RequestId(HeaderValue::from_static("the-id")),
        }
    }

    async fn panicking<T>() -> T {
        panic!("on purpose")
    }

    fn part() -> BatchPart {
        BatchPart {
            text: b"{\"id\": \"a\", \"op\": \"fit\", \"body\": {}}\n\n{}\n".to_vec(),
            first: 5,
        }
    }

    #[tokio::test]
    async fn a_panic_puts_the_problem_in_the_place_of_every_line() {
        let batch = batch();
        let text = guarded(&part(), &batch, panicking()).await.concat();
        let lines: Vec<serde_json::Value> = text
            .split(|byte| *byte == b'\n')
            .filter(|line| !line.is_empty())
            .map(|line| serde_json::from_slice(line).unwrap())
            .collect();
        let seen: Vec<_> = lines
            .iter()
            .map(|line| (&line["line"], &line["id"], &line["problem"]["code"]))
            .collect();
        let internal = serde_json::json!("internal");
        assert_eq!(
            seen,
            [(&5.into(), &"a".into(), &internal), (&7.into(), &serde_json::Value::Null, &internal)]
        );
        assert_eq!(batch.service.metrics.panics.get(), 1);
    }

    fn answers(batch: &Batch, reader: JoinHandle<()>, parts: Vec<JoinHandle<Chunks>>) -> Answers {
        let (send, receive) = mpsc::channel(9);
        parts
            .into_iter()
            .for_each(|part| send.try_send(Underway(part)).unwrap_or_else(|_| panic!("full")));
        Answers { parts: receive, reader: Some(reader), packer: None, batch: batch.clone() }
    }

    #[tokio::test]
    async fn an_answer_has_an_end_only_if_nothing_is_lost() {
        let batch = batch();
        let good =
            || tokio::spawn(async { part().refuse(&Problem::internal(), &memory::unlimited()) });
        let whole = |answers: Answers| Body::from_stream(answers.stream()).collect();
        assert!(whole(answers(&batch, tokio::spawn(async {}), vec![good()])).await.is_ok());
        assert!(
            whole(answers(&batch, tokio::spawn(async {}), vec![good(), tokio::spawn(panicking())]))
                .await
                .is_err()
        );
        assert!(
            whole(answers(&batch, tokio::spawn(panicking()), vec![good()])).await.is_err(),
            "the reader is gone"
        );
        assert_eq!(batch.service.metrics.panics.get(), 2);
    }

    #[tokio::test]
    async fn an_answer_may_be_asked_for_more_after_its_end() {
        let mut body =
            Body::from_stream(answers(&batch(), tokio::spawn(async {}), Vec::new()).stream());
        for _ in 0..3 {
            assert!(body.frame().await.is_none());
        }
    }
}
