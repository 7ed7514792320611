//! The problems that a datasheet poses: a flow curve, a frequency response, a step.

use crate::Result;
use crate::evaluate::problem::{DEGREES_PER_DECIBEL, Data, Problem, Sample, Series, Stream, Tone};
use crate::evaluate::reference;
use crate::model::valve::{LEAKAGE_AREA, Meter, ValveForm};
use crate::model::{Complete, Initial, Input, Output, Outputs, Parameter, Structure};
use crate::record::{FlowCurve, ResponseCurve, ResponsePoint, StepCurve, cases};

/// Full scale of the command where a datasheet speaks in per cent: that of the paper's method, 10 V.
pub const FULL_SCALE: f64 = 10.0;
/// Pressure drop of a flow curve from P to T, bar, where nobody says another: that of the published valves.
pub const DROP: f64 = 10.0;
/// Amplitude, % of full scale, of a response whose own is not known: no spool's error of that size is limited.
const SMALL: f64 = 0.1;
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
    /// What is compared at the points: one quantity, or phase and gain.
    pub measured: Vec<Measured>,
    /// What the points are called, such as `opening [%]`.
    pub axes: Vec<String>,
    /// Where each point lies on the axes.
    pub points: Vec<Vec<f64>>,
    /// What the reader has to know.
    pub notes: Vec<String>,
}

/// What a curve of a datasheet shows.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// `flow`, `phase`, `gain` or `spool`.
    pub name: &'static str,
    /// Its unit.
    pub unit: String,
    /// Its value at each point, where the datasheet has it.
    pub values: Vec<Option<f64>>,
}

impl Sheet {
    /// A flow curve at a pressure `drop` from P to T, bar, half of it at each land: an area at each opening. Openings are those
    /// of the curve, since between two points it says nothing. Of a curve of both sides the areas have the flow's sign.
    pub fn flow(curve: &FlowCurve, drop: f64) -> Self {
        let last = curve.opening.len() - 1;
        let both_sides = curve.opening[0] < 0.0;
        let mut openings = curve.opening.clone();
        // What lies below the first point is taken as straight from the closed valve.
        let closed = openings[0] > 0.0;
        if closed {
            openings.insert(0, 0.0);
        }
        let form = match both_sides {
            true => ValveForm::signed(&openings),
            // In the pressure line: in the load loop, areas that are all too large by the same amount would cancel.
            false => ValveForm {
                meter: Meter::Supply,
                ..ValveForm::table(&openings)
            },
        };
        let structure = Structure::flow_bench(form);
        let rated = curve
            .flow
            .iter()
            .fold(0.0f64, |most, flow| most.max(flow.abs()));
        let mut parameters = structure.parameters();
        set(&mut parameters, "rated_drop", drop);
        // The area that passes the largest flow, with room above it.
        let unit = flow_of_unit_area(&structure, &parameters);
        let widest = rated / unit;
        // A valve that is connected the other way round falls.
        let direction = if both_sides {
            curve.flow[last].signum()
        } else {
            1.0
        };
        let areas = parameters
            .iter_mut()
            .filter(|p| p.name.starts_with("area_"));
        for (i, (area, &opening)) in areas.zip(&openings).enumerate() {
            area.low = if both_sides { -2.0 * widest } else { 0.0 };
            area.high = 2.0 * widest;
            area.set_fixed(closed && i == 0);
            area.set_nominal(area.clamp(direction * widest * opening / 100.0));
        }
        let samples = (0..=last)
            .map(|k| Sample {
                input: Input {
                    command: curve.opening[k],
                    ..Input::default()
                },
                target: Outputs::from_fn(|output| match output {
                    Output::Flow => curve.flow[k],
                    _ => 0.0,
                }),
                weight: curve.weight[k],
                ..Sample::default()
            })
            .collect();
        // The paper's bench: the command rises from 0 to 100 % in 10 s.
        let time = curve.opening.iter().map(|opening| opening / 10.0).collect();
        let mut series = Series {
            name: curve.name.clone(),
            measured: Outputs::all(true),
            time,
            samples,
        };
        series.set_steps(0.0, 1);
        let mut notes = vec![
            "Only Cd A / sqrt(density) follows from flow: discharge coefficient and density are fixed.".into(),
            format!(
                "The drop is taken as {} bar a land (--drop sets that from P to T), and the flow as measured in the {}.",
                0.5 * drop,
                if both_sides {
                    "load loop, positive from A to B"
                } else {
                    "pressure line"
                }
            ),
        ];
        if closed {
            notes.push(format!(
                "The curve begins at {} %: below, the area is taken as straight from closed at 0 %.",
                curve.opening[0]
            ));
        }
        Self {
            title: format!("flow of {}", curve.name),
            published: vec![None; parameters.len()],
            problem: Problem::new(structure, parameters, Data::Series(vec![series])),
            measured: vec![Measured {
                name: "flow",
                unit: "L/min".into(),
                values: curve.flow.iter().copied().map(Some).collect(),
            }],
            axes: vec!["opening [%]".into()],
            points: curve.opening.iter().map(|&opening| vec![opening]).collect(),
            notes,
        }
    }

