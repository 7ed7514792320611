//! How people are told a result: in which units and in which words. What programs read does not depend on it.

use crate::browser::Browser;
use crate::html::assert_well_formed;
use crate::program::{BENCH, printed, refused, servobee};
use servobee::simulator::Setup;
use std::fs::{create_dir, read_to_string, write};
use std::path::Path;
use tempfile::TempDir;

/// What a number is multiplied by where it is told in gpm, psi, in and in2.
const FACTORS: [(&str, &str, f64); 4] = [
    ("L/min", "gpm", 1.0 / 3.785_411_784),
    ("bar", "psi", 14.503_773_77),
    ("mm", "in", 1.0 / 25.4),
    ("cm2", "in2", 1.0 / 6.4516),
];

/// The bench's record with a spool in mm and at a supply pressure that was measured.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let text = read_to_string(BENCH).unwrap();
    let mut rows = text.lines().take(4001);
    let head = rows.next().unwrap().replace("spool [V]", "spool [mm]");
    let mut text = format!("{head},supply_pressure [bar]\n");
    for (i, row) in rows.enumerate() {
        text += &format!("{row},{}\n", 70.0 + 0.05 * ((i % 7) as f64 - 3.0));
    }
    write(folder.path().join("bench.csv"), text).unwrap();
    folder
}

/// What a result of the folder's record is told as.
struct Told {
    page: String,
    printed: String,
    files: [String; 3],
}

fn told(folder: &Path, more: &[&str]) -> Told {
    let call = [
        "identify",
        "bench.csv",
        "--effects",
        "delay",
        "--out",
        "out",
        "--force",
    ];
    let printed = printed(&servobee(folder, &[&call[..], more].concat()));
    let read = |name: &str| read_to_string(folder.join("out").join(name)).unwrap();
    Told {
        page: read("report.html"),
        printed,
        files: ["report.json", "model.toml", "residual.csv"].map(read),
    }
}

/// The texts of a page that are for readers, without those of plots; and the labels of plots.
fn texts(page: &str) -> Vec<String> {
    let mut texts = Vec::new();
    let mut open: Vec<bool> = Vec::new();
    for piece in page.split('<').skip(1) {
        let (tag, text) = piece.split_once('>').unwrap();
        let name = tag
            .trim_start_matches('/')
            .split([' ', '/'])
            .next()
            .unwrap();
        if tag.starts_with('/') {
            open.pop();
        } else if !tag.ends_with('/') && !["meta", "br", "!DOCTYPE"].contains(&name) {
            let inside = open.last().is_some_and(|&hidden| hidden);
            let hidden =
                ["style", "code", "svg"].contains(&name) || tag.contains("translate=\"no\"");
            open.push(inside || hidden);
        }
        if let Some((_, label)) = tag.split_once("aria-label=\"") {
            texts.push(label.split('"').next().unwrap().to_owned());
        }
        let hidden = open.last().is_some_and(|&hidden| hidden);
        if !hidden && !text.trim().is_empty() {
            texts.push(text.trim().to_owned());
        }
    }
    texts
}

/// Texts in plots.
fn labels(page: &str) -> Vec<&str> {
    let plots = page.split("<text").skip(1);
    let inner = |plot: &'_ str| -> usize { plot.find('>').unwrap() + 1 };
    plots
        .map(|plot| plot[inner(plot)..].split("</text>").next().unwrap().trim())
        .collect()
}

/// Whether `unit` stands in `text` as a word.
fn has_unit(text: &str, unit: &str) -> bool {
    let is_letter = |c: char| c.is_alphanumeric() || c == '_';
    text.match_indices(unit).any(|(at, _)| {
        let before = text[..at].chars().next_back();
        let after = text[at + unit.len()..].chars().next();
        !before.is_some_and(is_letter) && !after.is_some_and(is_letter)
    })
}

/// The page has none of the units that were not asked for, and is whole.
fn assert_us(page: &str, place: &str) {
    assert_well_formed(page);
    let told = texts(page);
    let all = told.iter().map(String::as_str).chain(labels(page));
    for text in all {
        for (unit, _, _) in FACTORS {
            assert!(!has_unit(text, unit), "{place}: {unit} in {text:?}");
        }
        assert!(!has_unit(text, "µm"), "{place}: {text:?}");
    }
}

/// The cells of the rows of every table.
fn rows(page: &str) -> Vec<Vec<String>> {
    let row = |row: &str| {
        let row = row.split("</tr>").next().unwrap();
        let cell = |cell: &str| {
            let cell = cell.split_once('>').unwrap().1;
            cell.split("</td>").next().unwrap().to_owned()
        };
        row.split("<td").skip(1).map(cell).collect()
    };
    page.split("<tr>").skip(1).map(row).collect()
}

