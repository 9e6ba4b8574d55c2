//! The contract without HTTP: objects of the wire, operations, problems, JSON and the raw format,
//! lines of batches. From bytes to bytes.

pub mod chunks;
pub mod cost;
pub mod error;
pub mod json;
pub mod line;
pub mod lines;
pub mod memory;
pub mod number_text;
pub mod operations;
pub mod output;
pub mod pointer;
pub mod problem;
pub mod reader;
pub mod rounded;
pub mod sentences;
pub mod side;
pub mod specification;
pub mod unwritten;
pub mod wire;
pub mod writer;
