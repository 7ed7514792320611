//! Records and curves are read from every common dialect, and what is wrong in a file is named with its place.

use crate::program::measured;
use proptest::prelude::*;
use servobee::record::{
    Channel, FlowCurve, HOLD_OUT, Mapping, Quantity, Record, ResponseCurve, ResponsePoint, Series,
    StepCurve, cases, full_scale,
};
use servobee::{Error, Result};
use std::path::PathBuf;
use tempfile::TempDir;

const HEADER: &str = "time [s],command [V],spool [%]";
const GOOD: &str = "time [s],command [V],spool [%]\n0,0,0.25\n0.001,1.5,-2\n0.003,1.5,3e-2\n";

/// A file without its header.
fn below(text: &str) -> &str {
    text.split_once('\n').unwrap().1
}

fn mappings(texts: &[&str]) -> Vec<Mapping> {
    texts.iter().map(|text| text.parse().unwrap()).collect()
}

/// `bytes` in a file called `name`, in a folder of its own.
fn file(name: &str, bytes: impl AsRef<[u8]>) -> (TempDir, PathBuf) {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    (folder, path)
}

/// Asserts that the input is refused, in one short line that holds all `parts`.
fn assert_refused<T: std::fmt::Debug>(result: Result<T>, parts: &[&str]) {
    let error = result.expect_err("this must be refused");
    assert!(matches!(error, Error::Input { .. }), "{error:?}");
    let message = error.to_string();
    assert_eq!(message.lines().count(), 1, "{message:?}");
    assert!(message.len() < 1000, "{message:?}");
    assert_holds(&message, parts);
}

fn assert_holds(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "{part:?} is not in {message:?}");
    }
}

#[test]
fn every_dialect_gives_the_same_record() {
    let good = Record::parse("a.csv", GOOD, &[]).unwrap();
    assert_eq!(good.name, "a");
    assert_eq!(good.time(), [0.0, 0.001, 0.003]);
    assert_eq!(good.command(), &Series::new("V", vec![0.0, 1.5, 1.5]));
    assert_eq!(
        good.get(Channel::Spool),
        Some(&Series::new("%", vec![0.25, -2.0, 0.03]))
    );
    assert_eq!(good.get(Channel::Flow), None);
    assert!(good.warnings.is_empty() && good.ignored.is_empty());

    let quoted = GOOD
        .trim_end()
        .replace(',', "\",\"")
        .replace('\n', "\"\n\"");
    let dialects = [
        ("byte order mark", format!("\u{feff}{GOOD}")),
        ("CRLF", GOOD.replace('\n', "\r\n")),
        ("CR", GOOD.replace('\n', "\r")),
        ("no last line end", GOOD.trim_end().into()),
        ("semicolons", GOOD.replace(',', ";")),
        (
            "semicolons, decimal commas",
            GOOD.replace(',', ";").replace('.', ","),
        ),
        ("tabs", GOOD.replace(',', "\t")),
        (
            "tabs, decimal commas",
            GOOD.replace(',', "\t").replace('.', ","),
        ),
        ("blanks", GOOD.replace(',', " ,  ")),
        ("quotes", format!("\"{quoted}\"")),
        (
            "blanks around quotes",
            GOOD.replace("command [V]", " \" command [V] \" ")
                .replace("1.5", " \"1.5\""),
        ),
        ("blank lines", GOOD.replace('\n', "\n\n  \n")),
        ("rows of empty cells below", format!("{GOOD},,\n,,\n")),
        (
            "comments",
            format!(
                "# made by hand, in \"2020\n{}",
                GOOD.replace('\n', "\n  # \n")
            ),
        ),
        (
            "capitals",
            GOOD.replace("time [s]", "Time [S]")
                .replace("command", "Command"),
        ),
        (
            "blanks around units",
            GOOD.replace(" [", "[ ").replace(']', " ]"),
        ),
        ("no unit of time", GOOD.replace("time [s]", "time")),
        ("a delimiter behind each row", GOOD.replace('\n', ",\n")),
        (
            "another order",
            "spool [%],time [s],command [V]\n0.25,0,0\n-2,0.001,1.5\n0.03,0.003,1.5\n".into(),
        ),
        ("bars", GOOD.replace(',', "|")),
        ("colons", GOOD.replace(',', ":")),
        ("single blanks", GOOD.replace(',', " ")),
        (
            "aligned with blanks, decimal commas",
            format!(
                "  {}",
                GOOD.replace(',', "   ")
                    .replace('.', ",")
                    .replace('\n', "\n  ")
            ),
        ),
        (
            "a delimiter behind the header alone",
            GOOD.replacen('\n', ",\n", 1),
        ),
        (
            "a delimiter behind each row, not the header",
            GOOD.replacen('\n', "!", 1)
                .replace('\n', ",\n")
                .replace('!', "\n"),
        ),
        (
            "lines above the header",
            format!("Channel file v2\nOperator: Ada, Bob\n\nRate,1000\nStarted,12:30:05\n{GOOD}"),
        ),
        (
            "a rule below the header",
            GOOD.replacen('\n', "\n--------,-----------,---------\n", 1),
        ),
        (
            "units in parentheses",
            GOOD.replace('[', "(").replace(']', ")"),
        ),
        (
            "units behind a slash",
            GOOD.replace(" [", "/").replace(']', ""),
        ),
        (
            "a row of units",
            format!("time,command,spool\ns,V,%\n{}", below(GOOD)),
        ),
        (
            "a row of units in brackets below other lines",
            format!(
                "Log;;\nrig;7;a\ntime;command;spool\n[s];[V];[%]\n{}",
                below(GOOD).replace(',', ";")
            ),
        ),
        (
            "a row of units between blanks",
            format!(
                "time command spool\n(s) (V) (%)\n{}",
                below(GOOD).replace(',', " ")
            ),
        ),
        (
            "other units",
            "time [ms],command [mV],spool [%]\n0,0,0.25\n1,1500,-2\n3,1500,0.03\n".into(),
        ),
    ];
    for (dialect, text) in dialects {
        let mut record = Record::parse("a.csv", &text, &[]);
        if let Ok(record) = &mut record {
            record.sha256 = good.sha256.clone();
        }
        assert_eq!(
            record.as_ref().ok(),
            Some(&good),
            "{dialect}: {record:?} from {text:?}"
        );
    }
}

