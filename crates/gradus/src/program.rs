//! Programs from files: source texts are assembled, `.bin` files are read as they are.

use std::fs;
use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use gradus_asm::{Assembly, Options, Problem, Source, Style, assemble, from_bin, render};
use gradus_tmcl::Instruction;
use gradus_tmcl::catalogue::Module;

use crate::complain;

/// A program and, if there is one, the text it was made from.
pub struct Program {
    /// The commands.
    pub commands: Vec<Instruction>,
    assembly: Option<Assembly>,
}

impl Program {
    /// Reads a `.bin` file, or assembles a source file.
    ///
    /// # Errors
    /// When the file cannot be read or has errors; they are printed before.
    pub fn load(file: &Path, module: &'static Module, options: &Options) -> anyhow::Result<Self> {
        if file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("bin")) {
            return Ok(Self { commands: read_bin(file)?, assembly: None });
        }
        let assembly = assemble_file(file, module, options)?;
        Ok(Self { commands: assembly.program.clone(), assembly: Some(assembly) })
    }

    /// File, line and text of the command at an address, if the source is known.
    pub fn place(&self, address: u16) -> Option<String> {
        let assembly = self.assembly.as_ref()?;
        let span = *assembly.lines.get(usize::from(address))?;
        let source = assembly.sources.get(span.source)?;
        let (line, _) = source.position(span.start);
        Some(format!("{}:{line}: {}", source.path.display(), source.slice(span).trim()))
    }
}

/// Reads a `.bin` file.
///
/// # Errors
/// When it cannot be read or is not one.
pub fn read_bin(file: &Path) -> anyhow::Result<Vec<Instruction>> {
    let bytes = read(file)?;
    from_bin(&bytes).with_context(|| format!("{} is no program file", file.display()))
}

/// Assembles a file and prints its problems.
///
/// # Errors
/// When the file cannot be read or has errors.
pub fn assemble_file(file: &Path, module: &'static Module, options: &Options) -> anyhow::Result<Assembly> {
    let text = read(file)?;
    let assembly = assemble(file, &text, module, options, &|path: &Path| fs::read(path));
    print_problems(&assembly.problems, &assembly.sources);
    match assembly.problems.iter().filter(|problem| problem.is_error()).count() {
        0 => Ok(assembly),
        1 => bail!("{} has an error", file.display()),
        count => bail!("{} has {count} errors", file.display()),
    }
}

/// Prints problems for people.
pub fn print_problems(problems: &[Problem], sources: &[Source]) {
    let style = if io::stderr().is_terminal() { Style::Colored } else { Style::Plain };
    for problem in problems {
        complain(format_args!("{}\n", render(problem, sources, style)));
    }
}

fn read(file: &Path) -> anyhow::Result<Vec<u8>> {
    fs::read(file).with_context(|| format!("cannot read {}", file.display()))
}

/// Where the assembler looks for included files.
#[derive(clap::Args)]
pub struct Includes {
    /// Folder to look in for included files, after the folder of the including file; may be given several times.
    #[arg(short = 'I', value_name = "DIR")]
    folders: Vec<PathBuf>,
}

impl Includes {
    /// The assembler's options with these folders.
    pub fn options(&self) -> Options {
        Options { include_dirs: self.folders.clone(), ..Options::default() }
    }
}
