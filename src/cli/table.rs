//! Tables and numbers on the terminal.

use comfy_table::{CellAlignment, Table, presets};

/// A table without lines, below its heads. The first column is aligned to the left, the others to the right.
pub(super) fn table<H: AsRef<str>>(
    heads: &[H],
    rows: impl IntoIterator<Item = Vec<String>>,
) -> String {
    let mut table = Table::new();
    let heads: Vec<String> = heads.iter().map(|head| head.as_ref().to_owned()).collect();
    table
        .load_style(presets::NOTHING)
        .add_row(heads)
        .add_rows(rows);
    for (i, column) in table.column_iter_mut().enumerate() {
        column.set_padding((0, 2));
        if i > 0 {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    table.trim_fmt()
}

/// `value` to five significant digits, as short as that allows.
pub(super) fn number(value: f64) -> String {
    let magnitude = value.abs();
    if magnitude == 0.0 {
        return "0".into();
    }
    if !(1e-4..1e7).contains(&magnitude) {
        return format!("{value:.3e}");
    }
    let decimals = (4 - magnitude.log10().floor() as i32).max(0) as usize;
    let text = format!("{value:.decimals$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').into(),
        false => text,
    }
}
