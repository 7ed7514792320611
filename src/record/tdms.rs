//! TDMS files of LabVIEW and DIAdem, which are known and not read.

use crate::Error;

/// Bits of the table of contents behind the tag.
const BIG_ENDIAN: u8 = 1 << 6;
const DAQMX: u8 = 1 << 7;

/// The error that the file called `path` is one of these, if it begins with `bytes`.
pub(super) fn refusal(path: &str, bytes: &[u8]) -> Option<Error> {
    let index = bytes.starts_with(b"TDSh");
    if !index && !bytes.starts_with(b"TDSm") {
        return None;
    }
    let contents = bytes.get(4).copied().unwrap_or(0);
    let mut what = String::from("is a TDMS file");
    for (bit, kind) in [
        (BIG_ENDIAN, "with the high byte first"),
        (DAQMX, "with raw data of DAQmx"),
    ] {
        if contents & bit != 0 {
            what = format!("{what} {kind}");
        }
    }
    if index {
        what = String::from("is the index of a TDMS file, without its values");
    }
    Some(Error::input(
        path,
        what,
        "export its channels as CSV, from LabVIEW or DIAdem, or as an Excel workbook with NI's TDM add-in",
    ))
}
