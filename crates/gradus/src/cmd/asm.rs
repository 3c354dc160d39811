//! `gradus asm`

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::Context;
use gradus_asm::{listing, symbols, to_bin};
use gradus_tmcl::catalogue::{MODULES, Module};

use crate::port;
use crate::program::{Surroundings, assemble_file};

/// Assemble a program
///
/// Reports the problems of the text in one run, at most 50, with file, line, column and a hint. Writes the program as a .bin file:
/// eight bytes a command. Exit status 1 if the program has errors; nothing is written then.
#[derive(clap::Args)]
#[command(after_long_help = "\
Examples:
  gradus asm two-positions.tmc                  writes two-positions.bin
  gradus asm main.tmc -o main.bin -I include    with a folder of included files
  gradus asm main.tmc -D Speed=1000             with a constant from outside
  gradus asm main.tmc --listing                 shows address and bytes of each line")]
pub struct Asm {
    /// Source file
    file: PathBuf,
    /// File to write; FILE.bin beside the source file if left out
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Module the program is for
    #[arg(long, value_parser = port::module(MODULES), ignore_case = true, default_value = "tmcm-3351")]
    module: &'static Module,
    #[command(flatten)]
    surroundings: Surroundings,
    /// Write the labels, one `label address` a line
    #[arg(long, value_name = "FILE")]
    symbols: Option<PathBuf>,
    /// Print the listing: address, bytes and text of each line
    #[arg(long)]
    listing: bool,
    /// Append no STOP to a program that does not end with one
    #[arg(long)]
    no_stop: bool,
}

impl Asm {
    pub fn run(self, out: &mut dyn Write) -> anyhow::Result<()> {
        let options = gradus_asm::Options { no_stop: self.no_stop, ..self.surroundings.options() };
        let assembly = assemble_file(&self.file, self.module, &options)?;
        let output = self.output.unwrap_or_else(|| self.file.with_extension("bin"));
        write(&output, &to_bin(&assembly.program))?;
        if let Some(file) = &self.symbols {
            write(file, symbols(&assembly).as_bytes())?;
        }
        if self.listing {
            write!(out, "{}", listing(&assembly))?;
        }
        let (used, room) = (assembly.program.len(), self.module.program_len);
        Ok(writeln!(out, "{}: {used} of {room} commands", output.display())?)
    }
}

fn write(file: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    fs::write(file, bytes).with_context(|| format!("cannot write {}", file.display()))
}
