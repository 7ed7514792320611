//! The text of a file.

use crate::{Error, Result};
use std::io::{BufRead, Read};

/// Longest line that is read, in bytes: a file that is no CSV must not fill the memory.
const LONGEST_LINE: usize = 1 << 20;

/// The rest of `reader`, which belongs to the file called `path`.
///
/// # Errors
/// A line over 1 MiB, or the file cannot be read: `unreadable` says how.
pub(in crate::record) fn lines_of(
    path: &str,
    reader: &mut impl BufRead,
    unreadable: impl Fn(std::io::Error) -> Error,
) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    for row in 1.. {
        let length = reader
            .by_ref()
            .take(LONGEST_LINE as u64 + 1)
            .read_until(b'\n', &mut bytes)
            .map_err(&unreadable)?;
        if length > LONGEST_LINE {
            return Err(Error::input(
                format!("{path}, row {row}"),
                "is longer than 1 MiB",
                "give a CSV file with one sample a line",
            ));
        }
        if length == 0 {
            break;
        }
    }
    Ok(bytes)
}

/// `bytes` as text, with the name of their encoding: UTF-8, UTF-16 with a byte-order mark, or Latin-1.
///
/// Latin-1 is what remains if no byte is one that it has no letter for: such a byte shows another code page, in which
/// `°` and `µ` are other bytes too.
///
/// # Errors
/// None of them.
pub(super) fn decoded(path: &str, bytes: Vec<u8>) -> Result<(String, &'static str)> {
    let pair = |order: fn([u8; 2]) -> u16| {
        let units: Vec<u16> = bytes[2..]
            .chunks(2)
            .map(|pair| order([pair[0], pair.get(1).copied().unwrap_or(0)]))
            .collect();
        String::from_utf16(&units).map(|text| (text, "UTF-16"))
    };
    let utf16 = match bytes.get(..2) {
        Some([0xff, 0xfe]) => Some(pair(u16::from_le_bytes)),
        Some([0xfe, 0xff]) => Some(pair(u16::from_be_bytes)),
        _ => None,
    };
    match utf16 {
        Some(Ok(text)) => return Ok(text),
        Some(Err(_)) => {
            return Err(Error::input(
                path,
                "begins as UTF-16 text but is none",
                "save the file as CSV in UTF-8",
            ));
        }
        None => {}
    }
    let foreign = |&byte: &u8| matches!(byte, 0x80..=0x9f) || byte == 0;
    let at = |bytes: &[u8], position: usize| {
        let before = &bytes[..position];
        let row = 1 + before.iter().filter(|&&byte| byte == b'\n').count();
        Error::input(
            format!("{path}, row {row}"),
            "is not UTF-8 text",
            "save the file as CSV in UTF-8",
        )
    };
    match String::from_utf8(bytes) {
        Ok(text) => match text.find('\0') {
            None => Ok((text, "UTF-8")),
            Some(zero) => Err(at(text.as_bytes(), zero)),
        },
        Err(error) => {
            let valid = error.utf8_error().valid_up_to();
            let bytes = error.into_bytes();
            match bytes.iter().position(foreign) {
                None => Ok((bytes.into_iter().map(char::from).collect(), "Latin-1")),
                Some(foreign) => Err(at(&bytes, foreign.min(valid))),
            }
        }
    }
}
