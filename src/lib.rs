//! Springline: curves with shape parameters, over HTTP.
//!
//! - [`core`]: the mathematics; knows nothing of HTTP or JSON.

pub mod core;
