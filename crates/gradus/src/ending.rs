//! How and where a program ended, and what the module refused on the way.

use gradus_host::{Error, ProgramError, Session};
use gradus_tmcl::catalogue::Module;
use gradus_tmcl::{Instruction, Opcode};
use serde_json::{Value, json};

use crate::program::Program;

/// Why watching ended.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum End {
    /// The program stopped.
    Stopped,
    /// The time was up.
    TimeUp,
    /// Somebody wanted the end.
    Interrupted,
    /// The module restarted, and has forgotten what it did.
    Restarted,
}

impl End {
    /// Name in results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Stopped => "stopped",
            Self::TimeUp => "time-up",
            Self::Interrupted => "interrupted",
            Self::Restarted => "restarted",
        }
    }
}

/// What went wrong in a program: a command that the module refused, or a call or return that it ignored.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Wrong {
    Refused(ProgramError),
    Stack(u16),
}

/// What went wrong in a program so far, each thing once.
#[derive(Default)]
pub struct Refusals {
    seen: Vec<Wrong>,
}

impl Refusals {
    /// Asks for the latest one. A module remembers no other, so of those that follow each other faster than they are asked for
    /// only the last one is seen.
    ///
    /// # Errors
    /// When the session fails.
    pub fn look(&mut self, session: &mut Session) -> Result<(), Error> {
        let found = [session.program_error()?.map(Wrong::Refused), session.stack_fault().map(Wrong::Stack)];
        for wrong in found.into_iter().flatten() {
            if !self.seen.contains(&wrong) {
                self.seen.push(wrong);
            }
        }
        Ok(())
    }

    /// True if there was none.
    pub fn is_empty(&self) -> bool {
        self.seen.is_empty()
    }

    /// Each in words.
    pub fn lines(&self, program: &Program, module: &Module) -> Vec<String> {
        self.seen.iter().map(|wrong| wrong.text(program, module)).collect()
    }

    /// Each for programs.
    pub fn json(&self, program: &Program, module: &Module) -> Value {
        let wrong = |wrong: &Wrong| {
            let place = program.place(wrong.address());
            json!({ "address": wrong.address(), "place": place, "text": wrong.text(program, module) })
        };
        self.seen.iter().map(wrong).collect()
    }
}

impl Wrong {
    fn address(self) -> usize {
        match self {
            Self::Refused(error) => error.address.into(),
            Self::Stack(address) => address.into(),
        }
    }

    fn text(self, program: &Program, module: &Module) -> String {
        let address = self.address();
        let opcode = program.commands.get(address).map(|command| command.opcode);
        match (self, opcode) {
            (Self::Refused(error), _) => {
                format!("refused at {}: {}", program.place_and_text(address, module), error.status.text())
            }
            (_, Some(Opcode::RSUB)) => format!("fault: RSUB without CSUB at {}", program.place(address)),
            (_, Some(Opcode::CALL)) => format!("fault: CALL nested deeper than 8 at {}", program.place(address)),
            _ => format!("fault: CSUB nested deeper than 8 at {}", program.place(address)),
        }
    }
}

/// The STOP that a program stopped at, by its counter: it stands behind it, at some modules at it.
pub fn stop_at(counter: usize, program: &Program) -> Option<usize> {
    let is_stop =
        |address: &usize| program.commands.get(*address).is_some_and(|command| command.opcode == Opcode::STOP);
    [counter.checked_sub(1), Some(counter)].into_iter().flatten().find(is_stop)
}

/// Where a program stopped: `stopped at home.tmc:12`; where there is no STOP somebody stopped it from outside.
pub fn stopped(counter: usize, program: &Program, module: &Module) -> String {
    let behind = program.commands.len() <= counter;
    match stop_at(counter, program) {
        Some(stop) if program.is_appended(stop) => "stopped at its end".into(),
        Some(stop) => format!("stopped at {}", program.place(stop)),
        None if counter == 0 => "was put back to its start, from outside or past the end of its memory".into(),
        None if behind => "stopped behind its end".into(),
        None => format!("was stopped from outside at {}", program.place_and_text(counter, module)),
    }
}

/// Where a program is that has not stopped, and whether it waits: in a WAIT, or in a loop that only looks at something.
pub fn underway(counter: usize, waits: bool, program: &Program, module: &Module) -> String {
    match waits.then_some(counter).or_else(|| polling(counter, &program.commands)) {
        Some(address) => format!("the program waits at {}", program.place_and_text(address, module)),
        None => format!("the program is at {}", program.place_and_text(counter, module)),
    }
}

/// The conditional jump back that closes the smallest loop around an address, if nothing in this loop acts.
fn polling(counter: usize, commands: &[Instruction]) -> Option<usize> {
    let jumps = (counter..).zip(commands.get(counter..)?);
    let backwards = |(address, jump): &(usize, &Instruction)| {
        matches!(jump.opcode, Opcode::JC | Opcode::JA | Opcode::DJNZ)
            && usize::try_from(jump.value).is_ok_and(|to| to <= counter && to <= *address)
    };
    let (end, jump) = { jumps }.find(backwards)?;
    let body = commands.get(jump.value as usize..=end)?;
    (jump.opcode == Opcode::JC && body.iter().all(|command| only_looks(command.opcode))).then_some(end)
}

/// True for commands that change nothing but registers.
fn only_looks(opcode: Opcode) -> bool {
    matches!(
        opcode,
        Opcode::GAP
            | Opcode::GGP
            | Opcode::GIO
            | Opcode::CALC
            | Opcode::CALCX
            | Opcode::COMP
            | Opcode::JC
            | Opcode::CLE
    )
}
