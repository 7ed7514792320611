//! A tiny record through the whole of `identify`, from its file to its report, with searches that are cut short.

#![no_main]

use servobee::Error;
use servobee::card::Card;
use servobee::diagnose::{Cut, IdentificationProblem, Options, identify};
use servobee::evaluate::{Choice, choose};
use servobee::model::effects::CATALOGUE;
use servobee::record::Record;
use servobee::report::{Call, Document, Edition, ModelFile, page};
use servobee::search::{Plan, Settings};
use servobee_fuzz::{assert_reads_back, located};
use std::ops::ControlFlow;
use std::sync::Arc;

/// Integration steps of a whole record, at most: what asks for more is right, but slow.
const STEPS: u64 = 500;

const PATH: &str = "fuzz.csv";

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let Some(text) = csv(bytes) else { return };
    let Some(record) = located(PATH, Record::parse(PATH, &text, &[])) else {
        return;
    };
    assert_reads_back(&record);
    let usable = record
        .check_response()
        .and_then(|()| record.check_excited());
    if located(PATH, usable).is_none() {
        return;
    }
    let records = [record];
    let question = IdentificationProblem::of(&records, &[], Cut::default());
    let Some(question) = located(PATH, question) else {
        return;
    };
    let held = &question.measurements.hold_out;
    let samples = held.iter().flat_map(|series| &series.samples);
    if samples
        .map(|sample| u64::from(sample.substeps))
        .sum::<u64>()
        > STEPS
    {
        return;
    }

    let settings = Settings {
        itr: 3,
        n: 4,
        m: 2,
        e: 1,
        nep: 4,
        nsp: 2,
        ..Settings::standard()
    };
    let plan = Plan {
        method: Arc::new(settings),
        ..Plan::of_records(1)
    };
    // Which effects may be added is a part of the input.
    let choice = usize::from(bytes[1]);
    let entries = &CATALOGUE[choice % CATALOGUE.len()..];
    let options = Options::on(&question.structure, &entries[..entries.len().min(3)], 1);
    let mut chosen = choose(Choice::Cpu).expect("there is always a CPU");
    let identified = identify(
        question,
        chosen.evaluator.as_mut(),
        &plan,
        &options,
        &mut |_| ControlFlow::Continue(()),
    );
    let identified = match identified {
        Ok(identified) => identified,
        Err(Error::Failed { problem, remedy }) => {
            assert!(!problem.is_empty() && !remedy.is_empty());
            return;
        }
        Err(error) => panic!("what was accepted is refused later: {error}"),
    };
    let after = &identified.after;
    assert!(
        after
            .values
            .as_slice()
            .iter()
            .all(|value| value.is_finite()),
        "{:?}",
        after.values
    );
    let problem = &after.problem;
    let model = ModelFile::to_toml(&problem.structure, &problem.parameters, &after.values);
    let file = ModelFile::parse("model.toml", &model).expect(&model);
    let structure = file.complete_structure().expect(&model);
    assert_eq!(structure, problem.structure);
    file.parameters(structure.parameters()).expect(&model);
    // The card's sweeps take far longer than all before: they come with few inputs.
    if choice < 250 {
        return;
    }
    let card = Card::of(&after.problem, &after.fit);
    let call = Call::default();
    let document = Document::of(
        &identified,
        &card,
        &chosen,
        1,
        0.0,
        call,
        records[0].remarks(),
    );
    assert!(!document.to_json().contains("NaN"));
    assert!(
        page(&identified, &document, &card, &Edition::default())
            .trim_end()
            .ends_with("</html>")
    );
});

/// A record of up to 48 rows: the first bytes say which channels it has and how its numbers are made.
fn csv(bytes: &[u8]) -> Option<String> {
    let (&[kind, _, interval, height], mut rest) = bytes.split_first_chunk()?;
    let has = |bit: u8| kind & 1 << bit != 0;
    let mut heads = vec![
        "time [s]",
        if has(0) {
            "command [V]"
        } else {
            "command [mm]"
        },
    ];
    let spool = if has(1) { "spool [V]" } else { "spool [%]" };
    let optional = [
        (has(2), spool),
        (has(3), "flow [L/min]"),
        (has(4), "position [mm]"),
        (has(5), "supply_pressure [bar]"),
        (has(6), "pressure_a [bar]"),
        (has(6), "pressure_b [bar]"),
    ];
    heads.extend(
        optional
            .into_iter()
            .filter(|(has, _)| *has)
            .map(|(_, head)| head),
    );
    let exact = has(7);
    let interval = 10_f64.powf(f64::from(interval) / 32.0 - 6.0);
    let height = 10_f64.powf(f64::from(height) / 32.0 - 4.0);
    // Small numbers, or any that there are.
    let mut next = || -> Option<f64> {
        let (number, left) = match exact {
            true => {
                let (bytes, left) = rest.split_first_chunk()?;
                (f64::from_le_bytes(*bytes), left)
            }
            false => {
                let (bytes, left) = rest.split_first_chunk()?;
                (
                    height * f64::from(i16::from_le_bytes(*bytes)) / 3276.7,
                    left,
                )
            }
        };
        rest = left;
        Some(number)
    };
    let mut text = heads.join(",") + "\n";
    let mut time = 0.0;
    for row in 0..48 {
        let cells: Option<Vec<f64>> = heads[1..].iter().map(|_| next()).collect();
        let Some(cells) = cells else { break };
        text += &time.to_string();
        for cell in cells {
            text += &format!(",{cell}");
        }
        text += "\n";
        // Rows that are not equally far apart, too.
        time += interval * if row % 7 == 6 { 1.5 } else { 1.0 };
    }
    Some(text)
}
