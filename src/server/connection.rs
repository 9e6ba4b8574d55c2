//! One connection: what it may take its time with, and how it ends.

mod handler;
mod progress;
mod watched;

use std::convert::Infallible;
use std::future::poll_fn;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::pin::{Pin, pin};
use std::task::Poll;
use std::time::Duration;

use axum::body::Body;
use axum::http::{Request, Response};
use hyper::server::conn::http1;
use hyper_util::rt::TokioIo;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::sync::watch;
use tokio::time::{Instant, sleep_until, timeout};

use super::Stage;
use crate::http::metrics::{Because, Metrics, Reason};
use handler::Handler;
use progress::Progress;
pub use progress::Times;
use watched::Watched;

/// The largest head of a request. Of headers the parser allows 100.
const HEAD_BYTES: usize = 32 * 1024;
/// How long the rest of a request that was answered early is read and thrown away, so that the
/// client reads its answer before it learns that the connection is closed: in all, and without a
/// byte.
const LINGER: Duration = Duration::from_secs(5);
const SILENCE: Duration = Duration::from_secs(1);
/// How long a connection without a whole request holds up the end of the service.
pub const PARTING: Duration = Duration::from_millis(500);

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

#[cfg(test)]
mod tests;
