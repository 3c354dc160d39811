//! Rules about axes that move.

use gradus_tmcl::catalogue::Ap;
use gradus_tmcl::{Instruction, MoveKind, Opcode, Search, WaitFor};

use super::facts::Facts;
use crate::code::Code;
use crate::effects::meaning;
use crate::problem::Problem;
use crate::values::{AXES, Certainty, Flags, How, Motion, Origin, State, Value};

/// Commands that write an axis parameter.
const WRITES: [Opcode; 4] = [Opcode::SAP, Opcode::AAP, Opcode::SAPX, Opcode::AAPX];
/// Commands that start a motion of the axis in their motor field.
const STARTS: [Opcode; 6] = [Opcode::MVP, Opcode::MVPA, Opcode::ROL, Opcode::ROR, Opcode::ROLA, Opcode::RORA];

/// wait-pos-after-velocity, standstill-polled-early, position-written-while-moving, search-not-awaited
pub(crate) fn along_the_way(facts: &Facts, problems: &mut Vec<Problem>) {
    for (address, instruction) in facts.reached() {
        for state in facts.values.before(&facts.flow, address) {
            let here = Here { facts, address, instruction, state };
            problems.extend(here.wait_pos().or_else(|| here.standstill()).or_else(|| here.written()));
            problems.extend(here.search());
        }
    }
}

/// A command with what is known before it.
struct Here<'a> {
    facts: &'a Facts<'a>,
    address: usize,
    instruction: &'a Instruction,
    state: &'a State,
}

impl Here<'_> {
    /// The motion of the command's axis.
    fn motion(&self) -> Option<&Motion> {
        self.state.motion.get(usize::from(self.instruction.motor))
    }

    fn warning(&self, code: Code, message: String) -> Problem {
        Problem::warning(code, self.facts.span(self.address), message)
    }

    fn hint(&self, code: Code, message: String) -> Problem {
        Problem::hint(code, self.facts.span(self.address), message)
    }

    fn command(&self) -> &str {
        self.facts.command(self.address)
    }

    fn wait_pos(&self) -> Option<Problem> {
        let motion = self.motion()?;
        let waits = self.instruction.opcode == Opcode::WAIT && self.instruction.kind == WaitFor::POS.0;
        let turns = motion.how == How::Velocity && matches!(motion.certainty, Certainty::Must | Certainty::May);
        if !waits || !turns {
            return None;
        }
        let message = format!(
            "axis {} turns at a velocity (`{}`): `{}` may end at once or never",
            self.instruction.motor,
            self.facts.command(motion.at),
            self.command()
        );
        let problem = self.warning(Code::WaitPosAfterVelocity, message).note(self.facts.span(motion.at), "the motion");
        Some(problem.help("wait for a time, or until axis parameter 3 is 0"))
    }

    /// The speed is compared with 0 while the motor has had no time to start.
    fn standstill(&self) -> Option<Problem> {
        if self.instruction.opcode != Opcode::JC || self.instruction.kind > 3 {
            return None;
        }
        let Flags::Compared { value: Value::Read(Origin::Axis { number, axis }), with: 0, .. } = self.state.flags
        else {
            return None;
        };
        let motion = self.state.motion.get(usize::from(axis))?;
        let early = motion.certainty == Certainty::Must && motion.is_fresh;
        if !early || meaning(self.facts.module(), number) != Some(Ap::ActualSpeed) {
            return None;
        }
        let started = self.facts.command(motion.at);
        let message = format!("the speed is also 0 before the motor has started (`{started}`)");
        let problem = self.hint(Code::StandstillPolledEarly, message).note(self.facts.span(motion.at), "the start");
        let wait = self.facts.insert(motion.at + 1, "WAIT TICKS, 0, 1");
        Some(problem.help("write `WAIT TICKS, 0, 1` behind the start").unsafe_fix("insert a WAIT", wait))
    }

    /// The counter is written under a moving axis.
    fn written(&self) -> Option<Problem> {
        let writes = matches!(self.instruction.opcode, Opcode::SAP | Opcode::AAP);
        let motion = self.motion()?;
        if !writes || !self.is_position() {
            return None;
        }
        let (axis, command) = (self.instruction.motor, self.command());
        let problem = match motion.certainty {
            Certainty::Must => {
                let message = format!("axis {axis} moves here: `{command}` changes only the counter");
                self.warning(Code::PositionWrittenWhileMoving, message)
            }
            Certainty::May => {
                let message = format!("axis {axis} may still move here: `{command}` changes only the counter");
                self.hint(Code::PositionWrittenWhileMoving, message)
            }
            _ => return None,
        };
        Some(problem.note(self.facts.span(motion.at), "the motion").help("wait until the axis stands"))
    }

    /// The position counter; in closed loop the encoder's as well.
    fn is_position(&self) -> bool {
        match meaning(self.facts.module(), self.instruction.kind) {
            Some(Ap::ActualPosition) => true,
            Some(Ap::EncoderPosition) => self.facts.reached().any(|(_, it)| {
                it.opcode == Opcode::SAP
                    && it.value != 0
                    && meaning(self.facts.module(), it.kind) == Some(Ap::ClosedLoop)
            }),
            _ => false,
        }
    }

    fn search(&self) -> Option<Problem> {
        let motion = self.motion()?;
        let waits = motion.how == How::Search && motion.certainty == Certainty::Must;
        if !waits || !STARTS.contains(&self.instruction.opcode) || is_coordinated(self.instruction) {
            return None;
        }
        let message =
            format!("the reference search of axis {} may still run at `{}`", self.instruction.motor, self.command());
        let problem = self.hint(Code::SearchNotAwaited, message).note(self.facts.span(motion.at), "the search");
        let wait = format!("WAIT RFS, {}, 0", self.instruction.motor);
        let edits = self.facts.insert(self.address, &wait);
        Some(problem.help(format!("write `{wait}` before it")).unsafe_fix("wait for the search", edits))
    }
}

