//! Rules about the EEPROM, whose cells wear out after some 100 000 writes.

use std::collections::HashSet;

use gradus_tmcl::{Opcode, Search, WaitFor};

use super::facts::Facts;
use crate::code::Code;
use crate::effects::{VARIABLES, keeps_coordinates, stores, variable_set};
use crate::flow::{MAIN, Step};
use crate::loops::{Loop, on_every_pass, on_every_way};
use crate::problem::Problem;
use crate::values::Summary;

/// What a cell endures (data sheets of the memories).
const WRITES: u64 = 100_000;
/// Ticks of WAIT after which a write a pass does no harm: 60 s.
const RARE: u64 = 6_000;
/// How many routines are looked into for each loop.
const ROUTINES: usize = 64;
const HELP: &str = "store on a command of the host, or only when the value has changed";

/// eeprom-in-loop
pub(crate) fn in_loop(facts: &Facts, problems: &mut Vec<Problem>) {
    let keeps = facts.reached().any(|(_, instruction)| keeps_coordinates(instruction));
    if facts.reached().any(|(_, instruction)| stores(instruction, keeps)) {
        let found = facts.loops.iter().flatten();
        found.for_each(|found| Pass::new(facts, found, keeps).report(problems));
    }
}

/// A loop and the commands that every pass meets.
struct Pass<'a> {
    facts: &'a Facts<'a>,
    found: &'a Loop,
    always: HashSet<usize>,
    keeps: bool,
}

impl<'a> Pass<'a> {
    fn new(facts: &'a Facts, found: &'a Loop, keeps: bool) -> Self {
        Self { facts, found, always: on_every_pass(&facts.flow, found).into_iter().collect(), keeps }
    }

    fn report(&self, problems: &mut Vec<Problem>) {
        let ticks = self.ticks();
        if ticks >= RARE || self.always.iter().any(|node| searches(self.facts, *node)) {
            return;
        }
        // What every pass meets goes first: a routine is looked into once.
        let (always, sometimes): (Vec<usize>, Vec<usize>) =
            self.found.nodes.iter().partition(|node| self.always.contains(node));
        let mut seen = HashSet::new();
        always.into_iter().for_each(|node| self.store(node, true, ticks, &mut seen, problems));
        sometimes.into_iter().for_each(|node| self.store(node, false, ticks, &mut seen, problems));
    }

    /// The time that every pass waits, in ticks.
    fn ticks(&self) -> u64 {
        let waits = self.always.iter().map(|node| self.facts.at(*node));
        let ticks = waits.filter(|it| it.opcode == Opcode::WAIT && it.kind == WaitFor::TICKS.0);
        ticks.map(|it| u64::try_from(it.value).unwrap_or(0)).sum()
    }

    /// Reports a command that stores, or those of a routine that it calls.
    fn store(&self, node: usize, always: bool, ticks: u64, seen: &mut HashSet<usize>, problems: &mut Vec<Problem>) {
        if stores(self.facts.at(node), self.keeps) {
            problems.push(self.problem(node, always, ticks));
        }
        let Some(part) = self.facts.callee(node).filter(|part| seen.len() < ROUTINES && seen.insert(*part)) else {
            return;
        };
        let surely = always && matches!(self.facts.flow.steps[node], Step::Call(_));
        let met: HashSet<_> = if surely { on_every_run(self.facts, part) } else { HashSet::new() };
        for inner in &self.facts.flow.parts[part].nodes {
            self.store(*inner, met.contains(inner), ticks, seen, problems);
        }
    }

    fn problem(&self, node: usize, always: bool, ticks: u64) -> Problem {
        let (facts, span) = (self.facts, self.facts.span(node));
        let place = facts.place(self.found.header, span);
        let command = facts.command(node);
        let header = facts.span(self.found.header);
        if !always {
            let message = format!("`{command}` writes the EEPROM in the loop at {place}, on some passes");
            return Problem::hint(Code::EepromInLoop, span, message).note(header, "the loop").help(HELP);
        }
        let message = format!(
            "`{command}` writes the EEPROM on every pass of the loop at {place}; 100 000 writes are used up in {}",
            life(ticks)
        );
        Problem::warning(Code::EepromInLoop, span, message).note(header, "the loop").help(HELP)
    }
}