#[test]
fn every_number_with_a_unit_of_flow_pressure_or_length_is_told_in_those_that_were_asked_for() {
    let folder = folder();
    let limits = "rated_flow = \"57 .. 63 L/min\"\nspool_gain = \">= 0.1 mm/V\"\n";
    write(folder.path().join("limits.toml"), limits).unwrap();
    let metric = told(folder.path(), &["--limits", "limits.toml"]);
    let us = told(folder.path(), &["--limits", "limits.toml", "--units", "us"]);

    assert_us(&us.page, "identify");
    for (unit, name, _) in FACTORS {
        assert!(has_unit(&metric.page, unit), "the record has {unit}");
        assert!(has_unit(&us.page, name), "{name}");
        assert!(!has_unit(&us.printed, unit), "{}", us.printed);
    }
    // Tables: a row with a unit has its numbers multiplied, any other is the same.
    let [old, new] = [&metric.page, &us.page].map(|page| rows(page));
    assert_eq!(old.len(), new.len());
    let mut converted = [0; 4];
    for (old, new) in old.iter().zip(&new) {
        let with = |(unit, _, _): &&(&str, &str, f64)| {
            let mut cells = old.iter().map(|cell| cell.trim());
            cells.any(|cell| {
                let behind = cell
                    .strip_prefix(unit)
                    .is_some_and(|rest| rest.starts_with('/'));
                behind || cell == *unit || cell.ends_with(&format!("[{unit}]"))
            })
        };
        let factor = FACTORS.iter().position(|one| with(&one));
        let mut changed = false;
        for (old, new) in old.iter().zip(new) {
            let numbers = [old, new].map(|cell| {
                let all = cell.split(" … ").map(str::parse::<f64>);
                all.collect::<Result<Vec<f64>, _>>()
            });
            let [Ok(old), Ok(new)] = numbers else {
                continue;
            };
            for (old, new) in old.iter().zip(&new) {
                let expected = factor.map_or(1.0, |i| FACTORS[i].2) * old;
                assert!(
                    (new - expected).abs() <= 6e-4 * expected.abs(),
                    "{old} {new} {factor:?}"
                );
                changed |= factor.is_some() && *old != 0.0;
            }
        }
        if let Some(i) = factor.filter(|_| changed) {
            converted[i] += 1;
        }
    }
    assert!(converted[0] > 2 && converted[2] > 1, "{converted:?}");
    // Sentences: where a number has changed, so has its unit.
    let [old, new] = [&metric.page, &us.page].map(|page| texts(page));
    assert_eq!(old.len(), new.len());
    let changed = |(old, new): &(&String, &String)| {
        // When it was computed, and how long that took.
        if old.starts_with("20") && old.ends_with(" s") {
            return false;
        }
        let metric = FACTORS.iter().any(|(unit, _, _)| has_unit(old, unit));
        let alone = old.parse::<f64>().is_ok() || old.contains(" … ");
        assert_eq!(
            old != new,
            metric || alone && old != new,
            "{old:?}, {new:?}"
        );
        metric
    };
    assert!(old.iter().zip(&new).filter(changed).count() > 20);
    for known in [
        "rated flow at 1015 psi",
        "&gt;= 0.003937 in/V",
        "15.06 .. 16.64 gpm",
    ] {
        assert!(new.iter().any(|text| text.contains(known)), "{known}");
    }
    // What programs read is the same.
    let untimed = |text: &str| {
        let timed = |line: &&str| {
            !["\"seconds\": ", "\"date\": "]
                .iter()
                .any(|name| line.contains(name))
        };
        text.lines().filter(timed).collect::<Vec<_>>().join("\n")
    };
    for (old, new) in metric.files.iter().zip(&us.files) {
        assert!(untimed(old) == untimed(new));
    }
}

#[test]
fn units_that_are_none_are_refused_before_anything_is_computed() {
    let folder = folder();
    for bad in ["imperial", "gpm, L/s", "V"] {
        let call = ["identify", "bench.csv", "--units", bad, "--out", "out"];
        let error = refused(&servobee(folder.path(), &call));
        assert!(error.contains("write us, metric, or units of"), "{error}");
        assert!(!folder.path().join("out").exists());
    }
}

#[test]
fn a_comparison_a_batch_and_a_datasheet_are_told_and_printed_in_those_units_too() {
    let folder = tempfile::tempdir().unwrap();
    create_dir(folder.path().join("in")).unwrap();
    for (seed, name) in [(1, "before.csv"), (2, "after.csv")] {
        let setup = Setup {
            seconds: 2.0,
            seed,
            ..Setup::default()
        };
        let text = setup.record().unwrap().to_csv();
        write(folder.path().join("in").join(name), text).unwrap();
    }
    let browser = Browser::find();
    let page = |call: &[&str], name: &str| {
        let us = [call, &["--units", "us", "--evaluator", "cpu"]].concat();
        printed(&servobee(folder.path(), &us));
        let page = read_to_string(folder.path().join(name)).unwrap();
        assert_us(&page, name);
        if let Some(browser) = &browser {
            browser.assert_prints(&page, name);
        }
        page
    };
    let none = ["--effects", "none"];
    let call = [
        "compare",
        "in/before.csv",
        "--with",
        "in/after.csv",
        "--out",
        "compared",
    ];
    let compared = page(&[&call[..], &none].concat(), "compared/compare.html");
    assert!(compared.contains("flow [gpm]"));
    let batch = page(
        &[&["batch", "in", "--out", "batch"][..], &none].concat(),
        "batch/index.html",
    );
    assert!(
        batch.contains(">[gpm]<") || batch.contains("\n[gpm]\n"),
        "{batch}"
    );
    let resumed = [
        "batch",
        "in",
        "--out",
        "batch",
        "--resume",
        "--effects",
        "none",
    ];
    let error = refused(&servobee(folder.path(), &resumed));
    assert!(error.contains("batch"), "reports in other units: {error}");

    let curve = "opening [%],flow [L/min]\n0,0.2\n20,12\n40,24\n60,36\n80,48\n100,60\n";
    write(folder.path().join("flow.csv"), curve).unwrap();
    let sheet = page(
        &["datasheet", "--flow", "flow.csv", "--out", "sheet"],
        "sheet/report.html",
    );
    assert!(sheet.contains("gpm RMS"), "{sheet}");
}

