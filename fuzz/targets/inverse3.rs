#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| cohaptic_fuzz::inverse3::run(data));