#[test]
fn common_encodings_are_read() {
    let text = "time [µs],command [V],temperature [°C],note\n0,1,20,größer\n1,2,21,-\n";
    let expected = Record::parse("a.csv", text, &[]).unwrap();
    assert_eq!(expected.time(), [0.0, 1e-6]);
    let utf16 = |order: fn(u16) -> [u8; 2]| -> Vec<u8> {
        format!("\u{feff}{text}")
            .encode_utf16()
            .flat_map(order)
            .collect()
    };
    let latin: Vec<u8> = text.chars().map(|c| u8::try_from(c).unwrap()).collect();
    for (encoding, bytes) in [
        ("UTF-8", text.as_bytes().to_vec()),
        ("UTF-16, low byte first", utf16(u16::to_le_bytes)),
        ("UTF-16, high byte first", utf16(u16::to_be_bytes)),
        ("Latin-1", latin),
    ] {
        let (_folder, path) = file("a.csv", bytes);
        let mut record = Record::read(&path, &[]).unwrap();
        record.path = expected.path.clone();
        record.sha256 = expected.sha256.clone();
        assert_eq!(record, expected, "{encoding}");
    }
    // UTF-16 without a byte-order mark, and with half a character.
    let unmarked = &utf16(u16::to_le_bytes)[2..];
    let halved = [&[0xff, 0xfe], &[0x00, 0xd8][..], b"a\0"].concat();
    let plain: Vec<u8> = GOOD.encode_utf16().flat_map(u16::to_le_bytes).collect();
    for (bytes, parts) in [
        (unmarked.to_vec(), ["row 1", "UTF-8"]),
        (plain, ["row 1", "UTF-8"]),
        (halved, ["UTF-16", "UTF-8"]),
    ] {
        let (_folder, path) = file("a.csv", bytes);
        assert_refused(Record::read(&path, &[]), &parts);
    }
}

#[test]
fn two_possible_readings_are_refused() {
    let header = "time;command [V];spool [%]";
    for (rows, parts) in [
        // Decimals or thousands.
        (
            "1;2;1,234\n2;3;5,678\n",
            &[
                "row 2",
                "\"spool [%]\"",
                "\"1,234\" can be 1.234 and 1234",
                "point",
            ][..],
        ),
        (
            "0;1,5;1,234,567\n",
            &["row 2", "\"spool [%]\"", "\"1,234,567\" is not a number"],
        ),
        (
            "0;1.5;1.234.567\n",
            &["row 2", "\"spool [%]\"", "\"1.234.567\" is not a number"],
        ),
        (
            "0;1.5;1,234.5\n",
            &["row 2", "\"spool [%]\"", "\"1,234.5\" is not a number"],
        ),
    ] {
        let text = format!("{header}\n{rows}");
        assert_refused(Record::parse("a.csv", &text, &[]), parts);
    }
    // One cell that can only be a decimal tells for all.
    let text = format!("{header}\n0,000;2;1,234\n1;3;5,678\n");
    let record = Record::parse("a.csv", &text, &[]).unwrap();
    assert_eq!(record.get(Channel::Spool).unwrap().values, [1.234, 5.678]);

    // Two tables in a file.
    assert_refused(
        Record::parse("a.csv", format!("gain,offset\n1,2\n3,4\n\n{GOOD}"), &[]),
        &[
            "a.csv, row 2",
            "above the header in row 5",
            "one table a file",
        ],
    );
    // Semicolons with decimal commas, or commas with semicolons in a text.
    let text = "time,x;note;y,command\n1,2;a;3,4\n2,3;b;4,5\n";
    assert_refused(
        Record::parse("a.csv", text, &[]),
        &[
            "a.csv, row 2",
            "split in two ways",
            "';'",
            "','",
            "\"2;a;3\"",
            "nowhere else",
        ],
    );
    assert_refused(
        Record::parse(
            "a.csv",
            "time [s];command [V];spool [%]\ns;mV;%\n0;1;2\n",
            &[],
        ),
        &[
            "row 1",
            "\"command [V]\"",
            "\"V\"",
            "\"mV\" in the row of units",
            "one of the two",
        ],
    );
}

#[test]
fn a_file_may_do_without_the_column_of_a_mapping_if_it_has_the_channel() {
    let maps = mappings(&["u=command [V]", "y=spool [%]"]);
    let own = Record::parse("a.csv", GOOD, &maps).unwrap();
    assert_eq!(own.command().values, [0.0, 1.5, 1.5]);
    assert_holds(
        &own.remarks().join("; "),
        &[
            "a.csv: has no column \"u\"",
            "command is taken from \"command [V]\"",
            "\"y\"",
        ],
    );
    // A mapping comes before a name.
    let both = GOOD
        .replace("spool [%]", "u,spool [%]")
        .replace("5,", "5,7,")
        .replace("0,0,", "0,0,7,");
    let record = Record::parse("a.csv", &both, &maps[..1]).unwrap();
    assert_eq!(record.command().values, [7.0; 3]);
    assert_eq!(record.ignored, ["command [V]"]);
    // An exact name comes before one of another case.
    let cases = "T,t,command [V]\n20,0,1\n21,1,2\n";
    let record = Record::parse("a.csv", cases, &mappings(&["t=time [s]"])).unwrap();
    assert_eq!(record.time(), [0.0, 1.0]);
}

