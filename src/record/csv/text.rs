//! The text of a file.

use crate::{Error, Result};
use std::borrow::Cow;

/// Longest content that is no UTF-8, in bytes: as text it takes up to twice as many beside them.
const LONGEST_FOREIGN: usize = 64 << 20;

/// `bytes` as text, with the name of their encoding: UTF-8, UTF-16 with a byte-order mark, or Latin-1.
///
/// Latin-1 is what remains if no byte is one that it has no letter for: such a byte shows another code page, in which
/// `°` and `µ` are other bytes too.
///
/// # Errors
/// None of them; more than 64 MiB of another encoding than UTF-8.
pub(super) fn decoded<'a>(path: &str, bytes: &'a [u8]) -> Result<(Cow<'a, str>, &'static str)> {
    let refuse = |place: String, problem: &str| {
        let remedy = "save the file as CSV in UTF-8";
        Err(Error::input(place, problem, remedy))
    };
    let at = |position: usize| {
        let before = &bytes[..position];
        let row = 1 + before.iter().filter(|&&byte| byte == b'\n').count();
        refuse(format!("{path}, row {row}"), "is not UTF-8 text")
    };
    let valid = match std::str::from_utf8(bytes) {
        Ok(text) => match text.find('\0') {
            None => return Ok((text.into(), "UTF-8")),
            Some(zero) => return at(zero),
        },
        Err(error) => error.valid_up_to(),
    };
    if bytes.len() > LONGEST_FOREIGN {
        return refuse(path.into(), "is not UTF-8 text, and longer than 64 MiB");
    }
    let order: Option<fn([u8; 2]) -> u16> = match bytes.get(..2) {
        Some([0xff, 0xfe]) => Some(u16::from_le_bytes),
        Some([0xfe, 0xff]) => Some(u16::from_be_bytes),
        _ => None,
    };
    if let Some(order) = order {
        let pairs = bytes[2..].chunks(2);
        let units = pairs.map(|pair| order([pair[0], pair.get(1).copied().unwrap_or(0)]));
        let text: std::result::Result<String, _> = char::decode_utf16(units).collect();
        return match text {
            Ok(text) if !text.contains('\0') => Ok((text.into(), "UTF-16")),
            _ => refuse(path.into(), "begins as UTF-16 text but is none"),
        };
    }
    let has_no_letter = |&byte: &u8| matches!(byte, 0x80..=0x9f) || byte == 0;
    match bytes.iter().position(has_no_letter) {
        Some(position) => at(position.min(valid)),
        None => {
            let text: String = bytes.iter().copied().map(char::from).collect();
            Ok((text.into(), "Latin-1"))
        }
    }
}
