//! Runs the service.

pub mod commands;
pub mod config;
mod connection;
pub mod healthcheck;
mod listener;
pub mod offline;
pub mod pretty;
mod signals;
mod tls;

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::http::HeaderValue;
use tokio::net::{TcpListener, TcpSocket};
use tokio::sync::watch;
use tokio::time::{interval, sleep, timeout};

use crate::http;
use crate::http::middleware::Middleware;
use crate::http::service::Service;
use crate::server::config::Config;
use listener::Listener;
pub use signals::Signals;

/// How far the service has come with stopping.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    /// It serves.
    Serving,
    /// It says that it is not ready, and serves who comes nevertheless.
    Grace,
    /// It finishes what runs.
    Draining,
}

/// A service that listens and does not serve yet.
pub struct Server {
    service: Arc<Service>,
    config: Config,
    main: Listener<Middleware>,
    metrics: Option<Listener<Router>>,
}

impl Server {
    /// Takes the addresses, reads keys and certificates, starts the threads.
    ///
    /// # Errors
    /// A setting that cannot be had, by name.
    pub async fn bind(config: Config) -> Result<Self, String> {
        // As many files as the system allows: each connection is one.
        let _ = rlimit::increase_nofile_limit(u64::MAX);
        let service = Service::start(&config.settings())?;
        let tls = tls::acceptor(&config)?;
        let origins = origins(&config.cors_origins)?;
        let app = http::service(&service, &origins);
        let main = Listener::new(bind(config.listen)?, app, tls, &service, &config);
        let metrics = match config.metrics_listen {
            Some(address) => Some(Listener::new(
                bind(address)?,
                http::metrics_router(&service),
                None,
                &service,
                &config,
            )),
            None => None,
        };
        Ok(Server { service, config, main, metrics })
    }

    /// Where it listens.
    ///
    /// # Errors
    /// The system does not say.
    pub fn address(&self) -> io::Result<SocketAddr> {
        self.main.address()
    }

    /// The address as a client writes it.
    ///
    /// # Errors
    /// As [`Server::address`].
    pub fn url(&self) -> io::Result<String> {
        let scheme = if self.config.tls_cert.is_some() { "https" } else { "http" };
        Ok(format!("{scheme}://{}", self.address()?))
    }

    /// Serves until told to stop, then: says that it is not ready, and serves on for the grace
    /// time; takes no more connections and finishes what runs, for the drain time. A second signal
    /// ends it at once.
    pub async fn run(self, mut signals: Signals) {
        let (stage, follow) = watch::channel(Stage::Serving);
        let Server { service, config, main, metrics } = self;
        let main = tokio::spawn(main.run(follow.clone()));
        let metrics = metrics.map(|metrics| tokio::spawn(metrics.run(follow)));
        let keys = tokio::spawn(reload_keys(service.clone()));
        signals.next().await;
        service.stop();
        tracing::info!(grace = %config.grace, drain = %config.drain, "stopping");
        let stopped = async {
            let _ = stage.send(Stage::Grace);
            sleep(config.grace.0).await;
            let _ = stage.send(Stage::Draining);
            if timeout(config.drain.0, main).await.is_err() {
                tracing::warn!("the drain time is over; what still runs is lost");
            }
        };
        tokio::select! {
            () = stopped => tracing::info!("stopped"),
            () = signals.next() => tracing::warn!("a second signal; stopped at once"),
        }
        keys.abort();
        if let Some(metrics) = metrics {
            metrics.abort();
        }
        if service.traces.is_some() {
            let flushed = tokio::task::spawn_blocking(move || {
                service.traces.as_ref().map(http::traces::Traces::flush)
            });
            let _ = timeout(Duration::from_secs(5), flushed).await;
        }
    }
}

/// Connections that may wait to be taken. Beyond, the system drops their first packet, and the
/// client sends it again a second later.
const BACKLOG: u32 = 4_096;

fn bind(address: SocketAddr) -> Result<TcpListener, String> {
    let listening = || {
        let socket = if address.is_ipv4() { TcpSocket::new_v4() } else { TcpSocket::new_v6() }?;
        // A restart takes the address over while connections to the process before linger in the
        // system. Elsewhere than on Unix the option means another thing.
        #[cfg(unix)]
        socket.set_reuseaddr(true)?;
        socket.bind(address)?;
        socket.listen(BACKLOG)
    };
    listening().map_err(|error: io::Error| format!("cannot listen on {address}: {error}"))
}

/// Origins as a browser sends them: scheme, host and port, nothing after. A slash at the end is
/// left out, and said to be.
fn origins(given: &[String]) -> Result<Vec<HeaderValue>, String> {
    let checked = |text: &String| {
        let refused =
            |what: &str| Err(format!("the setting `cors-origins`: {text} is no origin; {what}"));
        let example = "write https://example.com, or * alone";
        if text == "*" {
            return if given.len() == 1 {
                Ok(HeaderValue::from_static("*"))
            } else {
                refused(example)
            };
        }
        let Some((scheme @ ("http" | "https"), rest)) = text.split_once("://") else {
            return refused(example);
        };
        let host = rest.split(['/', '?', '#']).next().unwrap_or("");
        let origin = format!("{scheme}://{host}");
        match rest.strip_prefix(host) {
            _ if host.is_empty() || host.contains('*') => refused(example),
            Some("") => HeaderValue::from_str(&origin).or_else(|_| refused(example)),
            Some("/") => {
                tracing::warn!(
                    setting = "cors-origins",
                    "{text} is taken as {origin}: an origin has no slash at its end"
                );
                HeaderValue::from_str(&origin).or_else(|_| refused(example))
            }
            _ => refused(&format!("write {origin}, without what follows it")),
        }
    };
    given.iter().map(checked).collect()
}

async fn reload_keys(service: Arc<Service>) {
    let mut ticks = interval(Duration::from_secs(1));
    loop {
        ticks.tick().await;
        match service.keys.reload() {
            Ok(true) => tracing::info!("the API keys file was read again"),
            Ok(false) => {}
            Err(error) => tracing::error!(error, "the API keys stay as they were"),
        }
    }
}
