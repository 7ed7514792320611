//! The simulator: what each planted effect does, and the command synthesize.

use crate::common::effects::area_of;
use crate::program::{names, off, printed, refused, rms, servobee, soak};
use servobee::evaluate::problem::Series;
use servobee::evaluate::simulate::outputs;
use servobee::model::valve::ValveForm;
use servobee::model::{Complete, Output, ServoValve, Structure};
use servobee::record::{Channel, Record};
use servobee::simulator::{
    Command, FULL_SCALE, Form, Kind, Meter, Noise, Oddity, Outsider, Planted, Quantisation,
    RATED_DROP, Setup, Simulation, SpoolUnit, Supply, Valve,
};
use std::f64::consts::TAU;
use std::fs::{read_to_string, write};

/// The default valve with these effects, without noise.
fn planted(effects: &[&str]) -> Setup {
    let planted: Vec<Planted> = effects.iter().map(|text| text.parse().unwrap()).collect();
    Setup {
        meter: Meter::that_shows(&planted),
        supply: Supply::that_shows(&planted),
        planted,
        noise: Noise::white(0.0),
        ..Setup::default()
    }
}

/// The same, commanded by `command` at each time in s, for `seconds`.
fn driven(effects: &[&str], seconds: f64, command: impl Fn(f64) -> f64) -> Simulation {
    let rows = (seconds * 1000.0) as usize;
    let values = (0..rows).map(|k| command(k as f64 / 1000.0)).collect();
    let setup = Setup {
        command: Command::Samples(values),
        ..planted(effects)
    };
    setup.simulate().unwrap()
}

fn last(values: &[f64]) -> f64 {
    values[values.len() - 1]
}

/// Every effect in every form, at its typical value, and every outsider.
fn everything() -> Vec<Setup> {
    let forms = |kind: Kind| {
        let all = [&[Form::Usual], kind.forms()].concat();
        all.into_iter()
            .map(move |form| Planted::new(kind, kind.typical()).form(form))
    };
    let effects = Kind::ALL.into_iter().flat_map(forms).map(|p| Setup {
        meter: p.effect.meter(),
        supply: p.effect.supply(p.form),
        planted: vec![p],
        ..planted(&[])
    });
    let outsiders = Oddity::ALL.into_iter().map(|oddity| Setup {
        outsiders: vec![Outsider {
            oddity,
            value: oddity.typical(),
        }],
        ..planted(&[])
    });
    effects.chain(outsiders).collect()
}

/// Every other one of them from this on, where there is no time for all.
fn every_other(first: usize) -> impl Iterator<Item = Setup> {
    let (skipped, step) = if soak() { (0, 1) } else { (first, 2) };
    everything().into_iter().skip(skipped).step_by(step)
}

/// The largest difference of two simulations, of full scale.
fn difference(setup: &Setup, a: &Simulation, b: &Simulation) -> f64 {
    let spool = a
        .spool
        .iter()
        .zip(&b.spool)
        .map(|(a, b)| (a - b).abs() / FULL_SCALE);
    let rated = setup.valve.rated_flow;
    let flow = a
        .flow
        .iter()
        .zip(&b.flow)
        .map(|(a, b)| (a - b).abs() / rated);
    spool.chain(flow).fold(0.0, f64::max)
}

