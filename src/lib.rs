//! Springline: curves with shape parameters, over HTTP.
//!
//! - [`core`]: the mathematics; knows nothing of HTTP or JSON.
//! - [`http`]: the edge: routes, what the JSON looks like, errors, the specification.
//! - [`server`]: runs the service on a listener until it is told to stop.
//! - [`offline`]: the same operations without a server; [`commands`]: on the command line; [`pretty`]: JSON for people.
//! - [`config`]: the settings.
//! - [`metrics`], [`logs`], [`traces`]: what an operator sees.
//! - [`healthcheck`]: asks a running service whether it is alive.

pub mod commands;
pub mod config;
pub mod core;
pub mod healthcheck;
pub mod http;
pub mod logs;
pub mod metrics;
pub mod offline;
pub mod pretty;
pub mod server;
pub mod traces;
