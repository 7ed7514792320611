//! Model files: what is written reads back exactly, a part changes the rest, and what is wrong is named.

use proptest::prelude::*;
use proptest::sample::{Index, select, subsequence};
use servobee::model::effects::CATALOGUE;
use servobee::model::orifice::Transition;
use servobee::model::valve::{AreaLaw, Drop, Meter, Orifices, ValveForm};
use servobee::model::{
    Complete, Drive, Hold, Initial, Output, Parameter, Piston, Polarity, Role, ServoValve,
    Structure,
};
use servobee::report::ModelFile;
use servobee::{Error, Result};

/// Every part in every kind, not every combination of them.
fn structures() -> Vec<Structure> {
    let base = Structure::actuator(9.999999999999998, "V");
    let form = ValveForm::linear();
    let table = ValveForm {
        area: AreaLaw::Table(vec![0.1, 0.2, 1.0 / 3.0, 1e2]),
        orifices: Orifices::Six,
        transition: Transition::Reynolds,
        meter: Meter::Supply,
        drop: Drop::Ports,
    };
    let supply = ValveForm {
        drop: Drop::Supply,
        ..form.clone()
    };
    let open = Output::ALL
        .into_iter()
        .filter(|output| !output.is_of_blocked_ports());
    let open: Vec<Output> = open.collect();
    let edges = Structure {
        observed: Output::ALL.into(),
        ..Structure::flow_bench(ValveForm {
            area: AreaLaw::Edges,
            ..form.clone()
        })
    };
    let flow = |valve: &ValveForm| Structure {
        observed: open.clone(),
        base: ServoValve {
            spool_unit: Some("%".into()),
            ..ServoValve::with(valve.clone())
        }
        .into(),
        ..base.clone()
    };
    vec![
        base.clone(),
        edges,
        flow(&form),
        flow(&supply),
        flow(&table),
        Structure::flow_bench(table),
        Structure {
            observed: vec![Output::Position],
            hold: Hold::Interpolated,
            initial: Initial::Free,
            base: ServoValve {
                piston: Piston::Servo,
                ..ServoValve::default()
            }
            .into(),
            ..Structure::actuator(1e-3, "mm")
        },
        Structure {
            initial: Initial::Rest,
            base: ServoValve {
                drive: Drive::Direct,
                ..ServoValve::default()
            }
            .into(),
            ..base
        },
    ]
}

fn nowhere() -> Result<Structure> {
    Err(Error::failed("asked for the base", "do not"))
}

#[test]
fn a_complete_file_reads_back_to_the_same() {
    for structure in structures() {
        let mut parameters = structure.parameters();
        for (i, parameter) in parameters.iter_mut().enumerate() {
            parameter.set_nominal(parameter.from_unit(((i + 1) as f64 * 0.618).fract()));
            parameter.set_fixed(i % 2 == 0);
        }
        let values = Complete::nominal(&parameters);
        let text = ModelFile::to_toml(&structure, &parameters, &values);
        let file = ModelFile::parse("model.toml", &text).unwrap();
        assert_eq!(file.structure(nowhere).unwrap(), structure, "{text}");
        let read = file.parameters(structure.parameters()).unwrap();
        assert_eq!(read, parameters, "{text}");
        assert_eq!(ModelFile::to_toml(&structure, &read, &values), text);
    }
}

#[test]
fn an_empty_file_changes_nothing() {
    let file = ModelFile::parse("model.toml", "").unwrap();
    for structure in structures() {
        assert_eq!(file.structure(|| Ok(structure.clone())).unwrap(), structure);
        let parameters = structure.parameters();
        assert_eq!(file.parameters(parameters.clone()).unwrap(), parameters);
    }
    let error = file.complete_structure().unwrap_err().to_string();
    assert!(error.contains("has no [structure]"), "{error}");
}

#[test]
fn a_part_changes_the_rest_key_by_key() {
    let text = "
        [structure]
        hold = \"interpolated\"
        valve.orifices = \"six\"
        [[parameter]]
        name = \"saturation\"
        value = 5
        fixed = true
    ";
    let file = ModelFile::parse("model.toml", text).unwrap();
    let base = Structure {
        observed: vec![Output::Spool, Output::Flow],
        base: ServoValve::with(ValveForm::table(&[0.0, 1.0, 2.0, 3.0])).into(),
        ..Structure::actuator(10.0, "V")
    };
    let structure = file.structure(|| Ok(base.clone())).unwrap();
    let mut expected = base.clone();
    expected.hold = Hold::Interpolated;
    let valve = expected
        .servo_valve_mut()
        .and_then(|base| base.valve.as_mut());
    valve.unwrap().orifices = Orifices::Six;
    assert_eq!(structure, expected);
    let parameters = file.parameters(structure.parameters()).unwrap();
    for (changed, before) in parameters.iter().zip(structure.parameters()) {
        let expected = match before.name.as_str() {
            "saturation" => Parameter {
                role: Role::Fixed { value: 5.0 },
                ..before
            },
            _ => before,
        };
        assert_eq!(*changed, expected);
    }
}