/// How long a cell lives with a write in that many ticks.
fn life(ticks: u64) -> String {
    let minutes = ticks * WRITES / 6_000;
    match minutes {
        0 => "minutes".into(),
        1..120 => format!("{minutes} min"),
        120..2_880 => format!("{} h", minutes / 60),
        _ => format!("{} days", minutes / 1_440),
    }
}

fn searches(facts: &Facts, node: usize) -> bool {
    facts.opcode(node) == Opcode::RFS && facts.at(node).kind == Search::START.0
}

/// The commands that every run of a routine meets.
fn on_every_run(facts: &Facts, part: usize) -> HashSet<usize> {
    let start = facts.start(part);
    let next = |node: usize| match facts.flow.steps[node] {
        Step::Return => vec![None],
        _ => facts.flow.next(node).map(Some).collect(),
    };
    on_every_way(start, next).into_iter().collect()
}

/// eeprom-at-start
pub(crate) fn at_start(facts: &Facts, problems: &mut Vec<Problem>) {
    let keeps = facts.reached().any(|(_, instruction)| keeps_coordinates(instruction));
    for node in always_at_start(facts).into_iter().filter(|node| stores(facts.at(*node), keeps)) {
        let span = facts.span(node);
        let message = format!("`{}` writes the EEPROM at every start of the program", facts.command(node));
        let problem = match facts.opcode(node) {
            Opcode::STGP => Problem::warning(Code::EepromAtStart, span, message),
            _ => Problem::hint(Code::EepromAtStart, span, message),
        };
        problems.push(problem.help("set it once from the host; for a program that sets up a module write `// gradus: allow-file(eeprom-at-start)`"));
    }
}

/// The commands that every run from address 0 meets, up to the first loop: it may wait for something.
fn always_at_start(facts: &Facts) -> Vec<usize> {
    let looped: HashSet<usize> = facts.loops[MAIN].iter().flat_map(|found| found.nodes.iter().copied()).collect();
    let next = |node: usize| {
        let next: Vec<_> = facts.flow.next(node).map(|next| (!looped.contains(&next)).then_some(next)).collect();
        if next.is_empty() { vec![None] } else { next }
    };
    if facts.flow.steps.is_empty() || looped.contains(&0) { Vec::new() } else { on_every_way(0, next) }
}

/// stored-overwritten
pub(crate) fn overwritten(facts: &Facts, problems: &mut Vec<Problem>) {
    let mut done = HashSet::new();
    for (address, instruction) in facts.reached() {
        let is_store = instruction.opcode == Opcode::STGP && instruction.motor == VARIABLES;
        if !is_store || !done.insert(instruction.kind) {
            continue;
        }
        if let Some(writer) = first_writer(facts, instruction.kind) {
            let span = facts.span(address);
            let place = facts.place(writer, span);
            let message =
                format!("what `{}` stores is never read: {place} overwrites it at every start", facts.command(address));
            let problem = Problem::warning(Code::StoredOverwritten, span, message);
            problems.push(problem.note(facts.span(writer), "overwritten here").help("delete one of the two"));
        }
    }
}

/// The command that overwrites a variable on every way from address 0, before anything reads it.
fn first_writer(facts: &Facts, variable: u8) -> Option<usize> {
    let (mut open, mut seen, mut writer) = (vec![0], HashSet::from([0]), None);
    while let Some(node) = open.pop() {
        let instruction = facts.at(node);
        if variable_set(instruction) == Some(variable) {
            writer = Some(writer.map_or(node, |first: usize| first.min(node)));
            continue;
        }
        let callee = facts.callee(node).map(|part| facts.values.summaries[part]);
        if callee.unwrap_or_else(|| Summary::of(instruction, facts.module())).touches(variable) {
            return None;
        }
        let mut next = facts.flow.next(node).peekable();
        next.peek()?; // a way that ends without overwriting it
        open.extend(next.filter(|next| seen.insert(*next)));
    }
    writer
}
