//! What an editor offers to do about a place.

use gradus_asm::{Edit, Problem, Span};

use crate::analysis::Analysis;

/// What kind of action it is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ActionKind {
    /// Removes one problem.
    QuickFix,
    /// Removes all problems of a file whose removal keeps the program's bytes.
    FixAll,
    /// Changes the text without a problem.
    Extract,
}

/// A change that an editor offers.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Action {
    /// As a menu shows it.
    pub title: String,
    /// What kind it is.
    pub kind: ActionKind,
    /// The problem that it removes, by its number in the analysis.
    pub problem: Option<usize>,
    /// What is changed.
    pub edits: Vec<Edit>,
    /// The first choice for its problem.
    pub is_preferred: bool,
}

/// Returns what can be done about the text in a span.
pub fn actions(analysis: &Analysis, within: Span) -> Vec<Action> {
    let touches = |span: &Span| span.source == within.source && span.start <= within.end && span.end >= within.start;
    let here = analysis.problems.iter().enumerate().filter(|(_, problem)| touches(&problem.span));
    let mut actions = Vec::new();
    for (number, problem) in here {
        actions.extend(fix(number, problem));
        actions.extend(allow(analysis, number, problem));
    }
    actions.extend(fix_all(analysis, within.source));
    actions.extend(extract(analysis, within));
    actions
}

fn fix(number: usize, problem: &Problem) -> Option<Action> {
    let fix = problem.fix.as_ref()?;
    let (title, edits) = (fix.title.clone(), fix.edits.clone());
    Some(Action { title, kind: ActionKind::QuickFix, problem: Some(number), edits, is_preferred: fix.safe })
}

/// `// gradus: allow(CODE)` behind the line of a finding.
fn allow(analysis: &Analysis, number: usize, problem: &Problem) -> Option<Action> {
    if problem.severity == gradus_asm::Severity::Error {
        return None;
    }
    let source = problem.span.source;
    let text = &analysis.assembly.sources[source].text;
    let lines = &analysis.lines[source];
    let (start, end) = lines.range(text, lines.line(problem.span.start));
    let line = text.get(start..end)?;
    let code = problem.code.text();
    let edit = match line.find("//") {
        // The line has a comment: the pragma stands alone above it.
        Some(_) => {
            let indent: String = line.chars().take_while(|letter| letter.is_whitespace()).collect();
            Edit { span: Span { source, start, end: start }, text: format!("{indent}// gradus: allow({code})\n") }
        }
        None => {
            let end = start + line.trim_end().len();
            Edit { span: Span { source, start: end, end }, text: format!(" // gradus: allow({code})") }
        }
    };
    let title = format!("allow {code} here");
    Some(Action { title, kind: ActionKind::QuickFix, problem: Some(number), edits: vec![edit], is_preferred: false })
}

fn fix_all(analysis: &Analysis, source: usize) -> Option<Action> {
    let here = analysis.problems.iter().filter(|problem| problem.span.source == source);
    let safe = here.filter_map(|problem| problem.fix.as_ref()).filter(|fix| fix.safe);
    let edits = without_overlaps(safe.flat_map(|fix| fix.edits.clone()).collect());
    let title = "fix all that keeps the program's bytes".to_owned();
    (!edits.is_empty()).then_some(Action { title, kind: ActionKind::FixAll, problem: None, edits, is_preferred: false })
}

/// The edits in the order of the text; of two that touch the same letters the first.
fn without_overlaps(mut edits: Vec<Edit>) -> Vec<Edit> {
    edits.sort_by_key(|edit| (edit.span.source, edit.span.start, edit.span.end));
    edits.dedup();
    let mut until = (0, 0);
    edits.retain(|edit| {
        let is_free = (edit.span.source, edit.span.start) >= until;
        until = if is_free { (edit.span.source, edit.span.end) } else { until };
        is_free
    });
    edits
}

/// A selected number becomes a constant that is defined above the first command.
fn extract(analysis: &Analysis, within: Span) -> Option<Action> {
    const NAME: &str = "NewConstant";
    let operands = analysis.assembly.commands.iter().flat_map(|text| &text.operands);
    let inside = |span: &&Span| span.source == within.source && span.start <= within.start && within.end <= span.end;
    let span = *operands.filter(|_| within.start < within.end).find(inside)?;
    let number = analysis.slice(span);
    if !number.starts_with(|letter: char| letter.is_ascii_digit() || letter == '-') || is_taken(analysis, NAME) {
        return None;
    }
    let text = &analysis.assembly.sources[span.source].text;
    let first = analysis.assembly.commands.iter().find(|text| text.line.source == span.source)?;
    let lines = &analysis.lines[span.source];
    let (start, _) = lines.range(text, lines.line(first.line.start));
    let define = Edit { span: Span { source: span.source, start, end: start }, text: format!("{NAME} = {number}\n\n") };
    let replace = Edit { span, text: NAME.to_owned() };
    let title = format!("give {number} a name");
    Some(Action { title, kind: ActionKind::Extract, problem: None, edits: vec![define, replace], is_preferred: false })
}

fn is_taken(analysis: &Analysis, name: &str) -> bool {
    analysis.definitions().any(|(_, of)| analysis.name(of).eq_ignore_ascii_case(name))
}
