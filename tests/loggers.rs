//! Files as loggers write them are read as they are: with what the file does not say given beside it, never guessed.

use crate::program::{printed, refused, servobee};
use servobee::Result;
use servobee::record::inspect::Inspection;
use servobee::record::{Channel, Mapping, Quantity, Reading, Record};
use std::fs::write;
use std::io::{Cursor, Read, Write};
use tempfile::tempdir;
use zip::write::SimpleFileOptions;
use zip::{ZipArchive, ZipWriter};

fn maps(texts: &[&str]) -> Vec<Mapping> {
    texts.iter().map(|text| text.parse().unwrap()).collect()
}

/// Asserts that the input is refused in one line that holds all `parts`.
fn assert_refused<T: std::fmt::Debug>(result: Result<T>, parts: &[&str]) {
    let message = result.expect_err("this must be refused").to_string();
    assert_eq!(message.lines().count(), 1, "{message:?}");
    for part in parts {
        assert!(message.contains(part), "{part:?} is not in {message:?}");
    }
}

/// The command at row `row` as a share of full scale: two sines, never the same for long.
fn share(row: usize) -> f64 {
    let time = row as f64 * 1e-3;
    0.5 * (9.0 * time).sin() + 0.4 * (41.0 * time).sin()
}

/// The spool that follows it with a lag of 20 ms.
fn lagging(rows: usize) -> Vec<f64> {
    let follow = |spool: &mut f64, row: usize| {
        *spool += (share(row) - *spool) / 20.0;
        Some(*spool)
    };
    (0..rows).scan(0.0, follow).collect()
}

/// What a bench amplifier of 4-20 mA logs, in Latin-1, with a header block and decimal commas.
fn current_loop(rows: usize) -> Vec<u8> {
    let mut text = String::from(
        "Prüfstand 3;Messung µ\nBediener;Ada\n\nZeit [s];I_soll [mA];I_ist [mA];Öl [°C]\n",
    );
    for (row, spool) in lagging(rows).iter().enumerate() {
        let line = format!(
            "{:.3};{:.4};{:.4};{:.1}\n",
            row as f64 * 1e-3,
            12.0 + 8.0 * share(row),
            12.0 - 8.0 * spool,
            40.0
        );
        text += &line.replace('.', ",");
    }
    text.chars().map(|letter| letter as u8).collect()
}

#[test]
fn a_column_is_scaled_and_shifted_as_its_mapping_says() {
    let text = current_loop(300);
    let maps = maps(&[
        "Zeit=time [s]",
        "I_soll=command [%] *12.5 -150",
        "I_ist = spool [%] * -12.5 + 150",
        "Öl=temperature [degC]",
    ]);
    let record = Record::parse("loop.csv", text, &maps).unwrap();
    assert_eq!(record.command().unit, "%");
    let spool = &record.get(Channel::Spool).unwrap().values;
    for (row, expected) in lagging(300).iter().enumerate() {
        let command = record.command().values[row];
        assert!((command - 100.0 * share(row)).abs() < 1e-3, "{command}");
        assert!((spool[row] - 100.0 * expected).abs() < 1e-3, "{row}");
    }
    // A column that is scaled is told of.
    let remarks = record.remarks().join("\n");
    for said in [
        "loop.csv: \"I_soll [mA]\" is taken as command [%] *12.5 -150",
        "loop.csv: \"I_ist [mA]\" is taken as spool [%] *-12.5 +150",
    ] {
        assert!(remarks.contains(said), "{remarks}");
    }
    assert!(!remarks.contains("temperature"), "{remarks}");
}

#[test]
fn a_column_with_the_name_of_its_channel_is_inverted_too() {
    let text = "time [s],command [V],spool [V]\n0,1,2\n0.1,-3,4\n";
    let read = |map: &str| Record::parse("a.csv", text, &maps(&[map])).unwrap();
    assert_eq!(
        read("command=command [V] *-1").command().values,
        [-1.0, 3.0]
    );
    // The unit is that of the value behind scale and offset.
    assert_eq!(
        read("command=command [mV] *1000 +500").command().values,
        [1.5, -2.5]
    );
    assert_eq!(read("time=time *2").time(), [0.0, 0.2]);
}

#[test]
fn a_mapping_is_written_as_it_is_read() {
    for text in [
        "i=command [%] *12.5 -150",
        "x = y=spool [mm] *-0.001",
        "Q=flow [L/min] +0.25",
        "t=time [s]",
    ] {
        let map: Mapping = text.parse().unwrap();
        let again: Mapping = map.to_string().parse().unwrap();
        assert_eq!(map, again);
        assert_eq!(map.to_string(), text);
    }
    for (text, said) in [
        ("i=command [%] *0", "has a scale of 0"),
        ("i=command [%] *1,5", "write decimals with a point: 1.5"),
        ("i=command *2", "has no unit"),
        ("i=command [%] 2", "neither scale nor offset"),
    ] {
        assert_refused(text.parse::<Mapping>(), &["--map", text, said]);
    }
}

#[test]
fn a_report_and_an_inspection_say_what_was_scaled() {
    let folder = tempdir().unwrap();
    write(folder.path().join("loop.csv"), current_loop(1500)).unwrap();
    let map = "I_soll=command [%] *12.5 -150";
    let spool = "I_ist=spool [%] *-12.5 +150";
    let call = [
        "identify",
        "loop.csv",
        "--evaluator",
        "cpu",
        "--effects",
        "none",
        "--json",
        "--map",
        "Zeit=time [s]",
        "--map",
        map,
        "--map",
        spool,
    ];
    let report: serde_json::Value =
        serde_json::from_str(&printed(&servobee(folder.path(), &call))).unwrap();
    let warnings = report["warnings"].to_string();
    assert!(
        warnings.contains("is taken as command [%] *12.5 -150"),
        "{warnings}"
    );
    let gain = report["parameters"].as_array().unwrap();
    let gain = gain.iter().find(|one| one["name"] == "gain").unwrap();
    assert!(gain["value"].as_f64().unwrap() > 0.0, "{gain}");

    let inspected = printed(&servobee(
        folder.path(),
        &["inspect", "loop.csv", "--map", map, "--map", spool],
    ));
    assert!(inspected.contains("command [%] *12.5 -150"), "{inspected}");
    assert!(
        inspected.contains(&format!("--map \"{map}\"")),
        "{inspected}"
    );

    let zero = refused(&servobee(
        folder.path(),
        &["inspect", "loop.csv", "--map", "I_soll=command [%] *0"],
    ));
    assert!(zero.contains("scale of 0"), "{zero}");
}

