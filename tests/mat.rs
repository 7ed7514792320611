//! MAT files of level 5 give the record that the CSV file does, bit for bit, and no damage makes the reader panic.
//!
//! The files are made by `tests/data/make_mat.py`.

use crate::program;
use crate::program::{printed, refused as refused_call, servobee, soak};
use flate2::Compression;
use flate2::write::ZlibEncoder;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use servobee::record::inspect::inspect;
use servobee::record::{Channel, FlowCurve, Mapping, Record};
use servobee::{Error, Result};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use tempfile::TempDir;

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/mat");

fn read(name: &str, maps: &[&str]) -> Result<Record> {
    read_at(&Path::new(FOLDER).join(name), maps)
}

fn read_at(path: &Path, maps: &[&str]) -> Result<Record> {
    let maps: Vec<Mapping> = maps.iter().map(|map| map.parse().unwrap()).collect();
    Record::read(path, &maps)
}

fn file(name: &str, bytes: &[u8]) -> (TempDir, PathBuf) {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    (folder, path)
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| value.to_bits()).collect()
}

/// A channel with its unit, as bits.
type Bits = (Channel, String, Vec<u64>);

/// Time and channels as bits.
fn content(record: &Record) -> (Vec<u64>, Vec<Bits>) {
    let channels = record
        .channels()
        .map(|(channel, s)| (channel, s.unit.clone(), bits(&s.values)));
    (bits(record.time()), channels.collect())
}

#[track_caller]
fn refused<T: std::fmt::Debug>(result: Result<T>, parts: &[&str]) {
    let error = result.expect_err("this must be refused");
    assert!(matches!(error, Error::Input { .. }), "{error:?}");
    let message = error.to_string();
    assert!(
        message.len() < 1000 && message.lines().count() == 1,
        "{message:?}"
    );
    for part in parts {
        assert!(message.contains(part), "{part:?} is not in {message:?}");
    }
}

#[test]
fn every_way_to_save_gives_the_record_bit_for_bit() {
    let expected = content(&read("record.csv", &[]).unwrap());
    assert_eq!((expected.0.len(), expected.1.len()), (60, 3));
    let files: [(&str, &[&str], &[&str]); 9] = [
        ("named.mat", &[], &[]),
        ("compressed.mat", &[], &[]),
        ("struct.mat", &[], &[]),
        ("short.mat", &[], &[]),
        ("timeseries.mat", &[], &[]),
        (
            "simulink.mat",
            &[
                "signals(2)(1)=spool [%]",
                "out.signals(2).values(2)=flow [L/min]",
            ],
            &[],
        ),
        ("blocks.mat", &["spool=spool [%]"], &[]),
        (
            "plain.mat",
            &[
                "t=time [s]",
                "u=command [mV]",
                "x(1)=spool [%]",
                "x(2)=flow [L/min]",
            ],
            &["rows(1)", "i8", "on", "cell"],
        ),
        (
            "plain.mat",
            &[
                "t=time [s]",
                "u=command [mV]",
                "cell=spool [%]",
                "rows(2)=flow [L/min]",
            ],
            &[],
        ),
    ];
    for (name, maps, ignored) in &files {
        let record = read(name, maps).unwrap();
        assert_eq!(content(&record), expected, "{name}");
        assert!(record.warnings.is_empty(), "{name}: {:?}", record.warnings);
        for ignored in *ignored {
            assert!(
                record.ignored.iter().any(|name| name == ignored),
                "{:?}",
                record.ignored
            );
        }
    }
    // Without a flow, in both byte orders.
    for name in ["stored_small.mat", "big_endian.mat"] {
        let record = read(name, &["command=command [mV]", "spool=spool [%]"]).unwrap();
        let (time, channels) = content(&record);
        assert_eq!(
            (time, &channels[..]),
            (expected.0.clone(), &expected.1[..2]),
            "{name}"
        );
        assert_eq!(record.ignored, ["count"]);
    }
}

