#![no_main]
libfuzzer_sys::fuzz_target!(|text: &str| octolux_fuzz::scene(text));