#[test]
fn without_effects_it_is_the_model() {
    for seed in [None, Some(1), Some(2), Some(3)] {
        let valve = seed.map_or(Valve::default(), Valve::random);
        let setup = Setup {
            valve,
            seconds: 4.0,
            ..planted(&[])
        };
        let structure = Structure {
            observed: vec![Output::Spool, Output::Flow],
            base: ServoValve::with(ValveForm::linear()).into(),
            ..Structure::actuator(FULL_SCALE, "V")
        };
        let parameters = structure.parameters();
        let area = area_of(&valve, &parameters);
        let values: Complete<f64> = parameters
            .iter()
            .map(|p| match p.name.as_str() {
                "gain" => valve.gain,
                "time_constant" => valve.time_constant,
                "saturation" => valve.saturation,
                "max_area" => area,
                _ => p.nominal(),
            })
            .collect();
        let mut series = Series::from_record(&setup.record().unwrap(), &structure).unwrap();
        series.set_steps(structure.fastest_rate(&parameters), 1);
        let simulated = outputs(&structure, &values, &series);
        let simulator = setup.simulate().unwrap();
        let model = Simulation {
            spool: simulated.iter().map(|row| row[Output::Spool]).collect(),
            flow: simulated.iter().map(|row| row[Output::Flow]).collect(),
            ..simulator.clone()
        };
        let off = difference(&setup, &simulator, &model);
        println!("{valve:?}: {off:.1e} of full scale");
        assert!(off < 1e-4, "{valve:?}: {off}");
    }
}

#[test]
fn half_the_step_changes_nothing_to_speak_of() {
    for setup in every_other(0) {
        let valves = [Valve::random(4), Valve::default()];
        for valve in &valves[..if soak() { 2 } else { 1 }] {
            let setup = Setup {
                valve: *valve,
                seconds: 1.5,
                ..setup.clone()
            };
            let fine = Setup {
                step: setup.step / 2.0,
                ..setup.clone()
            };
            let off = difference(
                &setup,
                &setup.simulate().unwrap(),
                &fine.simulate().unwrap(),
            );
            let what = (&setup.planted, &setup.outsiders);
            println!("{off:.1e} {what:?}");
            assert!(off < 1e-4, "{what:?}: {off}");
        }
    }
}

#[test]
fn everything_planted_is_seen_and_nothing_else_is() {
    let null = planted(&[]);
    let strength = null.strength().unwrap();
    assert!(strength.iter().all(|s| s.rms == 0.0));
    for setup in every_other(1) {
        let setup = Setup {
            noise: Noise::white(0.3),
            seconds: 4.0,
            ..setup
        };
        let strength = setup.strength().unwrap();
        let seen = strength.iter().fold(0.0, |max: f64, s| max.max(s.in_noise));
        let what = (&setup.planted, &setup.outsiders);
        assert!(seen > 1.0 && seen < 60.0, "{what:?}: {strength:?}");
    }
}

#[test]
fn neutral_is_absent() {
    // Long enough for steps, triangles and sweeps.
    let short = |effects: &[&str]| Setup {
        seconds: 2.0,
        ..planted(effects)
    };
    for kind in Kind::ALL {
        if matches!(
            kind,
            Kind::DcGain
                | Kind::SlewLimit
                | Kind::StrokeLimit
                | Kind::FlowSaturation
                | Kind::LineResonance
                | Kind::SpoolResonance
        ) {
            continue;
        }
        let neutral = short(&[&format!("{kind}=0")]);
        let absent = Setup {
            planted: vec![],
            ..neutral.clone()
        };
        assert_eq!(
            neutral.simulate().unwrap(),
            absent.simulate().unwrap(),
            "{kind}"
        );
    }
    let absent = short(&[]).simulate().unwrap();
    for oddity in Oddity::ALL {
        let setup = Setup {
            outsiders: vec![format!("{oddity}=0").parse().unwrap()],
            ..short(&[])
        };
        assert_eq!(setup.simulate().unwrap(), absent, "{oddity}");
    }
}

#[test]
fn a_delay_shifts_the_response_also_by_fractions_of_a_sample() {
    let usual = planted(&[]).simulate().unwrap();
    let late = planted(&["delay=0.003"]).simulate().unwrap();
    for k in 3..usual.spool.len() {
        assert!((late.spool[k] - usual.spool[k - 3]).abs() < 1e-12);
    }
    // At ten times the rate, where it is four whole samples.
    let late = planted(&["delay=0.0014"]).simulate().unwrap();
    let held = |k: usize| usual.command[k.saturating_sub(14) / 10];
    let fine = Setup {
        command: Command::Samples((0..10 * usual.time.len()).map(held).collect()),
        rate: 10_000.0,
        ..planted(&[])
    };
    let fine = fine.simulate().unwrap();
    for (k, x) in late.spool.iter().enumerate() {
        assert!((x - fine.spool[10 * k]).abs() < 1e-9, "row {k}");
    }
}