/// The spellings of a unit in a header that README names, and what other programs write.
#[test]
fn units_stand_behind_names_in_many_ways() {
    let readme = include_str!("../README.md");
    for spool in ["spool [V]", "spool (V)", "spool/V", "spool_V"] {
        assert!(readme.contains(&format!("`{spool}`")), "{spool}");
        let text = format!("time_ms,command_V,{spool},flow_L_per_min\n0,1,2,3\n1,2,3,4\n");
        let record = Record::parse("a.csv", &text, &[]).unwrap();
        assert_eq!(record.time(), [0.0, 1e-3]);
        assert_eq!(record.command(), &Series::new("V", vec![1.0, 2.0]));
        let spool = record.get(Channel::Spool);
        assert_eq!(spool, Some(&Series::new("V", vec![2.0, 3.0])));
        let flow = record.get(Channel::Flow);
        assert_eq!(flow, Some(&Series::new("L/min", vec![3.0, 4.0])));
    }
    // What looks like one of two columns of a channel is not chosen.
    let text = "time_s,command_V,spool_V,spool [V]\n0,1,2,3\n1,2,3,4\n";
    assert_refused(
        Record::parse("a.csv", text, &[]),
        &["a.csv", "spool_V", "spool [V]"],
    );
}

#[test]
fn mappings_rename_columns() {
    let text = "k,x cmd,y [V],note,time [ms]\n0,1,2,a,1\n1,2,3,b,1\n";
    let maps = [
        "k=time [s]",
        "x cmd = command [m]",
        "y [V]=spool [mm]",
        "time [ms]=flow [gpm]",
    ];
    let record = Record::parse("a.csv", text, &mappings(&maps)).unwrap();
    assert_eq!(record.time(), [0.0, 1.0]);
    assert_eq!(record.command(), &Series::new("mm", vec![1000.0, 2000.0]));
    assert_eq!(
        record.get(Channel::Spool),
        Some(&Series::new("mm", vec![2.0, 3.0]))
    );
    assert_eq!(record.get(Channel::Flow).unwrap().values, [3.785411784; 2]);
    assert_eq!(record.ignored, ["note"]);

    let absent = mappings(&["absent=command [V]"]);
    assert_refused(
        Record::parse("a.csv", text, &absent),
        &["a.csv", "\"absent\"", "\"k\", \"x cmd\"", "--map"],
    );
    let twice = mappings(&["k=time", "y=command [V]", "x cmd=command [V]"]);
    assert_refused(
        Record::parse("a.csv", text, &twice),
        &[
            "a.csv, row 1, column \"x cmd\"",
            "command",
            "\"y [V]\"",
            "rename",
        ],
    );
    assert_refused(
        Record::parse("a.csv", text.replace("note", "k"), &mappings(&maps)),
        &["a.csv, row 1, column \"k\"", "second time", "rename"],
    );

    for (text, parts) in [
        ("x command", ["no \\\"=\\\"", "COLUMN=CHANNEL [UNIT]"]),
        ("=command [V]", ["no column", "COLUMN=CHANNEL [UNIT]"]),
        (
            "x=comand [V]",
            ["\"comand\"", "time nor one of command, spool"],
        ),
        (
            "x=command [bar]",
            ["\"bar\"", "[V] [mV] [mA] [uA] [A] [%] [1] [mm]"],
        ),
        ("x=flow", ["no unit", "[L/min]"]),
    ] {
        let parts = parts.map(|part| part.replace('\\', ""));
        assert_refused(
            text.parse::<Mapping>(),
            &["--map", text, &parts[0], &parts[1]],
        );
    }
}

#[test]
fn every_channel_is_read_and_pressures_need_no_unit() {
    let text = "time,command [V],spool [%],flow [l/min],return_flow [l/min],supply_pressure [MPa],return_pressure,\
                Pressure A,pressure-b [psi],load pressure,position [in],temperature [degF]\n\
                0,0,0,0,0,7,1,2,1000,3,1,212\n1,0,0,0,0,7,1,2,1000,3,1,32\n";
    let record = Record::parse("a.csv", text, &[]).unwrap();
    assert!(
        record
            .channels()
            .map(|(channel, _)| channel)
            .eq(Channel::ALL)
    );
    let first = |channel| {
        let series = record.get(channel).unwrap();
        (series.values[0], series.unit.as_str())
    };
    assert_eq!(first(Channel::SupplyPressure), (70.0, "bar"));
    assert_eq!(first(Channel::ReturnPressure), (1.0, "bar"));
    assert_eq!(first(Channel::PressureA), (2.0, "bar"));
    assert!((first(Channel::PressureB).0 - 68.947_572_931_7).abs() < 1e-9);
    assert_eq!(first(Channel::Position), (25.4, "mm"));
    assert_eq!(first(Channel::Temperature), (100.0, "degC"));
    for channel in Channel::ALL {
        assert_eq!(channel.to_string().parse::<Channel>().unwrap(), channel);
    }
    assert_refused(
        "spol".parse::<Channel>(),
        &["\"spol\"", "use one of command, spool"],
    );
}

