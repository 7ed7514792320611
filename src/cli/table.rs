//! Tables and numbers on the terminal.

use comfy_table::{CellAlignment, Table, presets};
pub(super) use servobee::report::number;

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