#[test]
fn a_slow_sweep_shows_the_loop_of_the_hysteresis_at_any_rate() {
    for form in ["", "~preisach", "~bouc_wen"] {
        for seconds in [2.0, 8.0] {
            let triangle = |t: f64| 5.0 * (1.0 - (4.0 * (t / seconds).fract() - 2.0).abs());
            let effect = format!("hysteresis{form}=0.2");
            let loops = driven(&[&effect], 2.0 * seconds, triangle);
            let usual = driven(&[], 2.0 * seconds, triangle);
            let rows = |share: f64| ((1.0 + share) * seconds * 1000.0) as usize;
            // What is late with the rate is late in both.
            let [up, down] = [0.25, 0.75].map(|share| {
                let row = rows(share);
                loops.spool[row] - usual.spool[row]
            });
            assert!((down - up - 0.4).abs() < 1e-3, "{form}: {}", down - up);
        }
    }
}

#[test]
fn slew_is_limited_and_reached() {
    for form in ["", "~smooth"] {
        let slow = planted(&[&format!("slew_limit{form}=200")])
            .simulate()
            .unwrap();
        let speeds = slow
            .spool
            .windows(2)
            .map(|pair| (pair[1] - pair[0]).abs() * 1000.0);
        let fastest = speeds.fold(0.0, f64::max);
        assert!(fastest < 200.0 * (1.0 + 1e-9), "{form}: {fastest}");
        assert!(fastest > 190.0, "{form}: {fastest}");
    }
    // No windup: a step ends where the command is.
    let step = driven(
        &["slew_limit=100"],
        0.5,
        |t| if t < 0.01 { 0.0 } else { 8.0 },
    );
    let highest = step.spool.iter().fold(0.0, |max: f64, x| max.max(*x));
    assert!(
        highest < 8.4 && (last(&step.spool) - 8.0).abs() < 1e-6,
        "{highest}"
    );
}

#[test]
fn friction_sticks_and_leaves_plateaus() {
    let friction = 0.3;
    let sine = |t: f64| 2.0 * (TAU * 0.25 * t).sin();
    let run = driven(&["friction=0.3"], 8.0, sine);
    let stuck = run
        .spool
        .windows(2)
        .filter(|pair| pair[0] == pair[1])
        .count();
    // From where the sine turns until it is two F lower: a quarter of the time at each of four turns.
    let plateau = (1.0 - 2.0 * friction / 2.0f64).acos() / (TAU * 0.25) * 1000.0;
    let expected = 4.0 * plateau;
    assert!(
        off(stuck as f64, expected) < 0.05,
        "{stuck}, not {expected}"
    );
    let top = run.spool.iter().fold(0.0, |max: f64, x| max.max(*x));
    assert!((top - (2.0 - friction)).abs() < 1e-3, "{top}");
    let lag = run
        .command
        .iter()
        .zip(&run.spool)
        .map(|(u, x)| (u - x).abs());
    assert!(lag.fold(0.0, f64::max) < friction + 0.03);

    // Below the stiction it does not move at all, above it it does.
    let step = |height: f64, effect: &str| {
        driven(&[effect], 0.5, move |t| if t < 0.1 { 0.0 } else { height })
    };
    let moved = |run: Simulation| run.spool.iter().any(|x| x.abs() > 1e-12);
    assert!(!moved(step(0.299, "friction=0.3")));
    assert!(moved(step(0.301, "friction=0.3")));
    assert!(!moved(step(0.449, "friction=0.3:excess=0.15")));
    assert!(moved(step(0.451, "friction=0.3:excess=0.15")));
}

