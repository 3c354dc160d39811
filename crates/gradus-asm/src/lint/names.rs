//! Rules about names: unused-label, unused-constant, near-duplicate-name, named-number.

use std::collections::{HashMap, HashSet};

use gradus_tmcl::catalogue::{Command, OperandKind};

use super::facts::Facts;
use crate::assembler::OUTSIDE;
use crate::code::Code;
use crate::names::Defined;
use crate::problem::{Edit, Problem, Span};

pub(crate) fn rule(facts: &Facts, problems: &mut Vec<Problem>) {
    let used: HashSet<Defined> = facts.assembly.uses.iter().map(|used| used.of).collect();
    problems.extend(unused_labels(facts, &used));
    problems.extend(unused_constants(facts, &used));
    problems.extend(near_duplicates(facts));
    problems.extend(named_numbers(facts));
}

/// The program's own file. What it includes may have other users, so that nothing is deleted there.
const PROGRAM: usize = 0;

/// A name that begins so is meant to be unused.
const EXEMPT: char = '_';

fn unused_labels(facts: &Facts, used: &HashSet<Defined>) -> impl Iterator<Item = Problem> {
    let labels = facts.assembly.labels.iter().enumerate();
    let unused = labels.filter(|(index, label)| {
        let exempt = label.name.starts_with(EXEMPT) || is_started(facts, label.address);
        // What is never reached is reported as a whole.
        let unreached = facts.flow.is_complete && facts.flow.within.get(label.address).is_some_and(Vec::is_empty);
        !used.contains(&Defined::Label(*index)) && !exempt && !unreached
    });
    unused.map(|(_, label)| {
        let message = format!("nothing uses the label `{}`", label.name);
        let problem =
            Problem::hint(Code::UnusedLabel, label.span, message).help("delete it, or let its name begin with `_`");
        match label.span.source {
            PROGRAM => problem
                .safe_fix("delete the label", vec![Edit { span: with_colon(facts, label.span), text: String::new() }]),
            _ => problem,
        }
    })
}

/// True for the ways in that a host uses: pragmas, and a jump table of two and more.
fn is_started(facts: &Facts, address: usize) -> bool {
    let marked = facts.pragmas.entries.contains(&address);
    marked || facts.is_entry(address) && (address > 0 || facts.is_entry(1))
}

/// A label with its colon and what follows it up to the command; with its line if it stands alone.
fn with_colon(facts: &Facts, label: Span) -> Span {
    let text = &facts.assembly.sources[label.source].text;
    let colon = text[label.end..].find(':').map_or(label.end, |at| label.end + at + 1);
    let start = text[..label.start].rfind('\n').map_or(0, |newline| newline + 1);
    let rest = text[colon..].split('\n').next().unwrap_or("");
    let alone = text[start..label.start].trim().is_empty() && rest.trim().is_empty();
    if alone {
        return Span { start, end: text.len().min(colon + rest.len() + 1), ..label };
    }
    Span { end: colon, ..label }
}

fn unused_constants(facts: &Facts, used: &HashSet<Defined>) -> impl Iterator<Item = Problem> {
    let mut names = HashSet::new();
    let constants = facts.assembly.constants.iter().enumerate();
    let unused = constants.filter(move |(index, constant)| {
        let source = &facts.assembly.sources[constant.span.source];
        let again = !names.insert(constant.name.to_lowercase());
        let ours = !source.built_in && source.path.as_os_str() != OUTSIDE;
        ours && !again && !used.contains(&Defined::Constant(*index)) && !constant.name.starts_with(EXEMPT)
    });
    unused.map(|(_, constant)| {
        let message = format!("nothing uses the constant `{}`", constant.name);
        let problem = Problem::hint(Code::UnusedConstant, constant.span, message);
        let edits =
            definition(facts, constant.span).map(|span| Edit { span, text: String::new() }).into_iter().collect();
        problem.help("delete it, or let its name begin with `_`").safe_fix("delete the constant", edits)
    })
}

/// The line of a constant; up to its comment if there is one.
fn definition(facts: &Facts, name: Span) -> Option<Span> {
    let text = &facts.assembly.sources[name.source].text;
    let start = text[..name.start].rfind('\n').map_or(0, |newline| newline + 1);
    let line = text[start..].split('\n').next()?;
    let end = start + line.len();
    let labelled = !text[start..name.start].trim().is_empty();
    match line.find("//") {
        Some(comment) => Some(Span { start: name.start, end: start + comment, ..name }),
        None if labelled => Some(Span { start: name.start, end, ..name }),
        None => Some(Span { start, end: text.len().min(end + 1), ..name }),
    }
}

