#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    springline_fuzz::subdivide(bytes);
});
