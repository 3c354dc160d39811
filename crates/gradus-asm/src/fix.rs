//! Changes of the text that remove problems.

use crate::problem::{Edit, Problem};
use crate::source::Source;

/// A source text that has been changed.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Changed {
    /// Index of the source.
    pub source: usize,
    /// Its new text.
    pub text: String,
    /// How many fixes it has got.
    pub fixes: usize,
}

/// Applies the fixes of problems, `unsafe_too` also those that change the program's bytes. Where two overlap the first one wins;
/// another run takes the rest. Built-in files are left alone.
pub fn apply_fixes(problems: &[Problem], sources: &[Source], unsafe_too: bool) -> Vec<Changed> {
    let fixes = problems.iter().filter_map(|problem| problem.fix.as_deref()).filter(|fix| fix.safe || unsafe_too);
    let mut taken: Vec<&Edit> = Vec::new();
    let mut counts = vec![0; sources.len()];
    for fix in fixes {
        let foreign = |edit: &Edit| sources.get(edit.span.source).is_none_or(|source| source.built_in);
        let clashes = |edit: &Edit| taken.iter().any(|other| overlap(other, edit));
        if !fix.edits.is_empty() && !fix.edits.iter().any(|edit| foreign(edit) || clashes(edit)) {
            counts[fix.edits[0].span.source] += 1;
            taken.extend(&fix.edits);
        }
    }
    let changed = (0..sources.len()).filter(|source| taken.iter().any(|edit| edit.span.source == *source));
    changed
        .map(|source| Changed { source, text: edited(&sources[source].text, source, &taken), fixes: counts[source] })
        .collect()
}

/// True if two edits touch the same text, or insert at the same place.
fn overlap(a: &Edit, b: &Edit) -> bool {
    let (a, b) = (a.span, b.span);
    a.source == b.source && (a.start == b.start || a.start < b.end && b.start < a.end)
}

fn edited(text: &str, source: usize, edits: &[&Edit]) -> String {
    let mut edits: Vec<_> = edits.iter().filter(|edit| edit.span.source == source).collect();
    edits.sort_by_key(|edit| edit.span.start);
    let (mut new, mut at) = (String::with_capacity(text.len()), 0);
    for edit in edits {
        new.push_str(&text[at..edit.span.start]);
        new.push_str(&edit.text);
        at = edit.span.end;
    }
    new.push_str(&text[at..]);
    new
}
