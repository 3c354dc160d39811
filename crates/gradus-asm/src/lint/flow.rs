//! Rules about the ways through the program.

use std::collections::{HashMap, HashSet};

use gradus_tmcl::Opcode;

use super::facts::Facts;
use crate::code::Code;
use crate::flow::{Kind, MAIN, Step};
use crate::problem::{Edit, Problem, Span};

/// Return addresses that the module keeps.
const STACK: usize = 8;

/// unreachable
pub(crate) fn unreachable(facts: &Facts, problems: &mut Vec<Problem>) {
    let count = facts.assembly.commands.len();
    let mut address = 0;
    while address < count {
        if facts.flow.is_reached(address) {
            address += 1;
            continue;
        }
        let start = address;
        address += 1;
        // A label that is used begins another piece, and so does a new file.
        while address < count && !facts.flow.is_reached(address) && facts.label(address).is_none() {
            address += 1;
        }
        problems.push(piece(facts, start, address));
    }
}

/// The commands from `start` to `end`, which no way leads to.
fn piece(facts: &Facts, start: usize, end: usize) -> Problem {
    let span = whole(facts, start, end);
    let edits = (start..end).flat_map(|address| facts.delete(address)).collect();
    let commands = match end - start {
        1 => format!("`{}`", facts.command(start)),
        count => format!("{count} commands"),
    };
    let ends_alone = end - start == 1 && !matches!(facts.flow.steps[start], Step::Next);
    let problem = match facts.label(start) {
        Some(_) if end - start >= 2 => {
            let message = format!("{} ({commands}) is never reached", facts.name(start));
            let help = "call it, delete it, or write `// gradus: entry` at its label if the host starts it";
            Problem::warning(Code::Unreachable, span, message).help(help)
        }
        _ if ends_alone => {
            Problem::hint(Code::Unreachable, span, format!("{commands} is never reached")).help("delete it")
        }
        _ => {
            let verb = if end - start == 1 { "is" } else { "are" };
            Problem::hint(Code::Unreachable, span, format!("{commands} {verb} never reached"))
                .help("delete what is not needed, or jump to it")
        }
    };
    problem.unsafe_fix("delete the commands", edits)
}

/// From the first command to the last one that stands in the same file.
fn whole(facts: &Facts, start: usize, end: usize) -> Span {
    let first = facts.span(start);
    let same = (start..end).map(|address| facts.span(address)).take_while(|span| span.source == first.source);
    same.last().map_or(first, |last| first.to(last))
}

/// falls-into-routine, rsub-outside, reti-outside
pub(crate) fn returns(facts: &Facts, problems: &mut Vec<Problem>) {
    let handled: HashSet<usize> = handlers(facts).flat_map(|part| facts.flow.called_from(part)).collect();
    for (address, _) in facts.reached() {
        let parts = &facts.flow.within[address];
        match facts.flow.steps[address] {
            Step::Return if parts == &[MAIN] => problems.push(rsub_outside(facts, address)),
            Step::Return if parts.contains(&MAIN) => problems.extend(falls_into(facts, address)),
            Step::ReturnFromInterrupt if !parts.iter().any(|part| handled.contains(part)) => {
                let message = "no interrupt leads to this RETI; outside a handler it is ignored";
                let problem = Problem::warning(Code::RetiOutside, facts.span(address), message);
                problems.push(problem.help("write RSUB, or set the handler with VECT"));
            }
            _ => {}
        }
    }
}

fn handlers(facts: &Facts) -> impl Iterator<Item = usize> {
    let is_handler = |part: &usize| matches!(facts.flow.parts[*part].kind, Kind::Handler(_));
    (0..facts.flow.parts.len()).filter(is_handler)
}

fn rsub_outside(facts: &Facts, address: usize) -> Problem {
    let message = "no CSUB leads to this RSUB; without one it is ignored";
    Problem::warning(Code::RsubOutside, facts.span(address), message).help("write STOP, or call the routine with CSUB")
}

