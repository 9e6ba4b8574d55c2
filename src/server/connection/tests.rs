//! The limits of a connection, in a time that stands still until nothing but time can go on.

use std::sync::{Arc, Mutex};

use axum::Router;
use axum::routing::{get, post};
use futures_util::{StreamExt, stream};
use tokio::io::{DuplexStream, duplex};
use tokio::sync::mpsc;
use tokio::time::advance;

use super::*;
use crate::http::request_id::REQUEST_ID;

const LONG: usize = 100_000;
const REQUEST: &[u8] = b"GET / HTTP/1.1\r\nHost: a\r\n\r\n";
const ENDLESS: &[u8] = b"GET /endless HTTP/1.1\r\nHost: a\r\n\r\n";
const UPLOAD: &[u8] = b"POST /upload HTTP/1.1\r\nHost: a\r\nContent-Length: 5\r\n\r\nabc";

const fn seconds(count: u64) -> Duration {
    Duration::from_secs(count)
}

/// No two alike, so that the time of an end says which limit it was.
const TIMES: Times = Times { head: seconds(10), answer: seconds(60), idle: seconds(75) };

/// A client and what it is connected with.
struct Connected {
    client: DuplexStream,
    stage: watch::Sender<Stage>,
    metrics: Arc<Metrics>,
    /// Hears when a handler begins, and when it is dropped.
    handlers: mpsc::UnboundedReceiver<&'static str>,
    opened: Instant,
}

