//! Text as a model file, which is then simulated and exported.

#![no_main]

use servobee::evaluate::problem::Series;
use servobee::evaluate::{scale_of, simulate};
use servobee::export::{Model, c, modelica, simscape};
use servobee::model::{Complete, Output, Structure};
use servobee::record::{self, Channel, Record};
use servobee::report::ModelFile;
use servobee::{Error, Result};
use servobee_fuzz::located;

const PATH: &str = "fuzz.toml";

/// Integration steps between two rows, at most: what asks for more is right, but slow.
const STEPS: u32 = 1000;

libfuzzer_sys::fuzz_target!(|text: &str| {
    let Some(file) = located(PATH, ModelFile::parse(PATH, text)) else {
        return;
    };
    let base = || Ok(Structure::actuator(10.0, "V"));
    if let Some(structure) = located(PATH, file.structure(base)) {
        located(PATH, file.parameters(structure.parameters()));
    }
    let Some(structure) = located(PATH, file.complete_structure()) else {
        return;
    };
    let Some(parameters) = located(PATH, file.parameters(structure.parameters())) else {
        return;
    };
    let values = Complete::nominal(&parameters);
    for parameter in &parameters {
        let inside = (parameter.low..=parameter.high).contains(&parameter.nominal());
        assert!(inside && parameter.low < parameter.high, "{parameter:?}");
        assert!(
            parameter.low.is_finite() && parameter.high.is_finite(),
            "{parameter:?}"
        );
    }

    let written = ModelFile::to_toml(&structure, &parameters, &values);
    let again = ModelFile::parse("again.toml", &written).expect("a written model");
    assert_eq!(
        again.complete_structure().expect(&written),
        structure,
        "{written}"
    );
    let read = again.parameters(structure.parameters()).expect(&written);
    assert_eq!(read, parameters, "{written}");

    let record = record_for(&structure).expect("units that a record has");
    scale_of(&structure, std::slice::from_ref(&record));
    let mut series = Series::to_simulate(&record, &structure).expect("every channel is there");
    series.set_steps(structure.fastest_rate(&parameters), 1);
    if series.samples.iter().all(|sample| sample.substeps <= STEPS) {
        let outputs = simulate::outputs(&structure, &values, &series);
        assert_eq!(outputs.len(), record.samples());
    }

    let model = Model::new("fuzz", structure, parameters);
    for text in [
        c::program(&model),
        modelica::modelica(&model),
        simscape::script(&model),
    ] {
        assert!(!text.is_empty());
    }
});

/// A few rows with every channel, in the units of the structure.
fn record_for(structure: &Structure) -> Result<Record> {
    let rows = 12;
    let wave = |height: f64| {
        (0..rows)
            .map(|row| height * (f64::from(row) * 0.7).sin())
            .collect()
    };
    let level = |level: f64| vec![level; rows as usize];
    let series = |unit: &str, values| record::Series::new(unit, values);
    let command = structure.full_scale.min(1e6);
    let channels = [
        (
            Channel::Command,
            series(&structure.command_unit, wave(command)),
        ),
        (
            Channel::Spool,
            series(structure.unit(Output::Spool), wave(command)),
        ),
        (Channel::Flow, series("L/min", wave(30.0))),
        (Channel::Position, series("mm", wave(10.0))),
        (Channel::SupplyPressure, series("bar", level(70.0))),
        (Channel::ReturnPressure, series("bar", level(1.0))),
        (Channel::PressureA, series("bar", level(40.0))),
        (Channel::PressureB, series("bar", level(30.0))),
        (Channel::Temperature, series("degC", level(40.0))),
    ];
    let time = (0..rows).map(|row| 1e-3 * f64::from(row)).collect();
    Record::new("fuzz", time, channels).map_err(|error| Error::failed(error, "correct the target"))
}