#[test]
fn a_base_loses_the_valve_that_a_part_leaves_without_use() {
    let file = ModelFile::parse("m.toml", "structure.observed = [\"spool\"]").unwrap();
    let base = Structure {
        observed: vec![Output::Spool, Output::Flow],
        base: ServoValve::with(ValveForm::linear()).into(),
        ..Structure::actuator(10.0, "V")
    };
    let structure = file.structure(|| Ok(base)).unwrap();
    assert_eq!(structure, Structure::actuator(10.0, "V"));
}

#[test]
fn what_is_wrong_is_named_with_its_line() {
    const WHOLE: &str =
        "[structure]\nfull_scale = 10.0\ncommand_unit = \"V\"\nobserved = [\"spool\"]\n";
    const FLOW: &str =
        "[structure]\nfull_scale = 10.0\ncommand_unit = \"V\"\nobserved = [\"flow\"]\n";
    let whole = |rest: &str| format!("{WHOLE}{rest}");
    let flow = |rest: &str| format!("{FLOW}{rest}");
    let parameter = |keys: &str| whole(&format!("[[parameter]]\nname = \"gain\"\n{keys}\n"));
    let table = |openings: &str| flow(&format!("[structure.valve]\narea.table = {openings}\n"));
    let cases: &[(String, &[&str])] = &[
        ("[structure\n".into(), &["line 1", "[structure"]),
        (
            "[model]\n".into(),
            &["line 1", "\"model\"", "[[parameter]]"],
        ),
        ("structure = 3\n".into(), &["line 1", "\"structure\""]),
        (whole("colour = 1\n"), &["line 5", "`colour`", "full_scale"]),
        (
            whole("valve.colour = 1\n"),
            &["line 5", "`colour`", "orifices"],
        ),
        (
            whole("drive = \"direkt\"\n"),
            &["line 5", "`direkt`", "`direct`"],
        ),
        (WHOLE.replace("10.0", "\"ten\""), &["line 2", "ten", "f64"]),
        (WHOLE.replace("10.0", "nan"), &["line 2", "NaN", "positive"]),
        (WHOLE.replace("10.0", "-1"), &["line 2", "-1", "positive"]),
        (WHOLE.replace("\"V\"", "\"mV\""), &["line 3", "mV", "use V"]),
        (
            whole("spool_unit = \"inch\"\n"),
            &["line 5", "inch", "use V"],
        ),
        (
            WHOLE.replace("\"spool\"", ""),
            &["line 4", "none", "\"flow\""],
        ),
        (
            WHOLE.replace("\"spool\"", "\"spool\", \"spool\""),
            &["line 4", "twice"],
        ),
        (
            FLOW.into(),
            &["line 4", "needs a valve", "[structure.valve]"],
        ),
        (
            whole("valve.area = \"linear\"\n"),
            &["line 5", "follows from it", "delete"],
        ),
        (table("[0, 1, 2]"), &["line 6", "fewer than four", "rising"]),
        (table("[0, 1, 1, 2]"), &["line 6", "do not rise", "rising"]),
        (
            table("[0, 1, nan, 2]"),
            &["line 6", "do not rise", "rising"],
        ),
        (
            table("[0, 1, 2, inf]"),
            &["line 6", "do not rise", "rising"],
        ),
        (whole("[[parameter]]\nvalue = 1\n"), &["line 5", "`name`"]),
        (
            whole("[[parameter]]\nname = \"gian\"\n"),
            &["line 6", "gian", "gain, time_constant, saturation"],
        ),
        (
            parameter("[[parameter]]\nname = \"gain\""),
            &["line 8", "gain above already", "delete"],
        ),
        (parameter("colour = 1"), &["line 7", "`colour`", "`value`"]),
        (parameter("value = \"much\""), &["line 7", "much", "f64"]),
        (parameter("value = nan"), &["line 7", "nan", "not finite"]),
        (parameter("unit = \"rad/s\""), &["line 7", "rad/s", "1/s"]),
        (
            parameter("value = 1e9"),
            &["line 7", "1e9", "1 .. 5000", "inside"],
        ),
        (
            parameter("low = 300\nhigh = 200"),
            &["line 7", "300 .. 200", "less than"],
        ),
        (
            parameter("high = 0.5"),
            &["line 7", "1 .. 0.5", "less than"],
        ),
        (
            parameter("low = 0"),
            &["line 7", "low 0", "logarithmic", "positive"],
        ),
        (
            parameter("scale = \"root\""),
            &["line 7", "`root`", "`log`"],
        ),
        (parameter("fixed = 1"), &["line 7", "fixed", "boolean"]),
    ];
    for (text, parts) in cases {
        let read = ModelFile::parse("dir/model.toml", text).and_then(|file| {
            let structure = file.complete_structure()?;
            file.parameters(structure.parameters())
        });
        let error = read.expect_err(text);
        let message = error.to_string();
        assert_eq!(error.exit_code(), 2);
        assert!(!message.contains('\n'), "{message}");
        for part in parts.iter().chain(&["dir/model.toml"]) {
            assert!(message.contains(part), "{part} is not in: {message}");
        }
    }
}

