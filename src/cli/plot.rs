//! Points on two axes, drawn with characters.

use super::table::number;

/// Columns and rows of characters between the axes.
const SIZE: [usize; 2] = [60, 13];
/// Dots that a character can tell apart: a braille cell's.
const DOTS: [usize; 2] = [2, 4];
/// Width of the labels of the vertical axis.
const MARGIN: usize = 10;

/// `points` above axes called `names`, in 71 columns and 17 rows; both axes contain zero. With `braille` in
/// characters of 2 x 4 dots, otherwise in plain ones that tell their upper half from their lower half.
pub(super) fn scatter(points: &[[f64; 2]], names: [&str; 2], braille: bool) -> String {
    let [columns, rows] = SIZE;
    let column = |i: usize| points.iter().map(move |point| point[i]);
    let (x, y) = (Axis::new(column(0), 0.0), Axis::new(column(1), 0.05));
    let across = |value: f64| x.place(value, columns * DOTS[0]);
    let down = |value: f64| rows * DOTS[1] - 1 - y.place(value, rows * DOTS[1]);

    let mut cells = vec![[0u8; SIZE[0]]; rows];
    for point in points {
        let (i, j) = (across(point[0]), down(point[1]));
        cells[j / DOTS[1]][i / DOTS[0]] |= dot(i % DOTS[0], j % DOTS[1]);
    }
    let zero = [across(0.0) / DOTS[0], down(0.0) / DOTS[1]];
    let ticks: Vec<(usize, f64)> = y.ticks().map(|y| (down(y) / DOTS[1], y)).collect();

    let mut lines = vec![format!("{:MARGIN$} {}", "", names[1])];
    for (j, row) in cells.iter().enumerate() {
        let tick = ticks.iter().find(|tick| tick.0 == j);
        let mut line = format!(
            "{:>MARGIN$} |",
            tick.map_or(String::new(), |tick| number(tick.1))
        );
        line.extend(row.iter().enumerate().map(|(i, &dots)| match dots {
            0 if j == zero[1] => '-',
            0 if i == zero[0] && i > 0 => '|',
            0 => ' ',
            _ if braille => char::from_u32(0x2800 + u32::from(dots)).unwrap_or('*'),
            _ => plain(dots),
        }));
        lines.push(line.trim_end().to_owned());
    }
    lines.push(format!("{:MARGIN$} +{}", "", "-".repeat(columns)));
    let mut labels = String::new();
    for tick in x.ticks() {
        let label = number(tick);
        let middle = MARGIN + 2 + across(tick) / DOTS[0];
        let begin = middle.saturating_sub(label.len() / 2);
        let end = MARGIN + 2 + columns;
        let begin = begin.min(end.saturating_sub(label.len()));
        if labels.is_empty() || labels.len() < begin {
            labels = format!("{labels:begin$}{label}");
        }
    }
    lines.push(labels);
    lines.push(format!("{:MARGIN$}  {:^columns$}", "", names[0]));
    lines
        .iter()
        .map(|line| line.trim_end())
        .collect::<Vec<_>>()
        .join("\n")
}

/// The bit of a dot of a braille character (Unicode's block of braille patterns).
fn dot(i: usize, j: usize) -> u8 {
    [[0x01, 0x02, 0x04, 0x40], [0x08, 0x10, 0x20, 0x80]][i][j]
}

fn plain(dots: u8) -> char {
    let upper = [dot(0, 0), dot(0, 1), dot(1, 0), dot(1, 1)];
    let upper: u8 = upper.iter().sum();
    match (dots & upper != 0, dots & !upper != 0) {
        (true, false) => '\'',
        (false, _) => '.',
        (true, true) => ':',
    }
}

/// A range between two ticks.
struct Axis {
    /// Ticks lie at the multiples of this, from the first to the second.
    step: f64,
    first: i32,
    last: i32,
}

impl Axis {
    /// The axis that holds zero and all `values`, with this share of their range free beyond them.
    fn new(values: impl Iterator<Item = f64>, free: f64) -> Self {
        let (low, high) = values.fold((0.0_f64, 0.0_f64), |(low, high), value| {
            (low.min(value), high.max(value))
        });
        let span = match high - low {
            0.0 => 1.0,
            span => span,
        };
        let decade = 10f64.powf((span / 5.0).log10().floor());
        let steps = [1.0, 2.0, 5.0, 10.0].map(|n| n * decade);
        let step = steps.into_iter().find(|step| 5.0 * step >= span * 0.999);
        let step = step.unwrap_or(10.0 * decade);
        // What only rounding takes beyond a tick stays at it.
        let out = |end: f64| match end {
            0.0 => 0,
            _ => ((end.abs() + free * span) / step - 1e-6).ceil() as i32,
        };
        let (first, last) = (-out(low), out(high));
        Self {
            step,
            first,
            last: last.max(first + 1),
        }
    }

    fn ticks(&self) -> impl Iterator<Item = f64> {
        (self.first..=self.last).map(|n| f64::from(n) * self.step)
    }

    /// In which of `count` equal parts a value is.
    fn place(&self, value: f64, count: usize) -> usize {
        let share = (value / self.step - f64::from(self.first)) / f64::from(self.last - self.first);
        ((share * count as f64) as usize).min(count - 1)
    }
}