#[test]
fn units_are_converted() {
    for (quantity, text, value, kept, expected) in [
        (Quantity::Time, "ms", 1.0, "s", 0.001),
        (Quantity::Time, "µs", 5.0, "s", 5e-6),
        (Quantity::Time, "min", 2.0, "s", 120.0),
        (Quantity::Pressure, "Pa", 5e5, "bar", 5.0),
        (Quantity::Pressure, "kPa", 500.0, "bar", 5.0),
        (Quantity::Flow, "m³/s", 1e-3, "L/min", 60.0),
        (Quantity::Flow, "cm^3/s", 1e3, "L/min", 60.0),
        (Quantity::Signal, "A", 0.02, "mA", 20.0),
        (Quantity::Signal, "-", 0.5, "1", 0.5),
        (Quantity::Signal, "um", 50.0, "mm", 0.05),
        (Quantity::Length, "cm", 1.0, "mm", 10.0),
        (Quantity::Temperature, "K", 273.15, "degC", 0.0),
        (Quantity::Temperature, "°C", 40.0, "degC", 40.0),
        (
            Quantity::Frequency,
            "rad/s",
            std::f64::consts::TAU,
            "Hz",
            1.0,
        ),
        (Quantity::Phase, "rad", -std::f64::consts::PI, "deg", -180.0),
        (Quantity::Share, "1", 0.5, "%", 50.0),
        (Quantity::Area, "mm2", 1.0, "cm2", 0.01),
    ] {
        let unit = quantity.unit(Some(text), "").unwrap();
        assert_eq!(
            (unit.kept(), unit.convert(value)),
            (kept, expected),
            "{text}"
        );
    }
    for (quantity, text) in [
        (Quantity::Signal, "MV"),
        (Quantity::Pressure, "mPa"),
        (Quantity::Pressure, "V"),
        (Quantity::Time, "h"),
    ] {
        assert_refused(
            quantity.unit(Some(text), "here"),
            &["here", text, "write one of"],
        );
    }
}

#[test]
fn what_is_wrong_in_a_record_is_named() {
    let long = format!("H\n0,{},2\n", "x".repeat(5000));
    // In each text, H is a good header.
    let cases: &[(&str, &[&str])] = &[
        ("", &["is empty", "header"]),
        (" \n\n# a\n", &["is empty", "header"]),
        ("H", &["no rows", "below the header"]),
        (
            "0,1,2\n1,2,3\n",
            &["row 1", "numbers where the header", "put a header"],
        ),
        ("# H\n0,1\n", &["row 2", "without a #"]),
        (
            "t,command [V],spool [%]\n0,1,2\n1,2,3\n",
            &["\"time [s]\"", "\"t\"", "--map"],
        ),
        (
            "time,u,spool [%]\n0,1,2\n1,2,3\n",
            &["\"command [V]\"", "\"u\"", "--map"],
        ),
        (
            "time [h],command [V],spool [%]\n0,1,2\n",
            &["row 1", "\"time [h]\"", "[min]"],
        ),
        (
            "time,command,spool [%]\n0,1,2\n",
            &["row 1", "\"command\"", "no unit", "[mA]"],
        ),
        (
            "time,command [V],command [mA],spool [%]\n0,1,2,3\n",
            &[
                "row 1",
                "\"command [mA]\"",
                "second time",
                "\"command [V]\"",
                "rename",
            ],
        ),
        (
            "H\n\n# c\n0,1,2\n1,abc,2\n",
            &["row 5", "\"command [V]\"", "\"abc\"", "0.5"],
        ),
        (&long, &["row 2", "\"command [V]\"", "...", "0.5"]),
        (
            "H\n0,1,2\n1,2,\n",
            &["row 3", "\"spool [%]\"", "empty", "fill in"],
        ),
        (
            "H\n0,1,2\n1,2,NaN\n",
            &["row 3", "\"spool [%]\"", "\"NaN\"", "repair"],
        ),
        (
            "H\n0,1,2\n1,-inf,3\n",
            &["row 3", "\"command [V]\"", "\"-inf\"", "repair"],
        ),
        (
            "H\n0,1,2\n1,1e999,3\n",
            &["row 3", "\"command [V]\"", "\"1e999\"", "repair"],
        ),
        (
            "H\n0,1,2\n1,2\n",
            &["row 3", "2 cells", "3 columns", "one cell a column"],
        ),
        (
            "H\n0,1,2\n1,2,3,4\n",
            &["row 3", "4 cells", "3 columns", "one cell a column"],
        ),
        (
            "H\n0,1,2\n0,1,2,3\n",
            &["row 3", "decimal commas", "semicolons"],
        ),
        (
            "H\n0,1,2\n0.5,2,3\n0.5,2,3\n",
            &[
                "row 4",
                "\"time [s]\"",
                "0.5 s does not rise above 0.5 s",
                "sort",
            ],
        ),
        (
            "H\n1,1,2\n0.5,2,3\n",
            &[
                "row 3",
                "\"time [s]\"",
                "0.5 s does not rise above 1 s",
                "sort",
                "clock was set",
                "--sample-interval",
            ],
        ),
        ("H\n1,1,2\n", &["1 row", "at least two"]),
        (
            "time;command [V];spool [%]\n0;1,5;2.5\n",
            &["row 2", "\"spool [%]\"", "\"2.5\"", "decimal commas"],
        ),
        (
            "time,command [A],spool [%]\n0,1e308,2\n",
            &["row 2", "\"command [A]\"", "\"1e308\"", "repair"],
        ),
        ("H\n0,\"1,2\n1,2,3\n", &["row 2", "quote", "within its row"]),
        (
            "H\n0,1,2\n1,\"2\"2,3\n",
            &["row 3", "quote", "within its row"],
        ),
        (
            "time;command [V];spool [%]\n0;1,5;1.234,5\n",
            &["row 2", "\"spool [%]\"", "\"1.234,5\"", "0,5"],
        ),
    ];
    for (text, parts) in cases {
        let (_folder, path) = file("bad file.csv", text.replace('H', HEADER));
        let result = Record::read(&path, &[]);
        assert_refused(result, &[&["bad file.csv"], *parts].concat());
    }
}

