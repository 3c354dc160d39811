//! Rules about the accumulator and the flags.

use std::collections::HashMap;

use gradus_tmcl::catalogue::{Ap, Values as List};
use gradus_tmcl::{Instruction, Opcode};

use super::facts::Facts;
use crate::code::Code;
use crate::effects::{Effects, FIRST_ERROR, Places, meaning};
use crate::flow::Step;
use crate::problem::{Problem, Span};
use crate::values::{Flags, Origin, State, Value};

/// Conditions of JC and CALL, by what they hold for.
const EQUAL: [u8; 2] = [0, 2];
const NOT_EQUAL: [u8; 2] = [1, 3];

/// comparison-lost, flags-after-call, condition-without-comparison, condition-constant, equal-on-continuous, constant-written
pub(crate) fn conditions(facts: &Facts, problems: &mut Vec<Problem>) {
    for (address, instruction) in facts.reached() {
        let states: Vec<&State> = facts.values.before(&facts.flow, address).collect();
        match instruction.opcode {
            Opcode::JC | Opcode::CALL if instruction.kind < FIRST_ERROR => {
                let condition = Condition { facts, address, kind: instruction.kind };
                problems.extend(condition.without_comparison(&states));
                problems.extend(states.iter().filter_map(|state| condition.problem(state)));
            }
            Opcode::AAP => problems.extend(states.iter().find_map(|state| written(facts, address, state))),
            _ => {}
        }
    }
}

struct Condition<'a> {
    facts: &'a Facts<'a>,
    address: usize,
    kind: u8,
}

impl Condition<'_> {
    fn span(&self) -> Span {
        self.facts.span(self.address)
    }

    fn without_comparison(&self, states: &[&State]) -> Option<Problem> {
        let nothing = !states.is_empty() && states.iter().all(|state| state.flags == Flags::Start);
        let message = format!("nothing before `{}` sets the flags", self.facts.command(self.address));
        let problem = Problem::warning(Code::ConditionWithoutComparison, self.span(), message);
        nothing.then(|| problem.help("load or compare a value first"))
    }

    fn problem(&self, state: &State) -> Option<Problem> {
        match state.flags {
            Flags::Computed { at, lost: Some(lost) } => self.lost(at, lost),
            Flags::Call { at } => Some(self.after_call(at)),
            Flags::Compared { value: Value::Read(origin), with, at } => {
                self.constant(origin, with, at).or_else(|| self.continuous(origin, with))
            }
            _ => None,
        }
    }

    fn lost(&self, at: usize, lost: usize) -> Option<Problem> {
        if EQUAL.contains(&self.kind) || NOT_EQUAL.contains(&self.kind) {
            return None;
        }
        let facts = self.facts;
        let span = self.span();
        let message = format!(
            "`{}` compares with 0: `{}` at {} has replaced the comparison with {}",
            facts.command(self.address),
            facts.command(at),
            facts.place(at, span),
            facts.at(lost).value
        );
        let again = facts.insert(self.address, facts.command(lost));
        let problem = Problem::warning(Code::ComparisonLost, span, message).note(facts.span(lost), "the comparison");
        Some(problem.help("compare again right before the condition").unsafe_fix("repeat the comparison", again))
    }

    fn after_call(&self, at: usize) -> Problem {
        let facts = self.facts;
        let target = usize::try_from(facts.at(at).value).unwrap_or(0);
        let command = facts.command(self.address);
        let message = format!("{} changes the flags before `{command}` looks at them", facts.name(target));
        Problem::hint(Code::FlagsAfterCall, self.span(), message)
            .note(facts.span(at), "the call")
            .help("compare again behind the call")
    }

    /// A value that is always on one side of the number.
    fn constant(&self, origin: Origin, with: i32, at: usize) -> Option<Problem> {
        let (name, choices) = range(self.facts, origin)?;
        let outcomes = choices.iter().flat_map(|(min, max)| outcomes(self.kind, (*min, *max), with.into()));
        let (mut yes, mut no) = (false, false);
        outcomes.for_each(|holds| if holds { yes = true } else { no = true });
        if yes == no {
            return None;
        }
        let always = if yes { "always" } else { "never" };
        let list = listed(&choices);
        let message = format!("`{}` {always} holds: {name} is {list}", self.facts.command(self.address));
        let problem = Problem::warning(Code::ConditionConstant, self.span(), message);
        Some(problem.note(self.facts.span(at), "compared here").help("compare with a value that can be"))
    }

    /// A loop that only one exact value of a speed, a position or a voltage ends.
    fn continuous(&self, origin: Origin, with: i32) -> Option<Problem> {
        let facts = self.facts;
        let is_equality = EQUAL.contains(&self.kind) || NOT_EQUAL.contains(&self.kind);
        if with == 0 || !is_equality || !self.alone_ends_loop() {
            return None;
        }
        let name = continuous(facts, origin, with)?;
        let message = format!("{name} will hardly ever be exactly {with}, and nothing else ends this loop");
        let problem = Problem::warning(Code::EqualOnContinuous, self.span(), message);
        Some(problem.help("compare with GE or LE, or wait for 0"))
    }

    /// True if the condition is the only way out of the smallest loop around it.
    fn alone_ends_loop(&self) -> bool {
        let flow = &self.facts.flow;
        let back = |end: &usize| flow.next(*end).filter(|next| *next <= self.address).max();
        let reach = self.address..flow.steps.len().min(self.address + 64);
        let Some((end, start)) = reach.into_iter().find_map(|end| Some((end, back(&end)?))) else { return false };
        let body = start..=end;
        let leaves = |node: &usize| flow.next(*node).any(|next| !body.contains(&next));
        body.clone().filter(leaves).eq([self.address])
    }
}