fn is_coordinated(instruction: &Instruction) -> bool {
    matches!(instruction.opcode, Opcode::MVP | Opcode::MVPA) && instruction.kind == MoveKind::COORD.0
}

/// move-overwritten
pub(crate) fn straight_line(facts: &Facts, problems: &mut Vec<Problem>) {
    let mut targets = [None; AXES];
    for (address, instruction) in facts.commands() {
        let ways_meet = facts.label(address).is_some();
        let goes_on = matches!(
            instruction.opcode,
            Opcode::SAP | Opcode::SGP | Opcode::SIO | Opcode::CALC | Opcode::AAP | Opcode::AGP | Opcode::NOP
        );
        if ways_meet || !(goes_on || instruction.opcode == Opcode::MVP) {
            targets = [None; AXES];
        }
        if instruction.opcode != Opcode::MVP || is_coordinated(instruction) || !facts.flow.is_reached(address) {
            continue;
        }
        let Some(target) = targets.get_mut(usize::from(instruction.motor)) else { continue };
        if let Some(before) = target.replace(address) {
            let span = facts.span(address);
            let message = format!(
                "`{}` replaces the target of {} before it is reached",
                facts.command(address),
                facts.place(before, span)
            );
            let problem =
                Problem::warning(Code::MoveOverwritten, span, message).note(facts.span(before), "the first move");
            problems.push(problem.help(format!("write `WAIT POS, {}, 0` between them", instruction.motor)));
        }
    }
}

/// not-referenced, switches-left-off
pub(crate) fn program_wide(facts: &Facts, problems: &mut Vec<Problem>) {
    problems.extend(not_referenced(facts));
    (0..facts.module().axes).for_each(|axis| problems.extend(switches(facts, axis)));
}

fn not_referenced(facts: &Facts) -> Option<Problem> {
    let refers = |it: &Instruction| {
        let searches = it.opcode == Opcode::RFS && it.kind == Search::START.0;
        searches || WRITES.contains(&it.opcode) && meaning(facts.module(), it.kind) == Some(Ap::ActualPosition)
    };
    if facts.commands().any(|(_, instruction)| refers(instruction)) {
        return None;
    }
    let is_absolute = |it: &Instruction| it.opcode == Opcode::MVP && it.kind != MoveKind::REL.0;
    let (address, _) = facts.reached().find(|(_, instruction)| is_absolute(instruction))?;
    let message = "absolute moves, but no reference search and no write of the position anywhere in the program";
    let problem = Problem::hint(Code::NotReferenced, facts.span(address), message);
    Some(problem.help("search a reference first (RFS), if nothing else does it: after power-on every position is 0"))
}

/// Both stop switches of an axis are switched off and never on again.
fn switches(facts: &Facts, axis: u8) -> Option<Problem> {
    let off = |right: bool| {
        let mut last = None;
        for (address, it) in facts.reached().filter(|(_, it)| it.opcode == Opcode::SAP && it.motor == axis) {
            let disables = match (meaning(facts.module(), it.kind), right) {
                (Some(Ap::RightSwitchDisable), true) | (Some(Ap::LeftSwitchDisable), false) => it.value != 0,
                (Some(Ap::RightSwitchEnable), true) | (Some(Ap::LeftSwitchEnable), false) => it.value == 0,
                _ => continue,
            };
            last = disables.then_some(address);
        }
        last
    };
    let (right, left) = (off(true)?, off(false)?);
    let message = format!("both stop switches of axis {axis} are off and stay off");
    let problem = Problem::hint(Code::SwitchesLeftOff, facts.span(right.max(left)), message);
    Some(
        problem
            .note(facts.span(right.min(left)), "the other one")
            .help("switch them on again, or delete the two commands"),
    )
}
