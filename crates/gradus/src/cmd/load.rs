//! `gradus load`

use std::io::Write;
use std::path::PathBuf;

use anyhow::bail;
use gradus_asm::Identity;
use gradus_host::{Error, Session};
use gradus_tmcl::Instruction;
use gradus_tmcl::catalogue::Gp;

use crate::port::{self, Port};
use crate::program::{ProgramFile, Surroundings};
use crate::progress::progress;

/// Write a program into a module, and leave it there
///
/// Assembles the program, or takes a .bin file as it is, stops what runs, writes the program, reads it back and compares. Motors are
/// left as they are. On an error the module holds a part of the new program; load again.
#[derive(clap::Args)]
#[command(after_long_help = "\
Examples:
  gradus load home.tmc --port /dev/ttyACM0
  gradus load home.tmc --port /dev/ttyACM0 --start
  gradus load home.tmc --port /dev/ttyACM0 --autostart     at every power-up from now on")]
pub struct Load {
    /// Source file or .bin file; - is the standard input
    file: PathBuf,
    #[command(flatten)]
    surroundings: Surroundings,
    /// Start the program afterwards
    #[arg(long)]
    start: bool,
    /// Let the module start the program at power-up (global parameter 77); without this the setting stays as it is
    #[arg(long)]
    autostart: bool,
    /// Do not ask whether to write to a real module that GRADUS_PORT or gradus.toml names
    #[arg(long)]
    yes: bool,
    #[command(flatten, next_help_heading = "Connection")]
    port: Port,
}

impl Load {
    pub fn run(self, out: &mut dyn Write) -> anyhow::Result<()> {
        let file = ProgramFile::read(&self.file)?;
        let wanted = self.surroundings.module.map_or_else(|| file.module(), |module| Ok(Some(module)))?;
        let mut session = self.port.open_to_act(wanted, self.yes, &format!("load {}", self.file.display()))?;
        port::stays(&mut session)?;
        let module = session.module()?;
        if let Some(wanted) = wanted.filter(|wanted| wanted.name != module.name) {
            bail!("{} is a {}, not a {}", session.port(), module.name, wanted.name);
        }
        let program = file.program(module, session.firmware()?, &self.surroundings)?;
        load(&mut session, &program.commands)?;
        let count = program.commands.len();
        let (file, identity) = (self.file.display(), Identity::of(&program.commands));
        writeln!(out, "{file}: {count} commands, {identity}, written to {} and compared", session.port())?;
        if self.autostart {
            session.set_global(Gp::AutoStart, 0, 1)?;
            writeln!(out, "it starts at power-up")?;
        }
        if self.start {
            session.reset()?;
            session.run()?;
            writeln!(out, "it runs")?;
        }
        Ok(())
    }
}

/// Writes a program into the module and reads it back.
///
/// # Errors
/// When the module refuses, keeps something else, or the line breaks.
pub fn load(session: &mut Session, commands: &[Instruction]) -> Result<(), Error> {
    session.stop()?;
    let bar = progress("download", commands.len());
    session.download(commands, |count| bar.set_position(count as u64))?;
    let bar = progress("verify", commands.len());
    session.verify(commands, |count| bar.set_position(count as u64))
}
