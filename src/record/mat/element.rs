//! The data elements that a MAT file of level 5 is made of: a tag with type and length, and the bytes.
//!
//! All that the file claims is checked against the bytes that are there before anything is allocated.

use flate2::read::ZlibDecoder;
use std::io::Read;

/// Most bytes that a file's content may take in memory, inflated, as numbers and as columns.
const MEMORY: usize = 256 << 20;

/// Types of elements.
pub(super) const INT32: u32 = 5;
pub(super) const UINT32: u32 = 6;
pub(super) const MATRIX: u32 = 14;
pub(super) const COMPRESSED: u32 = 15;

/// What is wrong, and in which field of the variable.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Fault {
    /// The path to the field, empty for the variable itself.
    pub(super) field: String,
    pub(super) problem: String,
    pub(super) remedy: &'static str,
}

pub(super) type Read5<T> = std::result::Result<T, Fault>;

impl Fault {
    /// The same fault, in a field called `name` here.
    pub(super) fn within(mut self, name: &str) -> Self {
        self.field = format!(".{name}{}", self.field);
        self
    }
}

/// The file contradicts itself.
pub(super) fn damaged(problem: &str) -> Fault {
    Fault {
        field: String::new(),
        problem: format!("is damaged: {problem}"),
        remedy: "save or copy the file again",
    }
}

/// How to read numbers, and how much memory is left.
pub(super) struct Reader {
    pub(super) big_endian: bool,
    memory: usize,
}

impl Reader {
    pub(super) fn new(big_endian: bool) -> Self {
        Self {
            big_endian,
            memory: MEMORY,
        }
    }

    /// Accounts for `bytes` that are about to be allocated.
    pub(super) fn allocate(&mut self, bytes: usize) -> Read5<()> {
        self.memory = self.memory.checked_sub(bytes).ok_or_else(|| Fault {
            field: String::new(),
            problem: format!("takes the file's content over {} MiB", MEMORY >> 20),
            remedy: "save only the record's variables, or fewer samples",
        })?;
        Ok(())
    }

    /// Gives back `bytes` that are free again.
    pub(super) fn release(&mut self, bytes: usize) {
        self.memory += bytes;
    }

    fn u32(&self, bytes: [u8; 4]) -> u32 {
        match self.big_endian {
            true => u32::from_be_bytes(bytes),
            false => u32::from_le_bytes(bytes),
        }
    }

