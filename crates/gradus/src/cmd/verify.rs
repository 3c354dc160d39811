//! `gradus verify`

use std::io::Write;
use std::path::PathBuf;

use anyhow::bail;
use gradus_asm::{Difference, Identity};
use gradus_tmcl::Instruction;
use gradus_tmcl::catalogue::Module;

use crate::exit::Exit;
use crate::port::Port;
use crate::program::{Program, ProgramFile, Surroundings};
use crate::progress::progress;

/// Compare a program with the one in a module
///
/// Reads the program in the module and says whether it is the one of the file; where it is not, what is different: the lines with
/// their text and what the module has in their place. Nothing in the module changes.
///
/// Exit status: 0 when they are the same, 1 when they are not, or something failed.
#[derive(clap::Args)]
#[command(after_long_help = "\
Examples:
  gradus verify home.tmc --port /dev/ttyACM0
  gradus verify home.bin --port /dev/ttyACM0")]
pub struct Verify {
    /// Source file or .bin file
    file: PathBuf,
    #[command(flatten)]
    port: Port,
    #[command(flatten)]
    surroundings: Surroundings,
    /// Read all of the program memory, not only up to two commands 0 behind each other
    #[arg(long)]
    all: bool,
}

/// How many differences are shown.
const MOST_SHOWN: usize = 50;

impl Verify {
    pub fn run(self, out: &mut dyn Write) -> anyhow::Result<()> {
        let file = ProgramFile::read(&self.file)?;
        let mut session = self.port.open()?;
        let module = session.module()?;
        let wanted = self.surroundings.module.filter(|module| !module.is_any());
        if let Some(wanted) = wanted.filter(|wanted| wanted.name != module.name) {
            bail!("{} is a {}, not a {}", session.port(), module.name, wanted.name);
        }
        let program = file.program(module, session.firmware()?, &self.surroundings)?;
        if session.hides_program()? {
            bail!("the program in the {} is protected against reading (global parameter 81)", module.name);
        }
        let bar = progress("reading", usize::from(module.program_len));
        let memory = session.read_program(self.all, |read| bar.set_position(read as u64))?;
        drop(bar);
        let compared = Compared { program: &program, memory: &memory, module };
        writeln!(out, "{}: {}", self.file.display(), Identity::of(&program.commands))?;
        writeln!(out, "{}: {}", session.port(), Identity::of(&memory))?;
        compared.report(out)
    }
}

/// A program beside the memory of a module.
struct Compared<'a> {
    program: &'a Program,
    memory: &'a [Instruction],
    module: &'static Module,
}

impl Compared<'_> {
    fn report(&self, out: &mut dyn Write) -> anyhow::Result<()> {
        let difference = Difference::between(&self.program.commands, self.memory);
        let (say, addresses): (String, &[usize]) = match &difference {
            Difference::None => {
                return Ok(writeln!(out, "the same program, {} commands", self.program.commands.len())?);
            }
            Difference::StopAppended => ("the same program, but only one of the two ends with STOP".into(), &[]),
            Difference::Shifted(by) => (format!("the same program, {by} addresses further on in the module"), &[]),
            Difference::Constants(list) => (format!("{}, in values only", differ(list.len())), list),
            Difference::Commands(list) => (differ(list.len()), list),
        };
        for address in addresses.iter().take(MOST_SHOWN) {
            writeln!(out, "{} | {}", self.ours(*address), self.theirs(*address))?;
        }
        if addresses.len() > MOST_SHOWN {
            writeln!(out, "and {} more", addresses.len() - MOST_SHOWN)?;
        }
        Err(Exit::with(1, say))
    }

    fn ours(&self, address: usize) -> String {
        match self.program.commands.get(address) {
            Some(_) => self.program.place_and_text(address, self.module),
            None => format!("address {address}: nothing"),
        }
    }

    fn theirs(&self, address: usize) -> String {
        let command = self.memory.get(address).filter(|command| **command != Instruction::default());
        command.map_or_else(|| "nothing".into(), |command| command.display(self.module).to_string())
    }
}

fn differ(count: usize) -> String {
    if count == 1 { "1 command differs".into() } else { format!("{count} commands differ") }
}
