//! `gradus cmd`

use std::io::{self, Write};
use std::path::Path;

use anyhow::{Context, bail};
use gradus_asm::{Options, Problem, Source, assemble, assemble_line};
use gradus_host::{Error, Session, Terminal};
use gradus_tmcl::ascii::Reply;
use gradus_tmcl::catalogue::{EncodeError, Module};
use gradus_tmcl::{Instruction, Opcode, ParseError, Status};
use serde_json::{Value, json};

use crate::json::Json;
use crate::port::Port;
use crate::program::print_problems;

/// Send commands in direct mode
///
/// Commands are written as in programs; the names of the built-in include files are known. Each answer is printed with status
/// and value. Nothing is sent if a command is misspelt. A command that the module refuses does not keep the following ones
/// from being sent; exit status 1 if any was refused.
///
/// Control commands, which have no mnemonic, are written with their four fields, here as in programs:
/// DATA opcode, type, motor, value; `#data` means the same. DATA 129, 0, 0, 0 runs the program.
///
/// With --ascii the commands are lines of the ASCII interface of the TMCM-351, without address letter: those commands, and RUN,
/// STOP and BIN. The module is left in the mode in which it was found.
#[derive(clap::Args)]
#[command(after_long_help = "\
Examples:
  gradus cmd 'GAP 1, 0' 'SAP 4, 0, 20000'
  gradus cmd --port tcp:localhost:4322 'MVP ABS, 0, 51200'
  gradus cmd --port /dev/ttyACM0 'DATA 136, 1, 0, 0'
  gradus cmd --ascii --port sim:tmcm-351 'MVP REL, 0, 1000' 'GAP 0, 0'")]
pub struct Direct {
    #[command(flatten, next_help_heading = "Connection")]
    port: Port,
    /// Speak in command lines of the ASCII interface instead of datagrams
    #[arg(long, conflicts_with_all = ["verbose", "trace"])]
    ascii: bool,
    #[command(flatten)]
    json: Json,
    /// Commands, one an argument
    #[arg(required = true, value_name = "COMMAND")]
    commands: Vec<String>,
}

impl Direct {
    pub fn run(self, out: &mut dyn Write) -> anyhow::Result<()> {
        let refused = if self.ascii { self.type_lines(out)? } else { self.send(out)? };
        match refused {
            0 => Ok(()),
            count => bail!("{count} of {} commands refused", self.commands.len()),
        }
    }

    /// Sends the commands and gives back how many were refused.
    fn send(&self, out: &mut dyn Write) -> anyhow::Result<usize> {
        let mut session = self.port.open()?;
        let instructions = parse(&self.commands, session.module()?)?;
        let (mut refused, mut answers) = (0, Vec::new());
        for (text, instruction) in self.commands.iter().zip(instructions) {
            let (accepted, answer) = match send(&mut session, instruction) {
                Ok(answer) => (true, answer),
                Err(Error::Refused { status, reason, .. }) => (false, refusal(status, reason)),
                Err(error) => return Err(error.into()),
            };
            refused += usize::from(!accepted);
            self.answer(text, accepted, &answer, &mut answers, out)?;
        }
        self.json.write(&[("answers", answers.into())], out)?;
        Ok(refused)
    }

    fn answer(
        &self,
        text: &str,
        accepted: bool,
        answer: &str,
        answers: &mut Vec<Value>,
        out: &mut dyn Write,
    ) -> io::Result<()> {
        answers.push(json!({ "command": text, "accepted": accepted, "answer": answer }));
        if self.json.is_alone() { Ok(()) } else { writeln!(out, "{text}: {answer}") }
    }

    /// The same in command lines.
    fn type_lines(&self, out: &mut dyn Write) -> anyhow::Result<usize> {
        let check = |text: &String| Terminal::check(text).with_context(|| format!("nothing was sent: `{text}`"));
        let lines = self.commands.iter().map(check).collect::<Result<Vec<_>, _>>()?;
        let mut terminal = self.port.terminal()?;
        let (mut refused, mut answers) = (0, Vec::new());
        for (text, line) in self.commands.iter().zip(lines) {
            let Reply { status, value, .. } = terminal.ask(text.trim())?;
            let accepted = status.is_ok();
            let answer =
                if accepted { format!("{status} {value}") } else { refusal(status, Terminal::reason(line, status)) };
            refused += usize::from(!accepted);
            self.answer(text, accepted, &answer, &mut answers, out)?;
        }
        self.json.write(&[("answers", answers.into())], out)?;
        terminal.close()?;
        Ok(refused)
    }
}

/// A status with its reason, if that is known.
fn refusal(status: Status, reason: String) -> String {
    [status.to_string(), reason].join("; ").trim_end_matches("; ").into()
}

fn parse(commands: &[String], module: &'static Module) -> anyhow::Result<Vec<Instruction>> {
    let mut instructions = Vec::new();
    for text in commands {
        match read(text, module) {
            Ok(instruction) => instructions.push(instruction),
            Err(problems) => print_problems(&problems, &[Source::new("command", text.as_bytes())]),
        }
    }
    match commands.len() - instructions.len() {
        0 => Ok(instructions),
        _ => bail!("nothing was sent"),
    }
}

/// Reads a command. A value that 32 bits cannot hold would arrive as another one, and is a problem here; one that the module
/// does not take is refused by the module itself.
fn read(text: &str, module: &'static Module) -> Result<Instruction, Vec<Problem>> {
    match Instruction::parse(text, module) {
        Ok(instruction) => Ok(instruction),
        Err(ParseError::Encode(EncodeError::Range { .. })) => {
            let nothing = |_: &Path| Err(io::ErrorKind::NotFound.into());
            let options = Options { no_stop: true, ..Options::default() };
            let problems = assemble("command", text.as_bytes(), module, &options, &nothing).problems;
            if problems.iter().any(Problem::is_error) { Err(problems) } else { assemble_line(text, module) }
        }
        Err(_) => assemble_line(text, module),
    }
}

/// Sends a command and puts the answer into words. Two commands have replies of a form of their own.
fn send(session: &mut Session, instruction: Instruction) -> Result<String, Error> {
    match (instruction.opcode, instruction.kind) {
        (Opcode::FIRMWARE_VERSION, 0) => session.version_text(),
        (Opcode::READ_MEMORY, _) => {
            let address = u16::try_from(instruction.value).unwrap_or(u16::MAX); // past the end either way
            Ok(session.read_memory(address)?.display(session.module()?).to_string())
        }
        _ => {
            let reply = session.execute(instruction)?;
            if reply.status.is_ok() {
                Ok(format!("{} {}", reply.status, reply.value))
            } else {
                Err(session.refused(instruction, reply.status))
            }
        }
    }
}
