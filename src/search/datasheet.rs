//! The problems that a datasheet poses: a flow curve, a frequency response, a step.

use crate::Result;
use crate::evaluate::problem::{Data, Problem, Sample, Series, Stream, Tone};
use crate::evaluate::reference;
use crate::model::valve::{Meter, ValveForm};
use crate::model::{Initial, Output, Parameter, Structure};
use crate::record::{FlowCurve, ResponseCurve, StepCurve, cases};

/// Full scale of the command where a datasheet speaks in per cent: that of the paper's method, 10 V.
pub const FULL_SCALE: f64 = 10.0;
/// How much finer than a fit's the steps are with which the published response is computed.
const REFINED: u32 = 4;
/// Frequencies (Hz) of the D675's response: its published curve is not in the text, so K, T and S stand for it.
const D675_FREQUENCIES: [f64; 12] = [
    1.0, 2.0, 3.0, 5.0, 7.0, 10.0, 12.0, 14.0, 17.0, 20.0, 30.0, 40.0,
];

/// One curve of a datasheet, ready to be fitted.
#[derive(Debug, Clone)]
pub struct Sheet {
    /// What it is, in a few words.
    pub title: String,
    /// The model and the curve.
    pub problem: Problem,
    /// Published values of all parameters, where there are any.
    pub published: Vec<Option<f64>>,
    /// What is compared: `flow`, `phase` or `spool`, and its unit.
    pub quantity: (&'static str, String),
    /// What the points are called, such as `opening [%]`.
    pub axes: Vec<String>,
    /// Where each point lies on the axes.
    pub points: Vec<Vec<f64>>,
    /// What the reader has to know.
    pub notes: Vec<String>,
}

impl Sheet {
    /// A flow curve: an area at each opening, at 5 bar a land. Openings are those of the curve, since between two
    /// points it says nothing.
    pub fn flow(curve: &FlowCurve) -> Self {
        // In the pressure line: in the load loop, areas that are all too large by the same amount would cancel.
        let form = ValveForm {
            meter: Meter::Supply,
            ..ValveForm::table(&curve.opening)
        };
        let structure = Structure::flow_bench(form);
        let rated = curve
            .flow
            .iter()
            .fold(0.0f64, |most, flow| most.max(flow.abs()));
        let mut parameters = structure.parameters();
        // The area that passes the largest flow, with room above it.
        let unit = flow_of_unit_area(&structure, &parameters);
        let widest = rated / unit;
        for parameter in parameters
            .iter_mut()
            .filter(|p| p.name.starts_with("area_"))
        {
            parameter.high = 2.0 * widest;
        }
        for (i, &opening) in curve.opening.iter().enumerate() {
            set(
                &mut parameters,
                &format!("area_{}", i + 1),
                widest * opening / 100.0,
            );
        }
        let last = curve.opening.len() - 1;
        let samples = (0..=last)
            .map(|k| Sample {
                input: [curve.opening[k], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
                target: [0.0, curve.flow[k], 0.0],
                weight: curve.weight[k],
                ..Sample::default()
            })
            .collect();
        // The paper's bench: the command rises from 0 to 100 % in 10 s.
        let time = curve.opening.iter().map(|opening| opening / 10.0).collect();
        let mut series = Series {
            name: curve.name.clone(),
            time,
            samples,
        };
        series.set_steps(0.0, 1);
        Self {
            title: format!("flow of {}", curve.name),
            published: vec![None; parameters.len()],
            problem: Problem::new(structure, parameters, Data::Series(vec![series])),
            quantity: ("flow", "L/min".into()),
            axes: vec!["opening [%]".into()],
            points: curve.opening.iter().map(|&opening| vec![opening]).collect(),
            notes: vec![
                "Only Cd A / sqrt(density) follows from flow: discharge coefficient and density are fixed.".into(),
                "The drop is taken as 5 bar a land, and the flow as measured in the pressure line.".into(),
            ],
        }
    }

    /// A frequency response: K, T and S, all points together whatever their amplitude.
    pub fn response(curve: &ResponseCurve, full_scale: f64, stream: Stream) -> Self {
        let structure = Structure::actuator(full_scale, "V");
        let parameters = structure.parameters();
        let rate = structure.fastest_rate(&parameters);
        let tone = |p: &crate::record::ResponsePoint| {
            Tone::new(
                p.frequency,
                p.amplitude / 100.0 * full_scale,
                p.phase,
                p.weight,
                stream,
                rate,
                1,
            )
        };
        Self {
            title: format!("frequency response of {}", curve.name),
            published: vec![None; parameters.len()],
            problem: Problem::new(
                structure,
                parameters,
                Data::Tones(curve.points.iter().map(tone).collect()),
            ),
            quantity: ("phase", "deg".into()),
            axes: vec!["amplitude [%]".into(), "frequency [Hz]".into()],
            points: curve
                .points
                .iter()
                .map(|p| vec![p.amplitude, p.frequency])
                .collect(),
            notes: vec![format!(
                "Full scale of the command is {full_scale} V (--full-scale changes it)."
            )],
        }
    }

    /// A step from rest: K, T and S.
    ///
    /// # Errors
    /// If the curve makes no record.
    pub fn step(curve: &StepCurve, full_scale: Option<f64>) -> Result<Self> {
        let record = curve.to_record(full_scale)?;
        let full_scale = full_scale.unwrap_or_else(|| record.full_scale());
        let structure = Structure {
            initial: Initial::Rest,
            ..Structure::actuator(full_scale, &record.command().unit)
        };
        let parameters = structure.parameters();
        let rate = structure.fastest_rate(&parameters);
        let mut series = Series::from_record(&record, &structure)?;
        series.set_steps(rate, 1);
        Ok(Self {
            title: format!("step response of {}", curve.name),
            published: vec![None; parameters.len()],
            quantity: ("spool", record.command().unit.clone()),
            axes: vec!["time [s]".into()],
            points: curve.time.iter().map(|&time| vec![time]).collect(),
            problem: Problem::new(structure, parameters, Data::Series(vec![series])),
            notes: vec![format!(
                "The step starts from rest; full scale is {full_scale}."
            )],
        })
    }

    /// The measured value at every point.
    pub fn measured(&self) -> Vec<f64> {
        match &*self.problem.data {
            Data::Series(all) => all
                .iter()
                .flat_map(|s| &s.samples)
                .map(|s| s.target[self.output()])
                .collect(),
            Data::Tones(tones) => tones.iter().map(|tone| tone.phase).collect(),
        }
    }

    /// The simulated value at every point, for values of the free parameters.
    pub fn simulated(&self, problem: &Problem, free: &[f64]) -> Vec<f64> {
        let values = problem.complete(free, |fixed| fixed);
        match &*problem.data {
            Data::Series(all) => reference::trajectories(&problem.structure, &values, all)
                .concat()
                .iter()
                .map(|row| row[self.output()])
                .collect(),
            Data::Tones(tones) => {
                let near = |((phase, _), tone): ((f64, f64), &Tone)| {
                    tone.phase - tone.error(phase.to_radians())
                };
                reference::responses(&problem.structure, &values, tones)
                    .into_iter()
                    .zip(tones)
                    .map(near)
                    .collect()
            }
        }
    }

    fn output(&self) -> usize {
        if self.quantity.0 == "flow" {
            Output::Flow as usize
        } else {
            Output::Spool as usize
        }
    }

    fn publish(&mut self, values: &[(&str, f64)]) {
        for (name, value) in values {
            let index = self.problem.parameters.iter().position(|p| p.name == *name);
            self.published[index.expect("a parameter of the sheet")] = Some(*value);
        }
    }

    fn start_at(&mut self, values: &[(&str, f64)]) {
        for (name, value) in values {
            set(&mut self.problem.parameters, name, *value);
        }
    }
}

/// The flow (L/min) at full opening where the last area of the table is 1 cm² and the first is closed.
fn flow_of_unit_area(structure: &Structure, parameters: &[Parameter]) -> f64 {
    let areas = |p: &Parameter| p.name.starts_with("area_");
    let last = parameters.iter().rposition(areas);
    let value = |(i, p): (usize, &Parameter)| match (areas(p), Some(i) == last) {
        (true, true) => 1.0,
        (true, false) => 0.0,
        (false, _) => p.start,
    };
    let values: Vec<f64> = parameters.iter().enumerate().map(value).collect();
    let sample = Sample {
        input: [100.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        ..Sample::default()
    };
    let record = Series {
        name: String::new(),
        time: vec![0.0],
        samples: vec![sample],
    };
    reference::trajectories(structure, &values, &[record])[0][0][Output::Flow as usize]
}

fn set(parameters: &mut [Parameter], name: &str, start: f64) {
    let parameter = parameters
        .iter_mut()
        .find(|p| p.name == name)
        .expect("a parameter of the sheet");
    parameter.start = parameter.clamp(start);
}

/// A published valve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Case {
    /// The paper's valve: flow by 20 areas and the leakage area, response at 90 % by K, T and S.
    D675,
    /// Flow of a proportional valve, digitised, with falling weights.
    Kbfdg5v,
    /// Phases at two amplitudes, digitised.
    TwoAmplitude,
    /// A step, digitised.
    Step,
}

impl Case {
    /// The curves of the case.
    ///
    /// # Errors
    /// None for the built-in cases; the signature is that of what they are made with.
    pub fn sheets(self, full_scale: f64, stream: Stream) -> Result<Vec<Sheet>> {
        Ok(match self {
            Self::D675 => vec![d675_flow(), d675_response(full_scale, stream)],
            Self::Kbfdg5v => vec![kbfdg5v()],
            Self::TwoAmplitude => vec![Sheet::response(
                &cases::two_amplitude_response(),
                full_scale,
                stream,
            )],
            Self::Step => {
                let mut sheet = Sheet::step(&cases::step(), Some(full_scale))?;
                let [gain, time_constant, saturation] = cases::STEP_START;
                sheet.start_at(&[
                    ("gain", gain),
                    ("time_constant", time_constant),
                    ("saturation", saturation),
                ]);
                vec![sheet]
            }
        })
    }
}

fn d675_flow() -> Sheet {
    let mut sheet = Sheet::flow(&cases::d675_flow());
    let areas = cases::d675_areas().area;
    let names: Vec<String> = (1..=areas.len()).map(|i| format!("area_{i}")).collect();
    let published: Vec<(&str, f64)> = names
        .iter()
        .map(String::as_str)
        .zip(areas.iter().copied())
        .collect();
    sheet.publish(&published);
    // What a reader of the datasheet would set: closed over the overlap of 10 %, then a straight line to the rated flow.
    let last = areas.len() - 1;
    let rated = areas[last];
    let openings = cases::d675_areas().opening;
    let straight = |opening: f64| rated * ((opening - 10.0) / 90.0).max(0.0);
    let start: Vec<(&str, f64)> = names
        .iter()
        .map(String::as_str)
        .zip(openings.iter().map(|&opening| straight(opening)))
        .collect();
    sheet.start_at(&start);
    let leakage = sheet
        .problem
        .parameters
        .iter_mut()
        .find(|p| p.name == "leakage_area");
    leakage.expect("a valve has a leakage area").fixed = false;
    sheet.notes.push(
        "The paper fits 21 parameters and names 20 areas. The 21st is taken to be the leakage area: the only other \
         quantity of the valve block that shapes this curve and is not, like the discharge coefficient or an offset \
         of the openings, exactly interchangeable with the areas."
            .into(),
    );
    sheet
}

fn d675_response(full_scale: f64, stream: Stream) -> Sheet {
    let [gain, time_constant, saturation] = cases::D675_ACTUATOR;
    let published = [
        ("gain", gain),
        ("time_constant", time_constant),
        ("saturation", saturation),
    ];
    let structure = Structure::actuator(full_scale, "V");
    let rate = structure.fastest_rate(&structure.parameters());
    let amplitude = cases::D675_AMPLITUDE;
    let tones: Vec<Tone> = D675_FREQUENCIES
        .iter()
        .map(|&f| {
            Tone::new(
                f,
                amplitude / 100.0 * full_scale,
                0.0,
                1.0,
                stream,
                rate,
                REFINED,
            )
        })
        .collect();
    let phases = reference::responses(&structure, &cases::D675_ACTUATOR, &tones);
    let points = D675_FREQUENCIES
        .iter()
        .zip(phases)
        .map(|(&frequency, (phase, _))| crate::record::ResponsePoint {
            frequency,
            amplitude,
            phase,
            gain: None,
            weight: 1.0,
        })
        .collect();
    let curve = ResponseCurve {
        name: "d675".into(),
        points,
        warnings: Vec::new(),
    };
    let mut sheet = Sheet::response(&curve, full_scale, stream);
    sheet.publish(&published);
    sheet.start_at(&[
        ("gain", 200.0),
        ("time_constant", 0.01),
        ("saturation", 5.0),
    ]);
    sheet.notes.push(
        "The published phase curve is not in the text: it is computed here from the published K, T and S with finer \
         steps."
            .into(),
    );
    sheet
}

fn kbfdg5v() -> Sheet {
    let mut sheet = Sheet::flow(&cases::kbfdg5v_flow());
    let names: Vec<String> = (1..=cases::KBFDG5V_AREA_START.len())
        .map(|i| format!("area_{i}"))
        .collect();
    let start: Vec<(&str, f64)> = names
        .iter()
        .map(String::as_str)
        .zip(cases::KBFDG5V_AREA_START)
        .collect();
    sheet.start_at(&start);
    sheet.start_at(&[("leakage_area", cases::KBFDG5V_AREA_LEAK * 1e4)]);
    sheet
}