/// Whether the condition can hold and can fail for values between two limits.
fn outcomes(kind: u8, (min, max): (i64, i64), with: i64) -> impl Iterator<Item = bool> {
    let below = (min < with).then_some(kind_holds(kind, -1));
    let equal = (min..=max).contains(&with).then_some(kind_holds(kind, 0));
    let above = (max > with).then_some(kind_holds(kind, 1));
    [below, equal, above].into_iter().flatten()
}

/// ZE, NZ, EQ, NE, GT, GE, LT, LE for a value below, at or above the number.
fn kind_holds(kind: u8, order: i8) -> bool {
    match kind {
        0 | 2 => order == 0,
        1 | 3 => order != 0,
        4 => order > 0,
        5 => order >= 0,
        6 => order < 0,
        _ => order <= 0,
    }
}

/// Name and possible values of what was read.
fn range(facts: &Facts, origin: Origin) -> Option<(String, Vec<(i64, i64)>)> {
    match origin {
        Origin::Port { number, bank } => {
            let port = facts.module().port(bank, number)?;
            let (min, max) = port.range?;
            let what = if bank == 0 && number != u8::MAX { format!("input {number}") } else { port.name.into() };
            Some((what, vec![(min.into(), max.into())]))
        }
        Origin::Axis { number, .. } => {
            let row = facts.module().axis_parameter(number)?;
            let choices = match row.values {
                List::Only(list) => list.iter().map(|choice| (choice.first, choice.last)).collect(),
                _ => vec![(row.min, row.max)],
            };
            Some((row.name.into(), choices))
        }
        Origin::Global { .. } => None,
    }
}

fn listed(choices: &[(i64, i64)]) -> String {
    let one = |(min, max): &(i64, i64)| if min == max { min.to_string() } else { format!("{min}...{max}") };
    choices.iter().map(one).collect::<Vec<_>>().join(" or ")
}

/// The name of a value that runs through many numbers, unless the program itself leads it to this one.
fn continuous(facts: &Facts, origin: Origin, with: i32) -> Option<&'static str> {
    match origin {
        Origin::Port { number, bank: 1 } => facts.module().port(1, number).map(|_| "an analogue input"),
        Origin::Axis { number, axis } => {
            let (name, leads): (_, &[Opcode]) = match facts.module().axis_parameter(number)?.id {
                Ap::ActualPosition | Ap::EncoderPosition => ("the position", &[Opcode::MVP, Opcode::SAP, Opcode::SCO]),
                Ap::ActualSpeed | Ap::MeasuredSpeed | Ap::MeasuredSpeedNow => {
                    ("the speed", &[Opcode::ROR, Opcode::ROL, Opcode::SAP])
                }
                _ => return None,
            };
            let led = |it: &Instruction| leads.contains(&it.opcode) && it.motor == axis && it.value.abs() == with.abs();
            (!facts.reached().any(|(_, instruction)| led(instruction))).then_some(name)
        }
        _ => None,
    }
}

