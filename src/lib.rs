//! Springline: curves with shape parameters, over HTTP. Four floors, each built on those before it:
//!
//! - [`core`]: the mathematics; knows nothing of HTTP or JSON.
//! - [`api`]: the contract: what the JSON looks like, the operations, problems; from bytes to
//!   bytes. [`draw`]: pictures.
//! - [`http`]: the contract over HTTP: routes, middleware, admission.
//! - [`server`]: listening and stopping, the settings, the command line.

#[cfg(feature = "api")]
pub mod api;
pub mod core;
#[cfg(feature = "api")]
pub mod draw;
#[cfg(feature = "server")]
pub mod http;
#[cfg(feature = "server")]
pub mod server;
