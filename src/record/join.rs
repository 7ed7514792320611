//! One record from the files of several loggers.

use super::conversion::Conversion;
use super::interval::median_interval;
use super::mapping::known;
use super::reading::Reading;
use super::table::Table;
use super::target::Target;
use super::text::count;
use crate::{Error, Result};

/// Times of one row may differ by this share of the interval.
const TOLERANCE: f64 = 0.1;

/// The columns of both, of the rows that belong together: those of the same time, or where one has no times, of the same
/// number. Rows before the later of two beginnings and behind the earlier of two ends are left out.
///
/// # Errors
/// Times between these that the other does not have, or of which none is; without times unequal numbers of rows.
pub(super) fn join(one: Table, other: Table, reading: &Reading) -> Result<Table> {
    let time = |table: &Table| {
        let known = known(table, &reading.mappings);
        known.get(&Target::Time).copied()
    };
    let (times, other_times) = (time(&one), time(&other));
    let (rows, said) = match (times, other_times) {
        (Some(times), Some(other_times)) => by_time(&one, times, &other, other_times)?,
        _ => one_by_one(&one, &other)?,
    };
    let [of_one, of_other]: [Vec<usize>; 2] = rows;
    let mut joined = one.of_rows(&of_one);
    let mut more = other.of_rows(&of_other);
    if let (Some(_), Some((time, _))) = (times, other_times) {
        more.columns.remove(time);
    }
    joined.joined.push((joined.columns.len(), more.origin));
    joined.columns.extend(more.columns);
    joined.others.extend(more.others);
    joined.notes.push(said);
    joined.path = format!("{}+{}", one.path, other.path);
    Ok(joined)
}

/// Rows of both that belong together, and what to say of it.
type Pairs = ([Vec<usize>; 2], String);

fn one_by_one(one: &Table, other: &Table) -> Result<Pairs> {
    let rows = one.rows();
    if other.rows() != rows {
        return Err(Error::input(
            &other.path,
            format!(
                "has {} where {} has {rows}, and no times say which belong together",
                count(other.rows(), "row"),
                one.path
            ),
            "give both files a column of time, which --map may name, or export the same rows",
        ));
    }
    let all: Vec<usize> = (0..rows).collect();
    let said = format!(
        "joined {} one by one, as not both files have times",
        count(rows, "row")
    );
    Ok(([all.clone(), all], said))
}

fn by_time(
    one: &Table,
    (index, conversion): (usize, Conversion),
    other: &Table,
    (other_index, other_conversion): (usize, Conversion),
) -> Result<Pairs> {
    let times = one.rising_values(index, conversion)?;
    let mut other_times = other.rising_values(other_index, other_conversion)?;
    let moments = (
        &one.columns[index].moments,
        &other.columns[other_index].moments,
    );
    let shift = match moments {
        (None, None) => Some(0.0),
        (Some(moments), Some(later)) => moments.until(later),
        _ => None,
    };
    let Some(shift) = shift else {
        return Err(Error::input(
            other.header_place(other_index),
            format!("holds times of another kind than {}", one.path),
            "export both with times of one kind: s, times of day, or dates with times",
        ));
    };
    other_times.iter_mut().for_each(|time| *time += shift);

    let tolerance = TOLERANCE * median_interval(&times).min(median_interval(&other_times));
    let begin = times[0].max(other_times[0]) - tolerance;
    let end = times[times.len() - 1].min(other_times[other_times.len() - 1]) + tolerance;
    let within = |times: &[f64]| -> Vec<usize> {
        let within = |row: &usize| (begin..=end).contains(&times[*row]);
        (0..times.len()).filter(within).collect()
    };
    let (rows, other_rows) = (within(&times), within(&other_times));
    let remedy = "let both loggers sample at the same times, or resample one of the exports at the times of the other";
    let pairs = rows.iter().zip(&other_rows);
    let mut apart =
        pairs.filter(|(row, other)| (times[**row] - other_times[**other]).abs() > tolerance);
    if let Some((&row, &other_row)) = apart.next() {
        // The earlier of the two is the one that the other file lacks.
        let (table, place, time) = match times[row] < other_times[other_row] {
            true => (other, one.place(row, index), times[row]),
            false => (
                one,
                other.place(other_row, other_index),
                other_times[other_row],
            ),
        };
        return Err(Error::input(
            place,
            format!(
                "at {time} s there is no row of {} within {tolerance:.3e} s",
                table.path
            ),
            remedy,
        ));
    }
    if rows.len() != other_rows.len() || rows.len() < 2 {
        return Err(Error::input(
            &other.path,
            format!(
                "has {} in the time of {}, which has {} there",
                count(other_rows.len(), "row"),
                one.path,
                rows.len()
            ),
            remedy,
        ));
    }
    let left = times.len() + other_times.len() - 2 * rows.len();
    let left = match left {
        0 => String::new(),
        left => format!(
            ", and left out {} that only one of them has",
            count(left, "row")
        ),
    };
    let said = format!(
        "joined {} whose times agree within {tolerance:.1e} s{left}",
        count(rows.len(), "row")
    );
    Ok(([rows, other_rows], said))
}