    /// A frequency response: K, T and S, all points together whatever their amplitude, phases and gains.
    pub fn response(curve: &ResponseCurve, full_scale: f64, stream: Stream) -> Self {
        let structure = Structure::actuator(full_scale, "V");
        let parameters = structure.parameters();
        let rate = structure.fastest_rate(&parameters);
        let amplitude = |p: &ResponsePoint| p.amplitude.unwrap_or(SMALL);
        let tone = |p: &ResponsePoint| {
            let amplitude = amplitude(p) / 100.0 * full_scale;
            Tone {
                phase: p.phase,
                gain: p.gain,
                ..Tone::new(p.frequency, amplitude, 0.0, p.weight, stream, rate, 1)
            }
        };
        let measured = [
            ("phase", "deg", (|p| p.phase) as fn(&ResponsePoint) -> _),
            ("gain", "dB", |p| p.gain),
        ]
        .map(|(name, unit, of)| Measured {
            name,
            unit: unit.into(),
            values: curve.points.iter().map(of).collect(),
        });
        let known = |one: &Measured| one.values.iter().any(Option::is_some);
        let mut notes = vec![format!(
            "Full scale of the command is {full_scale} V (--full-scale changes it)."
        )];
        if known(&measured[1]) {
            notes.push(format!(
                "Gains are relative to that of a slow command, 0 dB. An error of 1 dB counts as one of \
                 {DEGREES_PER_DECIBEL} deg of phase: both move the response as far in the complex plane."
            ));
        }
        if curve.points.iter().any(|point| point.amplitude.is_none()) {
            notes.push(format!(
                "The curve has no amplitude: its sines are taken as so small, {SMALL} % of full scale, that nothing \
                 saturates (--amplitude says how large they were)."
            ));
        }
        Self {
            title: format!("frequency response of {}", curve.name),
            published: vec![None; parameters.len()],
            problem: Problem::new(
                structure,
                parameters,
                Data::Tones(curve.points.iter().map(tone).collect()),
            ),
            measured: measured.into_iter().filter(known).collect(),
            axes: vec!["amplitude [%]".into(), "frequency [Hz]".into()],
            points: curve
                .points
                .iter()
                .map(|p| vec![amplitude(p), p.frequency])
                .collect(),
            notes,
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
        let given = |time: &f64| curve.time.contains(time);
        let mut values = Vec::new();
        for (time, sample) in series.time.iter().zip(&mut series.samples) {
            // The moment of the step, where the curve has no point, is not compared.
            sample.weight = if given(time) { 1.0 } else { 0.0 };
            values.push(given(time).then_some(sample.target[Output::Spool]));
        }
        Ok(Self {
            title: format!("step response of {}", curve.name),
            published: vec![None; parameters.len()],
            measured: vec![Measured {
                name: "spool",
                unit: record.command().unit.clone(),
                values,
            }],
            axes: vec!["time [s]".into()],
            points: series.time.iter().map(|&time| vec![time]).collect(),
            problem: Problem::new(structure, parameters, Data::Series(vec![series])),
            notes: vec![format!(
                "The step starts from rest; full scale is {full_scale}."
            )],
        })
    }

    /// What the model has at every point for each quantity that is measured, for values of the free parameters. `problem` is
    /// the sheet's, or one with other integration steps.
    pub fn simulated(&self, problem: &Problem, free: &[f64]) -> Vec<Vec<f64>> {
        let values = problem.complete(free, |fixed| fixed);
        match &*problem.data {
            Data::Series(all) => {
                let rows = reference::trajectories(&problem.structure, &values, all).concat();
                let output = problem.structure.observed[0];
                vec![rows.iter().map(|row| row[output]).collect()]
            }
            Data::Tones(tones) => {
                let responses = reference::responses(&problem.structure, &values, tones);
                // As many turns as measured.
                let phase = |(tone, (phase, _)): (&Tone, &(f64, f64))| match tone.phase {
                    Some(measured) => {
                        measured - tone.phase_error(phase.to_radians()).unwrap_or_default()
                    }
                    None => *phase,
                };
                let one = |measured: &Measured| match measured.name {
                    "phase" => tones.iter().zip(&responses).map(phase).collect(),
                    _ => responses
                        .iter()
                        .map(|(_, ratio)| 20.0 * ratio.log10())
                        .collect(),
                };
                self.measured.iter().map(one).collect()
            }
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

/// The flow (L/min) at full opening where the last area of the table is 1 cm² and the others are closed.
fn flow_of_unit_area(structure: &Structure, parameters: &[Parameter]) -> f64 {
    let areas = |p: &Parameter| p.name.starts_with("area_");
    let last = parameters.iter().rposition(areas);
    let value = |(i, p): (usize, &Parameter)| match (areas(p), Some(i) == last) {
        (true, true) => 1.0,
        (true, false) => 0.0,
        (false, _) => p.nominal(),
    };
    let values: Complete<f64> = parameters.iter().enumerate().map(value).collect();
    let sample = Sample {
        input: Input {
            command: 100.0,
            ..Input::default()
        },
        ..Sample::default()
    };
    let record = Series {
        name: String::new(),
        measured: Outputs::all(true),
        time: vec![0.0],
        samples: vec![sample],
    };
    reference::trajectories(structure, &values, &[record])[0][0][Output::Flow]
}

fn set(parameters: &mut [Parameter], name: &str, start: f64) {
    let parameter = parameters
        .iter_mut()
        .find(|p| p.name == name)
        .expect("a parameter of the sheet");
    parameter.set_nominal(parameter.clamp(start));
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
    let mut sheet = Sheet::flow(&cases::d675_flow(), DROP);
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
        .find(|p| p.name == LEAKAGE_AREA);
    leakage
        .expect("a valve has a leakage area")
        .set_fixed(false);
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
    let actuator = Complete::from_iter(cases::D675_ACTUATOR);
    let phases = reference::responses(&structure, &actuator, &tones);
    let points = D675_FREQUENCIES
        .iter()
        .zip(phases)
        .map(|(&frequency, (phase, _))| ResponsePoint {
            frequency,
            amplitude: Some(amplitude),
            phase: Some(phase),
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
    let mut sheet = Sheet::flow(&cases::kbfdg5v_flow(), DROP);
    let names: Vec<String> = (1..=cases::KBFDG5V_AREA_START.len())
        .map(|i| format!("area_{i}"))
        .collect();
    let start: Vec<(&str, f64)> = names
        .iter()
        .map(String::as_str)
        .zip(cases::KBFDG5V_AREA_START)
        .collect();
    sheet.start_at(&start);
    sheet.start_at(&[(LEAKAGE_AREA, cases::KBFDG5V_AREA_LEAK * 1e4)]);
    sheet
}
