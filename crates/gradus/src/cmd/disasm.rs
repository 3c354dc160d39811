//! `gradus disasm`

use std::io::Write;
use std::path::PathBuf;

use gradus_asm::disassemble;
use gradus_tmcl::catalogue::{MODULES, Module};

use crate::port;
use crate::program::read_bin;

/// Turn a .bin file back into a source text
///
/// The text assembles to the same bytes; jumps get labels.
#[derive(clap::Args)]
pub struct Disasm {
    /// Program file
    file: PathBuf,
    /// Module the program is for
    #[arg(long, value_parser = port::module(MODULES), ignore_case = true, default_value = "tmcm-3351")]
    module: &'static Module,
}

impl Disasm {
    pub fn run(self, out: &mut dyn Write) -> anyhow::Result<()> {
        let text = disassemble(&read_bin(&self.file)?, self.module);
        Ok(write!(out, "{text}")?)
    }
}
