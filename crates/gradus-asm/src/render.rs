//! Problems as text: file, line, column, the source line with a caret, and the hint.

use std::borrow::Cow;

use std::ops::Range;

use annotate_snippets::{AnnotationKind, Group, Level, Origin, Renderer, Snippet};

use crate::{Problem, Severity, Source, Span};

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
    };
    let mut group = Group::with_title(level.primary_title(&problem.message).id(problem.code.text()));
    if let Some(source) = sources.get(problem.span.source) {
        group = place(group, problem, source);
    }
    if let Some((first, source)) = elsewhere(problem, sources) {
        let (line, _) = source.position(first);
        group = group.element(Level::NOTE.message(format!("the first one is at {}:{line}", source.path.display())));
    }
    match &problem.help {
        Some(help) => group.element(Level::HELP.message(help)),
        None => group,
    }
}

/// Adds the lines of a problem with its caret.
fn place<'a>(group: Group<'a>, problem: &Problem, source: &'a Source) -> Group<'a> {
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
        Some(first) => {
            group.element(snippet.annotation(AnnotationKind::Context.span(within(first)).label("the first one")))
        }
        None => group.element(snippet),
    }
}

/// The number of the first line to be shown, and the bytes of all.
fn shown(problem: &Problem, source: &Source) -> (usize, Range<usize>) {
    let (span, first) = (problem.span, near(problem, source).unwrap_or(problem.span));
    source.lines(span.start.min(first.start), span.end.max(first.end))
}

/// The first definition if it can be shown together with the problem.
fn near(problem: &Problem, source: &Source) -> Option<Span> {
    let (span, first) = (problem.span, problem.first?);
    let (_, both) = source.lines(span.start.min(first.start), span.end.max(first.end));
    (first.source == span.source && both.len() <= MOST_SHOWN).then_some(first)
}

/// The first definition if it stands in another file, or far away.
fn elsewhere<'a>(problem: &Problem, sources: &'a [Source]) -> Option<(usize, &'a Source)> {
    let first = problem.first?;
    let source = sources.get(first.source)?;
    near(problem, source).is_none().then_some((first.start, source))
}
