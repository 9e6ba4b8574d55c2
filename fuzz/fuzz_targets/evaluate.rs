#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    springline_fuzz::evaluate(bytes);
});