#[test]
fn other_forms_of_friction_end_near_the_same_sliding() {
    // On a slow ramp the spool is late by F and by its speed over K.
    for effect in [
        "friction=0.3",
        "friction~dahl=0.3",
        "friction~lugre=0.3:excess=0",
    ] {
        let run = driven(&[effect], 4.0, |t| 2.0 * t);
        let late = last(&run.command) - last(&run.spool);
        assert!((late - 0.3 - 2.0 / 200.0).abs() < 2e-3, "{effect}: {late}");
    }
}

#[test]
fn what_acts_behind_the_integrator_is_taken_up_by_it_and_winds_it_up() {
    // On a ramp the loop needs an error of its speed over K alone, whatever holds the spool back.
    for effect in ["friction~windup=0.3", "flow_force~windup=0.2"] {
        let run = driven(&[effect], 4.0, |t| 2.0 * t);
        let late = last(&run.command) - last(&run.spool);
        let taken = if effect.starts_with("flow") {
            0.2 * 2.0 / 200.0
        } else {
            0.0
        };
        assert!(
            (late - 2.0 / 200.0 - taken).abs() < 2e-3,
            "{effect}: {late}"
        );
    }
    // A spool that is limited goes on past its command for as long as the lead is worked off, or stays at its stop.
    let step = |effect: &str| driven(&[effect], 0.5, |t| if t < 0.1 { 0.0 } else { 5.0 });
    let overshoot = |run: &Simulation| run.spool.iter().fold(0.0, |max: f64, x| max.max(*x)) - 5.0;
    let fastest = |run: &Simulation| {
        let steps = run.spool.windows(2).map(|pair| (pair[1] - pair[0]) / 1e-3);
        steps.fold(0.0, f64::max)
    };
    let [held, wound, ramp] =
        ["", "~windup", "~command"].map(|form| step(&format!("slew_limit{form}=100")));
    assert!((fastest(&held) - 100.0).abs() < 1e-6 && (fastest(&wound) - 100.0).abs() < 1e-6);
    assert!((fastest(&ramp) - 100.0).abs() < 10.0, "{}", fastest(&ramp));
    assert!(overshoot(&wound) > 5.0 * overshoot(&held) && overshoot(&wound) > 1.0);
    let back = |effect: &str| {
        let run = driven(&[effect], 0.6, |t| {
            if (0.1..0.3).contains(&t) { 8.0 } else { 0.0 }
        });
        run.spool.iter().filter(|x| **x == 6.0).count()
    };
    assert!(back("stroke_limit~windup=6") > back("stroke_limit=6") + 50);
}

#[test]
fn the_stroke_ends_at_its_stop() {
    for form in ["", "~clipped", "~windup"] {
        let run = planted(&[&format!("stroke_limit{form}=6")])
            .simulate()
            .unwrap();
        let highest = run.spool.iter().fold(0.0, |max: f64, x| max.max(x.abs()));
        assert_eq!(highest, 6.0, "{form}");
        assert!(run.spool.iter().filter(|x| x.abs() == 6.0).count() > 20);
    }
    let soft = driven(&["stroke_limit~soft=6:stiffness=20"], 0.5, |_| 8.0);
    // Where (u − x) = 20 (x − L).
    assert!((last(&soft.spool) - 128.0 / 21.0).abs() < 1e-6);
}

