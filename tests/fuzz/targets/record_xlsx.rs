//! Bytes as an Excel workbook of a record: the workbook itself, or the content of its sheet.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| match bytes.starts_with(b"PK") {
    true => servobee_fuzz::record("fuzz.xlsx", bytes),
    false => servobee_fuzz::record("fuzz.xlsx", &servobee_fuzz::workbook(bytes)),
});
