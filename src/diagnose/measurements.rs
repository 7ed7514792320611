//! Records cut into what is fitted and what is held out.

use super::conditions::Conditions;
use super::jumps::answer_at_once;
use super::placed_jumps::PlacedJumps;
use super::simulation::Sides;
use crate::Result;
use crate::evaluate::problem::{Sample, Series};
use crate::model::base::servo_valve::remarks;
use crate::model::{Hold, Input, Structure};
use crate::record::{HOLD_OUT, Record, reversals};
use serde::Serialize;
use std::ops::Range;

/// Most rows that are diagnosed unless more are asked for: a diagnosis of these takes minutes, and more rows say little more of
/// a dozen parameters.
pub const ROWS: usize = 250_000;

/// Effects are chosen by about so many rows of either side, if it has more: with all of them each model that is tried takes as
/// many times as long, and says as much.
const CHOSEN_BY: usize = 20_000;
/// And sought on about so many of those that are fitted, in stretches of so many at least: what is found there is fitted to all by
/// which they are chosen.
const SOUGHT_ON: (usize, usize) = (2400, 600);

/// A stretch of a record too long to be used whole has at least about so many rows.
const STRETCH: usize = 4096;
/// A record too long to be used whole is cut into at most so many stretches.
const STRETCHES: usize = 10;
/// The simulation runs in before a stretch over one in so many of its rows.
const RUN_IN: usize = 4;

/// A sweep is held out in at most so many pieces from one reversal to the next, each of so many rows at least.
const PIECES: usize = 10;
const SHORTEST_PIECE: usize = 10;

/// How records are cut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cut {
    /// Share of each record that is held out where no record is; between 0 and 1.
    pub hold_out: f64,
    /// Most rows that are used, of all records together. Of records that have more, lively stretches all along them are.
    pub rows: usize,
}

impl Default for Cut {
    fn default() -> Self {
        Self {
            hold_out: HOLD_OUT,
            rows: ROWS,
        }
    }
}

/// A record, and how many of its rows were used for what.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Used {
    /// Its name.
    pub name: String,
    /// Its file, as it was given.
    pub path: String,
    /// SHA-256 of the file; null where there is none.
    pub sha256: Option<String>,
    /// Its rows.
    pub rows: usize,
    /// Those that were fitted.
    pub fitted: usize,
    /// Those that were held out.
    pub held_out: usize,
}

/// Records cut into what is fitted and what is held out.
#[derive(Debug, Clone)]
pub struct Measurements {
    /// Fitted.
    pub fit: Vec<Series>,
    /// Never fitted. Rows of weight 0 run the simulation in.
    pub hold_out: Vec<Series>,
    /// Rows of all records, those that are not used included.
    pub rows: usize,
    /// The records.
    pub records: Vec<Used>,
    /// Of which of the records each series is a part.
    pub of_record: Sides<Vec<usize>>,
    /// By how many s the time of each record, as the model sees it, was shifted so that what hums in all of them is in phase.
    pub clocks: Vec<f64>,
    /// Whether all of them are static sweeps: see [`Record::is_static`].
    pub is_static: bool,
    /// What their bench is taken to be, where that is not what most are.
    pub bench: Vec<String>,
    /// How records begin, where that is not as the model has it, in words.
    pub beginnings: Vec<String>,
    /// The noise that the inputs of each fitted series had before they were smoothed; empty where none was.
    pub input_noise: Vec<Input<f64>>,
    /// What the oil was at.
    pub conditions: Conditions,
    /// What the rows show that the command does between two of them, whatever a model leaves: where what is fitted answers a jump by the
    /// row that has it, it is not held.
    pub shown_hold: Option<Hold>,
    /// The jumps of the commands that were placed between rows.
    pub placed_jumps: PlacedJumps,
}