#[test]
fn the_units_of_benches_are_known() {
    for (quantity, text, value, expected) in [
        (Quantity::Time, "usec", 5.0, 5e-6),
        (Quantity::Time, "ns", 5.0, 5e-9),
        (Quantity::Signal, "mV", 500.0, 0.5),
        (Quantity::Signal, "µA", 500.0, 0.5),
        (Quantity::Signal, "percent", 5.0, 5.0),
        (Quantity::Flow, "ml/min", 500.0, 0.5),
        (Quantity::Flow, "ml/s", 50.0, 3.0),
        (Quantity::Flow, "l/h", 60.0, 1.0),
        (Quantity::Flow, "m3/h", 6.0, 100.0),
        (Quantity::Flow, "m³/min", 0.5, 500.0),
        (Quantity::Flow, "cm3/min", 500.0, 0.5),
        (Quantity::Flow, "in3/s", 1.0, 0.983_223_84),
        // 231 cubic inches are a gallon.
        (Quantity::Flow, "in^3/min", 231.0, 3.785_411_784),
        (Quantity::Pressure, "hPa", 1000.0, 1.0),
        (Quantity::Pressure, "mbar", 500.0, 0.5),
        (Quantity::Pressure, "MPa", 7.0, 70.0),
        (Quantity::Pressure, "psig", 1000.0, 68.947_572_931_683_6),
        (Quantity::Pressure, "kgf/cm²", 1.0, 0.980_665),
        (Quantity::Length, "inches", 1.0, 25.4),
        (Quantity::Temperature, "deg F", 212.0, 100.0),
        (Quantity::Frequency, "kHz", 0.5, 500.0),
    ] {
        let found = quantity.unit(Some(text), "").unwrap().convert(value);
        assert!((found / expected - 1.0).abs() < 1e-12, "{text}: {found}");
    }
}

#[test]
fn an_unknown_unit_is_refused_with_the_factor_to_give() {
    let text = "time [s];command [V];Q [pint/s];spool [V]\n0;1;2;3\n0.1;2;3;4\n";
    let flow = text.replace("Q [", "flow [");
    let remedy = "--map \"flow=flow [L/min] *FACTOR\"";
    assert_refused(
        Record::parse("a.csv", &flow, &[]),
        &["a.csv, row 1", "unit \"pint/s\" is not known here", remedy],
    );
    assert_refused(
        "Q=flow [pint/s]".parse::<Mapping>(),
        &["--map \"Q=flow [L/min] *FACTOR\""],
    );
    let map = maps(&[&remedy[7..remedy.len() - 1].replace("FACTOR", "28.4")]);
    let record = Record::parse("a.csv", &flow, &map).unwrap();
    assert_eq!(record.get(Channel::Flow).unwrap().values[0], 56.8);
}

/// `text` read as time, command and spool, which are given in a row every 1 ms if the file does not say it.
fn read_every(interval: &str, text: &str) -> Result<Record> {
    let reading = Reading {
        mappings: Vec::new(),
        sample_interval: Some(interval.parse()?),
        ..Reading::default()
    };
    Record::parse_as("a.csv", text, &reading)
}

#[test]
fn a_file_without_time_is_read_with_its_sample_interval() {
    // An oscilloscope's export: a byte-order mark, decimal commas, and no time.
    let text = "\u{feff}Rate;1000\nChannels;2\ncommand [V];spool [%]\n0,5;1,5\n0,6;1,6\n0,7;1,7\n";
    assert_refused(
        Record::parse("a.csv", text, &[]),
        &["has no column \"time [s]\"", "--sample-interval SECONDS"],
    );
    let record = read_every("1ms", text).unwrap();
    assert_eq!(record.time(), [0.0, 1e-3, 2e-3]);
    assert_eq!(record.command().values, [0.5, 0.6, 0.7]);
    assert!(record.remarks().is_empty(), "{:?}", record.remarks());

    let timed = text
        .replace("command [V];", "time [s];")
        .replace("spool", "command");
    assert_refused(
        read_every("1e-3", &timed),
        &[
            "row 3, column \"time [s]\"",
            "--sample-interval",
            "leave out",
        ],
    );
}

#[test]
fn a_sample_interval_is_an_option_wherever_records_are_read() {
    let folder = tempdir().unwrap();
    let mut text = String::from("command [V],spool [V]\n");
    for (row, spool) in lagging(1500).iter().enumerate() {
        text += &format!("{:.4},{:.4}\n", 10.0 * share(row), 10.0 * spool);
    }
    write(folder.path().join("a.csv"), text).unwrap();
    let call = |words: &str| {
        let words: Vec<&str> = words.split(' ').collect();
        servobee(folder.path(), &words)
    };
    let asked = printed(&call("inspect a.csv"));
    assert!(asked.contains("--sample-interval SECONDS"), "{asked}");
    let inspected = printed(&call("inspect a.csv --sample-interval 1ms"));
    assert!(
        inspected.contains("a row every 1 ms (1000 Hz)"),
        "{inspected}"
    );
    assert!(
        inspected.contains("servobee identify a.csv --sample-interval 0.001"),
        "{inspected}"
    );
    printed(&call(
        "identify a.csv --sample-interval 0.001 --effects none --evaluator cpu --out out",
    ));
    let report = std::fs::read(folder.path().join("out/report.json")).unwrap();
    let report: serde_json::Value = serde_json::from_slice(&report).unwrap();
    let parameters = report["parameters"].as_array().unwrap();
    let gain = parameters.iter().find(|one| one["name"] == "gain").unwrap();
    let value = gain["value"].as_f64().unwrap();
    // A lag of 20 ms.
    assert!((value / 50.0 - 1.0).abs() < 0.1, "{gain}");
    printed(&call(
        "simulate out/model.toml a.csv --sample-interval 1ms --out simulated.csv",
    ));
    for bad in ["0", "-1e-3", "nan", "1000 Hz", "0,001"] {
        let ran = servobee(
            folder.path(),
            &["inspect", "a.csv", "--sample-interval", bad],
        );
        assert!(refused(&ran).contains("--sample-interval"), "{bad}");
    }
}

