#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| drop(endowire_tests::readers::label_map(bytes)));
