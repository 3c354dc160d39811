//! Problems as text: file, line, column, the source line with a caret, and the hint.

use std::borrow::Cow;

use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet};

use crate::{Problem, Severity, Source};

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
        group = group.element(snippet(problem, source));
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

fn snippet<'a>(problem: &Problem, source: &'a Source) -> Snippet<'a, annotate_snippets::Annotation<'a>> {
    let span = problem.span;
    let snippet = Snippet::source(Cow::from(&*source.text))
        .path(source.path.display().to_string())
        .annotation(AnnotationKind::Primary.span(span.start..span.end));
    match problem.first {
        Some(first) if first.source == span.source => {
            snippet.annotation(AnnotationKind::Context.span(first.start..first.end).label("the first one"))
        }
        _ => snippet,
    }
}

/// The first definition if it stands in another file.
fn elsewhere<'a>(problem: &Problem, sources: &'a [Source]) -> Option<(usize, &'a Source)> {
    let first = problem.first.filter(|first| first.source != problem.span.source)?;
    Some((first.start, sources.get(first.source)?))
}