#[test]
fn unreadable_files_are_named() {
    let folder = TempDir::new().unwrap();
    let absent = folder.path().join("absent.csv");
    assert_refused(
        Record::read(&absent, &[]),
        &["absent.csv", "cannot be read", "check the path"],
    );
    assert_refused(
        Record::read(folder.path(), &[]),
        &["cannot be read", "check the path"],
    );
    assert_refused(FlowCurve::read(&absent), &["absent.csv", "check the path"]);

    let (_folder, path) = file("dos.csv", b"time [s]\n0\nm\x84\xe1ig\n");
    assert_refused(
        Record::read(path, &[]),
        &["dos.csv, row 3", "UTF-8", "save the file"],
    );
    let (_folder, path) = file(
        "endless.csv",
        [b"time [s]\n".as_slice(), &[b'0'; 2 << 20]].concat(),
    );
    assert_refused(
        Record::read(path, &[]),
        &["endless.csv, row 2", "1 MiB", "one sample a line"],
    );
    #[cfg(target_os = "linux")]
    assert_refused(
        Record::read("/dev/zero", &[]),
        &["/dev/zero", "longer than 256 MiB"],
    );
    let wide = |columns: usize| format!("{}\n", "x,".repeat(columns)).repeat(2);
    assert_refused(
        Record::parse("wide.csv", wide(9_000), &[]),
        &["\"time [s]\"", "and 8981 more"],
    );
    assert_refused(
        Record::parse("wide.csv", wide(100_000), &[]),
        &["wide.csv, row 1", "100001 cells"],
    );
}

#[test]
fn records_from_memory_are_checked() {
    let series = |unit: &str, values: &[f64]| Series::new(unit, values.to_vec());
    let command = [(Channel::Command, series("V", &[0.0, 1.0]))];
    let new = |time: &[f64], channels: &[(Channel, Series)]| {
        Record::new("made", time.to_vec(), channels.iter().cloned())
    };
    let position = (Channel::Position, series("m", &[0.0, 1.0]));
    let record = new(&[0.0, 1.0], &[command[0].clone(), position]).unwrap();
    assert_eq!(
        record.get(Channel::Position),
        Some(&series("mm", &[0.0, 1000.0]))
    );

    assert_refused(new(&[0.0, 1.0], &[]), &["made", "no command"]);
    assert_refused(
        new(&[0.0], &[(Channel::Command, series("V", &[0.0]))]),
        &["made", "1 row"],
    );
    assert_refused(
        new(&[0.0, 0.0], &command),
        &["made", "sample 1, time", "does not rise"],
    );
    assert_refused(
        new(&[0.0, f64::NAN], &command),
        &["made", "sample 1, time", "NaN is not finite"],
    );
    assert_refused(
        new(&[0.0, 1.0, 2.0], &command),
        &["made", "command", "2 values at 3 times"],
    );
    let furlong = [(Channel::Command, series("furlong", &[0.0, 1.0]))];
    assert_refused(new(&[0.0, 1.0], &furlong), &["made", "command", "furlong"]);
}

#[test]
fn suspicious_times_are_warned_of() {
    let warnings = |step: f64| {
        let time = (0..4).map(|row| f64::from(row) * step).collect();
        let command = Series::new("V", vec![0.0, 1.0, 0.0, 1.0]);
        let record = Record::new("a", time, [(Channel::Command, command)]).unwrap();
        record.warnings.join(" ")
    };
    assert_holds(&warnings(20.0), &["20 s apart", "ms"]);
    assert_holds(&warnings(1e-6), &["within"]);
    // A row a second shows nothing of a valve, and is what counted milliseconds look like.
    assert_holds(&warnings(1.0), &["1 s apart, 3 s in all", "ms"]);
    assert_eq!(warnings(0.1), "");
}

#[test]
fn a_constant_command_is_refused_only_where_asked() {
    let record = Record::parse("a.csv", GOOD.replace("1.5", "0"), &[]).unwrap();
    assert_refused(
        record.check_excited(),
        &["a.csv", "\"command [V]\"", "0 throughout", "moves"],
    );
    Record::parse("a.csv", GOOD, &[])
        .unwrap()
        .check_excited()
        .unwrap();
}

#[test]
fn a_record_without_a_response_is_refused_only_where_asked() {
    let text = "time,command [V],force\n0,1,2\n1,2,3\n";
    let record = Record::parse("a.csv", text, &[]).unwrap();
    assert_refused(
        record.check_response(),
        &["a.csv", "\"flow [L/min]\"", "force", "--map"],
    );
    Record::parse("a.csv", GOOD, &[])
        .unwrap()
        .check_response()
        .unwrap();
}

#[test]
fn the_last_rows_are_held_out() {
    let record = |samples: u32| {
        let time = (0..samples).map(f64::from).collect();
        let command = Series::new("mm", vec![-3.0; samples as usize]);
        Record::new("a", time, [(Channel::Command, command)]).unwrap()
    };
    assert_eq!(record(10).split(HOLD_OUT), 7);
    assert_eq!(record(1000).split(HOLD_OUT), 700);
    assert_eq!(record(10).split(0.0), 10);
    assert_eq!(record(10).split(1.0), 1);
    assert_eq!(record(10).full_scale(), 3.0);
    assert_eq!(full_scale("V", 3.0), 10.0);
    assert_eq!(full_scale("%", 3.0), 100.0);
    assert_eq!(full_scale("mA", 3.0), 3.0);
}

