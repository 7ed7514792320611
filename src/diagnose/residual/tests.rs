use super::*;
use crate::diagnose::simulated::{command, filtered, white};

fn look(channels: &[&[f64]], command: &[f64], spool: &[f64], seed: u64) -> Vec<Remaining> {
    let time: Vec<f64> = (0..command.len()).map(|k| k as f64 * 1e-3).collect();
    let residuals = Residuals {
        channels,
        starts: &[0],
        time: &time,
        command,
        known: &[("simulated spool", spool)],
    };
    remaining(&residuals, seed)
}

/// Noise that a first-order filter with this corner colours, of variance 1; white without one.
fn noise(count: usize, corner: Option<f64>, seed: u64) -> Vec<f64> {
    match corner {
        None => white(count, seed),
        Some(corner) => filtered(&white(count, seed), corner),
    }
}

fn alarms(
    count: usize,
    channels: usize,
    corner: Option<f64>,
    seeds: std::ops::Range<u64>,
) -> usize {
    let command = command(count);
    let spool = filtered(&command, 30.0);
    seeds
        .filter(|&seed| {
            let noises: Vec<Vec<f64>> = (0..channels as u64)
                .map(|channel| noise(count, corner, seed + 10_000 * channel))
                .collect();
            let channels: Vec<&[f64]> = noises.iter().map(Vec::as_slice).collect();
            let found = look(&channels, &command, &spool, seed);
            for found in found.iter().filter(|found| found.structured) {
                println!("{count} {corner:?} seed {seed}: {found:?}");
            }
            found.iter().any(|found| found.structured)
        })
        .count()
}

#[test]
#[ignore]
fn calibrate() {
    for corner in [Some(20.0)] {
        for (count, channels) in [(3500, 2)] {
            let n = 300;
            println!(
                "ALARMS {count} {channels} {corner:?}: {} of {n}",
                alarms(count, channels, corner, 0..n)
            );
        }
    }
}
