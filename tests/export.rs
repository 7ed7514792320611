//! Exported models simulate what servobee simulates. FMPy validates and runs the FMUs.

use crate::common;
use crate::program::{columns, printed, refused, servobee, soak};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use servobee::evaluate::problem::{Data, Sample, Series};
use servobee::evaluate::{Problem, simulate};
use servobee::export::{Model, c, fmu, modelica, simscape};
use servobee::model::effects::Port;
use servobee::model::{Complete, FreeForm, Hold, Input, Output, Outputs, Signal, Structure};
use servobee::report::ModelFile;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Largest deviation of an FMU from `servobee simulate` that passes, of full scale. Found: rounding, and 2e-8 where commands
/// are late and a measurement is filtered (servobee then makes steps of no length, too).
const TOLERANCE: f64 = 1e-6;

/// A Python with FMPy and rumoca; none where there is none and the caller has allowed that.
fn python() -> Option<PathBuf> {
    if std::env::var("SERVOBEE_SKIP_FMU").is_ok_and(|value| value == "1") {
        println!("SKIPPED: SERVOBEE_SKIP_FMU=1: no FMU was validated or simulated with FMPy");
        return None;
    }
    let python = std::env::var_os("SERVOBEE_PYTHON").unwrap_or_else(|| "python3".into());
    let ran = Command::new(&python)
        .args(["-c", "import fmpy, rumoca"])
        .output();
    assert!(
        ran.is_ok_and(|output| output.status.success()),
        "{} lacks FMPy or rumoca: pip install -r tests/export/requirements.txt (SERVOBEE_PYTHON names another Python), or set \
         SERVOBEE_SKIP_FMU=1",
        python.display()
    );
    Some(python.into())
}

/// What simulate.py reads.
#[derive(Serialize)]
struct Case {
    name: String,
    fmu: PathBuf,
    time: Vec<f64>,
    inputs: Vec<&'static str>,
    outputs: Vec<&'static str>,
    rows: Vec<Vec<f64>>,
    interpolated: bool,
    /// Of each row, whether its command goes nowhere until it jumps.
    keeps: Vec<bool>,
    /// Parameters that are set to other values than those of the FMU.
    parameters: BTreeMap<String, f64>,
    /// Parameters that are changed one by one, and to what.
    changes: BTreeMap<String, f64>,
    thorough: bool,
    /// Whether FMPy's own master simulates it, too.
    master: bool,
    #[serde(skip)]
    expected: Vec<Vec<f64>>,
}

/// Largest deviation of a Modelica model of differential equations. Found: 1e-8 where the spool exact steps, 2e-5 where
/// servobee takes steps.
const SMOOTH: f64 = 1e-4;
/// Of one that goes in steps. Found: rounding where servobee takes the same steps, 6e-6 where its spool exact steps.
const SAMPLED: f64 = 1e-4;
/// Of one whose command is late: a sine, which servobee has straight between rows.
const LATE: f64 = 1e-3;

type Trajectory = Vec<Vec<f64>>;

/// What it writes.
#[derive(Deserialize)]
struct Found {
    problems: Vec<String>,
    outputs: Trajectory,
    changed: BTreeMap<String, Trajectory>,
    master: Option<Trajectory>,
    ahead: Option<Trajectory>,
    behind: Option<Trajectory>,
    again: Option<Trajectory>,
    anew: Option<Trajectory>,
    parts: Option<Trajectory>,
    refused: Option<BTreeMap<String, String>>,
}

/// The structure and its parameters at their start values, with bounds that hold these.
fn model(name: &str, problem: &Problem) -> Model {
    let mut parameters = problem.parameters.clone();
    for parameter in &mut parameters {
        parameter.low = parameter.low.min(parameter.nominal());
        parameter.high = parameter.high.max(parameter.nominal());
    }
    Model::new(name, problem.structure.clone(), parameters)
}

