//! The diagnosis on a small, fixed set of the scorecard's records: nothing planted, one effect, another form, two effects,
//! and what is in no catalogue. `servobee scorecard` runs the whole set.

use servobee::scorecard::{Case, Outcome, Plan, Row, run};
use std::sync::Mutex;

/// Error after the diagnosis over the planted noise, at most.
const AFTER: f64 = 1.10;

/// The records' seed: that of the scorecard in the README.
const SEED: u64 = 1;

fn diagnosed(names: &[&str]) -> Vec<Row> {
    let plan = Plan::default();
    let cases: Vec<Case> = names.iter().map(|name| plan.case(name).unwrap()).collect();
    let rows = Mutex::new(Vec::new());
    run(&cases, SEED, 2, |row| {
        rows.lock().unwrap().push(row);
        Ok(())
    })
    .unwrap();
    let rows = rows.into_inner().unwrap();
    assert_eq!(rows.len(), names.len());
    for row in &rows {
        println!(
            "{}: {} [{}], {:.3} -> {:.3} times the noise, {:.0} s",
            row.case, row.verdict, row.named, row.base, row.after, row.seconds
        );
    }
    rows
}

#[test]
fn nothing_is_found_where_nothing_is_planted() {
    for row in diagnosed(&["null/111", "null/57", "null/36"]) {
        assert_eq!(row.verdict, "none", "{}", row.case);
    }
}

#[test]
fn what_is_planted_is_named_and_explains_everything() {
    let rows = diagnosed(&[
        "single/delay/3x/3",
        "single/hysteresis/3x/3",
        "single/friction/6x/1",
        "single/slew_limit/3x/0",
        "single/overlap/6x/1",
        "single/leakage/1.5x/3",
        "single/sensor_lag.flow/1.5x/2",
        "single/sensor_offset.flow/3x/1",
        "forms/hysteresis~bouc_wen/3x/1",
        "pairs/hysteresis+sensor_offset.flow/21",
    ]);
    for row in &rows {
        let named = matches!(row.outcome, Outcome::Right | Outcome::Tied);
        assert!(named, "{}: {} [{}]", row.case, row.verdict, row.named);
        assert!(row.after <= AFTER, "{}: {}", row.case, row.after);
        assert!(row.after < row.base / 1.25, "{}: {}", row.case, row.base);
    }
    // A lag of the flow meter and the filling of a volume have one equation: no record tells them apart.
    let lag = rows.iter().find(|row| row.case.contains("sensor_lag"));
    assert_eq!(lag.unwrap().outcome, Outcome::Tied);
    // 95 % intervals: of all these parameters one in twenty may miss.
    let covered = rows.iter().flat_map(|row| row.covered).flatten();
    let covered: Vec<bool> = covered.collect();
    let hit = covered.iter().filter(|hit| **hit).count();
    assert!(
        covered.len() > 20 && hit * 100 >= covered.len() * 85,
        "{hit} of {}",
        covered.len()
    );
}

#[test]
fn what_is_in_no_catalogue_gets_no_name() {
    let rows = diagnosed(&[
        "outsiders/gain_jump/0",
        "outsiders/coarse_dac/0",
        "outsiders/tanh_sensor/0",
    ]);
    for row in rows {
        assert_eq!(row.verdict, "unexplained", "{}: {}", row.case, row.named);
        assert_eq!(row.named, "", "{}", row.case);
    }
}
