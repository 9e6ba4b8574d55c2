//! One connection: what it may take its time with, and how it ends.

use std::convert::Infallible;
use std::future::poll_fn;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::pin::{Pin, pin};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll};
use std::time::Duration;

use axum::body::Body;
use axum::http::{HeaderValue, Request, Response, header};
use bytes::Bytes;
use http_body::{Body as _, Frame, SizeHint};
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::Service;
use hyper_util::rt::TokioIo;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt, ReadBuf};
use tokio::sync::watch;
use tokio::time::{Instant, sleep_until, timeout};
use tower::ServiceExt;

use super::Stage;
use crate::http::batch::Streaming;
use crate::http::metrics::{Because, Metrics, Reason};
use crate::http::observe::{REQUEST_ID, RequestId};
use crate::server::config::Config;

/// The largest head of a request. Of headers the parser allows 100.
const HEAD_BYTES: usize = 32 * 1024;
/// How long the rest of a request that was answered early is read and thrown away, so that the
/// client reads its answer before it learns that the connection is closed: in all, and without a
/// byte.
const LINGER: Duration = Duration::from_secs(5);
const SILENCE: Duration = Duration::from_secs(1);
/// How long a connection without a whole request holds up the end of the service.
pub const PARTING: Duration = Duration::from_millis(500);

/// The limits of each phase of a connection.
#[derive(Debug, Clone, Copy)]
pub struct Times {
    pub head: Duration,
    answer: Duration,
    idle: Duration,
}

impl Times {
    pub fn of(config: &Config) -> Self {
        Times { head: config.header_time.0, answer: config.answer_time.0, idle: config.idle_time.0 }
    }

    fn of_phase(&self, phase: Phase) -> Option<(Duration, Reason)> {
        match phase {
            Phase::Head => Some((self.head, Reason::head)),
            Phase::Idle => Some((self.idle, Reason::idle)),
            Phase::Answer => Some((self.answer, Reason::answer)),
            // The body and the computation have limits of their own; a stream goes on while both
            // sides do.
            Phase::Request | Phase::Stream => None,
        }
    }
}

/// What a connection is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// The head of a request arrives; a new connection starts here.
    Head,
    /// A request is being read and answered.
    Request,
    /// The client takes the answer.
    Answer,
    /// The client sends and takes line by line.
    Stream,
    /// Between requests.
    Idle,
}

/// How far a connection has come; shared by the socket, the handler and both bodies.
#[derive(Debug, Clone)]
struct Progress(Arc<Mutex<State>>);

#[derive(Debug)]
struct State {
    phase: Phase,
    since: Instant,
    /// Whether a part of the request's body has not been read.
    unread: bool,
    /// Whether all of the answer has been handed to the connection, which still has to send it.
    handed: bool,
    /// The id of the last request whose answer has begun.
    answered: Option<RequestId>,
    /// Since when the client has not taken all that was to be sent.
    blocked: Option<Instant>,
}