impl Case {
    /// Exports the structure of `problem` to a file in `folder`, to be simulated on its first record.
    fn new(name: &str, problem: &Problem, folder: &Path) -> Self {
        let Data::Series(all) = &*problem.data else {
            panic!("{name} has no record");
        };
        let structure = &problem.structure;
        let model = model(name, problem);
        let mut series: Series = all[0].clone();
        series.set_steps(structure.fastest_rate(&model.parameters), 1);
        // Compiled in half the time that -O1 takes.
        let fmu = fmu::fmu(&model, "cc -O0").expect("an FMU");
        assert!(fmu.without_binary.is_none(), "{:?}", fmu.without_binary);
        let number = folder.read_dir().expect("a folder").count();
        let path = folder.join(format!("{number}.fmu"));
        std::fs::write(&path, fmu.bytes).expect("a file that can be written");
        let values = Complete::nominal(&model.parameters);
        let outputs = simulate::outputs(structure, &values, &series);
        let inputs = &fmu.inputs;
        let row = |sample: &Sample| {
            inputs
                .iter()
                .map(|input| sample.input.numbers()[input.place])
                .collect()
        };
        let observed = |row: &Outputs<f64>| {
            let observed = structure.observed.iter();
            observed.map(|&output| row[output]).collect()
        };
        let mut parameters = BTreeMap::new();
        if structure.states().iter().any(|state| state == "position") {
            parameters.insert(
                "initial_position".into(),
                series.samples[0].target[Output::Position],
            );
        }
        Self {
            name: name.into(),
            fmu: path,
            time: series.time.clone(),
            inputs: inputs.iter().map(|input| input.name).collect(),
            outputs: structure.observed.iter().map(|o| o.name()).collect(),
            rows: series.samples.iter().map(row).collect(),
            interpolated: structure.hold.is_straight(),
            keeps: series
                .samples
                .iter()
                .map(|sample| sample.keeps_its_command(structure.hold))
                .collect(),
            parameters,
            changes: BTreeMap::new(),
            thorough: false,
            master: false,
            expected: outputs.iter().map(observed).collect(),
        }
    }

    /// The largest deviation of a trajectory from the expected one.
    fn deviation(&self, found: &Trajectory) -> f64 {
        deviation(&self.name, &self.expected, found)
    }
}

/// The largest deviation of one trajectory from another, each output's over its largest magnitude.
fn deviation(name: &str, expected: &Trajectory, found: &Trajectory) -> f64 {
    assert_eq!(found.len(), expected.len(), "{name}");
    let of = |i: usize| {
        let peak = expected.iter().map(|row| row[i].abs()).fold(0.0, f64::max);
        assert!(peak > 0.0, "{name}: output {i} is always zero");
        let off = |(a, b): (&Vec<f64>, &Vec<f64>)| (a[i] - b[i]).abs() / peak;
        let not_a_number = |far: f64| if far.is_nan() { f64::INFINITY } else { far };
        let rows = found.iter().zip(expected);
        rows.map(off).map(not_a_number).fold(0.0, f64::max)
    };
    (0..expected[0].len()).map(of).fold(0.0, f64::max)
}

/// What a script in Python makes of the cases; none where that is skipped.
fn simulated<C: Serialize, F: DeserializeOwned>(
    cases: &[C],
    folder: &Path,
    script: &str,
) -> Option<Vec<F>> {
    let python = python()?;
    let (asked, found) = (folder.join("cases.json"), folder.join("found.json"));
    std::fs::write(&asked, serde_json::to_string(cases).unwrap()).unwrap();
    let scripts = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/export"));
    let ran = Command::new(python)
        .args([&scripts.join(script), &asked, &found])
        .output()
        .unwrap();
    let errors = String::from_utf8_lossy(&ran.stderr);
    assert!(ran.status.success(), "{errors}");
    Some(serde_json::from_str(&std::fs::read_to_string(found).unwrap()).unwrap())
}