#[test]
fn a_fluid_sets_density_and_viscosity_unless_a_parameter_does() {
    let valve = Structure {
        observed: vec![Output::Spool, Output::Flow],
        base: ServoValve::with(ValveForm::linear()).into(),
        ..Structure::actuator(10.0, "V")
    };
    let value = |text: &str, name: &str| {
        let file = ModelFile::parse("model.toml", text).unwrap();
        let parameters = file.parameters(valve.parameters()).unwrap();
        parameters
            .into_iter()
            .find(|p| p.name == name)
            .unwrap()
            .nominal()
    };
    let oil = "[fluid]\niso_vg = 32\ntemperature = 60\n";
    assert!((value(oil, "viscosity") - 16.0).abs() < 0.2);
    assert!((value(oil, "density") - 844.0).abs() < 5.0);
    assert!((value("[fluid]\niso_vg = 46\n", "viscosity") - 46.0).abs() < 1e-9);
    let own = format!("{oil}[[parameter]]\nname = \"density\"\nvalue = 900.0\n");
    assert_eq!(value(&own, "density"), 900.0);

    let refused = |text: &str, structure: &Structure| {
        let file = match ModelFile::parse("model.toml", text) {
            Ok(file) => file,
            Err(error) => return error.to_string(),
        };
        file.parameters(structure.parameters())
            .unwrap_err()
            .to_string()
    };
    for (text, part) in [
        ("[fluid]\niso_vg = 460\n", "no hydraulic oil"),
        (
            "[fluid]\niso_vg = 46\ntemperature = 313\n",
            "no hydraulic oil",
        ),
        ("[fluid]\niso_vg = nan\n", "no hydraulic oil"),
        ("[fluid]\nclass = 46\n", "class"),
        ("[fluid]\ntemperature = 40\n", "iso_vg"),
    ] {
        let error = refused(text, &valve);
        assert!(error.contains(part) && error.contains("line"), "{error}");
    }
    let error = refused("[fluid]\niso_vg = 46\n", &Structure::actuator(10.0, "V"));
    assert!(error.contains("no valve"), "{error}");
}

/// A structure of any parts that fit together.
fn any_structure() -> impl Strategy<Value = Structure> {
    let units = select(vec!["V", "mA", "%", "mm", "1"]);
    let openings = || {
        proptest::collection::btree_set(-1000_i32..1000, 4..12)
            .prop_map(|openings| openings.into_iter().map(|at| f64::from(at) / 7.0).collect())
    };
    let area = prop_oneof![
        Just(AreaLaw::Linear),
        Just(AreaLaw::Proportional),
        Just(AreaLaw::Edges),
        openings().prop_map(AreaLaw::Table),
        openings().prop_map(AreaLaw::Signed),
    ];
    let kinds = (
        subsequence(Output::ALL.to_vec(), 1..=Output::COUNT),
        select(vec![Drive::Actuator, Drive::Direct]),
        select(vec![Piston::Integrated, Piston::Servo]),
        select(vec![Hold::Held, Hold::Interpolated]),
        select(vec![Initial::Equilibrium, Initial::Rest, Initial::Free]),
        any::<bool>(),
        select(vec![Polarity::Positive, Polarity::Negative]),
    );
    let valve = (
        area,
        select(vec![Orifices::Four, Orifices::Six]),
        select(vec![Transition::PressureRatio, Transition::Reynolds]),
        select(vec![Meter::Load, Meter::Supply]),
        select(vec![Drop::Rated, Drop::Supply, Drop::Ports]),
    );
    let effects = proptest::collection::vec(any::<Index>(), 0..4);
    let scale = (1e-6..1e6_f64, units.clone(), proptest::option::of(units));
    (scale, kinds, valve, effects).prop_map(|(scale, kinds, valve, effects)| {
        let (full_scale, command_unit, spool_unit) = scale;
        let (observed, drive, piston, hold, initial, reversed, polarity) = kinds;
        let (area, orifices, transition, meter, drop) = valve;
        let mut structure = Structure {
            observed,
            hold,
            initial,
            base: ServoValve {
                drive,
                spool_unit: spool_unit.map(String::from),
                piston,
                polarity,
                reversed,
                ..ServoValve::default()
            }
            .into(),
            ..Structure::actuator(full_scale, command_unit)
        };
        let form = ValveForm {
            area: match structure.observes_blocked_ports() {
                true => AreaLaw::Edges,
                false => area,
            },
            orifices,
            transition,
            meter,
            drop,
        };
        let valve = structure.needs_valve().then_some(form);
        structure.servo_valve_mut().unwrap().valve = valve;
        let able: Vec<_> = CATALOGUE
            .iter()
            .flat_map(|entry| entry.on(&structure))
            .collect();
        for index in effects.iter().filter(|_| !able.is_empty()) {
            structure = structure.with(*index.get(&able));
        }
        structure
    })
}