#[test]
fn at_rest_the_effects_are_where_their_equations_put_them() {
    let still = |effects: &[&str], command: f64| driven(effects, 1.0, move |_| command);
    let spool = |effects: &[&str], command| last(&still(effects, command).spool);
    let flow = |effects: &[&str], command| last(&still(effects, command).flow);
    let near =
        |found: f64, expected: f64| assert!((found - expected).abs() < 1e-6, "{found} {expected}");
    near(spool(&["null_bias=0.3"], 2.0), 2.3);
    near(spool(&["flow_force=0.25"], 2.0), 1.6);
    near(spool(&["sensor_offset=-0.2"], 2.0), 1.8);
    near(flow(&["sensor_offset.flow=-0.2"], 5.0), 29.8);
    near(flow(&["leakage=1.5"], 0.0), 1.5);
    // To whichever side it goes.
    for volts in [0.4, -0.4] {
        near(flow(&["leakage=1.5:width=4"], volts), 60.0 * 0.04 + 0.75);
    }
    near(flow(&["overlap=5"], 0.49), 0.0);
    near(flow(&["overlap=5"], -2.0), -9.0);
    near(flow(&["asymmetric_gain=0.1"], -5.0), -27.0);
    near(flow(&["gain_curvature=0.2"], 5.0), 27.0);
    for effect in [
        "compressibility=0.01",
        "line_resonance=80",
        "sensor_lag.flow=0.01",
    ] {
        near(flow(&[effect], 5.0), 30.0);
    }
    let drooped = flow(&["supply_droop=0.05"], 8.0);
    near(drooped, 48.0 * (1.0 - 0.05 * drooped / RATED_DROP).sqrt());
    // The record begins in that state.
    for effect in [
        "null_bias=0.3",
        "flow_force=0.25",
        "supply_droop=0.05",
        "friction=0.2",
    ] {
        let run = still(&[effect], 4.0);
        near(run.spool[0], last(&run.spool));
        near(run.flow[0], last(&run.flow));
    }
}

#[test]
fn drifts_and_disturbances_are_those_of_their_numbers() {
    let still = |effect: &str| driven(&[effect], 2.0, |_| 5.0);
    let drift = still("sensor_drift=0.1").spool;
    assert!((drift[1500] - 5.15).abs() < 1e-9);
    let drift = still("sensor_drift~settling=0.1:warm_up=0.5").spool;
    let settled = 0.05 * (1.0 - (-3.0f64).exp());
    assert!((drift[1500] - 5.0 - settled).abs() < 1e-9);
    let oil = still("viscosity_drift=0.02");
    assert!((oil.flow[1500] - 30.0 * 1.03).abs() < 1e-9 && oil.temperature.is_none());
    let oil = still("viscosity_drift~settling=0.02:warm_up=0.5");
    assert!((oil.flow[1500] - 30.0 * (1.0 + 0.2 * settled)).abs() < 1e-9);
    let oil = still("viscosity_drift=0.01:heating=20:warm_up=3");
    let temperature = oil.temperature.unwrap();
    let warmed = 20.0 * (1.0 - (-0.5f64).exp());
    assert!((temperature[1500] - 40.0 - warmed).abs() < 1e-9);
    assert!((oil.flow[1500] - 30.0 * (1.0 + 0.01 * warmed)).abs() < 1e-9);
    let hum = still("periodic_disturbance.flow=0.5:frequency=50:phase=0.3");
    for (t, q) in hum.time.iter().zip(&hum.flow) {
        assert!((q - 30.0 - 0.5 * (TAU * 50.0 * t + 0.3).sin()).abs() < 1e-9);
    }
    assert!(hum.spool.iter().all(|x| (x - 5.0).abs() < 1e-9));
}

#[test]
fn lags_and_lines_answer_a_sine_as_their_transfer_functions_say() {
    let frequency = 20.0;
    let amplitude = |effects: &[&str]| {
        let run = driven(effects, 1.5, |t| 0.5 * (TAU * frequency * t).sin());
        let half = |(&t, &q): (&f64, &f64)| {
            let (sin, cos) = (TAU * frequency * t).sin_cos();
            [q * sin, q * cos]
        };
        let parts = run.time.iter().zip(&run.flow).skip(500).map(half);
        let [a, b] = parts.fold([0.0; 2], |[a, b], [c, d]| [a + c, b + d]);
        a.hypot(b)
    };
    let usual = amplitude(&[]);
    let w = TAU * frequency;
    let lag = |tau: f64| 1.0 / (1.0 + (w * tau).powi(2)).sqrt();
    let r: f64 = 20.0 / 30.0;
    let line = 1.0 / ((1.0 - r * r).powi(2) + (2.0 * 0.1 * r).powi(2)).sqrt();
    for (effect, expected) in [
        ("compressibility=0.01", lag(0.01)),
        ("sensor_lag.flow=0.01", lag(0.01)),
        ("sensor_lag~second_order.flow=0.01", lag(0.005).powi(2)),
        ("line_resonance=30", line),
    ] {
        let gain = amplitude(&[effect]) / usual;
        assert!(
            off(gain, expected) < 5e-3,
            "{effect}: {gain}, not {expected}"
        );
    }
}

