//! Problems as text: file, line, column, the source line with a caret, and the hint.

use std::borrow::Cow;
use std::ops::Range;

use annotate_snippets::{AnnotationKind, Group, Level, Origin, Renderer, Snippet};

use crate::problem::{Note, Problem, Severity, Span};
use crate::source::Source;

/// Bytes of source text that are shown with a problem. Where its lines are longer, only the place is told.
const MOST_SHOWN: usize = 10_000;

/// How problems are drawn.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Style {
    /// Without colours.
    #[default]
    Plain,
    /// With the colours of a terminal.
    Colored,
}

/// Draws a problem. `sources` are those of the [`Assembly`](crate::Assembly) that has it.
pub fn render(problem: &Problem, sources: &[Source], style: Style) -> String {
    let renderer = match style {
        Style::Plain => Renderer::plain(),
        Style::Colored => Renderer::styled(),
    };
    renderer.render(&[group(problem, sources)])
}

fn group<'a>(problem: &'a Problem, sources: &'a [Source]) -> Group<'a> {
    let level = match problem.severity {
        Severity::Error => Level::ERROR,
        Severity::Warning => Level::WARNING,
        Severity::Hint => Level::INFO.with_name("hint"),
    };
    let mut group = Group::with_title(level.primary_title(&problem.message).id(problem.code.text()));
    if let Some(source) = sources.get(problem.span.source) {
        group = place(group, problem, source);
    }
    if let Some((note, source)) = elsewhere(problem, sources) {
        let (line, _) = source.position(note.span.start);
        let place = format!("{} is at {}:{line}", note.text, source.path.display());
        group = group.element(Level::NOTE.message(place));
    }
    match &problem.help {
        Some(help) => group.element(Level::HELP.message(help)),
        None => group,
    }
}

/// Adds the lines of a problem with its caret.
fn place<'a>(group: Group<'a>, problem: &'a Problem, source: &'a Source) -> Group<'a> {
    let (path, span) = (source.path.display().to_string(), problem.span);
    let (number, lines) = shown(problem, source);
    if lines.len() > MOST_SHOWN {
        let (line, column) = source.position(span.start);
        return group.element(Origin::path(path).line(line).char_column(column));
    }
    let within = |span: Span| span.start - lines.start..span.end.min(lines.end) - lines.start;
    let snippet = Snippet::source(Cow::from(&source.text[lines.clone()])).path(path).line_start(number);
    let snippet = snippet.annotation(AnnotationKind::Primary.span(within(span)));
    match near(problem, source) {
        Some(note) => {
            group.element(snippet.annotation(AnnotationKind::Context.span(within(note.span)).label(&note.text)))
        }
        None => group.element(snippet),
    }
}

/// The number of the first line to be shown, and the bytes of all.
fn shown(problem: &Problem, source: &Source) -> (usize, Range<usize>) {
    let (span, other) = (problem.span, near(problem, source).map_or(problem.span, |note| note.span));
    source.lines(span.start.min(other.start), span.end.max(other.end))
}

/// The other place if it can be shown together with the problem.
fn near<'a>(problem: &'a Problem, source: &Source) -> Option<&'a Note> {
    let (span, note) = (problem.span, problem.note.as_deref()?);
    let (_, both) = source.lines(span.start.min(note.span.start), span.end.max(note.span.end));
    (note.span.source == span.source && both.len() <= MOST_SHOWN).then_some(note)
}

/// The other place if it is in another file, or far away.
fn elsewhere<'a>(problem: &'a Problem, sources: &'a [Source]) -> Option<(&'a Note, &'a Source)> {
    let note = problem.note.as_deref()?;
    let source = sources.get(note.span.source)?;
    near(problem, source).is_none().then_some((note, source))
}
