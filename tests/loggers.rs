//! Files as loggers write them are read as they are: with what the file does not say given beside it, never guessed.

use crate::program::{printed, refused, servobee};
use servobee::Result;
use servobee::record::{Channel, Mapping, Quantity, Record};
use std::fs::write;
use tempfile::tempdir;

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
        "I_ist=spool [%] *-12.5 +150",
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
        &["inspect", "loop.csv", "--map", map],
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