#[test]
fn several_effects_combine() {
    let effects = [
        "null_bias=0.3",
        "stroke_limit=2",
        "leakage=1",
        "sensor_offset=0.5",
    ];
    let run = driven(&effects, 1.0, |_| 5.0);
    assert!((last(&run.spool) - 2.5).abs() < 1e-9);
    assert!((last(&run.flow) - 12.0 - 1.0 / 26.0).abs() < 1e-9);
    let run = driven(&["sensor_offset=0.5", "sensor_offset.flow=2"], 1.0, |_| 5.0);
    assert!((last(&run.spool) - 5.5).abs() < 1e-9 && (last(&run.flow) - 32.0).abs() < 1e-9);
}

#[test]
fn a_measured_supply_gives_way_late_and_slows_what_it_feeds() {
    // At full flow 40 % of 10 bar are missing after a lag of 50 ms; a pilot stage that it feeds then has the root of 0.6 of its speed.
    let supply = |effects: &[&str], command: fn(f64) -> f64| Setup {
        supply: Supply::Measured,
        command: Command::Samples((0..1500).map(|k| command(f64::from(k) / 1000.0)).collect()),
        ..planted(effects)
    };
    let run = supply(&[], |t| if t < 0.5 { 0.0 } else { 10.0 })
        .simulate()
        .unwrap();
    assert_eq!(run.supply[499], RATED_DROP);
    let (flow, left) = (last(&run.flow), last(&run.supply));
    assert!(
        (flow - 60.0 * (left / RATED_DROP).sqrt()).abs() < 1e-6,
        "{flow} {left}"
    );
    assert!(
        (left - RATED_DROP * (1.0 - 0.4 * flow / 60.0)).abs() < 1e-4,
        "{flow} {left}"
    );
    let back = |t| if t < 1.0 { 10.0 } else { -10.0 };
    let speed = |effects: &[&str]| {
        let run = supply(effects, back).simulate().unwrap();
        (run.spool[1015] - run.spool[1025]) / 0.01
    };
    let ratio = speed(&["pilot_supply=1"]) / speed(&[]);
    assert!((0.77..0.9).contains(&ratio), "{ratio}");
}

#[test]
fn what_makes_no_sense_is_refused() {
    let twice = planted(&["delay=0.001", "delay~pade=0.002"]);
    let blind = Setup {
        flow: false,
        ..planted(&["leakage=1"])
    };
    let unseen = Setup {
        meter: Meter::Load,
        ..planted(&["leakage=1"])
    };
    let still = Setup {
        supply: Supply::Constant,
        ..planted(&["pilot_supply=1"])
    };
    let known = Setup {
        supply: Supply::Measured,
        ..planted(&["supply_droop=0.03"])
    };
    let short = Setup {
        seconds: 0.001,
        ..planted(&[])
    };
    let empty = Setup {
        command: Command::Samples(vec![1.0]),
        ..planted(&[])
    };
    for (setup, part) in [
        (twice, "planted already"),
        (blind, "not measured"),
        (unseen, "no meter between A and B sees it"),
        (still, "--supply measured"),
        (known, "leave --supply measured away"),
        (short, "rows"),
        (empty, "two or more"),
    ] {
        let error = setup.record().unwrap_err();
        assert!(error.to_string().contains(part), "{error}");
        assert_eq!(error.exit_code(), 2);
    }
}