#[test]
fn columns_of_comments_and_columns_of_nothing_stop_no_file() {
    let plain = "time [s];command [V];spool [%]\n0;1;2\n0,5;2;3\n1;3;4\n";
    let expected = Record::parse("a.csv", plain, &[]).unwrap();
    for (what, text) in [
        (
            "a column without a head or a cell",
            "time [s];;command [V];spool [%]\n0;;1;2\n0,5;;2;3\n1;;3;4\n",
        ),
        (
            "three of them behind",
            "time [s];command [V];spool [%];;;\n0;1;2;;;\n0,5;2;3;;;\n1;3;4;;;\n",
        ),
        (
            "notes without a head",
            "time [s];command [V];spool [%];\n0;1;2;los\n0,5;2;3;\n1;3;4;halt, 5 bar\n",
        ),
        (
            "notes",
            "time [s];Bemerkung;command [V];spool [%]\n0;;1;2\n0,5;los!;2;3\n1;;3;4\n",
        ),
        (
            "a comment that is left out",
            "time [s];command [V];spool [%];Comment\n0;1;2;start\n0,5;2;3\n1;3;4\n",
        ),
        (
            "a sensor that never answered",
            "time [s];command [V];spool [%];aux [V]\n0;1;2;NaN\n0,5;2;3;NaN\n1;3;4;NaN\n",
        ),
    ] {
        let record = Record::parse("a.csv", text, &[]);
        let record = record.unwrap_or_else(|error| panic!("{what}: {error}"));
        assert_eq!(record.time(), expected.time(), "{what}");
        assert!(record.channels().eq(expected.channels()), "{what}");
    }
    // A row that is short for another reason is none of these.
    assert_refused(
        Record::parse(
            "a.csv",
            "time [s];command [V];Comment\n0;1;2\n1\n2;1;2\n",
            &[],
        ),
        &["row 3", "1 cell"],
    );
}

/// As numpy's `savetxt` writes it, a bench that numbers its rows, and a logger with remarks within the data.
#[test]
fn a_header_that_is_commented_out_is_a_header() {
    for text in [
        "# made by a script\n# time [s],command [V],spool [V]\n0.0e+00,1.0e+00,2.0e+00\n1.0e-01,-3.0e+00,4.0e+00\n",
        "# bench 3\n#,time,command,spool\n-,s,V,V\n0,0,1,2\n1,0.1,-3,4\n",
        "// bench 3\n// 10 Hz\ntime [s],command [V],spool [V]\n0,1,2\n// a marker, set by hand, here\n0.1,-3,4\n",
        // One that is not commented out comes first.
        "# command [V],spool [V],time [s]\ntime [s],command [V],spool [V]\n0,1,2\n0.1,-3,4\n",
    ] {
        let record = Record::parse("a.csv", text, &[]).unwrap();
        assert_eq!(record.time(), [0.0, 0.1], "{text}");
        assert_eq!(record.command().values, [1.0, -3.0], "{text}");
        let spool = record.get(Channel::Spool).unwrap();
        assert_eq!(spool.values, [2.0, 4.0], "{text}");
    }
    for header in ["# made by a script", "# time [s],command [V]"] {
        let text = format!("{header}\n0,1,2\n0.1,-3,4\n");
        let said = "holds numbers where the header should be";
        assert_refused(Record::parse("a.csv", text, &[]), &["row 2", said]);
    }
}

#[test]
fn a_measurement_of_labview_is_read() {
    let mut text = String::from(
        "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\nDecimal_Separator\t,\n\
         Multi_Headings\tNo\nX_Columns\tOne\nTime_Pref\tRelative\nOperator\tada\nDate\t2024/03/14\n\
         Time\t10:22:31,2500000000000000000\n***End_of_Header***\t\n\t\nChannels\t2\t\t\nSamples\t3\t3\t\n\
         Date\t2024/03/14\t2024/03/14\t\nTime\t10:22:31,25\t10:22:31,25\t\nY_Unit_Label\tVolts\tVolts\t\n\
         X_Dimension\tTime\tTime\t\nX0\t0,0000000000000000E+0\t0,0000000000000000E+0\t\n\
         Delta_X\t0,001000\t0,001000\t\n***End_of_Header***\t\t\t\nX_Value\tU_cmd\tU_spool\tComment\n",
    );
    for (row, spool) in lagging(200).iter().enumerate() {
        let note = if row == 0 { "\tstart" } else { "" };
        let line = format!(
            "{:.6}\t{:.6}\t{spool:.6}{note}\n",
            row as f64 * 1e-3,
            share(row)
        );
        text += &line.replace('.', ",");
    }
    let maps = maps(&["X_Value=time [s]", "U_cmd=command [V]", "U_spool=spool [V]"]);
    let record = Record::parse("a.lvm", &text, &maps).unwrap();
    assert_eq!((record.samples(), record.time()[199]), (200, 0.199));
    assert_eq!(record.command().values[7], (share(7) * 1e6).round() / 1e6);
}