impl Measurements {
    /// All of `records` are fitted where there are records to hold out; otherwise the end of each is held out, and of a
    /// static sweep pieces all along it, so that both directions are in what is fitted and in what is held out.
    ///
    /// # Errors
    /// A record lacks a channel that the structure needs, or has it in another unit.
    pub fn new(
        records: &[Record],
        hold_out: &[Record],
        cut: Cut,
        structure: &Structure,
        rate: f64,
    ) -> Result<Self> {
        let rows = records.iter().chain(hold_out).map(Record::samples).sum();
        let share = (cut.rows as f64 / rows as f64).min(1.0);
        let mut result = Self {
            fit: Vec::new(),
            hold_out: Vec::new(),
            rows,
            records: Vec::new(),
            of_record: Sides::default(),
            clocks: vec![0.0; records.len() + hold_out.len()],
            is_static: records.iter().all(Record::is_static),
            bench: remarks(structure, records),
            beginnings: Vec::new(),
            input_noise: Vec::new(),
            conditions: Conditions::of(&records.iter().chain(hold_out).collect::<Vec<_>>()),
            shown_hold: None,
            placed_jumps: PlacedJumps::default(),
        };
        let mut add = |record: &Record, fitted: usize| -> Result<()> {
            let whole = Series::from_record(record, structure)?;
            let mut used = Used {
                name: record.name.clone(),
                path: record.path.clone(),
                sha256: record.sha256.clone(),
                rows: record.samples(),
                fitted: 0,
                held_out: 0,
            };
            let number = result.records.len();
            let split = (1..record.samples()).contains(&fitted);
            if split && share == 1.0 && record.is_static() {
                let held = held_in_turn(&record.command().values, cut.hold_out);
                used.held_out = held.iter().filter(|&&held| held).count();
                used.fitted = record.samples() - used.held_out;
                result.fit.push(counting(&whole, rate, |row| !held[row]));
                result
                    .hold_out
                    .push(counting(&whole, rate, |row| held[row]));
                result.of_record.fit.push(number);
                result.of_record.hold_out.push(number);
                result.records.push(used);
                return Ok(());
            }
            let stretches = match share < 1.0 {
                true => {
                    let command = &record.command().values;
                    let wanted = (command.len() as f64 * share) as usize;
                    stretches(command, 0..command.len(), wanted, STRETCH, fitted)
                }
                false => whole_record(record.samples(), fitted),
            };
            for stretch in stretches {
                let held = stretch.counts.start >= fitted;
                *match held {
                    true => &mut used.held_out,
                    false => &mut used.fitted,
                } += stretch.counts.len();
                let mut series = stretch.of(&whole);
                series.set_steps(rate, 1);
                let (side, of_record) = match held {
                    true => (&mut result.hold_out, &mut result.of_record.hold_out),
                    false => (&mut result.fit, &mut result.of_record.fit),
                };
                side.push(series);
                of_record.push(number);
            }
            result.records.push(used);
            Ok(())
        };
        let all_fitted = !hold_out.is_empty();
        for record in records {
            let fitted = match all_fitted {
                true => record.samples(),
                false => record.split(cut.hold_out),
            };
            add(record, fitted)?;
        }
        for record in hold_out {
            add(record, 0)?;
        }
        result.shown_hold = answer_at_once(&result.fit, structure).then_some(Hold::Interpolated);
        Ok(result)
    }

    /// Lets the first of these rows of each series run the simulation in; none where there are zero.
    pub(super) fn run_in(&mut self, rows: &Sides<Vec<usize>>) {
        let fit = self.fit.iter_mut().zip(&self.of_record.fit).zip(&rows.fit);
        let hold_out = self.hold_out.iter_mut().zip(&self.of_record.hold_out);
        let hold_out = hold_out.zip(&rows.hold_out);
        let both = fit
            .map(|one| (one, false))
            .chain(hold_out.map(|one| (one, true)));
        for (((series, &record), &rows), held) in both.filter(|((_, rows), _)| **rows > 0) {
            let first = first_counting(series);
            let compared = counted(&series.samples[first..rows]);
            for sample in &mut series.samples[first..rows] {
                sample.weight = 0.0;
            }
            let used = &mut self.records[record];
            let count = match held {
                true => &mut used.held_out,
                false => &mut used.fitted,
            };
            *count -= compared;
            let begins = format!("{} begins in motion", series.name);
            self.beginnings.retain(|known| !known.starts_with(&begins));
            let seconds = series.time[rows] - series.time[0];
            self.beginnings.push(format!(
                "{begins}: its first {seconds:.3} s run the simulation in, and nothing is compared with them"
            ));
        }
    }

    /// Shifts the clock of a record: see [`Series::shift_clock`].
    pub(super) fn shift_clock(&mut self, record: usize, seconds: f64) {
        self.clocks[record] += seconds;
        let fit = self.fit.iter_mut().zip(&self.of_record.fit);
        let hold_out = self.hold_out.iter_mut().zip(&self.of_record.hold_out);
        let own = fit.chain(hold_out).filter(|(_, of)| **of == record);
        own.for_each(|(series, _)| series.shift_clock(seconds));
    }

    /// The rows by which effects are chosen. What was chosen is fitted to all.
    pub(super) fn chosen_by(&self) -> Sides<Vec<Series>> {
        let cut = |records: &[Series]| {
            let stretches = self.choosing_stretches(records);
            stretches.map(|(record, one)| one.of(record)).collect()
        };
        Sides {
            fit: cut(&self.fit),
            hold_out: cut(&self.hold_out),
        }
    }