/// constant-written
fn written(facts: &Facts, address: usize, state: &State) -> Option<Problem> {
    const SETTINGS: &[Ap] = &[
        Ap::MaxSpeed,
        Ap::MaxAcceleration,
        Ap::MaxDeceleration,
        Ap::StartVelocity,
        Ap::StopVelocity,
        Ap::StartAcceleration,
        Ap::FinalDeceleration,
        Ap::BreakVelocity,
        Ap::StopDeceleration,
        Ap::Bow1,
        Ap::Bow2,
        Ap::Bow3,
        Ap::Bow4,
        Ap::MaxCurrent,
        Ap::StandbyCurrent,
    ];
    let Value::Constant { value, compared: Some(at) } = state.accumulator else { return None };
    let row = facts.module().axis_parameter(facts.at(address).kind)?;
    if !SETTINGS.contains(&row.id) {
        return None;
    }
    let span = facts.span(address);
    let message = format!(
        "`{}` writes {value} to {}: that is what the comparison at {} has left in the accumulator",
        facts.command(address),
        row.name,
        facts.place(at, span)
    );
    let problem = Problem::warning(Code::ConstantWritten, span, message);
    Some(problem.note(facts.span(at), "here it is known").help("load the value again before it is written"))
}

/// load-unused
pub(crate) fn loads(facts: &Facts, problems: &mut Vec<Problem>) {
    let used = used(facts);
    for (address, instruction) in facts.reached() {
        let Effects { writes, .. } = Effects::of(instruction);
        let only_loads = writes == Places::ACCUMULATOR | Places::FLAGS;
        let tells = instruction.opcode == Opcode::GAP
            && meaning(facts.module(), instruction.kind) == Some(Ap::ExtendedErrorFlags);
        if !only_loads || tells || instruction.opcode == Opcode::SAC || used.contains_key(&address) {
            continue;
        }
        let message = format!("the value of `{}` is never used", facts.command(address));
        let problem = Problem::warning(Code::LoadUnused, facts.span(address), message);
        problems.push(
            problem
                .help("delete the command, or use its value")
                .unsafe_fix("delete the command", facts.delete(address)),
        );
    }
}

/// The commands behind which the accumulator or the flags are used on some way.
fn used(facts: &Facts) -> HashMap<usize, ()> {
    let mut used = HashMap::new();
    for part in &facts.flow.parts {
        let mut before: HashMap<usize, Vec<usize>> = HashMap::new();
        for node in &part.nodes {
            facts.flow.next(*node).for_each(|next| before.entry(next).or_default().push(*node));
        }
        let mut live: HashMap<usize, Places> = HashMap::new();
        let mut open = part.nodes.clone();
        while let Some(node) = open.pop() {
            let after = after(facts, node, &live);
            if !after.is_empty() {
                used.insert(node, ());
            }
            let now = needed(facts, node, after);
            if live.insert(node, now) != Some(now) {
                open.extend(before.get(&node).into_iter().flatten());
            }
        }
    }
    used
}

const WATCHED: Places = Places::ACCUMULATOR.union(Places::FLAGS);

/// What is used behind a command. Where a routine or the program ends, the caller or the host may look.
fn after(facts: &Facts, node: usize, live: &HashMap<usize, Places>) -> Places {
    let mut next = facts.flow.next(node).peekable();
    match facts.flow.steps[node] {
        Step::ReturnFromInterrupt | Step::Restart(_) => Places::empty(),
        _ if next.peek().is_none() => WATCHED,
        _ => next.filter_map(|next| live.get(&next)).fold(Places::empty(), |sum, live| sum | *live),
    }
}

/// What is used from a command on.
fn needed(facts: &Facts, node: usize, after: Places) -> Places {
    let instruction = facts.at(node);
    if facts.assembly.commands.get(node).is_some_and(|command| !command.is_valid) {
        return WATCHED;
    }
    let Effects { reads, writes } = match facts.callee(node) {
        Some(part) => facts.values.summaries[part].effects,
        None if matches!(facts.flow.steps[node], Step::Call(_) | Step::CallIf(_)) => return WATCHED,
        None => Effects::of(instruction),
    };
    let kept = if facts.callee(node).is_some() { after } else { after - writes };
    (kept | reads) & WATCHED
}