#[test]
fn incomplete_rows_are_refused_unless_they_may_be_skipped() {
    let text = "time [s];command [V];spool [%];note\n0;1;2;\n1;;3;\n2;3;NaN;x\n3;4;5;\n4;5;6;\n;;7;\n6;7;8;\n";
    assert_refused(
        Record::parse("a.csv", text, &[]),
        &[
            "row 7, column \"time [s]\"",
            "empty",
            "--skip-incomplete-rows",
        ],
    );
    let reading = Reading {
        skip_incomplete_rows: true,
        ..Reading::default()
    };
    let record = Record::parse_as("a.csv", text, &reading).unwrap();
    assert_eq!(record.time(), [0.0, 3.0, 4.0, 6.0]);
    assert_eq!(record.command().values, [1.0, 4.0, 5.0, 7.0]);
    let remarks = record.remarks().join("\n");
    assert!(
        remarks.contains(
            "a.csv: skipped 3 incomplete rows, the first at row 3, up to 2 one after another"
        ),
        "{remarks}"
    );
    // What is no number is repaired, not skipped, and later errors name the rows of the file.
    assert_refused(
        Record::parse_as("a.csv", text.replace("4;5;6", "4;5;six"), &reading),
        &["row 6, column \"spool [%]\"", "\"six\" is not a number"],
    );
    assert_refused(
        Record::parse_as("a.csv", text.replace("6;7;8", "2;7;8"), &reading),
        &["row 8, column \"time [s]\"", "does not rise"],
    );
    assert_refused(
        Record::parse_as(
            "a.csv",
            "time,command [V],spool [V]\n0,,\n1,,\n2,1,1\n",
            &reading,
        ),
        &["has 1 row"],
    );
    // Rows that are skipped leave gaps where the file does not say when they were, too.
    let untimed = Reading {
        sample_interval: Some("0.5".parse().unwrap()),
        ..reading
    };
    let text = "command [V],spool [V]\n1,2\n,3\n5,\n6,7\n";
    let record = Record::parse_as("a.csv", text, &untimed).unwrap();
    assert_eq!(record.time(), [0.0, 1.5]);
}

/// Rows with a stamp each, an interval of 0.5 s apart.
fn stamped(head: &str, stamps: [&str; 4]) -> String {
    let rows = stamps.iter().enumerate();
    let rows = rows.map(|(row, stamp)| format!("{stamp};{row},5;{row},25\n"));
    format!("{head};command [V];spool [V]\n{}", rows.collect::<String>())
}

#[test]
fn times_of_day_and_dates_are_times() {
    let midnight = ["23:59:59.0", "23:59:59.5", "00:00:00.0", "00:00:00.5"];
    let iso = [
        "2024-02-29T23:59:59.000Z",
        "2024-02-29T23:59:59.500Z",
        "2024-03-01T00:00:00.000Z",
        "2024-03-01T00:00:00.500Z",
    ];
    let german = [
        "14.03.2024 10:22:31,250",
        "14.03.2024 10:22:31,750",
        "14.03.2024 10:22:32,250",
        "14.03.2024 10:22:32,750",
    ];
    let american = [
        "03/04/2024 11:59:59.250 AM",
        "03/04/2024 11:59:59.750 AM",
        "03/04/2024 12:00:00.250 PM",
        "03/04/2024 12:00:00.750 PM",
    ];
    for (head, stamps) in [
        ("time", midnight),
        ("time", iso),
        ("\u{feff}Time", german),
        ("Time [hh:mm:ss]", american),
        ("time [ms]", german),
    ] {
        let record = Record::parse("a.csv", stamped(head, stamps), &[]);
        let record = record.unwrap_or_else(|error| panic!("{head}: {error}"));
        assert_eq!(record.time(), [0.0, 0.5, 1.0, 1.5], "{head} {stamps:?}");
        let remarks = record.remarks().join("\n");
        let since = format!("is taken as time [s] since {:?}", stamps[0]);
        assert!(remarks.contains(&since), "{remarks}");
        assert_eq!(
            remarks.contains("passes midnight 1 time"),
            stamps == midnight,
            "{remarks}"
        );
    }
    // With a head of its own it is mapped, and proposed by inspect.
    let text = stamped("Zeitstempel", german);
    let record = Record::parse("a.csv", &text, &maps(&["Zeitstempel=time"])).unwrap();
    assert_eq!(record.time()[3], 1.5);
    let inspection = Inspection::parse("a.csv", &text, &[]).unwrap();
    let proposed: Vec<&str> = inspection
        .proposals
        .iter()
        .map(|p| p.map.as_str())
        .collect();
    assert_eq!(proposed, ["Zeitstempel=time [s]"]);
    assert_eq!(inspection.problem_left, None);
    // A stamp may stand beside one number alone.
    let alone = "time;command [V]\n10:22:31,0;1\n10:22:31,5;2\n";
    let record = Record::parse("a.csv", alone, &[]).unwrap();
    assert_eq!(record.time(), [0.0, 0.5]);
}

#[test]
fn times_that_do_not_tell_when_it_was_are_refused() {
    let text = stamped(
        "time",
        [
            "03/04/2024 23:59:59.0",
            "03/04/2024 23:59:59.5",
            "03/05/2024 00:00:00.0",
            "03/05/2024 00:00:00.5",
        ],
    );
    assert_refused(
        Record::parse("a.csv", &text, &[]),
        &[
            "row 4, column \"time\"",
            "03/05/2024",
            "03/04/2024",
            "2024-03-14",
        ],
    );
    let four = |last| stamped("time", ["10:22:31", "10:22:32", "10:22:33", last]);
    for (last, said) in [
        ("10:22:32", "does not rise"),
        ("10:22", "is no time that follows from \"10:22:31\""),
        ("3,5", "is no time that follows from"),
        ("2024-03-14 10:22:34", "is no time that follows from"),
    ] {
        let read = Record::parse("a.csv", four(last), &[]);
        assert_refused(read, &["row 5, column \"time\"", said]);
    }
    // They are no signal, and no other unit.
    let text = four("10:22:34");
    for map in ["time=command [V]", "time=time [ms]", "time=time [s] *2"] {
        assert_refused(
            Record::parse("a.csv", &text, &maps(&[map])),
            &[
                "row 1, column \"time\"",
                "holds times of day such as \"10:22:31\"",
            ],
        );
    }
}

#[test]
fn what_counts_without_a_unit_is_asked_about() {
    let mut text = String::from("Tick;command [V];spool [V]\n");
    for (row, spool) in lagging(200).iter().enumerate() {
        text +=
            &format!("{};{:.4};{spool:.4}\n", 5_000_000 + 2 * row, share(row)).replace('.', ",");
    }
    let inspection = Inspection::parse("a.csv", &text, &[]).unwrap();
    let proposal = &inspection.proposals[0];
    assert_eq!(proposal.map, "Tick=time [ms]");
    assert!(proposal.reason.contains("assumed"), "{}", proposal.reason);
    let record = Record::parse("a.csv", &text, &maps(&["Tick=time [us]"])).unwrap();
    assert!((record.time()[1] - record.time()[0] - 2e-6).abs() < 1e-9);
}