    /// How many of the rows that count effects are chosen by.
    pub fn choosing(&self) -> usize {
        let count = |records: &[Series]| -> usize {
            let stretches = self.choosing_stretches(records);
            let rows = stretches.map(|(record, one)| counted(&record.samples[one.counts]));
            rows.sum()
        };
        count(&self.fit) + count(&self.hold_out)
    }

    /// The stretches of these `records`, one side's, by which effects are chosen.
    fn choosing_stretches<'a>(
        &self,
        records: &'a [Series],
    ) -> impl Iterator<Item = (&'a Series, Stretch)> {
        let most = match self.is_static {
            true => usize::MAX,
            false => CHOSEN_BY,
        };
        lively(records, most, STRETCH)
    }

    /// Rows that count, fitted and held out.
    pub fn used(&self) -> usize {
        let all = self.fit.iter().chain(&self.hold_out);
        all.map(|one| counted(&one.samples)).sum()
    }
}

/// How many of these rows count.
fn counted(rows: &[Sample]) -> usize {
    rows.iter().filter(|row| row.weight > 0.0).count()
}

/// The first row that counts.
pub(super) fn first_counting(series: &Series) -> usize {
    let first = series.samples.iter().position(|sample| sample.weight > 0.0);
    first.unwrap_or(series.samples.len())
}

/// Where each record, or each piece of one, begins among the rows that count.
pub(super) fn starts<'a>(records: impl IntoIterator<Item = &'a Series>) -> Vec<usize> {
    let mut count = 0;
    let begin = |piece: Vec<usize>| {
        let begin = count;
        count += piece.len();
        begin
    };
    let pieces = records.into_iter().flat_map(Series::pieces);
    pieces.map(begin).collect()
}

/// Rows of a record: those from `run_in` on are simulated, those in `counts` are compared.
#[derive(Debug, Clone, PartialEq)]
struct Stretch {
    run_in: usize,
    counts: Range<usize>,
}

impl Stretch {
    fn of(&self, whole: &Series) -> Series {
        let rows = self.run_in..self.counts.end;
        let mut series = Series {
            name: whole.name.clone(),
            time: whole.time[rows.clone()].to_vec(),
            measured: whole.measured,
            samples: whole.samples[rows].to_vec(),
        };
        for sample in &mut series.samples[..self.counts.start - self.run_in] {
            sample.weight = 0.0;
        }
        series
    }
}

/// The rows of the fitted `records` on which effects are sought.
pub(super) fn sought_on(records: &[Series]) -> Vec<Series> {
    let (most, stretch) = SOUGHT_ON;
    let stretches = lively(records, most, stretch);
    stretches.map(|(record, one)| one.of(record)).collect()
}

/// Lively stretches of the long ones of `records`, of about so many rows each, and the others whole, such that all together have
/// about `most` rows that count, or one of each.
fn lively(
    records: &[Series],
    most: usize,
    stretch: usize,
) -> impl Iterator<Item = (&Series, Stretch)> {
    let rows = |record: &Series| first_counting(record)..record.samples.len();
    let all: usize = records.iter().map(|record| rows(record).len()).sum();
    let share = most as f64 / all as f64;
    records.iter().flat_map(move |record| {
        let counts = rows(record);
        let some = match share >= 1.0 || counts.len() < 2 * stretch {
            true => vec![Stretch { run_in: 0, counts }],
            false => {
                let wanted = ((counts.len() as f64 * share) as usize).max(stretch);
                let samples = record.samples.iter();
                let command: Vec<f64> = samples.map(|row| row.input.command).collect();
                stretches(&command, counts.clone(), wanted, stretch, counts.end)
            }
        };
        some.into_iter().map(move |stretch| (record, stretch))
    })
}

/// A record of `rows` rows, of which the first `fitted` are fitted: the others are run into from its beginning.
fn whole_record(rows: usize, fitted: usize) -> Vec<Stretch> {
    let stretch = |counts: Range<usize>| Stretch { run_in: 0, counts };
    let both = [0..fitted, fitted..rows].map(stretch);
    let kept = |one: &Stretch| !one.counts.is_empty();
    both.into_iter().filter(kept).collect()
}

/// `whole` with the rows that count; the others are simulated, too.
fn counting(whole: &Series, rate: f64, counts: impl Fn(usize) -> bool) -> Series {
    let mut series = whole.clone();
    for (row, sample) in series.samples.iter_mut().enumerate() {
        if !counts(row) {
            sample.weight = 0.0;
        }
    }
    series.set_steps(rate, 1);
    series
}