#[test]
fn the_noise_is_as_wide_as_it_says_and_the_same_for_the_same_seed() {
    for (noise, quantisation) in [
        (Noise::white(0.4), None),
        (Noise::coloured(0.4, 80.0), None),
        (Noise::white(0.1), Some(Quantisation::Bits(8))),
    ] {
        for spool_unit in [SpoolUnit::Volt, SpoolUnit::Percent] {
            let setup = Setup {
                noise,
                quantisation,
                spool_unit,
                ..planted(&["friction=0.1"])
            };
            let clean = setup.simulate().unwrap();
            let record = setup.record().unwrap();
            for (channel, clean) in [(Channel::Spool, &clean.spool), (Channel::Flow, &clean.flow)] {
                let measured = &record.get(channel).unwrap().values;
                let found = rms(measured.iter().zip(clean).map(|(a, b)| a - b));
                let expected = setup.noise_std(channel);
                assert!(
                    off(found, expected) < 0.06,
                    "{channel}: {found}, not {expected}"
                );
            }
            assert_eq!(record, setup.record().unwrap());
            let other = Setup { seed: 2, ..setup };
            assert_ne!(record, other.record().unwrap());
        }
    }
    let coarse = Setup {
        quantisation: Some(Quantisation::Percent(1.0)),
        ..planted(&[])
    };
    let record = coarse.record().unwrap();
    let whole = |x: &f64| (x / 0.1 - (x / 0.1).round()).abs() < 1e-9;
    assert!(record.get(Channel::Spool).unwrap().values.iter().all(whole));
}

#[test]
fn the_unit_of_the_spool_is_a_choice() {
    let volts = planted(&["hysteresis=0.2"]);
    let percent = Setup {
        spool_unit: SpoolUnit::Percent,
        ..volts.clone()
    };
    let [a, b] = [volts, percent].map(|setup| setup.record().unwrap());
    let [a, b] = [&a, &b].map(|record| record.get(Channel::Spool).unwrap());
    assert_eq!((a.unit.as_str(), b.unit.as_str()), ("V", "%"));
    assert!(
        a.values
            .iter()
            .zip(&b.values)
            .all(|(a, b)| (10.0 * a - b).abs() < 1e-9)
    );
}

#[test]
fn every_command_rests_and_excites_in_both_parts() {
    for command in Command::DRAWN {
        for (seed, seconds) in [(1, 5.0), (2, 8.0), (3, 10.0), (4, 10.0)] {
            let setup = Setup {
                command: command.clone(),
                seconds,
                seed,
                ..planted(&[])
            };
            let run = setup.simulate().unwrap();
            let rows = run.command.len();
            assert_eq!(rows, (seconds * 1000.0) as usize);
            let (fitted, held_out) = run.command.split_at(rows * 7 / 10);
            for part in [fitted, held_out] {
                let still = part.iter().take_while(|u| **u == 0.0).count();
                assert!(still >= 400, "{command} {seed}: rests for {still} rows");
                let low = part.iter().fold(0.0, |a: f64, b| a.min(*b));
                let high = part.iter().fold(0.0, |a: f64, b| a.max(*b));
                assert!(
                    low < -1.5 && high > 1.5,
                    "{command} {seed}: {low} to {high}"
                );
                assert!(
                    high.max(-low) > 6.0 && high.max(-low) <= 9.0,
                    "{command} {seed}"
                );
            }
        }
    }
}

#[test]
fn random_valves_with_everything_stay_in_bounds() {
    for (seed, setup) in (1..).zip(everything()) {
        let setup = Setup {
            valve: Valve::random(seed),
            seed,
            seconds: 3.0,
            ..setup
        };
        let run = setup.simulate().unwrap();
        let highest = run.spool.iter().fold(0.0, |max: f64, x| max.max(x.abs()));
        // Of a loop with hardly any damping, a limit of its speed makes one that rocks: this far is seen, and no further.
        assert!(
            highest < 3.0 * FULL_SCALE,
            "{:?} {:?}: {highest}",
            setup.planted,
            setup.outsiders
        );
    }
}

