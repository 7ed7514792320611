//! A record simulated with a model.

use crate::evaluate::problem::Series;
use crate::evaluate::{STATE_LIMIT, Score, simulate};
use crate::model::{Complete, Output, Outputs, Structure};
use crate::record::{self, Record};
use crate::report::ModelFile;
use crate::{Error, Result};

/// A record simulated with a model, beside what it measures.
#[derive(Debug)]
pub struct Simulated {
    record: Record,
    structure: Structure,
    outputs: Vec<Outputs<f64>>,
    /// With half the integration steps.
    finer: Vec<Outputs<f64>>,
}

/// How one output of the model compares with what was measured.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatedChannel {
    /// Its name.
    pub name: &'static str,
    /// Its unit.
    pub unit: String,
    /// The error, where it is measured.
    pub score: Option<Score>,
    /// The largest change when the integration steps are halved, in its unit.
    pub integration_error: f64,
}

impl Simulated {
    /// `record` simulated with the model of `file`.
    ///
    /// # Errors
    /// The file is no complete model, or does not suit the record; the simulation diverges.
    pub fn new(file: &ModelFile, record: Record) -> Result<Self> {
        let structure = file.complete_structure()?;
        let parameters = file.parameters(structure.parameters())?;
        let mut series = Series::to_simulate(&record, &structure)?;
        // The steps that identify takes within the same bounds, so that its errors come out again.
        let rate = structure.fastest_rate(&parameters);
        let values = Complete::nominal(&parameters);
        let mut simulated = |refine| {
            series.set_steps(rate, refine);
            let outputs = simulate::outputs(&structure, &values, &series);
            let wild = |row: &Outputs<f64>| !row.0.iter().all(|y| y.abs() < STATE_LIMIT);
            match outputs.iter().position(wild) {
                None => Ok(outputs),
                Some(row) => Err(Error::failed(
                    format!(
                        "the simulation of {} diverges at {} s",
                        record.path,
                        record.time()[row]
                    ),
                    "check the model's values and the units of the record",
                )),
            }
        };
        Ok(Self {
            outputs: simulated(1)?,
            finer: simulated(2)?,
            structure,
            record,
        })
    }

    /// The record.
    pub fn record(&self) -> &Record {
        &self.record
    }

    /// What has to be said of each output that the model shows.
    pub fn channels(&self) -> Vec<SimulatedChannel> {
        let one = |&output: &Output| {
            let of = |rows: &[Outputs<f64>]| -> Vec<f64> {
                rows.iter().map(|row| row[output]).collect()
            };
            let (own, finer) = (of(&self.outputs), of(&self.finer));
            let changes = own.iter().zip(&finer).map(|(y, finer)| (y - finer).abs());
            SimulatedChannel {
                name: output.name(),
                unit: self.structure.unit(output).into(),
                integration_error: changes.fold(0.0, f64::max),
                score: self.measured(output).map(|measured| {
                    Score::new(measured.values.iter().copied().zip(own.iter().copied()))
                }),
            }
        };
        self.structure.observed.iter().map(one).collect()
    }

    /// What the record has measured of `output`.
    fn measured(&self, output: Output) -> Option<&record::Series> {
        let channel = output.channel();
        let responses = self.record.responses();
        self.record
            .get(channel)
            .filter(|_| responses.contains(&channel))
    }

    /// Time, command, and every observed output: measured, where it is, and simulated.
    pub fn to_csv(&self) -> String {
        let Self {
            record, structure, ..
        } = self;
        let command = record.command();
        let mut columns = vec![
            ("time [s]".to_string(), record.time().to_vec()),
            (
                format!("command [{}]", command.unit),
                command.values.clone(),
            ),
        ];
        for &output in &structure.observed {
            let unit = structure.unit(output);
            if let Some(measured) = self.measured(output) {
                columns.push((
                    format!("{} [{unit}]", output.name()),
                    measured.values.clone(),
                ));
            }
            let simulated = self.outputs.iter().map(|row| row[output]).collect();
            columns.push((format!("simulated_{} [{unit}]", output.name()), simulated));
        }
        let names: Vec<&str> = columns.iter().map(|(name, _)| name.as_str()).collect();
        let mut text = names.join(",") + "\n";
        for row in 0..record.samples() {
            let cells: Vec<String> = columns
                .iter()
                .map(|(_, values)| values[row].to_string())
                .collect();
            text += &(cells.join(",") + "\n");
        }
        text
    }
}
