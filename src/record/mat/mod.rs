//! A table of numbers read from a MAT file of level 5, which MATLAB writes by default and with `save -v6` and `-v7`.

mod columns;
mod element;
mod value;

use super::format::Format;
use super::table::{Table, WIDEST};
use super::text::quoted;
use crate::{Error, Result};
use columns::Gathered;
use element::Reader;

const HEADER: usize = 128;

const SAVE: &str = "save it in MATLAB with save -v7";

/// Whether a file that begins with `bytes` is a MAT file of any level that can be told by its beginning.
pub(super) fn is_mat(bytes: &[u8]) -> bool {
    bytes.starts_with(b"MATLAB 5.0 MAT-file") || byte_order(bytes).is_some() || is_hdf5(bytes)
}

/// The columns among the variables in `bytes`; errors name the file `path`.
///
/// # Errors
/// Another level, damage, more than 256 MiB of content or 10 000 columns, nothing that could be a column.
pub(super) fn parse(path: &str, bytes: &[u8]) -> Result<Table> {
    if is_hdf5(bytes) {
        let remedy = "save it in MATLAB with save -v7, or its columns as CSV";
        return Err(Error::input(
            path,
            "is a MAT file of version 7.3, or of HDF5 otherwise",
            remedy,
        ));
    }
    let Some(big_endian) = byte_order(bytes) else {
        let what = match is_level_4(bytes) {
            true => "is a MAT file of level 4",
            false => "is no MAT file of level 5",
        };
        return Err(Error::input(path, what, SAVE));
    };
    let mut reader = Reader::new(big_endian);
    let variables = value::variables(&mut reader, &bytes[HEADER..]).map_err(|(name, fault)| {
        let place = match name {
            Some(name) => format!("{path}, variable {}", quoted(&(name + &fault.field))),
            None => path.into(),
        };
        Error::input(place, fault.problem, fault.remedy)
    })?;
    let Gathered { columns, others } = Gathered::of(&variables);
    if columns.len() > WIDEST {
        return Err(Error::input(
            path,
            format!(
                "holds {} vectors, more than a record can have",
                columns.len()
            ),
            "save only the record's variables",
        ));
    }
    let format = Format::Mat { big_endian };
    let table = Table::of(path, format, Vec::new(), columns, others);
    if table.columns.is_empty() {
        return Err(
            match table.others.iter().any(|other| other.remedy.is_some()) {
                true => table.missing("with numbers", SAVE),
                false => Error::input(
                    path,
                    "holds no vector of numbers",
                    "save time, command and what was measured as vectors of the same length",
                ),
            },
        );
    }
    Ok(table)
}

/// Whether numbers begin with the high byte, in the header of level 5.
fn byte_order(bytes: &[u8]) -> Option<bool> {
    match bytes.get(HEADER - 4..HEADER)? {
        [0, 1, b'I', b'M'] => Some(false),
        [1, 0, b'M', b'I'] => Some(true),
        _ => None,
    }
}

fn is_hdf5(bytes: &[u8]) -> bool {
    const SIGNATURE: &[u8] = b"\x89HDF\r\n\x1a\n";
    const USER_BLOCK: usize = 512;
    bytes.starts_with(b"MATLAB 7.3 MAT-file")
        || bytes.starts_with(SIGNATURE)
        || bytes
            .get(USER_BLOCK..)
            .is_some_and(|bytes| bytes.starts_with(SIGNATURE))
}

/// Level 4 has no signature: its header begins with type, rows, columns, 0 or 1, and the length of a name.
fn is_level_4(bytes: &[u8]) -> bool {
    let word = |at: usize| {
        let bytes = bytes.get(4 * at..4 * at + 4)?;
        bytes.try_into().ok().map(u32::from_le_bytes)
    };
    let plausible = |order: fn(u32) -> u32| {
        let [kind, complex, name] = [0, 3, 4].map(|at| word(at).map_or(u32::MAX, order));
        kind < 5000 && complex <= 1 && (1..64).contains(&name)
    };
    plausible(u32::to_le) || plausible(u32::swap_bytes)
}