    /// The element at the beginning of `bytes`, which then begin behind it; `None` at their end.
    pub(super) fn next<'a>(&self, bytes: &mut &'a [u8]) -> Read5<Option<Element<'a>>> {
        if bytes.is_empty() {
            return Ok(None);
        }
        let (tag, rest) = bytes
            .split_first_chunk()
            .ok_or_else(|| damaged("it ends within a tag"))?;
        let tag = self.u32(*tag);
        // An element of up to four bytes stands in its tag.
        if tag >> 16 != 0 {
            let (packed, rest): (&[u8; 4], _) = rest
                .split_first_chunk()
                .ok_or_else(|| damaged("it ends within a tag"))?;
            *bytes = rest;
            let bytes = packed
                .get(..(tag >> 16) as usize)
                .ok_or_else(|| damaged("a short element is longer than four bytes"))?;
            let kind = tag & 0xffff;
            return Ok(Some(Element { kind, bytes }));
        }
        let (length, rest) = rest
            .split_first_chunk()
            .ok_or_else(|| damaged("it ends within a tag"))?;
        let length = self.u32(*length) as usize;
        let content = rest
            .get(..length)
            .ok_or_else(|| damaged("it ends before its content does"))?;
        let padded = match tag {
            COMPRESSED => length,
            _ => length.next_multiple_of(8).min(rest.len()),
        };
        *bytes = &rest[padded..];
        Ok(Some(Element {
            kind: tag,
            bytes: content,
        }))
    }

    /// The next element, which must be there.
    pub(super) fn needed<'a>(&self, bytes: &mut &'a [u8], what: &str) -> Read5<Element<'a>> {
        self.next(bytes)?
            .ok_or_else(|| damaged(&format!("it ends before its {what}")))
    }

    /// The content of the one matrix that `compressed` inflates to.
    pub(super) fn inflated(&mut self, compressed: &[u8]) -> Read5<Vec<u8>> {
        let broken = |_| damaged("its compressed data cannot be inflated");
        let mut decoder = ZlibDecoder::new(compressed);
        let mut tag = [0; 8];
        decoder.read_exact(&mut tag).map_err(broken)?;
        let [kind, length] = [0, 4].map(|at| {
            let bytes = [tag[at], tag[at + 1], tag[at + 2], tag[at + 3]];
            self.u32(bytes)
        });
        if kind != MATRIX {
            return Err(damaged("its compressed data is no array"));
        }
        self.allocate(length as usize)?;
        let mut content = Vec::new();
        let read = decoder.by_ref().take(u64::from(length));
        { read }.read_to_end(&mut content).map_err(broken)?;
        // Reading on to the end lets the checksum be compared, too.
        let mut behind = Vec::new();
        decoder.take(8).read_to_end(&mut behind).map_err(broken)?;
        match content.len() == length as usize && behind.len() < 8 {
            true => Ok(content),
            false => Err(damaged("its compressed data is not as long as it says")),
        }
    }

    /// The numbers of an element of any numeric type.
    pub(super) fn numbers(&mut self, element: Element<'_>) -> Read5<Vec<f64>> {
        macro_rules! read {
            ($type:ty) => {{
                const SIZE: usize = size_of::<$type>();
                let (chunks, rest) = element.bytes.as_chunks::<SIZE>();
                if !rest.is_empty() {
                    return Err(damaged("it ends within a number"));
                }
                // Once here, and once as a column.
                self.allocate(chunks.len().saturating_mul(2 * size_of::<f64>()))?;
                let number = match self.big_endian {
                    true => <$type>::from_be_bytes,
                    false => <$type>::from_le_bytes,
                };
                chunks.iter().map(|&chunk| number(chunk) as f64).collect()
            }};
        }
        Ok(match element.kind {
            1 => read!(i8),
            2 => read!(u8),
            3 => read!(i16),
            4 => read!(u16),
            INT32 => read!(i32),
            UINT32 => read!(u32),
            7 => read!(f32),
            9 => read!(f64),
            12 => read!(i64),
            13 => read!(u64),
            _ => return Err(damaged("its numbers are of no known type")),
        })
    }

    /// The text of an element of any type that characters are stored as.
    pub(super) fn text(&mut self, element: Element<'_>) -> Read5<String> {
        const UTF8: u32 = 16;
        const UTF32: u32 = 18;
        self.allocate(element.bytes.len().saturating_mul(4))?;
        let (pairs, _) = element.bytes.as_chunks::<2>();
        let (fours, _) = element.bytes.as_chunks::<4>();
        let unit = |&pair: &[u8; 2]| match self.big_endian {
            true => u16::from_be_bytes(pair),
            false => u16::from_le_bytes(pair),
        };
        let character =
            |&four: &[u8; 4]| char::from_u32(self.u32(four)).unwrap_or(char::REPLACEMENT_CHARACTER);
        Ok(match element.kind {
            1 | 2 => element.bytes.iter().copied().map(char::from).collect(),
            UTF8 => String::from_utf8_lossy(element.bytes).into_owned(),
            4 | 17 => String::from_utf16_lossy(&pairs.iter().map(unit).collect::<Vec<u16>>()),
            UTF32 => fours.iter().map(character).collect(),
            _ => return Err(damaged("its text is of no known type")),
        })
    }
}

/// Bytes and their type.
#[derive(Debug, Clone, Copy)]
pub(super) struct Element<'a> {
    pub(super) kind: u32,
    pub(super) bytes: &'a [u8],
}
