//! Comments that say something to the tools: where their words stand, and the two that count before anything is assembled.

use crate::problem::Span;
use crate::source::Source;

/// What begins a pragma behind the `//`.
const SIGN: &str = "gradus:";

/// How far down a file may name its module.
const HEAD: usize = 20;

/// The word that keeps the assembler from appending a STOP.
pub(crate) const NO_STOP: &str = "no-stop";

/// True if one of the comments says that no STOP is appended.
pub(crate) fn appends_no_stop(comments: &[Span], sources: &[Source]) -> bool {
    let says = |comment: &Span| {
        let source = sources.get(comment.source)?;
        Some(source.slice(words(source, *comment)?) == NO_STOP)
    };
    comments.iter().any(|comment| says(comment) == Some(true))
}

/// The module that a file names in its first lines.
pub fn module_of(text: &str) -> Option<&str> {
    let comments = text.lines().take(HEAD).filter_map(|line| line.split_once("//"));
    let pragmas = comments.filter_map(|(_, comment)| comment.trim().strip_prefix(SIGN));
    pragmas.filter_map(|words| words.trim().strip_prefix("module ")).map(str::trim).next()
}

/// What stands behind the sign of a pragma.
pub(crate) fn words(source: &Source, comment: Span) -> Option<Span> {
    let text = source.slice(comment);
    let rest = text.strip_prefix("//")?.trim_start().strip_prefix(SIGN)?.trim();
    let start = comment.start + (rest.as_ptr().addr() - text.as_ptr().addr());
    Some(Span { start, end: start + rest.len(), ..comment })
}