/// Which rows of a sweep with this `command` are held out: the same `share` of every way from one reversal to the next, in
/// pieces.
fn held_in_turn(command: &[f64], share: f64) -> Vec<bool> {
    let reversals = reversals(command);
    let mut held = Vec::with_capacity(command.len());
    for way in reversals.windows(2) {
        let rows = way[1] - way[0];
        let pieces = (rows / SHORTEST_PIECE).clamp(1, PIECES);
        for row in 0..rows {
            let piece = (row * pieces / rows) as f64;
            held.push(((piece + 1.0) * share).floor() > (piece * share).floor());
        }
    }
    held
}

/// Stretches of about `stretch` rows all along those `rows` of a record with this `command` that count, which have about as many of
/// them as are `wanted`: of each of equal sections the one in which the command moves most. None lies on both sides of row `fitted`,
/// and either side that has rows has one.
fn stretches(
    command: &[f64],
    rows: Range<usize>,
    wanted: usize,
    stretch: usize,
    fitted: usize,
) -> Vec<Stretch> {
    let sides = usize::from(fitted > rows.start) + usize::from(fitted < rows.end);
    let count = (wanted / stretch).clamp(sides, STRETCHES);
    let length = (wanted / count).max(1);
    let travel: Vec<f64> = std::iter::once(0.0)
        .chain(command.windows(2).scan(0.0, |sum, pair| {
            *sum += (pair[1] - pair[0]).abs();
            Some(*sum)
        }))
        .collect();
    let [fitted, held] = [rows.start..fitted, fitted..rows.end];
    let later = (count as f64 * held.len() as f64 / rows.len() as f64).round() as usize;
    let later = match (fitted.is_empty(), held.is_empty()) {
        (true, _) => count,
        (_, true) => 0,
        _ => later.clamp(1, count - 1),
    };
    let liveliest = |section: Range<usize>| {
        let last = section.end.saturating_sub(length).max(section.start);
        let moved = |begin: usize| travel[(begin + length).min(section.end) - 1] - travel[begin];
        let begins = (section.start..=last).step_by((length / RUN_IN).max(1));
        let livelier = |best, next| {
            if moved(next) > moved(best) {
                next
            } else {
                best
            }
        };
        let begin = begins.reduce(livelier).unwrap_or(section.start);
        Stretch {
            run_in: begin.saturating_sub(length / RUN_IN),
            counts: begin..(begin + length).min(section.end),
        }
    };
    [(fitted, count - later), (held, later)]
        .into_iter()
        .flat_map(|(side, count)| sections(side, count))
        .map(liveliest)
        .collect()
}

