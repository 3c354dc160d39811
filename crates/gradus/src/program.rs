//! Programs from files: source texts are assembled, `.bin` files are read as they are.

use std::fs;
use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use gradus_asm::{Assembly, Options, Problem, Source, Style, assemble, from_bin, render};
use gradus_tmcl::catalogue::Module;
use gradus_tmcl::{Instruction, Opcode};

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

    /// The address at which the program stopped, by the program counter: a STOP lies before the counter.
    pub fn stopped_at(&self, counter: i32) -> i32 {
        let before = counter.checked_sub(1).and_then(|address| usize::try_from(address).ok());
        let is_stop = before.and_then(|address| self.commands.get(address)).is_some_and(|it| it.opcode == Opcode::STOP);
        if is_stop { counter - 1 } else { counter }
    }

    /// File, line and text of the command at an address, if the source is known.
    pub fn place(&self, address: u16) -> Option<String> {
        let assembly = self.assembly.as_ref()?;
        let span = assembly.commands.get(usize::from(address))?.line;
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

/// How many problems of a program are printed; whoever has more mends these first.
const MOST_PRINTED: usize = 50;

/// Prints problems for people, errors first where there are too many to print all.
pub fn print_problems(problems: &[Problem], sources: &[Source]) {
    let style = if io::stderr().is_terminal() { Style::Colored } else { Style::Plain };
    let mut printed: Vec<&Problem> = problems.iter().collect();
    if printed.len() > MOST_PRINTED {
        printed.sort_by_key(|problem| !problem.is_error());
        printed.truncate(MOST_PRINTED);
    }
    for problem in &printed {
        complain(format_args!("{}\n", render(problem, sources, style)));
    }
    if printed.len() < problems.len() {
        complain(format_args!("and {} more\n", problems.len() - printed.len()));
    }
}

fn read(file: &Path) -> anyhow::Result<Vec<u8>> {
    fs::read(file).with_context(|| format!("cannot read {}", file.display()))
}

/// What the assembler needs besides the source file.
#[derive(clap::Args)]
pub struct Surroundings {
    /// Folder to look in for included files, after the folder of the including file; may be given several times.
    #[arg(short = 'I', value_name = "DIR")]
    folders: Vec<PathBuf>,
    /// Define a constant, as the line NAME = VALUE would; may be given several times.
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = constant)]
    constants: Vec<String>,
}

impl Surroundings {
    /// The assembler's options with these folders and constants.
    pub fn options(&self) -> Options {
        Options { include_dirs: self.folders.clone(), constants: self.constants.clone(), ..Options::default() }
    }
}

/// Takes the line that defines a constant; the assembler has a look at the value.
fn constant(text: &str) -> Result<String, &'static str> {
    let is_name = |name: &str| {
        name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
            && name.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_')
    };
    let is_value = |value: &str| !value.trim().is_empty() && !value.contains('\n');
    let fits = text.split_once('=').is_some_and(|(name, value)| is_name(name.trim()) && is_value(value));
    if fits { Ok(text.into()) } else { Err("a name and a value are expected: Speed=1000") }
}

#[cfg(test)]
mod tests {
    use super::constant;

    #[test]
    fn a_constant_is_a_name_and_a_value() {
        for text in ["Speed=1000", "_a1 = -2 * Speed", "x=0x10"] {
            assert_eq!(constant(text).as_deref(), Ok(text));
        }
        for text in ["Speed", "Speed=", "=1", "1x=1", "STOP\nx=1", "x=1\nSTOP", "MVP ABS, 0=1"] {
            assert!(constant(text).is_err(), "{text}");
        }
    }
}
