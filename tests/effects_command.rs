//! The command effects, as a user calls it.

use crate::program::{printed, refused, servobee};
use servobee::model::effects::CATALOGUE;
use std::path::Path;

/// What `servobee effects` prints with these arguments.
fn effects(arguments: &[&str]) -> String {
    let call = [&["effects"], arguments].concat();
    printed(&servobee(Path::new("."), &call))
}

/// The lines of the plot at the end of an explanation, from the name of the vertical axis on.
fn plot(text: &str) -> Vec<&str> {
    let lines: Vec<&str> = text.lines().collect();
    let begin = lines
        .iter()
        .position(|line| line.trim().starts_with("residual of the "));
    lines[begin.expect(text)..].to_vec()
}

/// The characters between the axes, row by row.
fn cells(text: &str) -> Vec<Vec<char>> {
    let rows = plot(text)
        .into_iter()
        .filter_map(|line| line.split_once('|'));
    rows.map(|(_, row)| row.chars().collect()).collect()
}

fn marked(cell: char) -> bool {
    ['\'', '.', ':'].contains(&cell)
}

/// The rows, from the top, that are marked in a column.
fn marks(text: &str, column: usize) -> Vec<usize> {
    let cells = cells(text);
    let at = |row: &usize| cells[*row].get(column).copied().is_some_and(marked);
    (0..cells.len()).filter(at).collect()
}

/// The row of zero.
fn zero(text: &str) -> usize {
    let begins = |line: &&str| line.trim_start().starts_with("0 |");
    plot(text).iter().position(begins).expect(text) - 1
}

#[test]
fn the_list_names_every_effect_once_in_the_order_of_the_catalogue() {
    let text = effects(&[]);
    let names: Vec<&str> = text
        .lines()
        .filter_map(|line| line.split_once(' '))
        .filter(|(name, _)| CATALOGUE.iter().any(|entry| entry.name == *name))
        .map(|(name, _)| name)
        .collect();
    let expected: Vec<&str> = CATALOGUE.iter().map(|entry| entry.name).collect();
    assert_eq!(names, expected);
    assert!(text.contains("supply_droop [bar/(L/min)]"), "{text}");
    let last = text.lines().last().unwrap();
    assert!(last.starts_with("servobee effects NAME"), "{last}");
}

#[test]
fn every_effect_is_explained_and_its_signature_is_drawn() {
    for entry in CATALOGUE {
        let text = effects(&[entry.name]);
        let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
        let whole = words(&text);
        let port = format!("port {}", entry.port);
        let sections = [
            ("", entry.summary),
            ("", port.as_str()),
            ("equation ", entry.equation),
            ("shows ", entry.shows),
            ("confused with ", entry.confused),
            ("source ", entry.source),
            ("parameter unit absent at ", ""),
            ("signature ", "what "),
        ];
        for (head, section) in sections {
            let section = format!("{head}{}", words(section));
            assert!(whole.contains(&section), "no {section:?} in {text}");
        }

        let plot = plot(&text);
        assert!(plot.len() <= 18, "{text}");
        assert!(plot.iter().all(|line| line.chars().count() <= 72), "{text}");
        assert!(plot[0].ends_with(']') && plot[plot.len() - 1].ends_with(']'));
        let marks = cells(&text)
            .concat()
            .into_iter()
            .filter(|cell| marked(*cell));
        assert!(marks.count() >= 20, "{text}");
    }
}

#[test]
fn signatures_look_as_their_effects_do() {
    // The loop of a play: upper and lower branch in the middle, as far from zero.
    let text = effects(&["hysteresis"]);
    let (branches, zero_row) = (marks(&text, 30), zero(&text));
    assert_eq!(branches.len(), 2, "{text}");
    assert!(branches[0] < zero_row && zero_row < branches[1], "{text}");

    // One branch with a dead band: it starts at zero and is level outside.
    let text = effects(&["overlap"]);
    assert_eq!(marks(&text, 5), marks(&text, 20), "{text}");
    assert!(marks(&text, 5)[0] < zero(&text), "{text}");
    assert!(marks(&text, 50)[0] > zero(&text), "{text}");

    // Even in the spool's position, and nothing at null.
    let text = effects(&["asymmetric_gain"]);
    assert_eq!(marks(&text, 10), marks(&text, 49), "{text}");
    assert_eq!(marks(&text, 29), [zero(&text)], "{text}");

    // Flow at null alone.
    let text = effects(&["leakage"]);
    assert_eq!(marks(&text, 5), [zero(&text)], "{text}");
    assert!(marks(&text, 29)[0] <= 3, "{text}");

    // Nothing before the step, much after it.
    let text = effects(&["line_resonance"]);
    assert_eq!(marks(&text, 2), [zero(&text)], "{text}");
    assert!(marks(&text, 10)[0] < zero(&text) - 3, "{text}");

    // A constant, and a ramp from zero.
    let text = effects(&["sensor_offset.spool"]);
    assert!((0..60).all(|column| marks(&text, column) == marks(&text, 0)));
    assert!(marks(&text, 0)[0] < zero(&text), "{text}");
    let text = effects(&["sensor_drift"]);
    assert_eq!(marks(&text, 0), [zero(&text)], "{text}");
    assert!(marks(&text, 59)[0] < marks(&text, 30)[0], "{text}");
}

#[test]
fn an_effect_is_shown_on_the_output_that_is_named() {
    let text = effects(&["sensor_lag.spool"]);
    assert!(text.contains("below: sensor_lag.spool"), "{text}");
    assert!(text.contains("residual of the spool [V]"), "{text}");
    assert!(text.contains("sensor_lag_spool = 0.006 s"), "{text}");
}

#[test]
fn what_absence_depends_on_is_told() {
    let row = |name: &str, parameter: &str| {
        let text = effects(&[name]);
        let line = text.lines().find(|line| line.starts_with(parameter));
        line.expect(&text)
            .split_whitespace()
            .last()
            .unwrap()
            .to_owned()
    };
    assert_eq!(row("friction", "stiction "), "0");
    assert_eq!(row("friction", "stribeck_speed "), "any");
    assert_eq!(row("line_resonance", "line_share_flow "), "0");
    assert_eq!(row("line_resonance", "line_frequency_flow "), "any");
    assert_eq!(row("compressibility", "compressibility_flow "), "0");
    assert_eq!(row("stroke_limit", "stroke_limit "), "100");
}

#[test]
fn an_unknown_name_is_refused_with_all_names_and_the_nearest() {
    let error = refused(&servobee(Path::new("."), &["effects", "hysterisis"]));
    for entry in CATALOGUE {
        assert!(error.contains(entry.name), "{error}");
    }
    assert!(
        error.contains("a similar value exists: 'hysteresis'"),
        "{error}"
    );
    refused(&servobee(Path::new("."), &["effects", "leakage.flow"]));
}

#[test]
fn help_has_an_example() {
    let text = effects(&["--help"]);
    assert!(text.contains("servobee effects hysteresis"), "{text}");
}