/// Fails unless every case is valid and on its trajectory; prints the largest deviation.
fn check(cases: &[Case], folder: &Path) {
    let Some(all): Option<Vec<Found>> = simulated(cases, folder, "simulate.py") else {
        return;
    };
    assert_eq!(all.len(), cases.len());
    let mut wrong = Vec::new();
    let mut worst = (0.0, "");
    for (case, found) in cases.iter().zip(&all) {
        assert!(
            found.problems.is_empty(),
            "{}: {:?}",
            case.name,
            found.problems
        );
        let deviation = case.deviation(&found.outputs);
        if deviation > worst.0 {
            worst = (deviation, &case.name);
        }
        if deviation > TOLERANCE {
            wrong.push(format!("{}: {deviation:.1e}", case.name));
        }
    }
    println!(
        "{} FMUs, largest deviation {:.1e} of full scale: {}",
        cases.len(),
        worst.0,
        worst.1
    );
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// A correction of unknown form at this port.
fn corrected(port: Port, signal: Signal, output: Option<Output>) -> Problem {
    let form = FreeForm {
        port,
        signal,
        output,
        knots: vec![-8.0, -1.0, 0.5, 9.0],
    };
    let structure = Structure {
        free_form: Some(form),
        ..common::effects::bench()
    };
    let values = [0.4, -0.3, 0.2, -0.5];
    let mut parameters = common::effects::absent(&structure, &common::effects::scale(&structure));
    let corrections = parameters.len() - values.len();
    for (parameter, value) in parameters[corrections..].iter_mut().zip(values) {
        parameter.set_nominal(value);
    }
    common::problem(
        structure,
        parameters,
        vec![common::Record::new(200, 1e-3, 12.0)],
    )
}

#[test]
fn every_structure_simulates_as_an_fmu() {
    let folder = tempfile::tempdir().unwrap();
    let mut cases: Vec<Case> = common::cases()
        .iter()
        .filter(|case| matches!(*case.problem.data, Data::Series(_)))
        .map(|case| Case::new(case.name, &case.problem, folder.path()))
        .collect();
    for (port, signal, output) in [
        (Port::Command, Signal::Command, None),
        (Port::Actuator, Signal::Speed, None),
        (Port::Area, Signal::Spool, None),
        (Port::Measurement, Signal::Time, Some(Output::Flow)),
    ] {
        let problem = corrected(port, signal, output);
        cases.push(Case::new(
            &format!("a correction at the {port} port"),
            &problem,
            folder.path(),
        ));
    }
    check(&cases, folder.path());
}

#[test]
fn every_effect_simulates_as_an_fmu() {
    let folder = tempfile::tempdir().unwrap();
    // Another trial is the same program with other numbers in it.
    let cases: Vec<Case> = common::effects::cases()
        .iter()
        .filter(|(name, _)| soak() || name.starts_with("delay") || name.contains("trial 0"))
        .step_by(if soak() { 1 } else { 2 })
        .map(|(name, problem)| Case::new(name, problem, folder.path()))
        .collect();
    check(&cases, folder.path());
}

#[test]
fn an_fmu_keeps_to_the_rules_of_fmi() {
    let folder = tempfile::tempdir().unwrap();
    let held = common::case("actuator, held").problem;
    let delayed = common::effects::cases()
        .into_iter()
        .find(|(name, _)| name.starts_with("delay + hysteresis"))
        .expect("a case");
    let mut cases = vec![
        Case::new("held", &held, folder.path()),
        Case::new("delayed", &delayed.1, folder.path()),
    ];
    for (case, problem) in cases.iter_mut().zip([&held, &delayed.1]) {
        case.thorough = true;
        for parameter in problem.parameters.iter().filter(|p| !p.is_fixed()).take(3) {
            case.changes
                .insert(parameter.name.clone(), 1.001 * parameter.nominal());
        }
    }
    let Some(all): Option<Vec<Found>> = simulated(&cases, folder.path(), "simulate.py") else {
        return;
    };
    for (case, found) in cases.iter().zip(&all) {
        // A fault is seen: a parameter that is off by a thousandth.
        assert_eq!(found.changed.len(), 3);
        for (name, trajectory) in &found.changed {
            let deviation = case.deviation(trajectory);
            println!("{}: {name} off by 0.1 %: {deviation:.1e}", case.name);
            assert!(
                deviation > 10.0 * TOLERANCE,
                "{name} is not seen: {deviation:.1e}"
            );
        }
        for (what, trajectory) in [
            ("ahead", &found.ahead),
            ("behind", &found.behind),
            ("again", &found.again),
            ("anew", &found.anew),
        ] {
            let trajectory = trajectory.as_ref().expect("a thorough run");
            assert!(
                trajectory == &found.outputs,
                "{}: {what} is another",
                case.name
            );
        }
        let parts = case.deviation(found.parts.as_ref().expect("a thorough run"));
        println!("{}: rows in three steps: {parts:.1e}", case.name);
        // Exact steps are exact, however long; the filter of a measurement goes with the steps (README, Limits).
        let finer = if case.name == "held" { TOLERANCE } else { 3e-4 };
        assert!(parts < finer, "{}: {parts:.1e}", case.name);
        let refused = found.refused.as_ref().expect("a thorough run");
        for (what, part) in [
            (
                "parameter while stepping",
                "before the end of initialization",
            ),
            ("step backwards", "positive"),
            ("not a number", "diverges"),
            ("step after failure", "failed"),
            ("parameter out of bounds", "min and max"),
        ] {
            assert!(refused[what].contains(part), "{what}: {}", refused[what]);
        }
    }
}

#[test]
fn the_program_exports_what_it_simulates() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    for hold in [Hold::Held, Hold::Interpolated] {
        let structure = Structure {
            hold,
            ..Structure::actuator(10.0, "V")
        };
        let parameters =
            common::with_starts(&structure, &[("gain", 250.0), ("time_constant", 0.004)]);
        let values = Complete::nominal(&parameters);
        let text = ModelFile::to_toml(&structure, &parameters, &values);
        std::fs::write(path.join("model.toml"), text).unwrap();
        let command = |k: usize| [0.0, 2.0, 9.0, -9.0, 1.5][k / 60 % 5] + (k as f64 / 9.0).sin();
        let row = |k: usize| format!("{},{}\n", k as f64 * 1e-3, command(k));
        let rows: String = (0..400).map(row).collect();
        std::fs::write(
            path.join("record.csv"),
            format!("time [s],command [V]\n{rows}"),
        )
        .unwrap();
        let call = |line: &str| printed(&servobee(path, &line.split(' ').collect::<Vec<_>>()));
        call("export model.toml --out valve.fmu --force");
        call("simulate model.toml record.csv --out simulated.csv --force");
        let columns = columns(path.join("simulated.csv"));
        let of = |name: &str| {
            columns
                .iter()
                .find(|(n, _)| n == name)
                .expect(name)
                .1
                .clone()
        };
        let each = |values: Vec<f64>| values.into_iter().map(|value| vec![value]).collect();
        let case = Case {
            name: format!("{hold:?}"),
            fmu: path.join("valve.fmu"),
            time: of("time [s]"),
            inputs: vec!["command"],
            outputs: vec!["spool"],
            rows: each(of("command [V]")),
            interpolated: hold == Hold::Interpolated,
            keeps: vec![false; of("time [s]").len()],
            parameters: BTreeMap::new(),
            changes: BTreeMap::new(),
            thorough: false,
            // FMPy 0.3.32 fails to set the derivatives of inputs.
            master: hold == Hold::Held,
            expected: each(of("simulated_spool [V]")),
        };
        let cases = [case];
        check(&cases, path);
        let found: Option<Vec<Found>> = simulated(&cases, path, "simulate.py");
        if let Some(all) = found.filter(|_| hold == Hold::Held) {
            let deviation = cases[0].deviation(all[0].master.as_ref().expect("asked for"));
            println!("{hold:?}, by FMPy's own master: {deviation:.1e}");
            assert!(deviation < TOLERANCE);
        }
    }
    let ran = servobee(path, &["export", "model.toml", "--out", "valve.xyz"]);
    assert!(refused(&ran).contains("names no format"));
    let ran = servobee(path, &["export", "model.toml", "--out", "valve.fmu"]);
    assert!(refused(&ran).contains("--force"));
}