impl Progress {
    fn new() -> Self {
        Progress(Arc::new(Mutex::new(State {
            phase: Phase::Head,
            since: Instant::now(),
            unread: false,
            handed: false,
            answered: None,
            blocked: None,
        })))
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn enter(&self, phase: Phase) {
        let mut state = self.state();
        (state.phase, state.since, state.handed) = (phase, Instant::now(), false);
    }

    /// Notes whether bytes could be sent, and when all of them have been.
    fn note<T>(&self, sending: &Poll<T>, is_flush: bool) {
        let mut state = self.state();
        match sending {
            Poll::Pending => drop(state.blocked.get_or_insert_with(Instant::now)),
            Poll::Ready(_) if is_flush => {
                state.blocked = None;
                if state.handed {
                    (state.phase, state.since, state.handed) = (Phase::Idle, Instant::now(), false);
                }
            }
            Poll::Ready(_) => {}
        }
    }

    /// Counts and logs what neither a status nor a metric of the request tells: its answer may have
    /// begun.
    fn panicked(&self, metrics: &Metrics) {
        metrics.panics.inc();
        let id =
            self.state().answered.clone().unwrap_or(RequestId(HeaderValue::from_static("none")));
        id.log_panic("an answer on its way; the connection is closed");
    }

    /// Whether the connection waits for a request.
    fn is_waiting(&self) -> bool {
        matches!(self.state().phase, Phase::Head | Phase::Idle)
    }

    /// When the connection is to be closed, and why, if nothing happens.
    fn deadline(&self, times: &Times, draining: Option<Instant>) -> Option<(Instant, Reason)> {
        let (phase, since, blocked) = {
            let state = self.state();
            (state.phase, state.since, state.blocked)
        };
        let limit = times.of_phase(phase).map(|(time, reason)| (since + time, reason));
        // Who sends request after request and reads no answer is in any phase.
        let taking = blocked.map(|since| (since + times.answer, Reason::answer));
        let limit = limit.into_iter().chain(taking).min_by_key(|(when, _)| *when);
        match (draining, phase) {
            (Some(begun), Phase::Head | Phase::Idle) => {
                let parting = (begun + PARTING, Reason::stop);
                Some(limit.filter(|limit| limit.0 < parting.0).unwrap_or(parting))
            }
            _ => limit,
        }
    }
}

/// What answers requests.
pub trait App:
    tower::Service<Request<Body>, Response = Response<Body>, Error = Infallible, Future: Send>
    + Clone
    + Send
    + 'static
{
}

impl<
    A: tower::Service<Request<Body>, Response = Response<Body>, Error = Infallible, Future: Send>
        + Clone
        + Send
        + 'static,
> App for A
{
}

/// Serves a connection until it ends, is too slow, or the service stops.
pub async fn serve<S>(
    stream: S,
    app: impl App,
    times: Times,
    mut stage: watch::Receiver<Stage>,
    metrics: &Metrics,
) where
    S: AsyncRead + AsyncWrite + Unpin + Send + 'static,
{
    let progress = Progress::new();
    let io = TokioIo::new(Watched { stream, progress: progress.clone() });
    let handler = Handler { app, progress: progress.clone(), stage: stage.clone() };
    let mut builder = http1::Builder::new();
    let mut connection = builder.max_buf_size(HEAD_BYTES).serve_connection(io, handler);
    let mut draining = None;
    let ended = loop {
        let drain = async {
            match draining {
                None => {
                    stage.wait_for(|stage| *stage == Stage::Draining).await.map(drop).unwrap_or(())
                }
                Some(_) => std::future::pending().await,
            }
        };
        tokio::select! {
            biased;
            ended = run(&mut connection, &progress, &times, draining) => break ended,
            () = drain => {
                draining = Some(Instant::now());
                // A request may have arrived that nobody has read yet: a connection that waits for
                // one does so for the time of parting.
                if !progress.is_waiting() {
                    Pin::new(&mut connection).graceful_shutdown();
                }
            }
        }
    };
    match ended {
        Ok(()) => {
            let mut stream = connection.into_parts().io.into_inner().stream;
            let _ = timeout(LINGER, linger(&mut stream)).await;
        }
        Err(Some(reason)) => {
            if reason == Reason::panic {
                progress.panicked(metrics);
            }
            metrics.closed.get_or_create(&Because { reason }).inc();
        }
        Err(None) => {}
    }
}

type Connection<S, A> = http1::Connection<TokioIo<Watched<S>>, Handler<A>>;

/// Drives a connection to its end, or to a limit: the error is the reason, none if the client broke
/// it off.
async fn run<S, A: App>(
    connection: &mut Connection<S, A>,
    progress: &Progress,
    times: &Times,
    draining: Option<Instant>,
) -> Result<(), Option<Reason>>
where
    S: AsyncRead + AsyncWrite + Unpin + Send + 'static,
{
    let deadline = || progress.deadline(times, draining);
    let far = || Instant::now() + Duration::from_secs(86_400);
    let mut alarm = pin!(sleep_until(deadline().map_or_else(far, |(when, _)| when)));
    poll_fn(|context| {
        // Whatever panics while an answer is made or sent: a closed connection shows the client
        // that it has not all of it.
        let polled = catch_unwind(AssertUnwindSafe(|| Pin::new(&mut *connection).poll(context)));
        let Ok(polled) = polled else { return Poll::Ready(Err(Some(Reason::panic))) };
        // Ends when the last answer is sent, and says so to the client.
        if let Poll::Ready(ended) = polled {
            return Poll::Ready(ended.map_err(|_| None));
        }
        // Phases change only while the connection is polled. An alarm that rings too early is set
        // again.
        loop {
            let due = deadline();
            let when = due.map_or_else(far, |(when, _)| when);
            if when < alarm.deadline() {
                alarm.as_mut().reset(when);
            }
            if alarm.as_mut().poll(context).is_pending() {
                return Poll::Pending;
            }
            match due {
                Some((when, reason)) if when <= Instant::now() => {
                    return Poll::Ready(Err(Some(reason)));
                }
                _ => alarm.as_mut().reset(when),
            }
        }
    })
    .await
}

/// Says that no more will be sent, and reads on for a while: a socket closed with unread bytes in
/// it takes the answer with it.
pub async fn linger<S: AsyncRead + AsyncWrite + Unpin>(stream: &mut S) -> io::Result<()> {
    stream.shutdown().await?;
    let mut thrown_away = vec![0; 16 * 1024];
    while timeout(SILENCE, stream.read(&mut thrown_away)).await?? > 0 {}
    Ok(())
}

/// The socket; notes when a request begins to arrive, and when an answer is sent.
struct Watched<S> {
    stream: S,
    progress: Progress,
}

impl<S: AsyncRead + Unpin> AsyncRead for Watched<S> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let before = buffer.filled().len();
        let polled = Pin::new(&mut self.stream).poll_read(context, buffer);
        if buffer.filled().len() > before {
            let is_first = self.progress.state().phase == Phase::Idle;
            if is_first {
                self.progress.enter(Phase::Head);
            }
        }
        polled
    }
}