#[test]
fn what_is_wrong_in_a_curve_is_named() {
    let flow = |text: &str| FlowCurve::parse("f.csv", text);
    assert_refused(
        flow("opening [%],q [L/min]\n0,0\n"),
        &["f.csv", "\"flow [L/min]\"", "\"q [L/min]\"", "rename"],
    );
    assert_refused(
        flow("opening,flow [L/min]\n0,0\n"),
        &["f.csv, row 1, column \"opening\"", "no unit", "[%]"],
    );
    assert_refused(
        flow("opening [%],flow [L/min]\n0,0\n0,1\n"),
        &[
            "f.csv, row 3, column \"opening [%]\"",
            "0 % does not rise",
            "sort",
        ],
    );
    assert_refused(
        flow("opening [%],flow [L/min],weight\n0,0,1\n1,1,-1\n"),
        &["f.csv, row 3, column \"weight\"", "negative", "give 1"],
    );
    assert_refused(
        flow("opening [%],flow [L/min],weight\n0,0,0\n1,1,0\n"),
        &[
            "f.csv, row 1, column \"weight\"",
            "every weight is 0",
            "give 1",
        ],
    );

    let response = |rows: &str| {
        ResponseCurve::parse(
            "r.csv",
            format!("frequency [Hz],amplitude [%],phase [deg]\n{rows}"),
        )
    };
    assert_refused(
        response("0,90,-1\n"),
        &[
            "r.csv, row 2, column \"frequency [Hz]\"",
            "0 Hz is not positive",
            "above 0",
        ],
    );
    assert_refused(
        response("1,101,-1\n"),
        &[
            "r.csv, row 2, column \"amplitude [%]\"",
            "101 %",
            "full scale",
        ],
    );
    assert_refused(
        response("1,0,-1\n"),
        &[
            "r.csv, row 2, column \"amplitude [%]\"",
            "outside 0 to 100 %",
            "full scale",
        ],
    );

    let step = |rows: &str| StepCurve::parse("s.csv", format!("time [s],spool [V]\n{rows}"));
    assert_refused(step("0,0\n"), &["s.csv", "1 row", "at least two"]);
    assert_refused(
        step("0,0\n0,1\n"),
        &["s.csv, row 3, column \"time [s]\"", "sort"],
    );
}

#[test]
fn curves_are_read_with_their_options() {
    let flow =
        FlowCurve::parse("f.csv", "opening [1];flow [gpm];wieght\n0;0;2\n0,5;1;2\n").unwrap();
    assert_eq!(flow.opening, [0.0, 50.0]);
    assert_eq!(flow.flow, [0.0, 3.785411784]);
    assert_eq!(flow.weight, [1.0, 1.0]);
    assert_holds(&flow.warnings.join(" "), &["\"wieght\"", "ignored"]);

    let text =
        "frequency [Hz],amplitude [1],phase [rad],gain [dB],weight\n1,0.5,1,,1\n2,1,1,-3,0.5\n";
    let response = ResponseCurve::parse("r.csv", text).unwrap();
    let [first, second] = response.points[..] else {
        panic!("{response:?}")
    };
    assert_eq!(
        (first.amplitude, first.gain, first.weight),
        (Some(50.0), None, 1.0)
    );
    assert_eq!(
        (second.amplitude, second.gain, second.weight),
        (Some(100.0), Some(-3.0), 0.5)
    );
    assert_eq!(first.phase, Some(1.0_f64.to_degrees()));
    assert_holds(&response.warnings.join(" "), &["positive"]);
}

#[test]
fn the_columns_of_a_response_are_known_by_their_units_too() {
    for header in [
        "deg,Hz,dB",
        "[deg],[Hz],[dB]",
        "phi/°,f/Hz,A/dB",
        "Phase Shift (deg),Freq (Hz),Amplitude Ratio (dB)",
        "phase,frequency,gain\ndeg,Hz,dB",
        "phase [deg],frequency [Hz],amplitude [dB]",
    ] {
        let text = format!("{header}\n-10,1,0.5\n-90,20,-3\n");
        let response = ResponseCurve::parse("r.csv", &text).unwrap();
        let known = |point: &ResponsePoint| (point.frequency, point.gain, point.phase);
        let points: Vec<_> = response.points.iter().map(known).collect();
        assert_eq!(
            points,
            [
                (1.0, Some(0.5), Some(-10.0)),
                (20.0, Some(-3.0), Some(-90.0))
            ],
            "{header}"
        );
        assert!(
            response
                .points
                .iter()
                .all(|point| point.amplitude.is_none())
        );
        assert!(response.warnings.is_empty(), "{:?}", response.warnings);
    }
    // A column that is called so comes before one that has the unit alone.
    let text = "frequency [Hz],phase [deg],smoothed [deg]\n1,-10,-9\n";
    let response = ResponseCurve::parse("r.csv", text).unwrap();
    assert_eq!(response.points[0].phase, Some(-10.0));
    assert_holds(
        &response.warnings.join(" "),
        &["\"smoothed [deg]\"", "ignored"],
    );
    let gains = ResponseCurve::parse("r.csv", "Hz,dB\n5,-30\n1,-20\n").unwrap();
    assert_holds(&gains.warnings.join(" "), &["1 Hz", "-20 dB", "0 dB"]);
}

