//! The accept loop: one task for each connection, and no more of them than allowed.

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use tokio::io::AsyncWriteExt;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{Semaphore, watch};
use tokio::time::{sleep, timeout};
use tokio_rustls::TlsAcceptor;

use super::Stage;
use super::connection::{self, App, PARTING, Times};
use crate::api::problem::Problem;
use crate::http::metrics::{Metrics, Reason};
use crate::http::service::Service;
use crate::server::config::Config;

/// Connections beyond the limit that are told so at the same time; others are closed without a
/// word.
const TURNED_AWAY: usize = 64;

/// Connections that the system may have taken for us and that are still served when draining
/// begins.
const WAITING: usize = 4_096;

/// Takes connections on one address.
pub struct Listener<A> {
    socket: TcpListener,
    host: Host<A>,
}

/// What a connection meets.
struct Host<A> {
    app: A,
    tls: Option<TlsAcceptor>,
    metrics: Arc<Metrics>,
    times: Times,
    most: usize,
    places: Arc<Semaphore>,
    turned_away: Arc<Semaphore>,
    full: Bytes,
}

impl<A: App> Listener<A> {
    pub fn new(
        socket: TcpListener,
        app: A,
        tls: Option<TlsAcceptor>,
        service: &Service,
        config: &Config,
    ) -> Self {
        let most = config.connections;
        let (places, turned_away) =
            (Arc::new(Semaphore::new(most)), Arc::new(Semaphore::new(TURNED_AWAY)));
        let host = Host {
            app,
            tls,
            metrics: service.metrics.clone(),
            times: Times::of(config),
            most,
            places,
            turned_away,
            full: full(),
        };
        Listener { socket, host }
    }

    pub fn address(&self) -> io::Result<SocketAddr> {
        self.socket.local_addr()
    }

    /// Takes connections until draining begins, then waits until all have ended.
    pub async fn run(self, stage: watch::Receiver<Stage>) {
        let Listener { socket, host } = self;
        let mut draining = stage.clone();
        loop {
            let accepted = tokio::select! {
                _ = draining.wait_for(|stage| *stage == Stage::Draining) => break,
                accepted = socket.accept() => accepted,
            };
            match accepted {
                Ok((stream, _)) => host.take(stream, &stage),
                Err(error) => recover(&error).await,
            }
        }
        // The system has connected them: closing the socket would break them off.
        if let Ok(socket) = socket.into_std() {
            let waiting = std::iter::from_fn(|| socket.accept().ok()).take(WAITING);
            waiting
                .filter_map(|(stream, _)| adopt(stream).ok())
                .for_each(|stream| host.take(stream, &stage));
        }
        // Every place is free when every connection has ended.
        let all = u32::try_from(host.most).unwrap_or(u32::MAX);
        let _ = host.places.acquire_many(all).await;
    }
}

/// A connection taken from the system's own queue.
fn adopt(stream: std::net::TcpStream) -> io::Result<TcpStream> {
    stream.set_nonblocking(true)?;
    TcpStream::from_std(stream)
}

impl<A: App> Host<A> {
    /// Serves a connection on a task of its own, or tells it that there are too many.
    fn take(&self, stream: TcpStream, stage: &watch::Receiver<Stage>) {
        // Answers are written whole: waiting for more to send only delays them.
        let _ = stream.set_nodelay(true);
        if let Ok(place) = self.places.clone().try_acquire_owned() {
            let serving = self.connection(stream, stage.clone());
            tokio::spawn(async move {
                serving.await;
                drop(place);
            });
            return;
        }
        self.metrics.shed(Reason::connections);
        if let Ok(place) = self.turned_away.clone().try_acquire_owned() {
            let full = self.full.clone();
            tokio::spawn(async move {
                let _ = timeout(Duration::from_secs(1), turn_away(stream, full)).await;
                drop(place);
            });
        }
    }

    /// Serves one connection to its end.
    fn connection(
        &self,
        stream: TcpStream,
        stage: watch::Receiver<Stage>,
    ) -> impl Future<Output = ()> + use<A> {
        let (app, tls, metrics, times) =
            (self.app.clone(), self.tls.clone(), self.metrics.clone(), self.times);
        async move {
            metrics.connections.inc();
            match tls {
                None => connection::serve(stream, app, times, stage, &metrics).await,
                // A handshake that fails or takes too long is no connection.
                Some(tls) => {
                    let mut draining = stage.clone();
                    let parting = async {
                        let _ = draining.wait_for(|stage| *stage == Stage::Draining).await;
                        sleep(PARTING).await;
                    };
                    let shaken = tokio::select! {
                        shaken = timeout(times.head, tls.accept(stream)) => shaken.ok().and_then(Result::ok),
                        () = parting => None,
                    };
                    if let Some(stream) = shaken {
                        connection::serve(stream, app, times, stage, &metrics).await;
                    }
                }
            }
            metrics.connections.dec();
        }
    }
}

/// After an error of accepting: some pass with the connection they belong to, others (no files
/// left) with time.
async fn recover(error: &io::Error) {
    use io::ErrorKind as K;
    if !matches!(
        error.kind(),
        K::ConnectionAborted | K::ConnectionReset | K::ConnectionRefused | K::Interrupted
    ) {
        tracing::error!(%error, "cannot take connections");
        sleep(Duration::from_millis(100)).await;
    }
}

/// What a client is told when there are too many; written once, as it may be told often.
fn full() -> Bytes {
    // A struct of strings and numbers always serialises.
    let body = serde_json::to_string(&Problem::overloaded("too many connections are open"))
        .unwrap_or_default();
    let kind = "application/problem+json";
    let head = "HTTP/1.1 503 Service Unavailable\r\nconnection: close\r\nretry-after: 1\r\n";
    format!("{head}content-type: {kind}\r\ncontent-length: {}\r\n\r\n{body}", body.len()).into()
}

/// Tells a client that there are too many.
async fn turn_away(mut stream: TcpStream, full: Bytes) -> io::Result<()> {
    stream.write_all(&full).await?;
    connection::linger(&mut stream).await
}
