//! The rules, and what is done with their findings.

use std::collections::HashSet;

use super::facts::Facts;
use super::options::LintOptions;
use super::{eeprom, flow, interrupts, motion, names, registers, style, timeouts};
use crate::assembler::Assembly;
use crate::code::Code;
use crate::pragma::{Allow, Pragmas};
use crate::problem::{Problem, Severity, Span};

/// A rule adds what it finds.
type Rule = fn(&Facts, &mut Vec<Problem>);

const RULES: &[Rule] = &[names::rule, style::rule, interrupts::pairs, timeouts::never, motion::program_wide];

/// Rules that need to know the ways through the program.
const FLOW_RULES: &[Rule] = &[
    eeprom::in_loop,
    eeprom::at_start,
    eeprom::overwritten,
    registers::conditions,
    registers::loads,
    flow::unreachable,
    flow::returns,
    flow::routines,
    flow::calls,
    interrupts::handlers,
    timeouts::unchecked,
    motion::along_the_way,
    motion::straight_line,
];

/// Every problem of a program: those of its assembly and what the rules find, in the order of the text, without what
/// options and pragmas allow.
pub fn lint(assembly: &Assembly, options: &LintOptions) -> Vec<Problem> {
    let facts = Facts::new(assembly, options);
    let mut problems = assembly.problems.clone();
    problems.extend(facts.pragmas.problems.iter().cloned());
    let rules = RULES.iter().chain(if facts.flow.is_complete { FLOW_RULES } else { &[] });
    rules.for_each(|rule| rule(&facts, &mut problems));
    problems.retain(|problem| problem.is_error() || !options.allow.contains(&problem.code));
    let unneeded = suppress(&mut problems, &facts.pragmas);
    problems.extend(unneeded.into_iter().filter(|problem| !options.allow.contains(&problem.code)));
    problems.sort_by_key(|problem| (problem.span.source, problem.span.start, problem.code));
    let mut seen = HashSet::new();
    problems.retain(|problem| seen.insert((problem.code, problem.span.source, problem.span.start, problem.span.end)));
    problems
}

/// Takes away what pragmas allow; gives back the hints about those that allow nothing.
fn suppress(problems: &mut Vec<Problem>, pragmas: &Pragmas) -> Vec<Problem> {
    let covers = |allow: &Allow, code: Code, at: Span| {
        allow.code == code
            && allow.place.source == at.source
            && (allow.place.start..=allow.place.end).contains(&at.start)
    };
    let mut used = vec![false; pragmas.allows.len()];
    problems.retain(|problem| {
        let allowed = |allow: &Allow| problem.severity != Severity::Error && covers(allow, problem.code, problem.span);
        let allowing = pragmas.allows.iter().zip(&mut used).filter(|(allow, _)| allowed(allow));
        allowing.map(|(_, used)| *used = true).count() == 0
    });
    let unused = pragmas.allows.iter().zip(used).filter(|(_, used)| !used).map(|(allow, _)| unneeded(allow));
    unused.collect()
}

fn unneeded(allow: &Allow) -> Problem {
    let message = format!("nothing here is `{}`", allow.code.text());
    Problem::hint(Code::UnneededAllow, allow.span, message).help("delete it from the pragma")
}
