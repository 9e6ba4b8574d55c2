//! What the service is set to.

use std::path::PathBuf;
use std::time::Duration;

use crate::core::limits::Limits;

/// Everything that an operator may set of the service itself; where it listens is set elsewhere.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Threads for computations, 1 or more.
    pub workers: usize,
    /// Computations that may wait for one.
    pub queue: usize,
    /// How long one may wait where others wait.
    pub patience: Duration,
    /// The sizes that requests may have.
    pub limits: Limits,
    /// Bytes for bodies and answers.
    pub memory: usize,
    /// Keys, of which a client sends one; none where anybody may ask.
    pub api_keys: Vec<String>,
    /// A file with more of them.
    pub api_keys_file: Option<PathBuf>,
    /// Where spans are sent.
    pub otlp_endpoint: Option<String>,
    /// Bytes of the largest body.
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
}