/// `model` in Modelica and one that drives it with a command that jumps every 20 ms, or is a sine where that is late; `interval`
/// is that of its steps, s.
fn bench_text(model: &Model, levels: &[f64], interval: f64) -> String {
    let last = levels.last().expect("a level");
    let steps = levels.iter().enumerate().take(levels.len() - 1);
    let steps: String = steps
        .map(|(i, level)| format!("if time < {:?} then {level:?} else ", 0.02 * (i + 1) as f64))
        .collect();
    let command = match model.structure.delays() {
        true => "6.0 * sin(50.0 * time)".to_owned(),
        false => format!("{steps}{last:?}"),
    };
    // rumoca's delay() is off by 0.15 for a sine of 50 rad/s: the late sine is written out in its place.
    let late = "(if time < dead_time then 0.0 else 6.0 * sin(50.0 * (time - dead_time)))";
    let text = modelica::modelica(model);
    assert_eq!(
        text.contains("delay(command, dead_time)"),
        model.structure.delays()
    );
    let text = text.replace("delay(command, dead_time)", late);
    // As long as the steps of the record.
    let interval = match text.contains("sample(") {
        true => format!("(interval = {interval:?})"),
        false => String::new(),
    };
    let others: String = DRIVEN
        .iter()
        .filter(|(name, _)| text.contains(&format!("input Real {name}(")))
        .map(|(name, value)| format!("  unit.{name} = {value:?};\n"))
        .collect();
    format!(
        "{text}model Bench\n  {} unit{interval};\nequation\n{others}  unit.command = {command};\nend Bench;\n",
        modelica::class_name(model)
    )
}

