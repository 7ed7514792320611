//! Bytes as a checkpoint, whole and cut off: a prefix holds no more than the whole, and whatever is kept is found again.

#![no_main]

use servobee::evaluate::checkpoint::{frame, results_in};
use servobee_fuzz::located;
use std::path::Path;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let path = Path::new("fuzz.checkpoint");
    let read = |bytes: &[u8]| located("fuzz.checkpoint", results_in(path, bytes));
    let whole = read(bytes);
    let cut = read(&bytes[..bytes.len() / 2]);
    if let (Some(whole), Some(cut)) = (whole, cut) {
        assert!(cut <= whole);
    }
    // What a run appends is read, and what is torn off it is not.
    let head = b"servobee/checkpoint/2 0.1.0 0000000000000007\n";
    let mut own = head.to_vec();
    own.extend(frame(1, bytes));
    assert_eq!(read(&own), Some(1));
    own.extend(frame(2, b"more"));
    assert_eq!(read(&own), Some(2));
    assert_eq!(read(&own[..own.len() - 1]), Some(1));
});
