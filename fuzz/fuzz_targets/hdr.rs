#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| octolux_fuzz::picture("hdr", bytes));
