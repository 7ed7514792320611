//! The scorecard: cases that a seed stands for, records of the strength that is asked for, a file that is gone on with.

use servobee::diagnose::Place;
use servobee::evaluate::Interrupt;
use servobee::record::Channel;
use servobee::scorecard::{Band, Case, Group, Ledger, Outcome, Plan, Row, Summary, Variant, run};
use std::collections::HashSet;
use std::sync::Mutex;

fn plan(groups: &[Group], count: f64) -> Plan {
    Plan {
        groups: groups.to_vec(),
        count,
        ..Plan::default()
    }
}

#[test]
fn a_plan_has_every_effect_and_a_larger_one_has_the_same_cases_and_more() {
    let cases = Plan::default().cases().unwrap();
    let count = |group: Group| cases.iter().filter(|case| case.group == group).count();
    assert_eq!(count(Group::Null), 200);
    assert_eq!(count(Group::Single), 3 * 4 * (26 + 2 * 4));
    assert_eq!(count(Group::Pairs), 60);
    assert_eq!(count(Group::Outsiders), 5 * 22);
    assert_eq!(count(Group::LeftOut), 26 + 2 * 4);
    let readme = include_str!("../README.md");
    let said = format!("# {} records, seed 1", cases.len());
    assert!(readme.contains(&said), "{said}");
    let names: HashSet<&str> = cases.iter().map(|case| case.id.as_str()).collect();
    assert_eq!(names.len(), cases.len());
    assert!(names.contains("single/sensor_lag.flow/3x/2"));
    assert!(names.contains("forms/hysteresis~bouc_wen/6x/1"));
    assert!(!names.iter().any(|name| name.contains("integrator")));
    let mut known = cases;
    for factor in [0.5, 0.2, 0.02, 0.001] {
        let few = plan(&Group::ALL, factor).cases().unwrap();
        assert!(few.iter().all(|case| known.contains(case)), "{factor}");
        for group in Group::ALL {
            let count = few.iter().filter(|case| case.group == group).count();
            let whole = Plan::default().cases().unwrap();
            let whole = whole.iter().filter(|case| case.group == group).count();
            let expected = (factor * whole as f64).round().max(1.0);
            assert_eq!(count as f64, expected, "{factor} of {whole} {group}");
        }
        known = few;
    }
    // Of few, all are of different kinds.
    let few = plan(&[Group::Single], 0.2).cases().unwrap();
    let kinds: HashSet<&str> = few
        .iter()
        .map(|c| c.id.rsplit_once('/').unwrap().0)
        .collect();
    assert_eq!(kinds.len(), few.len());
    let more = plan(&[Group::Single], 1.5).cases().unwrap();
    assert_eq!(more.len(), 3 * 6 * (26 + 2 * 4));
}

#[test]
fn pairs_are_of_two_kinds() {
    for case in plan(&[Group::Pairs], 3.0).cases().unwrap() {
        let servobee::scorecard::Subject::Effects(effects) = &case.subject else {
            panic!("{case:?}");
        };
        assert_ne!(effects[0].kind, effects[1].kind, "{}", case.id);
        assert!(case.targets.iter().all(|target| *target >= 2.0));
    }
}

#[test]
fn effects_are_called_as_the_catalogue_does() {
    for variant in Variant::usual() {
        let name = variant.catalogue_name();
        assert!(
            name.parse::<servobee::model::effects::Effect>().is_ok(),
            "{name}"
        );
    }
}

#[test]
fn the_only_cases_asked_for_are_those() {
    let mut plan = plan(&[Group::Single], 0.1);
    plan.only = Some("sensor_offset.flow".into());
    assert_eq!(plan.cases().unwrap().len(), 1);
    plan.only = Some("sensor_offset".into());
    assert_eq!(plan.cases().unwrap().len(), 2);
    plan.only = Some("sensor_ofset".into());
    assert_eq!(plan.cases().unwrap_err().exit_code(), 2);
    plan.only = None;
    assert!(plan.case("single/delay/3x/0").is_ok());
    let error = plan.case("single/delay/4x/0").unwrap_err().to_string();
    assert!(error.contains("single/delay/1.5x/0"), "{error}");
    plan.count = 0.0;
    assert_eq!(plan.cases().unwrap_err().exit_code(), 2);
}

#[test]
fn a_record_follows_from_name_and_seed() {
    let case = plan(&[Group::Null], 0.01).case("null/1").unwrap();
    let setup = case.setup(1).unwrap();
    assert_eq!(setup, case.setup(1).unwrap());
    assert_ne!(setup, case.setup(2).unwrap());
    assert!((5.0..=10.0).contains(&setup.seconds));
    let noise = 100.0 * setup.noise_std(Channel::Flow) / setup.valve.rated_flow;
    assert!((0.2..0.52).contains(&noise), "{noise}");
    assert!(setup.planted.is_empty() && setup.outsiders.is_empty());
}