/// The way by which the main program comes into a routine.
fn falls_into(facts: &Facts, rsub: usize) -> Option<Problem> {
    let flow = &facts.flow;
    let part = *flow.within[rsub].iter().find(|part| flow.parts[**part].kind == Kind::Routine)?;
    let start = facts.start(part);
    let enters =
        |node: &&usize| !flow.contains(part, **node) && flow.next(**node).any(|next| flow.contains(part, next));
    let from = *flow.parts[MAIN].nodes.iter().find(enters)?;
    let message =
        format!("the program runs from here into the routine {}, whose RSUB is then ignored", facts.name(start));
    let problem = Problem::warning(Code::FallsIntoRoutine, facts.span(from), message);
    Some(
        problem
            .note(facts.span(rsub), "the RSUB")
            .help("put a STOP or a JA in front of the routine, or call it with CSUB"),
    )
}

/// routine-never-returns, jump-out-of-routine, jump-to-next
pub(crate) fn routines(facts: &Facts, problems: &mut Vec<Problem>) {
    for (number, part) in facts.flow.parts.iter().enumerate().filter(|(_, part)| part.kind == Kind::Routine) {
        let jumps = jump_out(facts, number);
        if jumps.is_none() && !part.returns {
            problems.extend(never_returns(facts, number));
        }
        problems.extend(jumps);
    }
    for (address, instruction) in facts.reached() {
        if let (Opcode::JA | Opcode::JC, Step::Jump(target) | Step::Branch(target)) =
            (instruction.opcode, facts.flow.steps[address])
            && target == address + 1
        {
            let message = format!("`{}` jumps to the next command", facts.command(address));
            let problem = Problem::hint(Code::JumpToNext, facts.span(address), message).help("delete the jump");
            problems.push(problem.unsafe_fix("delete the jump", facts.delete(address)));
        }
    }
}

/// The call of a routine that reaches no RSUB.
fn never_returns(facts: &Facts, part: usize) -> Option<Problem> {
    let start = facts.start(part);
    let (call, _) = *facts.flow.parts.iter().flat_map(|from| &from.calls).find(|(_, callee)| *callee == part)?;
    let message = format!("{} is called here, but reaches no RSUB", facts.name(start));
    let problem = Problem::hint(Code::RoutineNeverReturns, facts.span(call), message);
    Some(problem.note(facts.span(start), "the routine").help("end it with RSUB, or jump to it with JA"))
}

/// A jump from a routine into the main program, which may call the routine again.
fn jump_out(facts: &Facts, part: usize) -> Option<Problem> {
    let flow = &facts.flow;
    let nodes = flow.parts[part].nodes.iter().filter(|node| !flow.contains(MAIN, **node));
    let target = |node: usize| match flow.steps[node] {
        Step::Jump(target) | Step::Branch(target) if flow.contains(MAIN, target) => Some(target),
        _ => None,
    };
    let (from, _) =
        nodes.filter_map(|node| Some((*node, target(*node)?))).find(|(_, to)| calls_again(facts, *to, part))?;
    let name = facts.name(facts.start(part));
    let message = format!(
        "`{}` leaves the routine {name} without RSUB: the stack keeps an entry, and from the ninth on calls are ignored",
        facts.command(from)
    );
    Some(
        Problem::warning(Code::JumpOutOfRoutine, facts.span(from), message)
            .help("leave it with RSUB, or start anew with RST"),
    )
}

/// True if a way leads from an address of the main program to a call of the routine.
fn calls_again(facts: &Facts, from: usize, part: usize) -> bool {
    let calls: HashSet<usize> =
        facts.flow.parts[MAIN].calls.iter().filter(|(_, callee)| *callee == part).map(|(at, _)| *at).collect();
    let (mut open, mut seen) = (vec![from], HashSet::from([from]));
    while let Some(node) = open.pop() {
        if calls.contains(&node) {
            return true;
        }
        open.extend(facts.flow.next(node).filter(|next| seen.insert(*next)));
    }
    false
}

