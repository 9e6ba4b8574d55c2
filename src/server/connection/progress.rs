//! How far a connection has come, and how long it may take from there.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::Poll;
use std::time::Duration;

use axum::http::HeaderValue;
use tokio::time::Instant;

use super::PARTING;
use crate::http::metrics::{Metrics, Reason};
use crate::http::request_id::RequestId;
use crate::server::config::Config;

/// The limits of each phase of a connection.
#[derive(Debug, Clone, Copy)]
pub struct Times {
    pub head: Duration,
    pub(super) answer: Duration,
    pub(super) idle: Duration,
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
pub(super) enum Phase {
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
pub(super) struct Progress(Arc<Mutex<State>>);

#[derive(Debug)]
pub(super) struct State {
    pub(super) phase: Phase,
    since: Instant,
    /// Whether a part of the request's body has not been read.
    pub(super) unread: bool,
    /// Whether all of the answer has been handed to the connection, which still has to send it.
    pub(super) handed: bool,
    /// The id of the last request whose answer has begun.
    pub(super) answered: Option<RequestId>,
    /// Since when the client has not taken all that was to be sent.
    blocked: Option<Instant>,
}

impl Progress {
    pub(super) fn new() -> Self {
        Progress(Arc::new(Mutex::new(State {
            phase: Phase::Head,
            since: Instant::now(),
            unread: false,
            handed: false,
            answered: None,
            blocked: None,
        })))
    }

    pub(super) fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn enter(&self, phase: Phase) {
        let mut state = self.state();
        (state.phase, state.since, state.handed) = (phase, Instant::now(), false);
    }

    /// Notes whether bytes could be sent, and when all of them have been.
    pub(super) fn note<T>(&self, sending: &Poll<T>, is_flush: bool) {
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
    pub(super) fn panicked(&self, metrics: &Metrics) {
        metrics.panics.inc();
        let id =
            self.state().answered.clone().unwrap_or(RequestId(HeaderValue::from_static("none")));
        id.log_panic("an answer on its way; the connection is closed");
    }

    /// Whether the connection waits for a request.
    pub(super) fn is_waiting(&self) -> bool {
        matches!(self.state().phase, Phase::Head | Phase::Idle)
    }

    /// When the connection is to be closed, and why, if nothing happens.
    pub(super) fn deadline(
        &self,
        times: &Times,
        draining: Option<Instant>,
    ) -> Option<(Instant, Reason)> {
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
