//! What the fuzz targets ask of everything that is read: an error that says where and what to do, or a value that is sound and
//! reads back as it was.

use servobee::record::inspect::Inspection;
use servobee::record::{Mapping, Record};
use servobee::{Error, Result};
use std::io::{Cursor, Write};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

/// Longest message that a user should have to read, in bytes.
const LONGEST_MESSAGE: usize = 4000;

/// What was read; `None` where it was refused with a message that is one line and names a place, which begins with `place`.
pub fn located<T>(place: &str, read: Result<T>) -> Option<T> {
    let error = match read {
        Ok(read) => return Some(read),
        Err(error) => error,
    };
    let text = error.to_string();
    let Error::Input {
        place: at,
        problem,
        remedy,
    } = error
    else {
        panic!("input was refused as a failure of the run: {text}");
    };
    assert!(at.starts_with(place), "{at:?} is not in {place}: {text}");
    assert!(!problem.is_empty() && !remedy.is_empty(), "{text}");
    assert!(text.len() < LONGEST_MESSAGE, "{} bytes: {text}", text.len());
    assert!(!text.contains(char::is_control), "{text:?}");
    None
}

/// Finite values, at least two, that rise.
pub fn assert_rising(values: &[f64]) {
    assert!(values.len() >= 2);
    assert!(values.iter().all(|value| value.is_finite()));
    assert!(values.is_sorted_by(|a, b| a < b), "{values:?}");
}

/// Reads `bytes` as the record in the file called `path`, and looks into the file.
pub fn record(path: &str, bytes: &[u8]) {
    let record = located(path, Record::parse(path, bytes, &[]));
    let inspection = located(path, Inspection::parse(path, bytes, &[]));
    if let Some(record) = &record {
        assert_sound(record);
        assert_reads_back(record);
        let excited = record
            .check_excited()
            .and_then(|()| record.check_response());
        let ready = located(path, excited).is_some();
        let inspection = inspection
            .as_ref()
            .expect("a record is in a file that can be read");
        assert_eq!(inspection.is_ready(), ready, "{inspection:?}");
    }
    let Some(inspection) = inspection else { return };
    assert!(record.is_some() || !inspection.is_ready(), "{inspection:?}");
    let maps = inspection
        .proposals
        .iter()
        .map(|proposal| proposal.map.parse());
    // A column may have a name that no --map can write.
    let Ok(maps) = maps.collect::<Result<Vec<Mapping>>>() else {
        return;
    };
    if let Some(record) = located(path, Record::parse(path, bytes, &maps)) {
        assert_sound(&record);
    }
}

/// A workbook whose one sheet has this content.
pub fn workbook(sheet: &[u8]) -> Vec<u8> {
    const OFFICE: &str = "http://schemas.openxmlformats.org/officeDocument/2006/relationships";
    const MAIN: &str = "http://schemas.openxmlformats.org/spreadsheetml/2006/main";
    let link = |name: &str, kind: &str, target: &str| {
        format!(
            "<Relationships xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\"><Relationship \
             Id=\"{name}\" Type=\"{OFFICE}/{kind}\" Target=\"{target}\"/></Relationships>"
        )
    };
    let book = format!(
        "<workbook xmlns=\"{MAIN}\" xmlns:r=\"{OFFICE}\"><sheets><sheet name=\"A\" sheetId=\"1\" r:id=\"a\"/></sheets></workbook>"
    );
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    let stored = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
    for (name, content) in [
        (
            "_rels/.rels",
            link("w", "officeDocument", "xl/workbook.xml").as_bytes(),
        ),
        ("xl/workbook.xml", book.as_bytes()),
        (
            "xl/_rels/workbook.xml.rels",
            link("a", "worksheet", "worksheets/a.xml").as_bytes(),
        ),
        ("xl/worksheets/a.xml", sheet),
    ] {
        zip.start_file(name, stored).expect("a file in memory");
        zip.write_all(content).expect("a file in memory");
    }
    zip.finish().expect("a file in memory").into_inner()
}

/// Times that rise, and finite values at each of them.
pub fn assert_sound(record: &Record) {
    assert_rising(record.time());
    for (channel, series) in record.channels() {
        assert_eq!(series.values.len(), record.samples(), "{channel}");
        assert!(
            series.values.iter().all(|value| value.is_finite()),
            "{channel}"
        );
    }
}

/// The record that was written and read again is the same, bit for bit.
pub fn assert_reads_back(record: &Record) {
    let text = record.to_csv();
    let again = Record::parse("again.csv", &text, &[]).expect("a written record");
    assert_eq!(bits(again.time()), bits(record.time()), "{text}");
    let channels = |record: &Record| {
        let channels = record.channels();
        let owned = channels.map(|(c, s)| (c, s.unit.clone(), bits(&s.values)));
        owned.collect::<Vec<_>>()
    };
    assert_eq!(channels(&again), channels(record), "{text}");
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| value.to_bits()).collect()
}
