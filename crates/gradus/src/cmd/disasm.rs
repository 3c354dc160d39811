//! `gradus disasm`

use std::io::Write;
use std::path::PathBuf;

use gradus_asm::disassemble;
use gradus_tmcl::catalogue::{MODULES, Module, TMCM_3351};

use crate::port;
use crate::program::ProgramFile;

/// Turn a .bin file back into a source text
///
/// The text assembles to the same bytes; jumps get labels.
#[derive(clap::Args)]
pub struct Disasm {
    /// Program file; - is the standard input
    file: PathBuf,
    /// Module the program is for; if left out the one of gradus.toml, or tmcm-3351
    #[arg(long, value_parser = port::module(MODULES), ignore_case = true)]
    module: Option<&'static Module>,
}

impl Disasm {
    pub fn run(self, out: &mut dyn Write) -> anyhow::Result<()> {
        let file = ProgramFile::read(&self.file)?;
        let module = self.module.map_or_else(|| file.module(), |module| Ok(Some(module)))?.unwrap_or(&TMCM_3351);
        Ok(write!(out, "{}", disassemble(&file.commands()?, module))?)
    }
}