#[test]
fn a_step_becomes_a_record() {
    let step = StepCurve::parse("s.csv", "time [s],spool [mm]\n-1,0\n0,0\n1,2\n").unwrap();
    assert_refused(
        step.to_record(None),
        &["\"s\"", "mm", "\"command [mm]\"", "full scale"],
    );
    let record = step.to_record(Some(2.0)).unwrap();
    assert_eq!(record.command(), &Series::new("mm", vec![0.0, 2.0, 2.0]));
    for (times, expected) in [
        ("0.5,1\n1,2\n", vec![0.0, 0.5, 1.0]),
        ("-1,0\n0.5,1\n", vec![-1.0, 0.0, 0.5]),
    ] {
        let text = format!("time [s],spool [V]\n{times}");
        let record = StepCurve::parse("s.csv", text)
            .unwrap()
            .to_record(None)
            .unwrap();
        assert_eq!(record.time(), expected);
        let command = expected
            .iter()
            .map(|&time| if time < 0.0 { 0.0 } else { 10.0 });
        assert_eq!(record.command().values, command.collect::<Vec<_>>());
        let at_zero = expected.iter().position(|&time| time == 0.0).unwrap();
        assert_eq!(record.get(Channel::Spool).unwrap().values[at_zero], 0.0);
    }
    let early = StepCurve::parse("s.csv", "time [s],spool [V]\n-2,0\n-1,0\n").unwrap();
    assert_refused(
        early.to_record(None),
        &["\"s\"", "-1 s", "0 s", "command [V]"],
    );
    let given = "time [s],spool [mm],command [V]\n0,0,1\n1,2,1\n";
    let record = StepCurve::parse("s.csv", given)
        .unwrap()
        .to_record(None)
        .unwrap();
    assert_eq!(record.command(), &Series::new("V", vec![1.0, 1.0]));
}

#[test]
fn built_in_cases_hold_the_published_numbers() {
    let (areas, flow) = (cases::d675_areas(), cases::d675_flow());
    let published = [
        0, 0, 0, 101, 173, 233, 303, 375, 443, 530, 618, 691, 756, 824, 877, 938, 989, 1028, 1066,
        1095,
    ];
    assert_eq!(areas.opening, flow.opening);
    assert_eq!(areas.area.len(), 20);
    let speed = (2.0 / cases::D675_DENSITY * cases::D675_LAND_PRESSURE * 1e5).sqrt();
    for (row, published) in published.into_iter().enumerate() {
        let expected = cases::D675_FLOW_COEFFICIENT * areas.area[row] * 1e-4 * speed * 60_000.0;
        assert!((flow.flow[row] - expected).abs() <= 1e-12 * expected);
        assert_eq!(flow.flow[row].round() as i32, published);
        assert!((areas.opening[row] - 100.0 * row as f64 / 19.0).abs() < 1e-12);
    }
    assert!(areas.warnings.is_empty() && flow.warnings.is_empty());

    let flow = cases::kbfdg5v_flow();
    assert_eq!(
        flow.opening,
        [
            0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0, 90.0, 100.0
        ]
    );
    assert_eq!(
        flow.flow,
        [
            0.0, 0.0, 52.0, 150.0, 248.0, 346.0, 450.0, 540.0, 625.0, 670.0, 700.0
        ]
    );
    assert_eq!(
        flow.weight,
        [1.0, 1.0, 1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2]
    );
    assert_eq!(cases::KBFDG5V_AREA_START.len(), flow.opening.len());
    assert!(flow.warnings.is_empty());

    let response = cases::two_amplitude_response();
    let at = |amplitude: f64| -> Vec<(f64, f64)> {
        let points = response
            .points
            .iter()
            .filter(|point| point.amplitude == Some(amplitude));
        points
            .map(|point| (point.frequency, point.phase.unwrap()))
            .collect()
    };
    assert_eq!((at(100.0).len(), at(40.0).len()), (8, 8));
    assert_eq!((at(100.0)[5], at(40.0)[6]), ((43.0, -90.0), (57.0, -90.0)));
    assert!(response.warnings.is_empty());

    let record = cases::step().to_record(None).unwrap();
    assert_eq!((record.samples(), record.time()[25]), (26, 0.1));
    assert_eq!(record.command().values, [cases::STEP_FULL_SCALE; 26]);
    assert_eq!(record.get(Channel::Spool).unwrap().max_abs(), 10.6791);
    assert!(cases::step().warnings.is_empty());
}

#[test]
fn a_pressure_that_drives_the_flow_is_taken_by_its_name_and_that_is_said() {
    let text = |column: &str| {
        format!("time [s],command [V],flow [L/min],{column},tank [bar]\n0,1,2,140,3\n1,2,3,141,3\n")
    };
    let record = Record::parse("a.csv", text("Supply [bar]"), &[]).unwrap();
    let supply = record.get(Channel::SupplyPressure).unwrap();
    assert_eq!(*supply, Series::new("bar", vec![140.0, 141.0]));
    let tank = record.get(Channel::ReturnPressure).unwrap();
    assert_eq!(tank.values, [3.0, 3.0]);
    assert_eq!(record.ignored, Vec::<String>::new());
    assert_holds(
        &record.warnings.join(" "),
        &["\"Supply [bar]\" is taken as supply_pressure: rename the column if it is another"],
    );
    // A name that says more, a unit that says otherwise, another column for it and a mapping each leave it alone.
    for other in [
        "pilot supply [bar]",
        "supply [V]",
        "supply",
        "supply [bar],p_supply [bar]",
    ] {
        let text = match other.contains(',') {
            true => text(other)
                .replace("140,", "140,140,")
                .replace("141,", "141,141,"),
            false => text(other),
        };
        let record = Record::parse("a.csv", text, &[]).unwrap();
        assert_eq!(record.get(Channel::SupplyPressure), None, "{other}");
        assert_eq!(record.ignored.len(), other.split(',').count(), "{other}");
    }
    let maps = mappings(&["Supply=spool [mm] *0.01"]);
    let record = Record::parse("a.csv", text("Supply [bar]"), &maps).unwrap();
    assert_eq!(record.get(Channel::SupplyPressure), None);
}