/// Tells of its end.
struct Dropped(mpsc::UnboundedSender<&'static str>);

impl Drop for Dropped {
    fn drop(&mut self) {
        let _ = self.0.send("dropped");
    }
}

/// A connection that holds few bytes on their way, to a service that has much to say.
fn connected() -> Connected {
    let (client, server) = duplex(1_000);
    let (stage, follow) = watch::channel(Stage::Serving);
    let metrics = Arc::new(Metrics::default());
    let counted = metrics.clone();
    let (tell, handlers) = mpsc::unbounded_channel();
    let endless = move || {
        let tell = tell.clone();
        async move {
            tell.send("begun").unwrap();
            let _dropped = Dropped(tell);
            std::future::pending::<()>().await;
        }
    };
    let router = Router::new()
        .route("/", get(|| async { "x".repeat(LONG) }))
        .route("/short", get(|| async { "x" }))
        .route("/upload", post(|body: String| async { body }))
        .route("/endless", get(endless));
    tokio::spawn(async move { serve(server, router, TIMES, follow, &counted).await });
    Connected { client, stage, metrics, handlers, opened: Instant::now() }
}

impl Connected {
    async fn send(&mut self, bytes: &[u8]) {
        self.client.write_all(bytes).await.unwrap();
    }

    /// What comes until the service closes the connection, and when it does.
    async fn rest(&mut self) -> (Vec<u8>, Duration) {
        let mut rest = Vec::new();
        self.client.read_to_end(&mut rest).await.unwrap();
        (rest, Instant::now() - self.opened)
    }

    /// Waits for the service to close a connection of which nothing is read; when it does.
    async fn closed(&self) -> Duration {
        while self.count(Reason::answer) == 0 {
            advance(Duration::from_millis(100)).await;
        }
        Instant::now() - self.opened
    }

    fn count(&self, reason: Reason) -> u64 {
        self.metrics.closed.get_or_create(&Because { reason }).get()
    }
}

/// Within the precision of a timer, and of a test that looks once a second.
fn assert_at(when: Duration, limit: Duration) {
    let latest = limit + limit / 10 + Duration::from_millis(200);
    assert!(when >= limit && when < latest, "{when:?} instead of {limit:?}");
}

#[tokio::test(start_paused = true)]
async fn who_says_nothing_or_half_a_head_is_closed_after_the_time_for_a_head() {
    for sent in [b"".as_slice(), b"GET / HTTP/1.1\r\nHos"] {
        let mut connected = connected();
        connected.send(sent).await;
        let (heard, when) = connected.rest().await;
        assert_eq!(heard, b"");
        assert_at(when, TIMES.head);
        assert_eq!(connected.count(Reason::head), 1);
    }
}

#[tokio::test(start_paused = true)]
async fn a_head_that_drips_has_no_more_time() {
    let mut connected = connected();
    connected.send(b"GET / HTTP/1.1\r\nX-Long: ").await;
    while connected.client.write_all(b"a").await.is_ok() {
        advance(Duration::from_millis(200)).await;
    }
    assert_at(Instant::now() - connected.opened, TIMES.head);
    assert_eq!(connected.count(Reason::head), 1);
}

#[tokio::test(start_paused = true)]
async fn a_connection_between_requests_is_closed_after_its_idle_time() {
    let mut connected = connected();
    connected.send(b"GET /short HTTP/1.1\r\nHost: a\r\n\r\n").await;
    let (heard, when) = connected.rest().await;
    assert!(heard.starts_with(b"HTTP/1.1 200"));
    assert_at(when, TIMES.idle);
    assert_eq!(connected.count(Reason::idle), 1);
}

#[tokio::test(start_paused = true)]
async fn who_reads_no_answer_is_closed_after_the_time_for_it() {
    let mut connected = connected();
    connected.send(REQUEST).await;
    assert_at(connected.closed().await, TIMES.answer);
}

#[tokio::test(start_paused = true)]
async fn a_request_being_computed_has_no_limit_here_and_ends_when_its_client_leaves() {
    let mut connected = connected();
    connected.send(ENDLESS).await;
    assert_eq!(connected.handlers.recv().await, Some("begun"));
    advance(seconds(3_600)).await;
    assert!(connected.handlers.try_recv().is_err(), "it goes on");
    drop(connected.client);
    assert_eq!(connected.handlers.recv().await, Some("dropped"));
}

#[tokio::test(start_paused = true)]
async fn an_answer_on_its_way_is_sent_to_its_end_while_the_service_stops() {
    let mut connected = connected();
    connected.send(REQUEST).await;
    connected.client.read_exact(&mut [0; 1_000]).await.unwrap();
    connected.stage.send(Stage::Draining).unwrap();
    advance(2 * PARTING).await;
    let (rest, _) = connected.rest().await;
    assert!(rest.len() + 1_000 > LONG, "{}", rest.len());
}

#[tokio::test(start_paused = true)]
async fn a_request_on_its_way_is_answered_while_the_service_stops() {
    let mut connected = connected();
    connected.send(UPLOAD).await;
    connected.stage.send(Stage::Draining).unwrap();
    advance(2 * PARTING).await;
    connected.send(b"de").await;
    let (heard, _) = connected.rest().await;
    assert!(
        heard.starts_with(b"HTTP/1.1 200") && heard.ends_with(b"abcde"),
        "{}",
        String::from_utf8_lossy(&heard)
    );
}

#[tokio::test(start_paused = true)]
async fn a_connection_without_a_request_is_parted_from_when_the_service_stops() {
    for sent in [b"".as_slice(), b"GET / HTTP/1.1\r\nHos"] {
        let mut connected = connected();
        connected.send(sent).await;
        connected.stage.send(Stage::Draining).unwrap();
        assert_at(connected.rest().await.1, PARTING);
        assert_eq!(connected.count(Reason::stop), 1);
    }
}

#[tokio::test(start_paused = true)]
async fn the_last_answer_of_a_connection_is_sent_to_its_end() {
    let mut connected = connected();
    connected.send(b"GET / HTTP/1.1\r\nHost: a\r\nConnection: close\r\n\r\n").await;
    let (all, _) = connected.rest().await;
    assert!(all.len() > LONG, "{}", all.len());
}

#[tokio::test(start_paused = true)]
async fn a_request_that_is_answered_early_may_be_sent_to_its_end() {
    let mut connected = connected();
    connected.send(b"GET / HTTP/1.1\r\nHost: a\r\nContent-Length: 400000\r\n\r\n").await;
    connected.client.read_exact(&mut [0; LONG]).await.unwrap();
    for _ in 0..4 {
        advance(Duration::from_millis(500)).await;
        connected.send(&[b' '; LONG]).await;
    }
}

#[tokio::test(start_paused = true)]
async fn who_sends_on_and_reads_nothing_is_closed() {
    let mut connected = connected();
    // The service stops reading where it cannot send, and closes.
    assert!(connected.client.write_all(&REQUEST.repeat(100)).await.is_err());
    assert_at(Instant::now() - connected.opened, TIMES.answer);
    let (got, _) = connected.rest().await;
    assert!(got.len() < 2_000, "closed before it read anything: {}", got.len());
    assert_eq!(connected.count(Reason::answer), 1);
}

/// Collects what is logged on this thread.
#[derive(Clone, Default)]
struct Logged(Arc<Mutex<Vec<u8>>>);

impl io::Write for Logged {
    fn write(&mut self, line: &[u8]) -> io::Result<usize> {
        io::Write::write(&mut *self.0.lock().unwrap(), line)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Half an answer, then a panic where the connection asks for more.
async fn half() -> Response<Body> {
    let pieces = stream::iter(["half", ""]).then(|piece| async move {
        // So that the first piece is sent before the next is asked for.
        tokio::task::yield_now().await;
        if piece.is_empty() { panic!("on purpose") } else { Ok::<_, Infallible>(piece) }
    });
    Response::builder().header(REQUEST_ID, "the-id").body(Body::from_stream(pieces)).unwrap()
}

#[tokio::test]
async fn a_panic_while_an_answer_is_sent_is_counted_logged_and_seen_as_an_answer_cut_off() {
    let logged = Logged::default();
    let writer = logged.clone();
    let subscriber = tracing_subscriber::fmt().with_writer(move || writer.clone()).json().finish();
    let _logging = tracing::subscriber::set_default(subscriber);
    let (mut client, server) = duplex(1_000);
    let (_stage, follow) = watch::channel(Stage::Serving);
    let metrics = Arc::new(Metrics::default());
    let counted = metrics.clone();
    let router = Router::new().route("/", get(half));
    let serving = tokio::spawn(async move { serve(server, router, TIMES, follow, &counted).await });
    client.write_all(REQUEST).await.unwrap();
    let mut answer = Vec::new();
    client.read_to_end(&mut answer).await.unwrap();
    let answer = String::from_utf8(answer).unwrap();
    assert!(
        answer.contains("chunked") && answer.ends_with("4\r\nhalf\r\n"),
        "no last chunk: {answer}"
    );
    serving.await.unwrap();
    assert_eq!(
        (
            metrics.panics.get(),
            metrics.closed.get_or_create(&Because { reason: Reason::panic }).get()
        ),
        (1, 1)
    );
    let log = String::from_utf8(logged.0.lock().unwrap().clone()).unwrap();
    assert!(log.contains("\"request_id\":\"the-id\"") && log.contains("ERROR"), "{log}");
}