#[test]
fn synthesize_writes_a_record_and_says_what_is_in_it() {
    let folder = tempfile::tempdir().unwrap();
    let call = [
        "synthesize",
        "--effect",
        "hysteresis~bouc_wen=0.2,sensor_lag.flow=0.004",
        "--outsider",
        "detent=0.1",
        "--seconds",
        "2",
        "--rate",
        "500",
        "--spool-unit",
        "%",
        "--quantise",
        "12",
        "--noise-colour",
        "40",
        "--random-valve",
        "--out",
        "planted.csv",
    ];
    let text = printed(&servobee(folder.path(), &call));
    for part in [
        "hysteresis~bouc_wen=0.2 [V]",
        "sensor_lag.flow=0.004 [s]",
        "detent=0.1 [V], an outsider",
        "in noise",
        "1000 rows",
    ] {
        assert!(text.contains(part), "{part} is not in\n{text}");
    }
    let path = folder.path().join("planted.csv");
    let record = Record::read(&path, &[]).unwrap();
    assert_eq!(record.samples(), 1000);
    assert_eq!(record.get(Channel::Spool).unwrap().unit, "%");
    assert!(record.get(Channel::Flow).is_some() && record.warnings.is_empty());

    let first = read_to_string(&path).unwrap();
    let again = [&call[..], &["--force"]].concat();
    printed(&servobee(folder.path(), &again));
    assert_eq!(read_to_string(&path).unwrap(), first);
    assert_eq!(names(folder.path()), ["planted.csv"]);
}

#[test]
fn synthesize_without_effects_plants_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let call = [
        "synthesize",
        "--no-flow",
        "--gain",
        "150",
        "--seconds",
        "3",
        "--out",
        "null.csv",
    ];
    let text = printed(&servobee(folder.path(), &call));
    assert!(
        text.contains("Planted: nothing") && text.contains("K = 150 1/s"),
        "{text}"
    );
    let record = Record::read(folder.path().join("null.csv"), &[]).unwrap();
    assert!(record.get(Channel::Flow).is_none());
}

#[test]
fn synthesize_refuses_in_one_line_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, part) in [
        (["--effect", "dealy=0.1"], "line_resonance"),
        (["--effect", "delay=0.1,delay=0.2"], "planted already"),
        (["--effect", "friction~lugr=0.1"], "lugre"),
        (["--outsider", "detend=0.1"], "detent"),
        (["--command", "ramp"], "multisine"),
        (["--seconds", "0"], "above zero"),
        (["--noise", "-1"], "0 to 100"),
        (["--quantise", "99"], "1 to 32"),
        (["--time-constant", "0"], "above zero"),
    ] {
        let argument = arguments.join("=");
        let call = ["synthesize", "--out", "out.csv", &argument];
        let error = refused(&servobee(folder.path(), &call));
        assert!(error.contains(part), "{part} is not in: {error}");
        assert!(names(folder.path()).is_empty());
    }
    write(folder.path().join("out.csv"), "mine").unwrap();
    let error = refused(&servobee(
        folder.path(),
        &["synthesize", "--out", "out.csv"],
    ));
    assert!(error.contains("--force"), "{error}");
    assert_eq!(
        read_to_string(folder.path().join("out.csv")).unwrap(),
        "mine"
    );
}

#[test]
fn the_help_lists_every_name() {
    let folder = tempfile::tempdir().unwrap();
    let text = printed(&servobee(folder.path(), &["synthesize", "--help"]));
    let kinds = Kind::ALL.map(Kind::name);
    let oddities = Oddity::ALL.map(Oddity::name);
    for name in kinds.iter().chain(&oddities) {
        assert!(
            text.contains(&format!("  {name}=")),
            "{name} is not in\n{text}"
        );
    }
}
