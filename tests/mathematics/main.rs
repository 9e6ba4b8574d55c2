//! The mathematics, against vectors, closed forms and other algorithms.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::unreachable,
    reason = "a test ends where it fails"
)]

#[path = "../laws/mod.rs"]
mod laws;

mod architecture;
mod cancellation;
mod convert;
mod correction;
mod errata;
mod extremes;
mod far;
mod fit;
mod imports;
mod interpolation;
mod join;
mod knots;
mod limits;
mod near;
mod properties;
mod rational;
mod rational_surfaces;
mod references;
mod reshape;
mod vectors;