/// English words that no German text has.
const ENGLISH: [&str; 22] = [
    "the", "of", "is", "and", "which", "with", "not", "are", "from", "by", "that", "to", "at",
    "what", "where", "than", "it", "no", "each", "for", "measured", "model",
];

/// No text of the page is left in English.
fn assert_german(page: &str, place: &str) {
    assert_well_formed(page);
    assert!(page.contains("<html lang=\"de\">"), "{place}");
    let told = texts(page);
    let all = told.iter().map(String::as_str).chain(labels(page));
    let left: Vec<&str> = all
        .filter(|text| {
            let mut words = text.split(|c: char| !c.is_alphanumeric());
            words.any(|word| ENGLISH.contains(&word))
        })
        .collect();
    assert!(left.is_empty(), "{place}: {left:#?}");
}

#[test]
fn a_german_page_has_no_english_text_and_fits_on_paper() {
    let folder = folder();
    let browser = Browser::find();
    let limits = "rated_flow = \"57 .. 63 L/min\"\nhysteresis = \"<= 3 %\"\n";
    write(folder.path().join("limits.toml"), limits).unwrap();
    let page = |call: &[&str], name: &str| {
        let german = [call, &["--language", "de", "--evaluator", "cpu"]].concat();
        servobee(folder.path(), &german);
        let page = read_to_string(folder.path().join(name)).unwrap();
        assert_german(&page, name);
        if let Some(browser) = &browser {
            browser.assert_prints(&page, name);
        }
        page
    };
    let call = [
        "identify",
        "bench.csv",
        "--limits",
        "limits.toml",
        "--out",
        "found",
    ];
    let found = page(&call, "found/report.html");
    for known in [
        "Die Antwort eilt um",
        "Nennvolumenstrom bei 70 bar",
        "Volumenstromverstärkung",
        "Hysterese",
        "Nullpunktverschiebung",
        "Umkehrspanne",
        "Druckverstärkung",
        "innere Leckage",
        "Grenzen: 1 von 2 sind erfüllt",
        "Schieberweg [mm]",
    ] {
        assert!(found.contains(known), "{known}");
    }
    let outsider = [
        "synthesize",
        "--outsider",
        "detent=0.3",
        "--seconds",
        "4",
        "--no-flow",
        "--out",
        "odd.csv",
    ];
    printed(&servobee(folder.path(), &outsider));
    page(
        &[
            "identify",
            "odd.csv",
            "--effects",
            "delay,null_bias",
            "--out",
            "odd",
        ],
        "odd/report.html",
    );

    let long = [
        "synthesize",
        "--seconds",
        "40",
        "--no-flow",
        "--out",
        "long.csv",
    ];
    printed(&servobee(folder.path(), &long));
    let call = [
        "identify",
        "long.csv",
        "--effects",
        "delay",
        "--out",
        "long",
    ];
    let long = page(&call, "long/report.html");
    assert!(long.contains("Effekte werden nach 32000 von 40000 Zeilen gewählt"));

    create_dir(folder.path().join("in")).unwrap();
    for (seed, name) in [(1, "before.csv"), (2, "after.csv")] {
        let mut setup = Setup {
            seconds: 2.0,
            seed,
            ..Setup::default()
        };
        setup.valve.gain *= seed as f64;
        let text = setup.record().unwrap().to_csv();
        write(folder.path().join("in").join(name), text).unwrap();
    }
    let call = [
        "compare",
        "in/before.csv",
        "--with",
        "in/after.csv",
        "--effects",
        "delay",
        "--out",
        "compared",
    ];
    page(&call, "compared/compare.html");
    let call = [
        "batch",
        "in",
        "--baseline",
        "in/before.csv",
        "--effects",
        "none",
        "--out",
        "batch",
    ];
    page(&call, "batch/index.html");
    page(
        &["datasheet", "--case", "step", "--out", "sheet"],
        "sheet/report.html",
    );
}

#[test]
fn a_language_without_words_is_refused() {
    let folder = folder();
    let call = ["identify", "bench.csv", "--language", "fr", "--out", "out"];
    let error = refused(&servobee(folder.path(), &call));
    assert!(error.contains("write en or de"), "{error}");
}
