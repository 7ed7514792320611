//! Bytes as a CSV file of a record.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| servobee_fuzz::record("fuzz.csv", bytes));