/// call-depth, recursion
pub(crate) fn calls(facts: &Facts, problems: &mut Vec<Problem>) {
    let mut depths = Depths { facts, deepest: HashMap::new(), open: HashSet::new(), recursion: None };
    let main = depths.of(MAIN);
    let handler = handlers(facts).map(|part| (depths.of(part), part)).max();
    if let Some((call, callee)) = depths.recursion {
        let message =
            format!("{} calls itself; from the ninth call on calls are ignored", facts.name(facts.start(callee)));
        let problem = Problem::warning(Code::Recursion, facts.span(call), message);
        problems.push(problem.help("make it a loop, with variables for what changes"));
        return;
    }
    let (depth, chain) = match handler {
        Some((depth, part)) if depth > 0 => (main + depth, [depths.chain(MAIN), depths.chain(part)].concat()),
        _ => (main, depths.chain(MAIN)),
    };
    if depth > STACK {
        let names: Vec<_> = chain.iter().map(|(_, callee)| facts.name(facts.start(*callee))).collect();
        let message = format!("calls nest {depth} deep: {}; the ninth is ignored", names.join(" > "));
        let span = chain.get(STACK).map_or(Span::default(), |(call, _)| facts.span(*call));
        problems.push(
            Problem::warning(Code::CallDepth, span, message)
                .help("call less deeply: the module keeps 8 return addresses"),
        );
    }
}

/// How deep calls nest below each part.
struct Depths<'a> {
    facts: &'a Facts<'a>,
    /// Depth below a part, and the call that leads there.
    deepest: HashMap<usize, (usize, Option<(usize, usize)>)>,
    open: HashSet<usize>,
    /// The first call that leads back into a part that is still open.
    recursion: Option<(usize, usize)>,
}

impl Depths<'_> {
    /// The calls of a part; not those of the main program that a routine has jumped into.
    fn calls(&self, part: usize) -> Vec<(usize, usize)> {
        let flow = &self.facts.flow;
        let own = |call: usize| part == MAIN || !flow.contains(MAIN, call);
        flow.parts[part].calls.iter().copied().filter(|(call, _)| own(*call)).collect()
    }

    /// Without recursion of our own: programs may nest as deep as they are long.
    fn of(&mut self, part: usize) -> usize {
        let mut path = vec![self.enter(part)];
        while let Some((part, calls)) = path.last_mut() {
            match calls.next() {
                Some((call, callee)) if self.open.contains(&callee) => {
                    self.recursion = self.recursion.or(Some((call, callee)));
                }
                Some((_, callee)) if self.deepest.contains_key(&callee) => {}
                Some((_, callee)) => path.push(self.enter(callee)),
                None => {
                    let part = *part;
                    self.close(part);
                    path.pop();
                }
            }
        }
        self.deepest.get(&part).map_or(0, |(depth, _)| *depth)
    }

    fn enter(&mut self, part: usize) -> (usize, std::vec::IntoIter<(usize, usize)>) {
        self.open.insert(part);
        (part, self.calls(part).into_iter())
    }

    fn close(&mut self, part: usize) {
        self.open.remove(&part);
        let below = |(call, callee)| Some((self.deepest.get(&callee)?.0 + 1, Some((call, callee))));
        let deepest = self.calls(part).into_iter().filter_map(below).max_by_key(|(depth, _)| *depth);
        self.deepest.insert(part, deepest.unwrap_or((0, None)));
    }

    /// The calls on the deepest way below a part.
    fn chain(&self, part: usize) -> Vec<(usize, usize)> {
        let next = |part: usize| self.deepest.get(&part).and_then(|(_, call)| *call);
        std::iter::successors(next(part), |(_, callee)| next(*callee)).collect()
    }
}

/// stop-appended
pub(crate) fn stop_appended(facts: &Facts, problems: &mut Vec<Problem>) {
    let assembly = facts.assembly;
    let Some(last) = assembly.commands.len().checked_sub(1) else { return };
    let appended = assembly.program.len() > assembly.commands.len();
    if !appended || !assembly.commands[last].is_valid || !facts.flow.next(last).any(|next| next > last) {
        return;
    }
    let message =
        format!("`{}` is the last command and falls through: the assembler appends a STOP", facts.command(last));
    let text = &assembly.sources[0].text;
    let newline = if text.ends_with('\n') { "" } else { "\n" };
    let at = Span { source: 0, start: text.len(), end: text.len() };
    let edit = Edit { span: at, text: format!("{newline}    STOP\n") };
    let problem = Problem::hint(Code::StopAppended, facts.span(last), message).help("write the STOP");
    problems.push(problem.safe_fix("insert STOP", vec![edit]));
}
