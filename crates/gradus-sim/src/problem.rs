//! What is wrong with a bench file, and where.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// What is wrong with a bench file. Prints as `12: axis.0.travel.home.at: expected a length`, to be put behind the name of
/// the file and a colon.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("{line}: {key}{}{message}", if key.is_empty() { "" } else { ": " })]
pub struct Problem {
    /// Line of the file, from 1.
    pub line: usize,
    /// The key with those above it. Empty where the file is no TOML, and when a key is missing at the top.
    pub key: String,
    /// What is wrong, and what is expected.
    pub message: String,
}

/// What is wrong with some bytes of the text.
pub(crate) struct Misfit {
    /// Where it begins; `None` at the end of the text.
    start: Option<usize>,
    message: String,
}

impl Misfit {
    pub(crate) fn new(span: Option<Range<usize>>, message: impl Into<String>) -> Self {
        Self { start: span.map(|span| span.start), message: message.into() }
    }

    /// Finds the line and the key.
    pub(crate) fn locate(self, text: &str) -> Problem {
        let start = self.start.unwrap_or(text.len());
        let line = 1 + text.bytes().take(start).filter(|byte| *byte == b'\n').count();
        let key = DeTable::parse(text).ok().and_then(|table| key_in_table(table.get_ref(), start));
        Problem { line, key: key.unwrap_or_default(), message: self.message }
    }
}

/// The key of what is at an offset of the text, with those above it.
fn key_in_table(table: &DeTable, offset: usize) -> Option<String> {
    table.iter().find_map(|(key, value)| {
        let below = key_in_value(value.get_ref(), offset);
        let here = || (key.span().contains(&offset) || holds(value, offset)).then(|| key.get_ref().to_string());
        below.map(|below| format!("{}.{below}", key.get_ref())).or_else(here)
    })
}

fn key_in_value(value: &DeValue, offset: usize) -> Option<String> {
    match value {
        DeValue::Table(table) => key_in_table(table, offset),
        DeValue::Array(values) => values.iter().find_map(|value| key_in_value(value.get_ref(), offset)),
        _ => None,
    }
}

/// The span of a table with a heading is the heading, so that the elements of an array of such tables have their own.
fn holds(value: &Spanned<DeValue>, offset: usize) -> bool {
    let elements = value.get_ref().as_array().into_iter().flatten();
    value.span().contains(&offset) || elements.into_iter().any(|element| holds(element, offset))
}
