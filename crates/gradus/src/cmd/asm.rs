//! `gradus asm`

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use gradus_asm::{Assembly, Identity, listing, symbols, to_bin};

use crate::complain;
use crate::program::{ProgramFile, STANDARD, Surroundings};

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
  gradus asm main.tmc --listing                 shows address and bytes of each line
  gradus asm - -o main.bin < main.tmc           from the standard input; -o - writes to the standard output")]
pub struct Asm {
    /// Source file; - is the standard input
    file: PathBuf,
    /// File to write; FILE.bin beside the source file if left out; - is the standard output
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
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
        let (module, assembly) = ProgramFile::read(&self.file)?.assemble(&self.surroundings, self.no_stop)?;
        let output = self.output();
        for file in [Some(&output), self.symbols.as_ref()].into_iter().flatten() {
            refuse_source(file, &assembly)?;
        }
        let bytes = to_bin(&assembly.program);
        if output == Path::new(STANDARD) {
            out.write_all(&bytes)?;
        } else {
            write(&output, &bytes)?;
        }
        if let Some(file) = &self.symbols {
            write(file, symbols(&assembly).as_bytes())?;
        }
        if self.listing {
            write!(out, "{}", listing(&assembly))?;
        }
        let (used, identity) = (assembly.program.len(), Identity::of(&assembly.program));
        let size = format!("{}: {used} of {} commands, {identity}", output.display(), module.memory());
        if output == Path::new(STANDARD) {
            complain(format_args!("{size}"));
            return Ok(());
        }
        Ok(writeln!(out, "{size}")?)
    }

    fn output(&self) -> PathBuf {
        let beside = || {
            if self.file == Path::new(STANDARD) { STANDARD.into() } else { self.file.with_extension("bin") }
        };
        self.output.clone().unwrap_or_else(beside)
    }
}

/// A program is never written over its own text.
fn refuse_source(output: &Path, assembly: &Assembly) -> anyhow::Result<()> {
    let Ok(file) = fs::canonicalize(output) else { return Ok(()) };
    let files = assembly.sources.iter().filter(|source| !source.built_in);
    if { files }.any(|source| fs::canonicalize(&source.path).is_ok_and(|source| source == file)) {
        bail!("{} is a source file of this program; name another file", output.display());
    }
    Ok(())
}

fn write(file: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    fs::write(file, bytes).with_context(|| format!("cannot write {}", file.display()))
}
