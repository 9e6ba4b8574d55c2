//! The contract and the service, from outside: the binary as its clients and operators meet it.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::unreachable,
    reason = "a test ends where it fails"
)]

#[path = "../laws/mod.rs"]
mod laws;
#[path = "../load/mod.rs"]
mod load;
#[path = "../support/mod.rs"]
mod support;

mod batch;
mod browser;
mod clients;
mod command_line;
mod errors;
mod figures;
mod formats;
mod fuzz;
mod hostile;
mod http;
mod http_vectors;
mod openapi;
mod operation;
mod readme;
mod settings;
mod stop;
mod surfaces;
mod weights;