/// Pieces that make a model file another one, or none.
fn piece() -> impl Strategy<Value = &'static str> {
    select(vec![
        "",
        "nan",
        "inf",
        "-1",
        "0",
        "1e300",
        "1e-300",
        "true",
        "\"\"",
        "\"%\"",
        "\"flow\"",
        "[]",
        "{}",
        "[[parameter]]\n",
        "[structure]\n",
        "[fluid]\niso_vg = 46\n",
        "\n",
        "=",
        "#",
        "\"",
        "é",
        "\u{7}",
    ])
}

proptest! {
    #[test]
    fn any_model_reads_back_to_the_same(
        structure in any_structure(),
        places in proptest::collection::vec((0.0..1.0_f64, any::<bool>()), 1..30),
    ) {
        let mut parameters = structure.parameters();
        for (parameter, (place, fixed)) in parameters.iter_mut().zip(places.iter().cycle()) {
            parameter.set_nominal(parameter.from_unit(*place));
            parameter.set_fixed(*fixed);
        }
        let values = Complete::nominal(&parameters);
        let text = ModelFile::to_toml(&structure, &parameters, &values);
        let file = ModelFile::parse("model.toml", &text).unwrap();
        prop_assert_eq!(file.complete_structure().unwrap(), structure.clone(), "{}", text);
        prop_assert_eq!(file.parameters(structure.parameters()).unwrap(), parameters, "{}", text);
    }

    /// A file with something else in one place is refused there, or is sound and reads back.
    #[test]
    fn a_changed_model_is_refused_with_its_line_or_sound(
        structure in any_structure(),
        [at, end] in any::<[Index; 2]>(),
        piece in piece(),
    ) {
        let parameters = structure.parameters();
        let values = Complete::nominal(&parameters);
        let mut text = ModelFile::to_toml(&structure, &parameters, &values);
        // From one word to another, which may be the same.
        let words: Vec<usize> = text.match_indices([' ', '\n', ',']).map(|(at, _)| at).collect();
        let [one, other] = [at, end].map(|index| *index.get(&words));
        let near = one.max(other).min(one.min(other) + 30);
        text.replace_range(one.min(other)..near, piece);

        let read = ModelFile::parse("model.toml", &text).and_then(|file| {
            let structure = file.complete_structure()?;
            let parameters = file.parameters(structure.parameters())?;
            Ok((structure, parameters))
        });
        match read {
            Ok((structure, parameters)) => {
                prop_assert!(parameters.iter().all(|p| (p.low..=p.high).contains(&p.nominal())));
                let values = Complete::nominal(&parameters);
                let again = ModelFile::to_toml(&structure, &parameters, &values);
                let file = ModelFile::parse("again.toml", &again).unwrap();
                prop_assert_eq!(file.complete_structure().unwrap(), structure.clone());
                prop_assert_eq!(file.parameters(structure.parameters()).unwrap(), parameters);
            }
            Err(error) => {
                let message = error.to_string();
                let located = message.starts_with("model.toml, line ") || message.contains("no [structure]");
                prop_assert!(located && error.exit_code() == 2, "{} in {}", message, text);
                prop_assert!(!message.contains(char::is_control), "{}", message);
            }
        }
    }
}
