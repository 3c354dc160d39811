//! Rules that look at one command each, and at the size of the program.

use gradus_tmcl::catalogue::Command;
use gradus_tmcl::{Opcode, WaitFor};

use super::facts::Facts;
use super::flow;
use crate::code::Code;
use crate::problem::{Edit, Problem, Span};

/// ticks-comment, needs-firmware, memory-nearly-full, stop-appended
pub(crate) fn rule(facts: &Facts, problems: &mut Vec<Problem>) {
    problems.extend(ticks(facts));
    problems.extend(firmware(facts));
    problems.extend(memory(facts));
    flow::stop_appended(facts, problems);
}

/// A tick of WAIT in milliseconds.
const TICK_MS: f64 = 10.0;

fn ticks(facts: &Facts) -> impl Iterator<Item = Problem> {
    let waits = facts.commands().filter(|(_, it)| it.opcode == Opcode::WAIT && it.kind == WaitFor::TICKS.0);
    waits.filter_map(|(address, instruction)| {
        let line = facts.assembly.commands[address].line;
        let comment = facts.text(line).split_once("//")?.1;
        let said = time_ms(comment)?;
        let is = f64::from(instruction.value) * TICK_MS;
        if instruction.value < 0 || said == is {
            return None;
        }
        let message = format!("{} ticks are {}, the comment says {}", instruction.value, time(is), time(said));
        let problem = Problem::warning(Code::TicksComment, facts.span(address), message);
        let ticks = said / TICK_MS;
        let right = (ticks.fract() == 0.0).then(|| facts.operand(address, 2));
        Some(match right {
            Some(span) => problem
                .help(format!("a tick is 10 ms: write `WAIT TICKS, 0, {ticks}`, or correct the comment"))
                .unsafe_fix(format!("wait {ticks} ticks"), vec![Edit { span, text: ticks.to_string() }]),
            None => problem.help("a tick is 10 ms: correct the comment"),
        })
    })
}

/// The time in a comment in milliseconds, if it names exactly one.
fn time_ms(comment: &str) -> Option<f64> {
    let mut words =
        comment.split(|c: char| c.is_whitespace() || "(),;:".contains(c)).filter(|word| !word.is_empty()).peekable();
    let mut found = None;
    while let Some(word) = words.next() {
        let digits = word.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(word.len());
        let Ok(number) = word[..digits].parse::<f64>() else { continue };
        let unit = if digits < word.len() { &word[digits..] } else { words.peek().copied().unwrap_or("") };
        let factor = match unit.trim_end_matches('.').to_lowercase().as_str() {
            "ms" | "msec" | "milliseconds" => 1.0,
            "s" | "sec" | "second" | "seconds" => 1000.0,
            _ => continue,
        };
        if found.replace(number * factor).is_some() {
            return None;
        }
    }
    found
}

/// Seconds where they are shorter.
fn time(ms: f64) -> String {
    if ms >= 1000.0 { format!("{} s", ms / 1000.0) } else { format!("{ms} ms") }
}

fn firmware(facts: &Facts) -> impl Iterator<Item = Problem> {
    let version = facts.options.firmware.or(facts.pragmas.firmware);
    facts.commands().filter_map(move |(address, instruction)| {
        let (row, version) = (Command::of(instruction.opcode)?, version?);
        let since = row.since.filter(|since| version < *since && !facts.module().is_any())?;
        let text = |(major, minor): (u8, u8)| format!("{major}.{minor:02}");
        let message =
            format!("`{}` needs firmware {}; the program is for {}", row.mnemonic, text(since), text(version));
        let span = facts.assembly.commands[address].mnemonic;
        let problem = Problem::warning(Code::NeedsFirmware, span, message);
        Some(problem.help("write it with older commands, or update the firmware"))
    })
}

/// Per cent of the memory above which a program is nearly too long.
const FULL: usize = 97;

fn memory(facts: &Facts) -> Option<Problem> {
    let (used, room) = (facts.assembly.program.len(), facts.module().memory());
    if facts.module().is_any() || used > room || used * 100 <= room * FULL {
        return None;
    }
    let span = facts.assembly.commands.last().map_or(Span::default(), |last| last.span());
    let message = format!("the program has {used} of the {room} commands that the {} holds", facts.module().name);
    Some(Problem::hint(Code::MemoryNearlyFull, span, message).help("move what repeats into routines"))
}