/// What drives a model beside the command, in the order of a sample's inputs.
const DRIVEN: [(&str, f64); 5] = [
    ("supply_pressure", 100.0),
    ("return_pressure", 4.0),
    ("pressure_a", 60.0),
    ("pressure_b", 45.0),
    ("temperature", 30.0),
];

/// What modelica.py reads.
#[derive(Serialize)]
struct Sheet {
    name: String,
    text: String,
    time: Vec<f64>,
    outputs: Vec<String>,
    #[serde(skip)]
    expected: Vec<Vec<f64>>,
    #[serde(skip)]
    tolerance: f64,
}

/// What it writes.
#[derive(Deserialize)]
struct Simulated {
    outputs: Trajectory,
    /// Why it could not be compiled or simulated.
    problem: Option<String>,
}

#[test]
fn every_effect_simulates_as_a_modelica_model() {
    let levels = [0.0, 6.0, -6.0, 1.0, 9.0, 8.0, -2.0, -2.5, 0.0, 0.3];
    let time: Vec<f64> = (0..200).map(|k| f64::from(k) * 1e-3).collect();
    let base = common::effects::bench();
    let mut sheets = Vec::new();
    let mut add = |name: String, problem: &Problem| {
        let late = problem.structure.delays();
        let structure = Structure {
            hold: if late { Hold::Interpolated } else { Hold::Held },
            ..problem.structure.clone()
        };
        let command = |k: usize| match late {
            true => 6.0 * (50.0 * time[k]).sin(),
            false => levels[k / 20],
        };
        let mut model = model("valve", problem);
        model.structure = structure.clone();
        let sample = |k: usize| Sample {
            input: Input {
                command: command(k),
                supply: 100.0,
                tank: 4.0,
                a: 60.0,
                b: 45.0,
                temperature: 30.0,
                time: time[k],
            },
            ..Sample::default()
        };
        let mut series = Series {
            name: "levels".into(),
            measured: Outputs::all(true),
            time: time.clone(),
            samples: (0..time.len()).map(sample).collect(),
        };
        series.set_steps(structure.fastest_rate(&model.parameters), 1);
        let values = Complete::nominal(&model.parameters);
        let text = bench_text(&model, &levels, series.samples[0].step);
        let smooth = !text.contains("sample(");
        let outputs = simulate::outputs(&structure, &values, &series);
        sheets.push(Sheet {
            name,
            text,
            time: time.clone(),
            outputs: structure
                .observed
                .iter()
                .map(|o| format!("unit.simulated_{}", o.name()))
                .collect(),
            expected: outputs
                .iter()
                .map(|row| structure.observed.iter().map(|&o| row[o]).collect())
                .collect(),
            tolerance: match (late, smooth) {
                (true, _) => LATE,
                (_, true) => SMOOTH,
                _ => SAMPLED,
            },
        });
    };
    add(
        "actuator alone".into(),
        &common::case("actuator, held").problem,
    );
    let scale = common::effects::scale(&base);
    let record = || vec![common::Record::new(20, 1e-3, 12.0)];
    let [spools @ .., _] = common::effects::everywhere();
    for (base, effects) in spools {
        let scale = common::effects::scale(&base);
        for effect in effects {
            let problem = common::effects::planted(&base, &[effect], &scale, 1, record());
            add(effect.to_string(), &problem);
        }
    }
    let piston = common::effects::piston();
    for effects in [&[][..], &["compressibility.flow", "hysteresis"]] {
        let effects: Vec<_> = effects
            .iter()
            .map(|text| text.parse().expect("an effect"))
            .collect();
        let problem = common::effects::planted(&piston, &effects, &scale, 1, record());
        add(format!("piston, {effects:?}"), &problem);
    }
    let several = ["hysteresis", "friction", "supply_droop", "sensor_lag.flow"];
    let several = several.map(|text| text.parse().expect("an effect"));
    let problem = common::effects::planted(&base, &several, &scale, 1, record());
    add("several".into(), &problem);
    // A planted fault.
    let mut faulty = common::case("actuator, held").problem;
    let parameter = &mut faulty.parameters[0];
    parameter.set_nominal(1.01 * parameter.nominal());
    add("faulty".into(), &faulty);
    let right = sheets[0].expected.clone();
    sheets.last_mut().expect("the faulty one").expected = right;
    let folder = tempfile::tempdir().unwrap();
    let Some(all): Option<Vec<Simulated>> = simulated(&sheets, folder.path(), "modelica.py") else {
        return;
    };
    assert_eq!(all.len(), sheets.len());
    let mut wrong = Vec::new();
    for (sheet, found) in sheets.iter().zip(&all) {
        if let Some(problem) = &found.problem {
            wrong.push(format!("{}: {problem}", sheet.name));
            continue;
        }
        let deviation = deviation(&sheet.name, &sheet.expected, &found.outputs);
        println!("{}: {deviation:.1e}", sheet.name);
        if (deviation > sheet.tolerance) != (sheet.name == "faulty") {
            wrong.push(format!("{}: {deviation:.1e}", sheet.name));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The script names every effect that Simscape lacks, with its equation and values, and sets all that it has.
#[test]
fn the_simscape_script_leaves_nothing_out() {
    let base = common::effects::bench();
    let scale = common::effects::scale(&base);
    let effects = common::effects::all_on(&base);
    let problem = common::effects::planted(
        &base,
        &effects,
        &scale,
        1,
        vec![common::Record::new(20, 1e-3, 12.0)],
    );
    let text = simscape::script(&model("valve", &problem));
    for effect in &problem.structure.effects {
        let entry = effect.entry;
        let start = format!("% - {effect}: {}\n%   {}\n", entry.summary, entry.equation);
        let after = text.split(&start).nth(1).expect("the effect");
        for own in effect.parameters(&scale) {
            let known = problem.parameters.iter().find(|p| p.name == own.name);
            let line = format!(
                "%   {} = {:?} {}\n",
                own.name,
                known.unwrap().nominal(),
                own.unit
            );
            let item = after.split("\n% - ").next().unwrap().to_owned() + "\n";
            assert!(item.contains(&line), "{line} is not in {item}");
        }
    }
    for value in [
        "{'gain'}, '200.0'",
        "{'time_constant'}, '0.003'",
        "{'saturation'}, '5.0'",
        "{'mdl_type_identical', 'mdl_type'}, '1'",
        // On to ten times full scale.
        "{'area_max'}, '4.16'",
        "{'opening_max'}, '1000'",
        "{'C_d'}, '0.7'",
        "{'x_0_P_A'}, '0.0'",
    ] {
        assert!(text.contains(value), "{value}");
    }
}

/// The C program is used as its first comment says.
#[test]
fn the_c_program_simulates_by_itself() {
    let folder = tempfile::tempdir().unwrap();
    let (_, problem) = common::effects::cases()
        .into_iter()
        .find(|(name, _)| name.starts_with("delay + hysteresis"))
        .expect("a case");
    let case = Case::new("c", &problem, folder.path());
    let list = |values: Vec<String>| values.join(", ");
    let time = list(case.time.iter().map(|t| format!("{t:?}")).collect());
    let command = list(
        case.rows
            .iter()
            .map(|row| format!("{:?}", row[0]))
            .collect(),
    );
    let main = format!(
        "{}\n#include <stdio.h>\nint main(void)\n{{\n    static const double time[] = {{ {time} }}, command[] = {{ {command} }};\n    \
         int k, rows = sizeof time / sizeof *time;\n    double values[INPUT_COUNT + PARAMETER_COUNT];\n    \
         Model model = {{ 0 }};\n    memcpy(values, START, sizeof values);\n    values[0] = command[0];\n    \
         model.plant = prepare(values + INPUT_COUNT);\n    \
         model.state = initial(model.plant, input_of(values, 0.0), initial_position(values + INPUT_COUNT));\n    \
         for (k = 0; k < rows; k++) {{\n        Input from;\n        Outputs now;\n        values[0] = command[k];\n        \
         from = input_of(values, time[k]);\n        now = look(&model, from, time[k]);\n        \
         printf(\"%.17g %.17g\\n\", now.spool, now.flow);\n        if (k + 1 < rows)\n            \
         travel(&model, from, from, time[k], time[k + 1] - time[k]);\n    }}\n    return 0;\n}}\n",
        c::program(&model("c", &problem))
    );
    std::fs::write(folder.path().join("main.c"), main).unwrap();
    let options = [
        "-std=c99",
        "-O1",
        "-ffp-contract=off",
        "main.c",
        "-o",
        "main",
        "-lm",
    ];
    let built = Command::new("cc")
        .args(options)
        .current_dir(folder.path())
        .output()
        .unwrap();
    assert!(
        built.status.success(),
        "{}",
        String::from_utf8_lossy(&built.stderr)
    );
    let ran = Command::new(folder.path().join("main")).output().unwrap();
    let numbers = |line: &str| line.split(' ').map(|n| n.parse().unwrap()).collect();
    let found: Trajectory = String::from_utf8(ran.stdout)
        .unwrap()
        .lines()
        .map(numbers)
        .collect();
    let deviation = case.deviation(&found);
    println!("C: {deviation:.1e}");
    assert!(deviation < TOLERANCE);
}

#[test]
fn without_a_compiler_there_are_the_sources() {
    let problem = common::case("actuator, held").problem;
    let fmu = fmu::fmu(&model("held", &problem), "no-such-compiler").expect("an FMU");
    assert!(
        fmu.without_binary
            .expect("a reason")
            .contains("no-such-compiler")
    );
    let text = String::from_utf8_lossy(&fmu.bytes).into_owned();
    assert!(text.contains("sources/fmu.c") && !text.contains("binaries/"));
}