#[test]
fn a_measured_record_is_read() {
    let Some(path) = measured("mts_actuator_mrdamper_0A.csv") else {
        return;
    };
    let maps = mappings(&[
        "t_s=time [s]",
        "x_cmd_mm=command [mm]",
        "x_meas_mm=spool [mm]",
    ]);
    let record = Record::read(path, &maps).unwrap();
    assert_eq!(record.samples(), 61_500);
    assert_eq!(record.name, "mts_actuator_mrdamper_0A");
    assert_eq!(record.ignored, ["force_N"]);
    assert!(record.warnings.is_empty());
    record.check_excited().unwrap();
}

fn record() -> impl Strategy<Value = Record> {
    let number = || any::<f64>().prop_filter("finite", |value| value.is_finite());
    let time = proptest::collection::btree_set(any::<i32>(), 2..20);
    let rows = proptest::collection::vec((number(), number(), number()), 20);
    (time, rows).prop_map(|(time, rows)| {
        let column =
            |pick: fn(&(f64, f64, f64)) -> f64| rows[..time.len()].iter().map(pick).collect();
        Record::new(
            "a",
            time.iter().map(|&time| f64::from(time) / 7.0).collect(),
            [
                (Channel::Command, Series::new("mA", column(|row| row.0))),
                (Channel::Flow, Series::new("L/min", column(|row| row.1))),
                (
                    Channel::Temperature,
                    Series::new("degC", column(|row| row.2)),
                ),
            ],
        )
        .unwrap()
    })
}

/// Text that is almost a record: it gets further than any text does.
fn almost_a_record() -> impl Strategy<Value = String> {
    "time( \\[(s|ms)\\])?[,;\t]\"?command \\[V\\]\"?[,;\t](spool \\[%\\]|flow|é)\n([0-9]{0,2}[.,;\t\"\n #e-]){0,40}"
}

proptest! {
    #[test]
    fn a_written_record_reads_back(record in record()) {
        let folder = TempDir::new().unwrap();
        let path = folder.path().join("a.csv");
        record.write_csv(&path).unwrap();
        let read = Record::read(&path, &[]).unwrap();
        prop_assert_eq!(&read.name, &record.name);
        prop_assert_eq!(read.time(), record.time());
        prop_assert!(read.channels().eq(record.channels()));
    }

    /// In whatever dialect a record is written, it is read as it was, or refused as ambiguous.
    #[test]
    fn no_dialect_changes_a_record(
        record in record(),
        delimiter in prop::sample::select(vec![",", ";", "\t", "|", ":", " ", " ; "]),
        [comma, unit_row, lines_above, behind, small] in any::<[bool; 5]>(),
    ) {
        let shown = |value: f64| {
            let text = if small { format!("{:.3}", value % 1e4) } else { value.to_string() };
            if comma && delimiter != "," { text.replace('.', ",") } else { text }
        };
        let labels: Vec<(&str, &str)> = std::iter::once(("time", "s"))
            .chain(record.channels().map(|(channel, series)| (channel.name(), series.unit.as_str())))
            .collect();
        let end = if behind && delimiter != " " { format!("{}\n", delimiter.trim_end_matches(' ')) } else { "\n".into() };
        let line = |cells: Vec<String>| cells.join(delimiter) + &end;
        let mut text = String::new();
        if lines_above {
            text += "Channel file v2\nOperator: Ada; Bob, and C\n\nRate 1000\n";
        }
        if unit_row {
            text += &line(labels.iter().map(|(name, _)| name.to_string()).collect());
            text += &line(labels.iter().map(|(_, unit)| format!("[{unit}]")).collect());
        } else {
            text += &line(labels.iter().map(|(name, unit)| format!("{name} [{unit}]")).collect());
        }
        let even: Vec<f64> = (0..record.samples()).map(|row| 1.0 + 0.25 * row as f64).collect();
        let time = if small { &even } else { record.time() };
        let columns: Vec<&[f64]> = std::iter::once(time)
            .chain(record.channels().map(|(_, series)| &series.values[..]))
            .collect();
        for row in 0..record.samples() {
            text += &line(columns.iter().map(|column| shown(column[row])).collect());
        }
        let expected: Vec<Vec<f64>> = columns
            .iter()
            .map(|column| column.iter().map(|&value| shown(value).replace(',', ".").parse().unwrap()).collect())
            .collect();
        match Record::parse("a.csv", &text, &[]) {
            Ok(read) => {
                prop_assert_eq!(read.time(), &expected[0][..]);
                for ((_, series), expected) in read.channels().zip(&expected[1..]) {
                    prop_assert_eq!(&series.values, expected);
                }
                prop_assert_eq!(read.channels().count() + 1, expected.len());
            }
            Err(error) => {
                let message = error.to_string();
                prop_assert!(message.contains(" can be "), "{} in {:?}", message, text);
            }
        }
    }

    #[test]
    fn no_text_panics(text in prop_oneof![any::<String>(), almost_a_record()], map in any::<String>()) {
        let _ = map.parse::<Mapping>();
        let _ = Record::parse("a.csv", &text, &[]);
        let _ = Record::parse("a.csv", &text, &mappings(&["time=spool [V]", "command=time [s]"]));
        let _ = FlowCurve::parse("a.csv", text.replace("time", "opening"));
        let _ = ResponseCurve::parse("a.csv", &text);
        let _ = StepCurve::parse("a.csv", &text);
    }

    #[test]
    fn no_bytes_panic(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
        let (_folder, path) = file("a.csv", bytes);
        let _ = Record::read(path, &[]);
    }
}
