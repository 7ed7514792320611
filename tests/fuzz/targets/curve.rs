//! Bytes as a file of each of a datasheet's curves.

#![no_main]

use servobee::record::{AreaCurve, FlowCurve, ResponseCurve, StepCurve};
use servobee_fuzz::{assert_rising, located};

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let path = match bytes.starts_with(b"MATLAB") {
        true => "fuzz.mat",
        false => "fuzz.csv",
    };
    if let Some(curve) = located(path, FlowCurve::parse(path, bytes)) {
        assert_rising(&curve.opening);
        assert!(curve.flow.iter().all(|flow| flow.is_finite()));
        assert!(
            curve
                .weight
                .iter()
                .all(|weight| *weight >= 0.0 && weight.is_finite())
        );
        assert!(curve.weight.iter().any(|weight| *weight > 0.0));
    }
    if let Some(curve) = located(path, AreaCurve::parse(path, bytes)) {
        assert_rising(&curve.opening);
        assert!(
            curve
                .area
                .iter()
                .all(|area| *area >= 0.0 && area.is_finite())
        );
    }
    if let Some(curve) = located(path, ResponseCurve::parse(path, bytes)) {
        assert!(!curve.points.is_empty());
        for point in &curve.points {
            assert!(point.frequency > 0.0 && point.frequency.is_finite());
            assert!(point.amplitude.is_none_or(|one| one > 0.0 && one <= 100.0));
            assert!(point.phase.or(point.gain).is_some());
            assert!(
                [point.phase, point.gain]
                    .into_iter()
                    .flatten()
                    .all(f64::is_finite)
            );
            assert!(point.weight >= 0.0 && point.weight.is_finite());
        }
    }
    if let Some(curve) = located(path, StepCurve::parse(path, bytes)) {
        assert_rising(&curve.time);
        assert_eq!(curve.spool.values.len(), curve.time.len());
        if let Some(record) = located("step", curve.to_record(None)) {
            let step = curve.command.is_none() && !curve.time.contains(&0.0);
            assert_eq!(record.time().len(), curve.time.len() + usize::from(step));
        }
    }
});
