//! The operation that the variable `OPERATION` names, by its name in batches.
#![no_main]

use std::sync::LazyLock;

use springline_fuzz::{Law, laws};

static LAW: LazyLock<Law> = LazyLock::new(|| {
    let name = std::env::var("OPERATION").expect("OPERATION=evaluate, or another operation");
    let path = format!("/v1/{name}");
    laws().into_iter().find(|(known, _)| *known == path).expect("there is no such operation").1
});

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    LAW(bytes);
});
