//! What all requests share.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use axum::http::{HeaderMap, HeaderValue};

use super::budget::Budget;
use super::coding::Coding;
use super::keys::Keys;
use super::pool::Pool;
use super::request_id::RequestId;
use super::settings::Settings;
use crate::api::memory::Memory;
use crate::http::metrics::Metrics;
use crate::http::traces::Traces;

/// The state of the service: everything a request needs beside itself.
#[derive(Debug)]
pub struct Service {
    /// Where computations run.
    pub pool: Pool,
    /// Memory for bodies and answers.
    pub memory: Arc<dyn Memory>,
    /// The same, for who waits for room in it.
    pub budget: Arc<Budget>,
    /// What is counted.
    pub metrics: Arc<Metrics>,
    /// Who may ask.
    pub keys: Keys,
    /// Where spans go.
    pub traces: Option<Traces>,
    /// The largest body.
    pub max_body: usize,
    /// The deepest JSON.
    pub max_depth: usize,
    /// Time for a body.
    pub body_time: Duration,
    /// Time for a computation.
    pub deadline: Duration,
    /// Whether answers are compressed for clients that ask.
    pub compression: bool,
    /// Whether `/metrics` is answered elsewhere.
    pub metrics_elsewhere: bool,
    stopping: AtomicBool,
}

impl Service {
    /// Starts the threads and reads the keys.
    ///
    /// # Errors
    /// Keys that cannot be read, threads that cannot be started.
    pub fn start(settings: &Settings) -> Result<Arc<Self>, String> {
        let metrics = Arc::new(Metrics::default());
        let budget = Budget::new(settings.memory, metrics.clone());
        let limits = settings.limits.checked().map_err(|error| error.to_string())?;
        let Settings { workers, queue, patience, .. } = *settings;
        let pool = Pool::start(workers, queue, patience, limits, metrics.clone());
        Ok(Arc::new(Service {
            pool: pool.map_err(|error| format!("cannot start the compute threads: {error}"))?,
            memory: budget.clone(),
            budget,
            keys: Keys::new(&settings.api_keys, settings.api_keys_file.clone())?,
            traces: settings.otlp_endpoint.as_deref().map(Traces::start).transpose()?,
            max_body: settings.max_body,
            max_depth: settings.max_depth,
            body_time: settings.body_time,
            deadline: settings.deadline,
            compression: settings.compression,
            metrics_elsewhere: settings.metrics_elsewhere,
            stopping: AtomicBool::new(false),
            metrics,
        }))
    }

    /// How an answer to this request is compressed.
    pub fn coding(&self, headers: &HeaderMap) -> Option<Coding> {
        if self.compression { Coding::wanted(headers) } else { None }
    }

    /// What an answer of an operation depends on beside the address and the body.
    pub fn vary(&self) -> HeaderValue {
        HeaderValue::from_static(if self.compression {
            "accept, accept-encoding"
        } else {
            "accept"
        })
    }

    /// Counts a panic that the client may see as an answer cut off, and logs what.
    pub fn panicked(&self, id: &RequestId, what: &str) {
        self.metrics.panics.inc();
        id.log_panic(what);
    }

    /// From now on the service is not ready.
    pub fn stop(&self) {
        self.stopping.store(true, Ordering::Relaxed);
    }

    /// Whether it has been told to stop.
    pub fn is_stopping(&self) -> bool {
        self.stopping.load(Ordering::Relaxed)
    }
}