fn near_duplicates(facts: &Facts) -> impl Iterator<Item = Problem> {
    let assembly = facts.assembly;
    assembly.uses.iter().filter_map(move |used| {
        let (name, span) = match used.of {
            Defined::Label(index) => (&assembly.labels[index].name, assembly.labels[index].span),
            Defined::Constant(index) => (&assembly.constants[index].name, assembly.constants[index].span),
        };
        let written = facts.text(used.span);
        let foreign = assembly.sources[span.source].built_in || assembly.sources[used.span.source].built_in;
        if foreign || written == name {
            return None;
        }
        let message = format!("`{written}` and `{name}` are one name, written in two ways");
        let problem = Problem::hint(Code::NearDuplicateName, used.span, message).note(span, "as it is defined");
        let edit = Edit { span: used.span, text: name.clone() };
        Some(problem.help(format!("write `{name}`")).safe_fix(format!("write `{name}`"), vec![edit]))
    })
}

/// What a number stands for: two numbers are compared only within one of these.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum Role {
    AxisParameter,
    Global(u8),
    Port(u8),
    Coordinate,
    Interrupt,
}

/// An operand that could have a name.
struct Number {
    role: Role,
    value: i64,
    span: Span,
}

fn named_numbers(facts: &Facts) -> Vec<Problem> {
    let numbers: Vec<_> = facts.commands().flat_map(|(address, _)| numbers(facts, address)).collect();
    let of: HashMap<Span2, Defined> = facts.assembly.uses.iter().map(|used| (Span2::of(used.span), used.of)).collect();
    let mut names: HashMap<(Role, i64), HashSet<usize>> = HashMap::new();
    for number in &numbers {
        if let Some(Defined::Constant(index)) = of.get(&Span2::of(number.span))
            && (facts.options.pedantic || !is_built_in(facts, *index))
        {
            names.entry((number.role, number.value)).or_default().insert(*index);
        }
    }
    let literal =
        |number: &&Number| facts.text(number.span).starts_with(|c: char| c.is_ascii_digit() || "$%".contains(c));
    let unnamed = numbers.iter().filter(literal);
    unnamed.filter_map(|number| named(facts, number, names.get(&(number.role, number.value))?)).collect()
}

/// A span as a key.
#[derive(PartialEq, Eq, Hash)]
struct Span2(usize, usize, usize);

impl Span2 {
    fn of(span: Span) -> Self {
        Self(span.source, span.start, span.end)
    }
}

fn is_built_in(facts: &Facts, constant: usize) -> bool {
    facts.assembly.sources[facts.assembly.constants[constant].span.source].built_in
}

/// A number that exactly one constant is used for.
fn named(facts: &Facts, number: &Number, constants: &HashSet<usize>) -> Option<Problem> {
    let (1, Some(constant)) = (constants.len(), constants.iter().next()) else { return None };
    let constant = &facts.assembly.constants[*constant];
    let written = facts.text(number.span);
    let message = format!("{written} is `{}` elsewhere", constant.name);
    let problem = Problem::hint(Code::NamedNumber, number.span, message).note(constant.span, "its name");
    let edit = Edit { span: number.span, text: constant.name.clone() };
    let title = format!("write `{}`", constant.name);
    Some(problem.help(title.clone()).safe_fix(title, vec![edit]))
}

/// The operands of a command that could have a name.
fn numbers(facts: &Facts, address: usize) -> Vec<Number> {
    let instruction = facts.at(address);
    let Some(row) = Command::of(instruction.opcode) else { return Vec::new() };
    let bank = instruction.motor;
    let written = facts.assembly.commands[address].operands.iter().zip(row.operands);
    let number = |(span, operand): (&Span, &gradus_tmcl::catalogue::Operand)| {
        let role = match operand.kind {
            OperandKind::AxisParameter => Role::AxisParameter,
            OperandKind::GlobalParameter => Role::Global(bank),
            OperandKind::Variable => Role::Global(crate::effects::VARIABLES),
            OperandKind::Port => Role::Port(bank),
            OperandKind::Coordinate => Role::Coordinate,
            OperandKind::Interrupt => Role::Interrupt,
            _ => return None,
        };
        Some(Number { role, value: operand.get(instruction), span: *span })
    };
    written.filter_map(number).collect()
}
