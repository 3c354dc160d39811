//! Tables for people.

use comfy_table::{CellAlignment, Table, presets};

/// A table with a heading, without lines. Columns whose heading ends in `#` hold numbers.
pub fn table<'a>(heading: impl IntoIterator<Item = &'a str>) -> Table {
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    let heading: Vec<&str> = heading.into_iter().collect();
    table.set_header(heading.iter().map(|text| text.trim_end_matches('#')));
    for (column, text) in table.column_iter_mut().zip(heading) {
        column.set_padding((0, 2));
        if text.ends_with('#') {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    table
}