#[test]
fn every_class_of_numbers_is_read() {
    let column = |name: &str| {
        let map = format!("{name}=position [mm]");
        let record = read("plain.mat", &["t=time [s]", "u=command [mV]", &map]).unwrap();
        record.get(Channel::Position).unwrap().values.clone()
    };
    let scaled = |scale: f64, offset: f64| -> Vec<f64> {
        (0..60).map(|row| scale * f64::from(row) + offset).collect()
    };
    for (name, expected) in [
        ("i8", scaled(1.0, -30.0)),
        ("u8", scaled(1.0, 0.0)),
        ("u16", scaled(1000.0, 0.0)),
        ("i32", scaled(-70_000.0, 0.0)),
        ("u32", scaled(70_000.0, 0.0)),
        ("i64", scaled(-(2_f64.powi(40)), 0.0)),
        ("u64", scaled(2_f64.powi(40), 0.0)),
        (
            "f32",
            (0..60_u8)
                .map(|row| f64::from(f32::from(row) / 3.0))
                .collect(),
        ),
        ("on", (0..60).map(|row| f64::from((row + 1) % 2)).collect()),
    ] {
        assert_eq!(column(name), expected, "{name}");
    }
}

#[test]
fn what_cannot_be_read_is_named_with_its_variable() {
    refused(
        read("plain.mat", &[]),
        &[
            "plain.mat",
            "\"time [s]\"",
            "only \"t\", \"u\", \"x(1)\"",
            "--map",
        ],
    );
    refused(
        read(
            "plain.mat",
            &["t=time [s]", "u=command [mV]", "z=spool [%]"],
        ),
        &["plain.mat", "\"z\"", "--map"],
    );
    refused(
        read("blocks.mat", &[]),
        &["variable \"spool.signals.values\"", "no unit", "[%]"],
    );
    refused(
        read("object.mat", &[]),
        &[
            "object.mat, variable \"ts\"",
            "class timeseries",
            "struct('time', ts.Time",
            "save(",
        ],
    );
    refused(
        read("level4.mat", &[]),
        &["level4.mat", "level 4", "save -v7"],
    );
    let header = b"MATLAB 7.3 MAT-file, Platform: GLNXA64";
    for bytes in [header.as_slice(), b"\x89HDF\r\n\x1a\n"] {
        let (_folder, path) = file("new.mat", bytes);
        refused(read_at(&path, &[]), &["new.mat", "7.3", "save -v7"]);
    }
    let (_folder, path) = file("text.mat", b"time,command\n0,1\n");
    refused(read_at(&path, &[]), &["text.mat", "no MAT file of level 5"]);
    // By its content, a MAT file needs no extension, and a curve can be one.
    let bytes = std::fs::read(Path::new(FOLDER).join("named.mat")).unwrap();
    let (_folder, path) = file("record.dat", &bytes);
    assert_eq!(read_at(&path, &[]).unwrap().samples(), 60);
    refused(
        FlowCurve::read(&path),
        &["record.dat", "\"opening [%]\"", "\"flow\""],
    );
}

#[test]
fn unequal_lengths_and_two_times_are_refused() {
    let vector = |name: &str, values: &[f64]| array(6, name, 9, values);
    let of = |arrays: &[Vec<u8>]| file("a.mat", &with_header(&arrays.concat()));
    let (time, command) = (vector("time", &[0.0, 1.0, 2.0]), vector("u", &[0.0, 1.0]));
    let (_folder, path) = of(&[time.clone(), command]);
    refused(
        read_at(&path, &["u=command [V]"]),
        &[
            "a.mat, variable \"u\"",
            "2 values where \"time\" has 3",
            "same times",
        ],
    );
    let later = vector("Time", &[0.0, 1.0, 3.0]);
    let (_folder, path) = of(&[time.clone(), later, vector("u", &[0.0, 1.0, 2.0])]);
    refused(
        read_at(&path, &["u=command [V]"]),
        &[
            "a.mat, variable \"Time\"",
            "time a second time",
            "--map name the one",
        ],
    );
    let chosen = read_at(&path, &["u=command [V]", "Time=time [s]"]).unwrap();
    assert_eq!(chosen.time(), [0.0, 1.0, 3.0]);
    let nan = vector("u", &[0.0, f64::NAN, 1.0]);
    let (_folder, path) = of(&[time, nan]);
    refused(
        read_at(&path, &["u=command [V]"]),
        &[
            "a.mat, variable \"u\", sample 2",
            "\"NaN\" is not finite",
            "repair",
        ],
    );
}

