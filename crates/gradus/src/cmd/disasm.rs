//! `gradus disasm`

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::bail;
use gradus_asm::{Identity, disassemble};
use gradus_tmcl::Instruction;
use gradus_tmcl::catalogue::{MODULES, Module, TMCM_3351};
use indicatif::ProgressBar;

use crate::port::{self, Port};
use crate::program::ProgramFile;

/// Turn a program back into a source text: a .bin file, or what is in a module
///
/// The text assembles to the same bytes; jumps get labels. With --port and no file the program is read from the module. The first
/// line has the program's identity, which `gradus asm` and `gradus verify` print as well.
#[derive(clap::Args)]
#[command(after_long_help = "\
Examples:
  gradus disasm home.bin
  gradus disasm --port /dev/ttyACM0 > home.tmc")]
pub struct Disasm {
    /// Program file; - is the standard input
    #[arg(required_unless_present = "port", conflicts_with = "port")]
    file: Option<PathBuf>,
    /// Module the program is for; if left out the one at the port, or of gradus.toml, or tmcm-3351
    #[arg(long, value_parser = port::module(MODULES), ignore_case = true, conflicts_with = "port")]
    module: Option<&'static Module>,
    /// Read all of the module's program memory, not only up to two commands 0 behind each other
    #[arg(long, conflicts_with = "file")]
    all: bool,
    #[command(flatten, next_help_heading = "Connection")]
    port: Port,
}

impl Disasm {
    pub fn run(self, out: &mut dyn Write) -> anyhow::Result<()> {
        let (commands, module) = match &self.file {
            Some(file) => self.of_file(file)?,
            None => self.of_module()?,
        };
        let (count, identity) = (commands.len(), Identity::of(&commands));
        writeln!(out, "// {}, {count} commands, identity {identity}", module.name)?;
        Ok(write!(out, "{}", disassemble(&commands, module))?)
    }

    fn of_file(&self, file: &Path) -> anyhow::Result<(Vec<Instruction>, &'static Module)> {
        let file = ProgramFile::read(file)?;
        let module = self.module.map_or_else(|| file.module(), |module| Ok(Some(module)))?.unwrap_or(&TMCM_3351);
        Ok((file.commands()?, module))
    }

    fn of_module(&self) -> anyhow::Result<(Vec<Instruction>, &'static Module)> {
        let mut session = self.port.open()?;
        let module = session.module()?;
        let bar = ProgressBar::new_spinner().with_message("read");
        if session.hides_program()? {
            bail!("the program in the {} is protected against reading (global parameter 81)", module.name);
        }
        let commands = session.read_program(self.all, |count| bar.set_position(count as u64))?;
        bar.finish_and_clear();
        if commands.is_empty() {
            bail!("the {} at {} has no program", module.name, session.port());
        }
        Ok((commands, module))
    }
}