#[test]
fn the_files_of_two_loggers_are_one_record() {
    let folder = tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let table =
        |head: &str, rows: std::ops::Range<usize>, late: f64, value: &dyn Fn(usize) -> f64| {
            let line = |row: usize| {
                format!(
                    "{:.6};{:.6}\n",
                    (row as f64).mul_add(1e-3, late),
                    value(row)
                )
                .replace('.', ",")
            };
            format!("{head}\n{}", rows.map(line).collect::<String>())
        };
    let spool = lagging(1500);
    let spool = |row: usize| 100.0 * spool[row];
    let command = |row: usize| 10.0 * share(row);
    // The second begins 20 rows later, ends 10 rows later, and its clock is 20 us off.
    let put = |name: &str, text: String| write(path(name), text).unwrap();
    put(
        "command.csv",
        table("time [s];command [V]", 0..1400, 0.0, &command),
    );
    put("spool.csv", table("t/s;x [%]", 20..1410, 2e-5, &spool));
    put(
        "coarse.csv",
        table("t/s;x [%]", 0..700, 0.0, &spool).replace("0,001", "0,0015"),
    );
    put("late.csv", table("t/s;x [%]", 0..1400, 4e-4, &spool));
    put("after.csv", table("t/s;x [%]", 0..1400, 90.0, &spool));
    let untimed: String = (0..1400)
        .map(|row| format!("{:.6}\n", spool(row)))
        .collect();
    let untimed = untimed.lines().map(|x| format!("{x},0\n"));
    put(
        "untimed.csv",
        format!("x [%],aux\n{}", untimed.collect::<String>()),
    );
    put("short.csv", "x [%],aux\n1,2\n2,3\n".into());
    put(
        "a+b.csv",
        "time,command [V],spool [V]\n0,1,2\n1,2,3\n".into(),
    );

    let reading = Reading::with(&maps(&["t=time [s]", "x=spool [%]"]));
    let read = |name: &str| {
        Record::read_as(
            path(&name.replace('+', &format!("+{}/", folder.path().display()))),
            &reading,
        )
    };
    let record = read("command.csv+spool.csv").unwrap();
    assert_eq!((record.samples(), record.time()[0]), (1380, 0.02));
    let at = |channel, row: usize| record.get(channel).unwrap().values[row];
    for row in [0, 700, 1379] {
        assert!((at(Channel::Command, row) - command(row + 20)).abs() < 1e-6);
        assert!((at(Channel::Spool, row) - spool(row + 20)).abs() < 1e-6);
    }
    let remarks = record.remarks().join("\n");
    let said = "joined 1380 rows whose times agree within 1.0e-4 s, and left out 30 rows that only one of them has";
    assert!(remarks.contains(said), "{remarks}");

    let record = read("command.csv+untimed.csv").unwrap();
    assert_eq!(record.samples(), 1400);
    let remarks = record.remarks().join("\n");
    assert!(remarks.contains("joined 1400 rows one by one"), "{remarks}");

    assert_refused(
        read("command.csv+late.csv"),
        &[
            "late.csv, row 2, column \"t/s\"",
            "at 0.0004 s there is no row of",
            "command.csv within 1.000e-4 s",
            "resample",
        ],
    );
    assert_refused(read("command.csv+coarse.csv"), &["no row of", "resample"]);
    assert_refused(
        read("command.csv+after.csv"),
        &["after.csv", "has 0 rows in the time of"],
    );
    assert_refused(
        read("command.csv+short.csv"),
        &["short.csv", "has 2 rows where", "has 1400"],
    );
    assert_refused(read("command.csv+absent.csv"), &["absent.csv"]);
    assert_refused(
        read("command.csv+command.csv"),
        &[
            "command.csv, row 1, column \"command [V]\"",
            "a second time",
        ],
    );
    // A file that is called so is one file.
    let record = Record::read(path("a+b.csv"), &[]).unwrap();
    assert_eq!(record.samples(), 2);

    let call = [
        "inspect",
        "command.csv+spool.csv",
        "--map",
        "t=time [s]",
        "--map",
        "x=spool [%]",
    ];
    let inspected = printed(&servobee(folder.path(), &call));
    assert!(inspected.contains("Ready for identify"), "{inspected}");
    assert!(
        inspected.contains("servobee identify \"command.csv+spool.csv\""),
        "{inspected}"
    );
}

#[test]
fn clocks_of_two_loggers_are_compared_with_their_dates() {
    let folder = tempdir().unwrap();
    let command = "time;command [V]\n2024-03-14 10:22:31.0;1\n2024-03-14 10:22:31.5;2\n2024-03-14 10:22:32.0;3\n";
    let spool =
        "time;spool [V]\n2024-03-14T10:22:31.5;2\n2024-03-14T10:22:32;3\n2024-03-14T10:22:32.5;4\n";
    write(folder.path().join("a.csv"), command).unwrap();
    write(folder.path().join("b.csv"), spool).unwrap();
    write(
        folder.path().join("c.csv"),
        "time;spool [V]\n0,0;2\n0,5;3\n1,0;4\n",
    )
    .unwrap();
    let both = |other: &str| format!("{0}/a.csv+{0}/{other}", folder.path().display());
    let record = Record::read(both("b.csv"), &[]).unwrap();
    assert_eq!(record.time(), [0.5, 1.0]);
    assert_eq!(record.command().values, [2.0, 3.0]);
    assert_eq!(record.get(Channel::Spool).unwrap().values, [2.0, 3.0]);
    assert_refused(
        Record::read(both("c.csv"), &[]),
        &["c.csv, row 1, column \"time\"", "times of another kind"],
    );
}