/// The command that says so is looked at in `tests/inspect.rs`; here three files of one bench are fitted together.
#[test]
fn unlike_files_are_fitted_together() {
    let bench = Record::read(Path::new(FOLDER).join("../bench.csv"), &[]).unwrap();
    let series = |channel| &bench.get(channel).unwrap().values;
    let [command, spool] = [Channel::Command, Channel::Spool].map(series);
    let (half, rows) = (bench.samples() / 2, bench.samples());
    let folder = TempDir::new().unwrap();
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).unwrap();
    let line = |row: usize| format!("{};{};{}\n", bench.time()[row], command[row], spool[row]);
    let lines = |rows: std::ops::Range<usize>| rows.map(line).collect::<String>();
    let own = format!("time [s];command [V];spool [V]\n{}", lines(0..half));
    write("a.csv", own.replace(';', ",").as_bytes());
    let german = format!("Log\n\ntime;command;spool\ns;V;V\n{}", lines(half..rows));
    write("c.csv", german.replace('.', ",").as_bytes());
    let vectors = [("t", bench.time()), ("u", &command[..]), ("x", &spool[..])];
    let vectors = vectors.map(|(name, values)| array(6, name, 9, &values[..half]));
    write("b.mat", &with_header(&vectors.concat()));

    let call = |maps: &[&str]| {
        let files = ["identify", "a.csv", "b.mat", "--hold-out", "c.csv"];
        let maps = maps.iter().flat_map(|map| ["--map", map]);
        let rest = ["--effects", "none", "--evaluator", "cpu", "--out", "result"];
        let arguments: Vec<&str> = files.into_iter().chain(maps).chain(rest).collect();
        servobee(folder.path(), &arguments)
    };
    let line = refused_call(&call(&["t=time [s]", "u=command [V]"]));
    assert!(
        line.contains("b.mat") && line.contains("\"spool [%]\""),
        "{line}"
    );
    let line = refused_call(&call(&["t=time [s]", "u=command [mA]", "x=spool [V]"]));
    assert!(line.contains("b.mat"), "{line}");
    let shown = printed(&call(&["t=time [s]", "u=command [V]", "x=spool [V]"]));
    assert!(shown.contains("spool [V]"), "{shown}");
    let report = program::json(folder.path().join("result/report.json"));
    let warnings = report["warnings"].to_string();
    assert!(
        warnings.contains("a.csv: has no column") && !warnings.contains("b.mat"),
        "{warnings}"
    );
}

#[test]
fn a_bomb_is_refused_before_it_fills_the_memory() {
    let claimed: u32 = 3 << 30;
    let started = Instant::now();
    for (claimed, real, parts) in [
        (claimed, 600 << 20, ["over 256 MiB", "fewer samples"]),
        (64, 600 << 20, ["damaged", "as long as it says"]),
    ] {
        let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
        encoder.write_all(&14_u32.to_le_bytes()).unwrap();
        encoder.write_all(&claimed.to_le_bytes()).unwrap();
        let zeros = vec![0; 1 << 20];
        for _ in 0..real >> 20 {
            encoder.write_all(&zeros).unwrap();
        }
        let bomb = encoder.finish().unwrap();
        assert!(bomb.len() < 8 << 20, "{}", bomb.len());
        let mut element = 15_u32.to_le_bytes().to_vec();
        element.extend((bomb.len() as u32).to_le_bytes());
        element.extend(bomb);
        let (_folder, path) = file("bomb.mat", &with_header(&element));
        refused(read_at(&path, &[]), &parts);
    }
    assert!(started.elapsed() < Duration::from_secs(60));

    // Sizes that nothing stands behind: cells, structs, numbers, and cells in cells in cells.
    let sizes = |class: u32, sizes: &[i32]| {
        let bytes: Vec<u8> = sizes.iter().flat_map(|size| size.to_le_bytes()).collect();
        [flags(class), element(5, &bytes), element(1, b"a")].concat()
    };
    let mut nested = element(14, &[]);
    for _ in 0..100 {
        nested = element(14, &[sizes(1, &[1, 1]), nested].concat());
    }
    let huge = [i32::MAX, i32::MAX];
    let names = [
        element(5, &8_i32.to_le_bytes()),
        element(1, b"x\0\0\0\0\0\0\0"),
    ]
    .concat();
    for content in [
        element(14, &sizes(1, &huge)),
        element(14, &[sizes(2, &huge), names].concat()),
        element(14, &[sizes(6, &huge), element(9, &[0; 16])].concat()),
        element(14, &sizes(6, &[i32::MAX; 4])),
        element(14, &sizes(6, &[-1, 2])),
        nested,
    ] {
        let (_folder, path) = file("huge.mat", &with_header(&content));
        refused(read_at(&path, &[]), &["huge.mat, variable \"a", "damaged"]);
    }
}

