//! Rules about interrupts and their handlers.

use std::collections::HashSet;

use gradus_tmcl::catalogue::InterruptKind;
use gradus_tmcl::{Opcode, WaitFor};

use super::facts::Facts;
use crate::code::Code;
use crate::flow::{Kind, MAIN, Step};
use crate::problem::Problem;

/// The number that stands for all interrupts in EI and DI.
const GLOBAL: u8 = 255;
/// Bank of the periods of the timers.
const PERIODS: u8 = 3;

/// handler-without-reti, falls-into-handler, handler-waits
pub(crate) fn handlers(facts: &Facts, problems: &mut Vec<Problem>) {
    for part in 0..facts.flow.parts.len() {
        let Kind::Handler(interrupt) = facts.flow.parts[part].kind else { continue };
        let start = facts.start(part);
        if facts.flow.contains(MAIN, start) {
            problems.extend(falls_into(facts, part, interrupt));
        } else {
            problems.extend(leaves(facts, part, interrupt));
        }
        problems.extend(waits(facts, part, interrupt));
    }
}

/// The command from which the main program comes into a handler.
fn falls_into(facts: &Facts, part: usize, interrupt: u8) -> Option<Problem> {
    let flow = &facts.flow;
    let start = facts.start(part);
    let before = flow.parts[MAIN].nodes.iter().find(|node| flow.next(**node).any(|next| next == start));
    let from = before.copied().unwrap_or(start);
    let message =
        format!("the program runs from here into {}, the handler of interrupt {interrupt}", facts.name(start));
    let problem = Problem::warning(Code::FallsIntoHandler, facts.span(from), message);
    Some(problem.note(facts.span(start), "the handler").help("put a STOP or a JA in front of the handler"))
}

/// A way out of a handler that is no RETI.
fn leaves(facts: &Facts, part: usize, interrupt: u8) -> Option<Problem> {
    let flow = &facts.flow;
    let own = |node: &&usize| !flow.contains(MAIN, **node);
    let leaves = |node: &&usize| {
        let stops = matches!(flow.steps[**node], Step::Stop | Step::Restart(_));
        (stops && flow.steps[**node] == Step::Stop) || flow.next(**node).any(|next| flow.contains(MAIN, next))
    };
    let from = *flow.parts[part].nodes.iter().filter(own).find(leaves)?;
    let message = format!(
        "`{}` leaves the handler of interrupt {interrupt} without RETI: interrupts stay off",
        facts.command(from)
    );
    let problem = Problem::warning(Code::HandlerWithoutReti, facts.span(from), message);
    Some(problem.note(facts.span(facts.start(part)), "the handler").help("end the handler with RETI on every way"))
}

fn waits(facts: &Facts, part: usize, interrupt: u8) -> Option<Problem> {
    let for_ever = |node: &&usize| {
        let instruction = facts.at(**node);
        instruction.opcode == Opcode::WAIT && instruction.kind != WaitFor::TICKS.0 && instruction.value == 0
    };
    let node = *facts.flow.parts[part].nodes.iter().find(for_ever)?;
    let message = format!("`{}` may wait for ever in the handler of interrupt {interrupt}", facts.command(node));
    let problem = Problem::warning(Code::HandlerWaits, facts.span(node), message);
    Some(problem.help("give it a time-out, or wait in the main program"))
}

/// interrupt-not-enabled, timer-without-period
pub(crate) fn pairs(facts: &Facts, problems: &mut Vec<Problem>) {
    let of = |opcode| {
        let found = facts.reached().filter(move |(_, instruction)| instruction.opcode == opcode);
        found.map(|(address, instruction)| (address, instruction.kind)).collect::<Vec<_>>()
    };
    let (vectors, enabled) = (of(Opcode::VECT), of(Opcode::EI));
    let numbers = |list: &[(usize, u8)]| list.iter().map(|(_, number)| *number).collect::<HashSet<u8>>();
    let (with_vector, with_enable) = (numbers(&vectors), numbers(&enabled));
    let mut seen = HashSet::new();
    for (address, number) in vectors.iter().filter(|(_, number)| !with_enable.contains(number)) {
        if seen.insert(*number) {
            let message = format!("interrupt {number} has a handler, but is never enabled");
            problems.push(hint(facts, *address, message, format!("write EI {number}, if the host does not do it")));
        }
    }
    for (address, number) in enabled.iter().filter(|(_, number)| *number != GLOBAL) {
        if !with_vector.contains(number) {
            let message = format!("interrupt {number} is enabled, but has no handler");
            problems.push(hint(facts, *address, message, format!("write VECT {number}, <label>")));
        } else if !with_enable.contains(&GLOBAL) && seen.insert(GLOBAL) {
            let message = "interrupts are never enabled together".into();
            problems.push(hint(facts, *address, message, "write EI 255".into()));
        }
        problems.extend(period(facts, *address, *number));
    }
}

fn hint(facts: &Facts, address: usize, message: String, help: String) -> Problem {
    Problem::hint(Code::InterruptNotEnabled, facts.span(address), message).help(help)
}

/// A timer that is enabled and never gets a period.
fn period(facts: &Facts, address: usize, number: u8) -> Option<Problem> {
    let row = facts.module().interrupt(number)?;
    let sets = |opcode| matches!(opcode, Opcode::SGP | Opcode::AGP | Opcode::RSGP);
    let is_set = facts.reached().any(|(_, it)| sets(it.opcode) && (it.kind, it.motor) == (row.index, PERIODS));
    if row.kind != InterruptKind::Timer || is_set {
        return None;
    }
    let message = format!("timer {} is enabled, but its period is never set", row.index);
    let problem = Problem::hint(Code::TimerWithoutPeriod, facts.span(address), message);
    Some(problem.help(format!("write SGP {}, {PERIODS}, <milliseconds>, if the host does not do it", row.index)))
}
