//! The cells of a line, and what they look like.

use crate::record::moment::Moment;
use std::borrow::Cow;

/// What may stand between cells.
pub(super) const DELIMITERS: [char; 6] = [',', ';', '\t', '|', ':', ' '];

/// The cells of a line without blanks and quotes around them; `None` where a quote is left open or has text behind it.
///
/// Where blanks separate cells, any number of them does, and a unit in brackets belongs to the name before it.
pub(super) fn split(line: &str, delimiter: char) -> Option<Vec<Cow<'_, str>>> {
    if delimiter == ' ' {
        return split_at_blanks(line);
    }
    let mut cells = Vec::new();
    let mut rest = line;
    loop {
        let quoted = rest.trim_start_matches(' ').strip_prefix('"');
        let (cell, after) = match quoted {
            Some(quoted) => unquote(quoted)?,
            None => {
                let end = rest.find(delimiter).unwrap_or(rest.len());
                (rest[..end].trim().into(), &rest[end..])
            }
        };
        cells.push(cell);
        match after.strip_prefix(delimiter) {
            Some(next) => rest = next,
            None if after.is_empty() => return Some(cells),
            None => return None,
        }
    }
}

fn split_at_blanks(line: &str) -> Option<Vec<Cow<'_, str>>> {
    let opens = |cell: &str| cell.starts_with('[') || cell.starts_with('(');
    let mut cells: Vec<Cow<'_, str>> = Vec::new();
    let mut rest = line.trim();
    while !rest.is_empty() {
        let (cell, after) = match rest.strip_prefix('"') {
            Some(quoted) => unquote(quoted)?,
            None => {
                let end = rest.find(' ').unwrap_or(rest.len());
                (rest[..end].into(), rest[end..].trim_start_matches(' '))
            }
        };
        match cells.last_mut() {
            Some(name) if opens(&cell) && !opens(name) => *name = format!("{name} {cell}").into(),
            _ => cells.push(cell),
        }
        rest = after;
    }
    Some(cells)
}

/// What stands before the closing quote, and what follows it and the blanks behind it.
fn unquote(quoted: &str) -> Option<(Cow<'_, str>, &str)> {
    let mut from = 0;
    let end = loop {
        let quote = from + quoted[from..].find('"')?;
        if !quoted[quote + 1..].starts_with('"') {
            break quote;
        }
        from = quote + 2;
    };
    let cell = quoted[..end].trim();
    let cell = if cell.contains('"') {
        cell.replace("\"\"", "\"").into()
    } else {
        cell.into()
    };
    Some((cell, quoted[end + 1..].trim_start_matches(' ')))
}

/// What a cell looks like before the decimal mark is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Look {
    Empty,
    Number,
    /// A time of day, perhaps with its date.
    Moment,
    Text,
    /// Digits that are no number, or bare marks: what is left where cells are split at the wrong marks.
    Debris,
}

/// What `cell` looks like if cells are separated by `delimiter`.
pub(super) fn look(cell: &str, delimiter: char) -> Look {
    let digit = |c: char| c.is_ascii_digit();
    let point = cell.parse::<f64>().is_ok();
    let comma = delimiter != ','
        && cell.starts_with(|c| digit(c) || c == '-' || c == '+')
        && cell.ends_with(digit)
        && cell.replacen(',', ".", 1).parse::<f64>().is_ok();
    match cell {
        "" => Look::Empty,
        _ if point || comma => Look::Number,
        _ if Moment::parse(cell).is_some() => Look::Moment,
        _ if is_date(cell) || cell.contains(char::is_alphabetic) => Look::Text,
        _ if cell.contains(digit) || cell.chars().all(|c| DELIMITERS.contains(&c)) => Look::Debris,
        _ => Look::Text,
    }
}

/// Whether a column called `name` holds comments: of the last one, LabVIEW writes no cell where there is none.
pub(super) fn is_comment(name: &str) -> bool {
    ["comment", "comments", "kommentar", "bemerkung"].contains(&name.to_lowercase().as_str())
}

/// A date, or what looks like a time of day.
fn is_date(cell: &str) -> bool {
    let twice = |mark| {
        let parts: Vec<&str> = cell.split(mark).collect();
        parts.len() == 3
            && parts
                .iter()
                .all(|part| part.contains(|c: char| c.is_ascii_digit()))
    };
    cell.chars()
        .all(|c| c.is_ascii_digit() || " :-/.,".contains(c))
        && (twice(':') || twice('-') || twice('/'))
}

/// The decimal mark of a cell that is a number with one.
pub(super) fn decimal_mark(cell: &str) -> Option<char> {
    let mark = cell.chars().find(|mark| matches!(mark, '.' | ','))?;
    cell.replace(',', ".")
        .parse::<f64>()
        .is_ok()
        .then_some(mark)
}

/// Whether the comma of `cell` could stand between thousands: `1,234` but not `0,234` or `1,23`.
pub(super) fn could_be_thousands(cell: &str) -> bool {
    let cell = cell.trim_start_matches(['-', '+']);
    let Some((before, behind)) = cell.split_once(',') else {
        return false;
    };
    (1..=3).contains(&before.len())
        && !before.starts_with('0')
        && before.chars().all(|c| c.is_ascii_digit())
        && behind.len() == 3
        && behind.chars().all(|c| c.is_ascii_digit())
}

/// The number in a cell.
pub(super) fn number(cell: &str, decimal: char) -> Option<f64> {
    match decimal {
        ',' if cell.contains('.') => None,
        ',' => cell.replace(',', ".").parse().ok(),
        _ => cell.parse().ok(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_told_apart_by_their_looks() {
        for (cell, delimiter, expected) in [
            ("", ';', Look::Empty),
            ("-1,5", ';', Look::Number),
            ("-1,5", ',', Look::Debris),
            ("1.5e-3", ',', Look::Number),
            ("NaN", ',', Look::Number),
            ("1,", ' ', Look::Debris),
            ("1.234,5", ';', Look::Debris),
            ("5\t1", ',', Look::Debris),
            (";", ' ', Look::Debris),
            ("12:30:05,25", ';', Look::Moment),
            ("2020-01-31 12:30", ';', Look::Text),
            ("-", ';', Look::Text),
            ("%", ';', Look::Text),
            ("x(1)", ';', Look::Text),
        ] {
            assert_eq!(look(cell, delimiter), expected, "{cell:?}");
        }
    }

    #[test]
    fn blanks_do_not_part_a_name_from_its_unit() {
        let cells = |line| split(line, ' ').unwrap();
        assert_eq!(cells(" time [s]   u (V) "), ["time [s]", "u (V)"]);
        assert_eq!(cells("[s] [V] \"a b\""), ["[s]", "[V]", "a b"]);
        assert_eq!(split("1 \"2", ' '), None);
    }
}