#[test]
fn no_truncation_panics() {
    for name in ["struct.mat", "stored_small.mat", "timeseries.mat"] {
        let maps = ["command=command [mV]", "spool=spool [%]"];
        let (time, whole) = content(&read(name, &maps).unwrap());
        let bytes = std::fs::read(Path::new(FOLDER).join(name)).unwrap();
        let (_folder, path) = file("cut.mat", &[]);
        for length in 0..bytes.len() {
            std::fs::write(&path, &bytes[..length]).unwrap();
            // A file that is cut between two variables is whole; what it still has must be right.
            if let Ok(record) = read_at(&path, &maps) {
                let (cut_time, channels) = content(&record);
                assert_eq!(cut_time, time, "{name} at {length}");
                assert!(
                    channels.iter().all(|channel| whole.contains(channel)),
                    "{name} at {length}"
                );
                assert!(length + 1600 > bytes.len(), "{name} at {length}");
            }
        }
    }
}

#[test]
fn no_flipped_byte_panics() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let (mut good, mut bad) = (0, 0);
    let maps = [
        "t=time [s]",
        "u=command [mV]",
        "x(1)=spool [%]",
        "q=flow [L/min]",
    ];
    for entry in std::fs::read_dir(FOLDER).unwrap() {
        let original = std::fs::read(entry.unwrap().path()).unwrap();
        let (_folder, path) = file("flipped.mat", &[]);
        for _ in 0..if soak() { 3000 } else { 300 } {
            let mut bytes = original.clone();
            for _ in 0..rng.random_range(1..4) {
                let at = rng.random_range(0..bytes.len());
                bytes[at] ^= 1 << rng.random_range(0..8);
            }
            std::fs::write(&path, &bytes).unwrap();
            let _ = inspect(&path, &[]);
            match read_at(&path, &maps).or_else(|_| read_at(&path, &[])) {
                Ok(record) => {
                    good += 1;
                    assert!(record.time().iter().all(|time| time.is_finite()));
                }
                Err(error) => {
                    bad += 1;
                    assert_eq!(error.exit_code(), 2, "{error}");
                    assert!(error.to_string().len() < 1000, "{error}");
                }
            }
        }
    }
    println!("{good} read, {bad} refused");
    assert!(good > 300 && bad > 300);
}

#[test]
fn compressed_data_that_changed_is_noticed() {
    let bytes = std::fs::read(Path::new(FOLDER).join("compressed.mat")).unwrap();
    let expected = content(&read("compressed.mat", &[]).unwrap());
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let (_folder, path) = file("flipped.mat", &[]);
    for _ in 0..1000 {
        let mut bytes = bytes.clone();
        let at = rng.random_range(128..bytes.len());
        bytes[at] ^= 1 << rng.random_range(0..8);
        std::fs::write(&path, &bytes).unwrap();
        if let Ok(record) = read_at(&path, &[]) {
            assert_eq!(content(&record), expected, "byte {at}");
        }
    }
}

/// `elements` behind the header of a MAT file, low byte first.
fn with_header(elements: &[u8]) -> Vec<u8> {
    let mut bytes = b"MATLAB 5.0 MAT-file".to_vec();
    bytes.resize(124, b' ');
    bytes.extend([0, 1, b'I', b'M']);
    bytes.extend(elements);
    bytes
}

fn element(kind: u32, data: &[u8]) -> Vec<u8> {
    let mut bytes = kind.to_le_bytes().to_vec();
    bytes.extend((data.len() as u32).to_le_bytes());
    bytes.extend(data);
    bytes.resize(bytes.len().next_multiple_of(8), 0);
    bytes
}

fn flags(class: u32) -> Vec<u8> {
    element(6, &[class.to_le_bytes(), [0; 4]].concat())
}

/// A column of numbers.
fn array(class: u32, name: &str, kind: u32, values: &[f64]) -> Vec<u8> {
    let size = [(values.len() as i32).to_le_bytes(), 1_i32.to_le_bytes()].concat();
    let numbers: Vec<u8> = values
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect();
    let name = element(1, name.as_bytes());
    element(
        14,
        &[
            flags(class),
            element(5, &size),
            name,
            element(kind, &numbers),
        ]
        .concat(),
    )
}