/// The same workbook with its parts changed, each of which has a number.
fn rewritten(workbook: &[u8], change: impl Fn(usize, String) -> String) -> Vec<u8> {
    let mut archive = ZipArchive::new(Cursor::new(workbook)).unwrap();
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for index in 0..archive.len() {
        let mut part = archive.by_index(index).unwrap();
        let mut content = String::new();
        part.read_to_string(&mut content).unwrap();
        zip.start_file(part.name().unwrap(), SimpleFileOptions::default())
            .unwrap();
        zip.write_all(change(index, content).as_bytes()).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

#[test]
fn a_workbook_with_damage_within_its_parts_is_read_or_refused() {
    let dated = [
        "time|command [V]|spool [V]",
        "@45365.5|1|2",
        "@45365.75|2|3",
    ];
    let sane = workbook(&[("A", SHEET), ("B", &dated)]);
    let parts = ZipArchive::new(Cursor::new(&sane)).unwrap().len();
    for part in 0..parts {
        for at in (0..1500).step_by(29) {
            for put in ["", "<", "\"", "9", "-"] {
                let bytes = rewritten(&sane, |index, mut content| {
                    if index == part && content.is_char_boundary(at) && at < content.len() {
                        let letter = content[at..].chars().next().unwrap();
                        content.replace_range(at..at + letter.len_utf8(), put);
                    }
                    content
                });
                if let Err(error) = Record::parse("a.xlsx", &bytes, &[]) {
                    let error = error.to_string();
                    assert!(error.starts_with("a.xlsx"), "{error}");
                    assert!(!error.contains(char::is_control), "{error:?}");
                }
            }
        }
    }
    for serial in ["1e300", "-1e300", "-1", "2958466", "1e-300", "1e18"] {
        let dated = [
            "time|command [V]|spool [V]",
            "@45365.5|1|2",
            &format!("@{serial}|2|3"),
        ];
        let read = Record::parse("a.xlsx", workbook(&[("A", &dated)]), &[]);
        assert_refused(
            read,
            &["a.xlsx, row 3, column \"time\"", "is no time that follows"],
        );
    }
}

#[test]
fn a_workbook_that_unpacks_to_far_more_than_it_is_is_refused() {
    let far = ["time|command [V]|spool [V]", "0|1|2", "1|2|3"];
    let sane = workbook(&[("A", &far)]);
    let rewritten = |from: &str, to: &str| rewritten(&sane, |_, content| content.replace(from, to));
    // The last cell that Excel can have, and one behind it.
    for place in ["XFD1048576", "A1048577", "ZZZZ9"] {
        let bytes = rewritten("r=\"C3\"", &format!("r=\"{place}\""));
        assert_refused(Record::parse("a.xlsx", bytes, &[]), &["a.xlsx: "]);
    }
    let blanks = " ".repeat(140 << 20);
    let bytes = rewritten("<sheetData>", &format!("<sheetData>{blanks}"));
    assert!(bytes.len() < 1 << 20);
    assert_refused(
        Record::parse("a.xlsx", bytes, &[]),
        &["a.xlsx: unpacks to more than 128 MiB"],
    );
}

/// A workbook with these sheets; a cell is a number, a moment as `@serial`, an error as `#N/A`, or a text.
fn workbook(sheets: &[(&str, &[&str])]) -> Vec<u8> {
    let main = "xmlns=\"http://schemas.openxmlformats.org/spreadsheetml/2006/main\"";
    let office = "http://schemas.openxmlformats.org/officeDocument/2006/relationships";
    let package = "http://schemas.openxmlformats.org/package/2006";
    let kind = "application/vnd.openxmlformats-officedocument.spreadsheetml";
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    let mut put = |name: &str, content: String| {
        zip.start_file(name, SimpleFileOptions::default()).unwrap();
        zip.write_all(b"<?xml version=\"1.0\" encoding=\"UTF-8\"?>")
            .unwrap();
        zip.write_all(content.as_bytes()).unwrap();
    };
    let (mut types, mut list, mut links) = (String::new(), String::new(), String::new());
    for (index, (name, rows)) in sheets.iter().enumerate() {
        let number = index + 1;
        types += &format!(
            "<Override PartName=\"/xl/worksheets/sheet{number}.xml\" ContentType=\"{kind}.worksheet+xml\"/>"
        );
        list += &format!("<sheet name=\"{name}\" sheetId=\"{number}\" r:id=\"r{number}\"/>");
        links += &format!(
            "<Relationship Id=\"r{number}\" Type=\"{office}/worksheet\" Target=\"worksheets/sheet{number}.xml\"/>"
        );
        let mut data = String::new();
        for (row, line) in rows.iter().enumerate() {
            data += &format!("<row r=\"{}\">", row + 1);
            for (column, cell) in line.split('|').enumerate() {
                let place = format!("r=\"{}{}\"", char::from(b'A' + column as u8), row + 1);
                data += &match cell {
                    "" => String::new(),
                    "#N/A" => format!("<c {place} t=\"e\"><v>#N/A</v></c>"),
                    _ if cell.starts_with('@') => {
                        format!("<c {place} s=\"1\"><v>{}</v></c>", &cell[1..])
                    }
                    _ if cell.parse::<f64>().is_ok() => format!("<c {place}><v>{cell}</v></c>"),
                    _ => format!("<c {place} t=\"inlineStr\"><is><t>{cell}</t></is></c>"),
                };
            }
            data += "</row>";
        }
        put(
            &format!("xl/worksheets/sheet{number}.xml"),
            format!("<worksheet {main}><sheetData>{data}</sheetData></worksheet>"),
        );
    }
    put(
        "[Content_Types].xml",
        format!(
            "<Types xmlns=\"{package}/content-types\"><Default Extension=\"rels\" ContentType=\"application/vnd.openxmlformats-package.relationships+xml\"/><Override PartName=\"/xl/workbook.xml\" ContentType=\"{kind}.sheet.main+xml\"/><Override PartName=\"/xl/styles.xml\" ContentType=\"{kind}.styles+xml\"/>{types}</Types>"
        ),
    );
    put(
        "_rels/.rels",
        format!(
            "<Relationships xmlns=\"{package}/relationships\"><Relationship Id=\"w\" Type=\"{office}/officeDocument\" Target=\"xl/workbook.xml\"/></Relationships>"
        ),
    );
    put(
        "xl/workbook.xml",
        format!("<workbook {main} xmlns:r=\"{office}\"><sheets>{list}</sheets></workbook>"),
    );
    put(
        "xl/_rels/workbook.xml.rels",
        format!(
            "<Relationships xmlns=\"{package}/relationships\">{links}<Relationship Id=\"s\" Type=\"{office}/styles\" Target=\"styles.xml\"/></Relationships>"
        ),
    );
    put(
        "xl/styles.xml",
        format!(
            "<styleSheet {main}><cellXfs count=\"2\"><xf numFmtId=\"0\"/><xf numFmtId=\"22\"/></cellXfs></styleSheet>"
        ),
    );
    zip.finish().unwrap().into_inner()
}

const SHEET: &[&str] = &[
    "Prüfstand 3|Ada; Bob",
    "",
    "time|command|spool|Bemerkung",
    "[s]|[V]|[%]|",
    "0|1.5|0.25|#1: los",
    "0.001|1e-3|-2|",
    "0.002|-4|3|",
];

#[test]
fn a_sheet_of_a_workbook_is_a_record() {
    let notes: (&str, &[&str]) = ("Notizen", &["Ventil 7, Öl HLP 46"]);
    let bytes = workbook(&[notes, ("Messung", SHEET)]);
    let record = Record::parse("a.xlsx", &bytes, &[]).unwrap();
    assert_eq!(record.time(), [0.0, 1e-3, 2e-3]);
    assert_eq!(record.command().values, [1.5, 1e-3, -4.0]);
    assert_eq!(record.get(Channel::Spool).unwrap().unit, "%");
    let inspection = Inspection::parse("a.xlsx", &bytes, &[]).unwrap();
    assert_eq!(
        inspection.format.to_string(),
        "Excel, sheet \"Messung\", header in row 3, units in row 4"
    );
    assert_eq!(inspection.others[0].0, "Notizen");

    let dated = [
        "time|command [V]|spool [V]",
        "@45365.5|1|2",
        "@45365.500005787037|2|3",
        "@45365.500011574074|3|4",
    ];
    let record = Record::parse("a.xlsx", workbook(&[("A", &dated)]), &[]).unwrap();
    assert_eq!(record.time(), [0.0, 0.5, 1.0]);
}

#[test]
fn what_is_wrong_in_a_workbook_is_named() {
    let mut sheet = SHEET.to_vec();
    sheet[5] = "0.001|acht|-2|";
    let read = |sheets: &[(&str, &[&str])]| Record::parse("a.xlsx", workbook(sheets), &[]);
    assert_refused(
        read(&[("A", &sheet)]),
        &[
            "a.xlsx, row 6, column \"command\"",
            "\"acht\" is not a number",
        ],
    );
    sheet[5] = "0.001|#N/A|-2|";
    assert_refused(
        read(&[("A", &sheet)]),
        &["a.xlsx, row 6, column \"command\"", "not finite"],
    );
    let reading = Reading {
        skip_incomplete_rows: true,
        ..Reading::default()
    };
    let record = Record::parse_as("a.xlsx", workbook(&[("A", &sheet)]), &reading).unwrap();
    assert_eq!(record.time(), [0.0, 2e-3]);
    assert_refused(
        read(&[("Lauf 1", SHEET), ("Lauf 2", SHEET)]),
        &["has tables in the sheets \"Lauf 1\", \"Lauf 2\"", "CSV"],
    );
    assert_refused(read(&[("A", &[])]), &["has no sheet with a cell"]);
    let bytes = workbook(&[("A", SHEET)]);
    for length in [10, bytes.len() / 2, bytes.len() - 10] {
        assert_refused(
            Record::parse("a.xlsx", &bytes[..length], &[]),
            &["a.xlsx", "that cannot be read", "CSV"],
        );
    }
    // Damage anywhere is an error or changes nothing, and never a panic.
    for at in (0..bytes.len()).step_by(7) {
        let mut damaged = bytes.clone();
        damaged[at] ^= 0x55;
        let _ = Record::parse("a.xlsx", &damaged, &[]);
    }
}

#[test]
fn a_sheet_of_several_is_named_behind_the_workbook() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("bench.xlsx");
    let mut second = SHEET.to_vec();
    second[4] = "0|9.5|0.25|";
    write(&path, workbook(&[("Lauf 1", SHEET), ("Lauf 2", &second)])).unwrap();
    let named = |sheet: &str| folder.path().join(format!("bench.xlsx#{sheet}"));
    assert_refused(
        Record::read(&path, &[]),
        &[
            "sheets \"Lauf 1\", \"Lauf 2\"",
            "name one:",
            "bench.xlsx#Lauf 1",
        ],
    );
    for (sheet, first) in [("Lauf 1", 1.5), ("Lauf 2", 9.5)] {
        let record = Record::read(named(sheet), &[]).unwrap();
        assert_eq!(record.command().values[0], first);
        assert!(
            record.path.ends_with(&format!("#{sheet}")),
            "{}",
            record.path
        );
    }
    assert_refused(
        Record::read(named("Lauf 3"), &[]),
        &["has no sheet \"Lauf 3\", only \"Lauf 1\", \"Lauf 2\""],
    );
    let csv = folder.path().join("plain.csv");
    write(&csv, "time [s],command [V],spool [V]\n0,1,1\n1,2,2\n").unwrap();
    let sheet = folder.path().join("plain.csv#A");
    assert_refused(
        Record::read(sheet, &[]),
        &["plain.csv", "is no Excel workbook"],
    );
    // A file may be called so.
    let odd = folder.path().join("odd.csv#2");
    std::fs::copy(&csv, &odd).unwrap();
    assert_eq!(Record::read(odd, &[]).unwrap().samples(), 2);
}

/// A sweep measured by a meter for large flows, with steps of 0.5 L/min, and by one for small ones in gpm that ends at 5.2 L/min.
fn two_meters(offset: f64) -> String {
    let mut text = String::from("time [s],command [V],Q_small [gpm],Q_large [L/min]\n");
    for k in 0..4000 {
        let time = 0.01 * f64::from(k);
        let command = 10.0 * (0.3 * time).sin();
        let flow = 4.0 * command;
        let small = (flow + offset).clamp(-5.2, 5.2) / 3.785_411_784;
        let large = (flow / 0.5).round() * 0.5;
        text += &format!("{time:.2},{command:.4},{small:.5},{large}\n");
    }
    text
}

#[test]
fn two_meters_for_two_ranges_are_one_flow() {
    let inspection = Inspection::parse("a.csv", two_meters(0.0), &[]).unwrap();
    let maps: Vec<&str> = inspection
        .proposals
        .iter()
        .map(|one| one.map.as_str())
        .collect();
    let proposed = ["Q_small=flow [gpm] below 1.215", "Q_large=flow [L/min]"];
    for map in proposed {
        assert!(maps.contains(&map), "{map} is not in {maps:?}");
    }
    assert_eq!(maps.len(), 2);
    assert!(inspection.problem_left.is_none() && !inspection.is_ready());
    assert!(
        inspection.call.contains("below 1.215"),
        "{}",
        inspection.call
    );

    let maps = proposed.map(|map| map.parse().unwrap());
    let record = Record::parse("a.csv", two_meters(0.0), &maps).unwrap();
    let flow = &record.get(Channel::Flow).unwrap().values;
    for (flow, command) in flow.iter().zip(&record.command().values) {
        let most = if (4.0 * command).abs() < 4.0 {
            1e-3
        } else {
            0.2501
        };
        assert!((flow - 4.0 * command).abs() < most, "{flow} at {command}");
    }
    let said = record.remarks().join("\n");
    assert!(
        said.contains("flow is taken from \"Q_small [gpm]\" where"),
        "{said}"
    );
    assert!(
        !said.contains("jumps") && !said.contains("ends at"),
        "{said}"
    );
    // With the mappings said, nothing is left to propose.
    let ready = Inspection::parse("a.csv", two_meters(0.0), &maps).unwrap();
    assert!(ready.is_ready() && ready.proposals.is_empty());
    assert_eq!(maps[0].to_string(), proposed[0]);

    // What does not fit together is said.
    let off = Record::parse("a.csv", two_meters(0.6), &maps).unwrap();
    assert!(
        off.remarks().join("\n").contains("flow jumps by 0.599"),
        "{:?}",
        off.remarks()
    );
    let wide = ["Q_small=flow [gpm] below 3", proposed[1]].map(|map| map.parse().unwrap());
    let gap = Record::parse("a.csv", two_meters(0.0), &wide).unwrap();
    assert!(
        gap.remarks().join("\n").contains("ends at 5.200 L/min"),
        "{:?}",
        gap.remarks()
    );
    let alone = ["Q_small=flow [gpm] below 3".parse().unwrap()];
    let refused = Record::parse("a.csv", two_meters(0.0).replace("Q_large", "x"), &alone);
    assert_refused(refused, &["no column is that for large ones", "--map"]);
    for bad in [
        "q=flow [L/min] below 0",
        "q=flow [L/min] below x",
        "q=command [V] below 5",
        "q=time [s] below 5",
    ] {
        assert!(bad.parse::<Mapping>().is_err(), "{bad}");
    }
}

#[test]
fn formats_that_are_not_read_are_refused_by_name_with_the_way_out() {
    let file = |head: &[u8]| [head, &[7; 600]].concat();
    let tdms = |contents: u8| file(&[b'T', b'D', b'S', b'm', contents, 0, 0, 0, 0x69, 0x12, 0, 0]);
    for (bytes, said) in [
        (tdms(0x0e), "is a TDMS file; export its channels as CSV"),
        (
            tdms(0x4e),
            "is a TDMS file with the high byte first; export",
        ),
        (tdms(0x8e), "is a TDMS file with raw data of DAQmx; export"),
        (
            file(b"TDSh\x0e\0\0\0"),
            "is the index of a TDMS file, without its values; export",
        ),
        (
            file(b"\x89HDF\r\n\x1a\n"),
            "version 7.3, or of HDF5 otherwise; save it in MATLAB with save -v7",
        ),
        (
            file(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"),
            "is an Excel workbook of before 2007; save it as .xlsx",
        ),
    ] {
        assert_refused(Record::parse("a.dat", bytes, &[]), &["a.dat: ", said]);
    }
}

/// A bad contact: what it does to eight of 6000 readings weighs more in a sum of squares than all the others.
#[test]
fn a_few_spikes_make_nothing_of_a_valve_that_lacks_nothing() {
    let folder = tempdir().unwrap();
    printed(&servobee(
        folder.path(),
        &["synthesize", "--seconds", "6", "--out", "clean.csv"],
    ));
    let clean = std::fs::read_to_string(folder.path().join("clean.csv")).unwrap();
    let mut lines: Vec<String> = clean.lines().map(str::to_owned).collect();
    let flow = lines[0]
        .split(',')
        .position(|name| name.starts_with("flow"))
        .unwrap();
    for (number, row) in (1..=8).map(|number| (number, 700 * number)) {
        let mut cells: Vec<String> = lines[row].split(',').map(str::to_owned).collect();
        let value: f64 = cells[flow].parse().unwrap();
        let height = 6.0 * number as f64 * if number % 2 == 0 { 1.0 } else { -1.0 };
        cells[flow] = (value + height).to_string();
        lines[row] = cells.join(",");
    }
    write(folder.path().join("spiky.csv"), lines.join("\n")).unwrap();
    let identified = |file: &str| {
        let call = [
            "identify",
            file,
            "--evaluator",
            "cpu",
            "--out",
            file.trim_end_matches(".csv"),
        ];
        printed(&servobee(folder.path(), &call));
        let report = folder.path().join(call[5]).join("report.json");
        let report: serde_json::Value =
            serde_json::from_slice(&std::fs::read(report).unwrap()).unwrap();
        report
    };
    let [clean, spiky] = ["clean.csv", "spiky.csv"].map(identified);
    let said = spiky["warnings"].to_string();
    assert!(
        said.contains("readings of the flow stand out by themselves"),
        "{said}"
    );
    for report in [&clean, &spiky] {
        assert_eq!(report["verdict"], "none", "{said}");
    }
    for number in 0..3 {
        let [one, other] = [&clean, &spiky].map(|of| &of["parameters"][number]);
        let [value, found] = [one, other].map(|own| own["value"].as_f64().unwrap());
        assert!((found / value - 1.0).abs() < 1e-3, "{one} {other}");
    }
}
