//! Tables for people.

use comfy_table::{CellAlignment, ContentArrangement, Table, presets};

use crate::terminal;

/// A table with a heading, without lines. Columns whose heading ends in `#` hold numbers.
pub fn table<'a>(heading: impl IntoIterator<Item = &'a str>) -> Table {
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    if let Some(width) = terminal::width() {
        // Cells break rather than lines where the terminal is narrow.
        table.set_content_arrangement(ContentArrangement::Dynamic).set_width(u16::try_from(width).unwrap_or(u16::MAX));
    }
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