impl<S: AsyncWrite + Unpin> AsyncWrite for Watched<S> {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        let polled = Pin::new(&mut self.stream).poll_write(context, bytes);
        self.progress.note(&polled, false);
        polled
    }

    /// Called when everything has been written.
    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        let polled = Pin::new(&mut self.stream).poll_flush(context);
        self.progress.note(&polled, true);
        polled
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(context)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        slices: &[io::IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        let polled = Pin::new(&mut self.stream).poll_write_vectored(context, slices);
        self.progress.note(&polled, false);
        polled
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }
}

/// The app, told of the phases.
struct Handler<A> {
    app: A,
    progress: Progress,
    stage: watch::Receiver<Stage>,
}

impl<A: App> Service<Request<Incoming>> for Handler<A> {
    type Response = Response<Sent>;
    type Error = Infallible;
    type Future = Pin<Box<dyn Future<Output = Result<Self::Response, Infallible>> + Send>>;

    fn call(&self, request: Request<Incoming>) -> Self::Future {
        self.progress.enter(Phase::Request);
        {
            let mut state = self.progress.state();
            (state.unread, state.answered) = (!request.body().is_end_stream(), None);
        }
        let (app, progress, stage) = (self.app.clone(), self.progress.clone(), self.stage.clone());
        Box::pin(async move {
            let arriving = |body| Body::new(Arriving { body, progress: progress.clone() });
            let mut response = app.oneshot(request.map(arriving)).await?;
            let is_stream = response.extensions().get::<Streaming>().is_some();
            progress.enter(if is_stream { Phase::Stream } else { Phase::Answer });
            progress.state().answered = response.headers().get(&REQUEST_ID).cloned().map(RequestId);
            // After a body that nobody reads, no further request can be told from its rest.
            if *stage.borrow() != Stage::Serving || progress.state().unread {
                response
                    .headers_mut()
                    .insert(header::CONNECTION, HeaderValue::from_static("close"));
            }
            Ok(response.map(|body| Sent { body, progress }))
        })
    }
}

/// The body of a request; notes when it is read.
struct Arriving {
    body: Incoming,
    progress: Progress,
}

impl http_body::Body for Arriving {
    type Data = Bytes;
    type Error = hyper::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, hyper::Error>>> {
        let polled = Pin::new(&mut self.body).poll_frame(context);
        if self.body.is_end_stream() || matches!(polled, Poll::Ready(None)) {
            self.progress.state().unread = false;
        }
        polled
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}

/// The body of an answer; notes when the connection has all of it.
struct Sent {
    body: Body,
    progress: Progress,
}

impl Drop for Sent {
    fn drop(&mut self) {
        self.progress.state().handed = true;
    }
}

impl http_body::Body for Sent {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        Pin::new(&mut self.body).poll_frame(context)
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}

#[cfg(test)]
mod tests;