/// `rows` in `count` sections of equal length.
fn sections(rows: Range<usize>, count: usize) -> impl Iterator<Item = Range<usize>> {
    let edge = move |i: usize| rows.start + rows.len() * i / count.max(1);
    (0..count)
        .map(move |i| edge(i)..edge(i + 1))
        .filter(|section| !section.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Input, Outputs};
    use proptest::prelude::*;

    #[test]
    fn of_long_records_stretches_all_along_choose_and_of_short_ones_all() {
        let record = |rows: usize, run_in: usize| {
            let sample = |row: usize| Sample {
                input: Input {
                    command: (row as f64 / 100.0).sin(),
                    ..Input::default()
                },
                weight: f64::from(u8::from(row >= run_in)),
                ..Sample::default()
            };
            Series {
                name: "run".into(),
                measured: Outputs::all(true),
                time: (0..rows).map(|row| row as f64).collect(),
                samples: (0..rows).map(sample).collect(),
            }
        };
        let cut = |records: &[Series]| -> Vec<Series> {
            let stretches = lively(records, CHOSEN_BY, STRETCH);
            stretches.map(|(record, one)| one.of(record)).collect()
        };
        let some = cut(&[record(60_000, 0), record(90_000, 30_000), record(1000, 0)]);
        let counts: Vec<usize> = some.iter().map(|one| counted(&one.samples)).collect();
        assert_eq!(counts, [4958, 4958, 4958, 4958, 1000]);
        let begins: Vec<f64> = some[..4]
            .iter()
            .map(|one| one.time[first_counting(one)])
            .collect();
        for (begin, half) in begins.iter().zip([0.0, 30_000.0, 30_000.0, 60_000.0]) {
            assert!((half..half + 30_000.0).contains(begin), "{begins:?}");
        }
        // One that runs in over rows that are not its own, too.
        assert!(some[2..4].iter().all(|one| first_counting(one) >= 1239));
        assert!(
            some[2..4]
                .iter()
                .all(|one| one.time[first_counting(one)] >= 30_000.0)
        );
        assert_eq!(cut(&[record(20_000, 0)])[0].samples.len(), 20_000);
        let few = sought_on(&[record(7000, 0), record(1000, 0)]);
        let counts: Vec<usize> = few.iter().map(|one| counted(&one.samples)).collect();
        assert_eq!(counts, [700, 700, 700, 1000]);
        assert_eq!(sought_on(&[record(2400, 0)])[0].samples.len(), 2400);
        // Of many that are long one each.
        let many = sought_on(&vec![record(4096, 0); 5]);
        assert!(many.iter().all(|one| counted(&one.samples) == 600));
    }

    #[test]
    fn both_directions_of_a_sweep_are_fitted_and_held_out() {
        let there = (0..=100).map(f64::from);
        let command: Vec<f64> = there.clone().chain(there.rev()).collect();
        assert_eq!(reversals(&command), [0, 100, 202]);
        let held = held_in_turn(&command, 0.3);
        assert_eq!(held.len(), command.len());
        for way in [0..101, 101..202] {
            for upper in [false, true] {
                let rows = || way.clone().filter(|&row| (command[row] > 50.0) == upper);
                let out = rows().filter(|&row| held[row]).count();
                assert!(
                    out >= 9 && rows().count() - out >= 30,
                    "{way:?} {upper}: {out}"
                );
            }
        }
        let share = held.iter().filter(|&&held| held).count() as f64 / 202.0;
        assert!((share - 0.3).abs() < 0.02, "{share}");
        // What trembles does not turn.
        let trembling: Vec<f64> = (0..200)
            .map(|k| f64::from(k) + 2.0 * f64::from(k % 2))
            .collect();
        assert_eq!(reversals(&trembling), [0, 200]);
    }

    proptest! {
        #[test]
        fn stretches_lie_all_along_a_record_and_on_both_sides_of_the_split(
            rows in (1.0..6.5f64).prop_map(|power| 10f64.powf(power) as usize),
            share in 1e-4..0.99f64,
            held in 0.05..0.9f64,
        ) {
            let fitted = ((1.0 - held) * rows as f64).round() as usize;
            let command: Vec<f64> = (0..rows).map(|row| (0.01 * row as f64).sin()).collect();
            let wanted = (rows as f64 * share) as usize;
            let all = stretches(&command, 0..rows, wanted, STRETCH, fitted);
            let used: usize = all.iter().map(|one| one.counts.len()).sum();
            prop_assert!(used as f64 <= (share * rows as f64).max(2.0), "{used}");
            prop_assert!(used as f64 >= 0.4 * (share * rows as f64).floor(), "{used} of {rows}");
            prop_assert!(all.iter().any(|one| one.counts.end <= fitted));
            prop_assert!(all.iter().any(|one| one.counts.start >= fitted));
            for one in &all {
                prop_assert!(one.run_in <= one.counts.start && !one.counts.is_empty());
                prop_assert!(one.counts.start >= fitted || one.counts.end <= fitted);
            }
            for pair in all.windows(2) {
                prop_assert!(pair[0].counts.end <= pair[1].counts.start);
            }
        }
    }

    #[test]
    fn a_stretch_lies_where_the_command_moves() {
        // At rest but for a step near the end of each side.
        let moved = |row: usize| f64::from(u8::from((6000..6100).contains(&row) || row >= 9500));
        let command: Vec<f64> = (0..10_000).map(moved).collect();
        let all = stretches(&command, 0..10_000, 1000, STRETCH, 7000);
        assert_eq!(all.len(), 2);
        let alive = |one: &Stretch| {
            let rows = &command[one.counts.clone()];
            rows.iter().any(|value| *value != rows[0])
        };
        assert!(all.iter().all(alive), "{all:?}");
    }

    #[test]
    fn a_record_that_is_short_enough_is_used_whole() {
        assert_eq!(
            whole_record(10, 7),
            [
                Stretch {
                    run_in: 0,
                    counts: 0..7
                },
                Stretch {
                    run_in: 0,
                    counts: 7..10
                }
            ]
        );
        assert_eq!(
            whole_record(10, 10),
            [Stretch {
                run_in: 0,
                counts: 0..10
            }]
        );
        assert_eq!(
            whole_record(10, 0),
            [Stretch {
                run_in: 0,
                counts: 0..10
            }]
        );
    }
}