/// A record with nothing, two with something.
fn few() -> Vec<Case> {
    let plan = plan(&Group::ALL, 0.01);
    [
        "null/0",
        "single/delay/3x/0",
        "single/sensor_offset.flow/3x/0",
    ]
    .map(|id| plan.case(id).unwrap())
    .to_vec()
}

#[test]
fn a_few_records_are_diagnosed_and_an_interrupted_file_is_gone_on_with() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scorecard.csv");
    let cases = few();
    let ran = Mutex::new(0);
    let go_on = |cases: &[Case], stop_after: usize| {
        let mut ledger = Ledger::open(&path, 1).unwrap();
        let open: Vec<Case> = cases
            .iter()
            .filter(|c| !ledger.has(&c.id))
            .cloned()
            .collect();
        let mut left = stop_after;
        let result = run(&open, 1, 2, &Interrupt::default(), |row| {
            *ran.lock().unwrap() += 1;
            left -= 1;
            ledger.push(row)?;
            match left {
                0 => Err(servobee::Error::failed("interrupted", "go on")),
                _ => Ok(()),
            }
        });
        (ledger.rows().to_vec(), result.is_ok())
    };
    let (rows, whole) = go_on(&cases, 2);
    assert_eq!((rows.len(), whole), (2, false));
    // As if the power had failed while a line was written.
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, format!("{text}2,1,single/delay/3x/0,sing")).unwrap();
    let (rows, whole) = go_on(&cases, usize::MAX);
    assert_eq!((rows.len(), whole), (cases.len(), true));
    assert_eq!(*ran.lock().unwrap(), cases.len());

    // What was read is what was written.
    let summary = Summary::of(&rows);
    let (again, _) = go_on(&cases, usize::MAX);
    assert_eq!(*ran.lock().unwrap(), cases.len());
    let rounded = |summary: &Summary| Summary {
        seconds: None,
        within: Vec::new(),
        ..summary.clone()
    };
    assert_eq!(rounded(&Summary::of(&again)), rounded(&summary));

    let row = |id: &str| -> &Row { rows.iter().find(|row| row.case == id).unwrap() };
    assert_eq!(row("null/0").outcome, Outcome::Right);
    assert!(row("null/0").base < 1.1);
    let offset = row("single/sensor_offset.flow/3x/0");
    assert!(offset.outcome.good(Group::Single), "{offset:?}");
    assert!(offset.after < 1.1, "{offset:?}");
    for id in ["single/delay/3x/0", "single/sensor_offset.flow/3x/0"] {
        // The strength was set without noise, by a quicker fit.
        assert_eq!(Band::of(row(id).base), Band::Clear, "{:?}", row(id));
    }

    let located = |id: &str| row(id).located.map(Place::name);
    assert_eq!(located("single/delay/3x/0"), Some("before_spool"));
    assert_eq!(
        located("single/sensor_offset.flow/3x/0"),
        Some("behind_spool")
    );
    assert_eq!(located("null/0"), None);
    let places = summary.located.iter().map(|(place, _)| *place);
    let places: Vec<Place> = places.collect();
    assert_eq!(places, [Place::BeforeSpool, Place::BehindSpool]);
    assert!(summary.located.iter().all(|(_, rate)| rate.share() == 1.0));

    // What is wrong is not known at any time.
    let mut timed = rows.clone();
    for (row, seconds) in timed.iter_mut().zip([0.5, 3.0, 100.0]) {
        row.seconds = seconds;
    }
    timed[0].outcome = Outcome::Wrong;
    let within = Summary::of(&timed).within.into_iter();
    let good: Vec<usize> = within.map(|(_, good)| good.hits).collect();
    assert_eq!(good, [0, 0, 1, 1, 1, 1]);

    let error = Ledger::open(&path, 2).unwrap_err();
    assert_eq!(error.exit_code(), 2);
    assert!(error.to_string().contains("seed 1, not 2"), "{error}");
}

#[test]
fn a_form_is_planted_with_its_own_parameters_alone() {
    for case in ["1.5x/1", "3x/1", "6x/1"] {
        let id = format!("forms/viscosity_drift~settling/{case}");
        for seed in 7..10 {
            let setup = plan(&Group::ALL, 1.0).case(&id).unwrap().setup(seed);
            assert!(setup.is_ok(), "{id}, seed {seed}: {setup:?}");
        }
    }
}

#[test]
fn another_file_is_refused_and_left_as_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("record.csv");
    for text in ["time [s],command [V]\n0,1\n", "no line ends here"] {
        std::fs::write(&path, text).unwrap();
        assert_eq!(Ledger::open(&path, 1).unwrap_err().exit_code(), 2);
        assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
    }
    assert!(Ledger::open(&folder.path().join("no/such/folder.csv"), 1).is_err());
}
