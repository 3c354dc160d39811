//! Rules about the time-outs of WAIT.

use std::collections::HashMap;

use gradus_tmcl::{Instruction, Opcode, WaitFor};

use super::facts::Facts;
use crate::code::Code;
use crate::effects::{Effects, Places};
use crate::problem::Problem;

/// The condition of JC that a WAIT has timed out.
const ETO: u8 = 8;
/// Flags of CLE that clear it: ALL and ETO.
const CLEARS: [u8; 2] = [0, 1];

/// True for a WAIT that may time out.
fn may_time_out(instruction: &Instruction) -> bool {
    instruction.opcode == Opcode::WAIT && instruction.kind != WaitFor::TICKS.0 && instruction.value != 0
}

fn looks(instruction: &Instruction) -> bool {
    matches!(instruction.opcode, Opcode::JC | Opcode::CALL) && instruction.kind == ETO
}

/// timeout-never
pub(crate) fn never(facts: &Facts, problems: &mut Vec<Problem>) {
    if facts.reached().any(|(_, instruction)| may_time_out(instruction)) {
        return;
    }
    for (address, _) in facts.reached().filter(|(_, instruction)| looks(instruction)) {
        let message = format!("`{}` never holds: no WAIT has a time-out", facts.command(address));
        let problem = Problem::warning(Code::TimeoutNever, facts.span(address), message);
        problems.push(problem.help("give the WAIT a time-out: `WAIT POS, 0, 500` waits 5 s at most"));
    }
}

/// timeout-not-checked
pub(crate) fn unchecked(facts: &Facts, problems: &mut Vec<Problem>) {
    if !facts.reached().any(|(_, instruction)| may_time_out(instruction)) {
        return;
    }
    for part in &facts.flow.parts {
        let moves = moves_unchecked(facts, &part.nodes);
        for node in part.nodes.iter().filter(|node| may_time_out(facts.at(**node))) {
            if facts.flow.next(*node).any(|next| moves.contains_key(&next)) {
                let message =
                    format!("`{}` may time out, and nothing looks at it before the next motion", facts.command(*node));
                let problem = Problem::hint(Code::TimeoutNotChecked, facts.span(*node), message);
                problems.push(problem.help("write `JC ETO, <label>` behind it"));
            }
        }
    }
}

/// The commands from which a way leads to a motion past no look at the time-out.
fn moves_unchecked(facts: &Facts, nodes: &[usize]) -> HashMap<usize, ()> {
    let mut before: HashMap<usize, Vec<usize>> = HashMap::new();
    for node in nodes {
        facts.flow.next(*node).for_each(|next| before.entry(next).or_default().push(*node));
    }
    let mut open: Vec<usize> = nodes.iter().copied().filter(|node| moves(facts, *node)).collect();
    let mut found = HashMap::new();
    while let Some(node) = open.pop() {
        if !checks(facts, node) && found.insert(node, ()).is_none() {
            open.extend(before.get(&node).into_iter().flatten());
        }
    }
    found
}

fn moves(facts: &Facts, node: usize) -> bool {
    let starts = [
        Opcode::MVP,
        Opcode::MVPA,
        Opcode::MVPXA,
        Opcode::ROL,
        Opcode::ROR,
        Opcode::ROLA,
        Opcode::RORA,
        Opcode::ROLXA,
        Opcode::RORXA,
        Opcode::RFS,
    ];
    let effects = Effects::of(facts.at(node));
    starts.contains(&facts.opcode(node)) && effects.writes.contains(Places::MOTION)
}

/// A look at the time-out, here or in a routine that is called.
fn checks(facts: &Facts, node: usize) -> bool {
    let instruction = facts.at(node);
    let clears = instruction.opcode == Opcode::CLE && CLEARS.contains(&instruction.kind);
    let in_routine = |part: usize| facts.values.summaries[part].effects.reads.contains(Places::ERRORS);
    looks(instruction) || clears || facts.callee(node).is_some_and(in_routine)
}
