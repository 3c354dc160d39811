//! Programs from files: source texts are assembled, `.bin` files are read as they are.

use std::fs;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow, bail};
use gradus_asm::{
    Assembly, LintOptions, Options, Problem, Severity, Source, Style, assemble, from_bin, lint, module_of, render,
};
use gradus_lab::Project;
use gradus_tmcl::Instruction;
use gradus_tmcl::catalogue::{MODULES, Module, TMCM_3351};

use crate::levels::Levels;
use crate::{complain, port, project, terminal};

/// A version of the firmware: `(1, 11)` is 1.11.
type Version = (u8, u8);

/// The name that stands for standard input and output.
pub const STANDARD: &str = "-";
/// What messages call the standard input.
const STANDARD_INPUT: &str = "<stdin>";

/// A program and, if there is one, the text it was made from.
pub struct Program {
    /// The commands.
    pub commands: Vec<Instruction>,
    assembly: Option<Assembly>,
}

impl Program {
    /// File and line of the command at an address, `home.tmc:12`; its address where there is no text.
    pub fn place(&self, address: usize) -> String {
        self.line(address).map_or_else(|| format!("address {address}"), |(place, _)| place)
    }

    /// The same with the command: `home.tmc:12: WAIT POS, 0, 0`.
    pub fn place_and_text(&self, address: usize, module: &Module) -> String {
        let command = || self.commands.get(address).map(|command| command.display(module).to_string());
        match self.line(address) {
            Some((place, text)) => format!("{place}: {text}"),
            None => command().map_or_else(|| self.place(address), |text| format!("{}: {text}", self.place(address))),
        }
    }

    /// True for the STOP that the assembler put behind the last line.
    pub fn is_appended(&self, address: usize) -> bool {
        self.assembly.as_ref().is_some_and(|assembly| address >= assembly.commands.len())
    }

    fn line(&self, address: usize) -> Option<(String, String)> {
        let assembly = self.assembly.as_ref()?;
        let span = assembly.commands.get(address)?.span();
        let source = assembly.sources.get(span.source)?;
        let (line, _) = source.position(span.start);
        Some((format!("{}:{line}", source.path.display()), source.slice(span).trim().into()))
    }
}

/// The file of a program with what its folder says.
pub struct ProgramFile {
    path: PathBuf,
    bytes: Vec<u8>,
    project: Project,
}

impl ProgramFile {
    /// Reads a file, or the standard input for `-`.
    ///
    /// # Errors
    /// When it cannot be read, or the folder's `gradus.toml` has mistakes.
    pub fn read(file: &Path) -> anyhow::Result<Self> {
        let is_standard = file == Path::new(STANDARD);
        Self::named(if is_standard { STANDARD_INPUT.into() } else { file.to_path_buf() }, read(file)?)
    }

    /// A text under a name, as if it stood there.
    ///
    /// # Errors
    /// When the folder's `gradus.toml` has mistakes.
    pub fn named(path: PathBuf, bytes: Vec<u8>) -> anyhow::Result<Self> {
        let project = project::near(path.parent().unwrap_or(Path::new("")))?;
        Ok(Self { bytes, path, project })
    }

    /// The module that the program is for, as its first lines or the folder's `gradus.toml` say.
    ///
    /// # Errors
    /// When the first lines name a module that there is not.
    pub fn module(&self) -> anyhow::Result<Option<&'static Module>> {
        Ok(self.written_module()?.filter(|module| !module.is_any()))
    }

    /// The same; `any` is one too.
    fn written_module(&self) -> anyhow::Result<Option<&'static Module>> {
        let text = String::from_utf8_lossy(if self.is_bin() { &[] } else { &self.bytes });
        let Some(name) = module_of(&text) else {
            return Ok(self.project.module.as_deref().and_then(project::named));
        };
        let module = project::named(name).ok_or_else(|| {
            let names: Vec<String> = MODULES.iter().map(|module| module.name.to_lowercase()).collect();
            anyhow!("{}: there is no module `{name}`, only {}, any", self.path.display(), names.join(", "))
        });
        module.map(Some)
    }

    /// The program for a module with a version of the firmware: a `.bin` file as it is, a source text assembled.
    ///
    /// # Errors
    /// When it has errors, which are printed before, or no command.
    pub fn program(
        &self,
        module: &'static Module,
        firmware: Option<Version>,
        surroundings: &Surroundings,
    ) -> anyhow::Result<Program> {
        if !self.is_bin() {
            let options = surroundings.options(&self.project);
            let assembly = self.assembly(module, firmware, options, &surroundings.levels)?;
            return Ok(Program { commands: assembly.program.clone(), assembly: Some(assembly) });
        }
        let commands = self.commands()?;
        if commands.is_empty() { Err(self.empty()) } else { Ok(Program { commands, assembly: None }) }
    }

    /// The commands of a `.bin` file.
    ///
    /// # Errors
    /// When it is none.
    pub fn commands(&self) -> anyhow::Result<Vec<Instruction>> {
        from_bin(&self.bytes).with_context(|| format!("{} is no program file", self.path.display()))
    }

    /// The assembled text; its problems are printed.
    ///
    /// # Errors
    /// When it has errors, or no command.
    pub fn assemble(&self, surroundings: &Surroundings, no_stop: bool) -> anyhow::Result<(&'static Module, Assembly)> {
        let module = self.target(surroundings)?;
        let options = Options { no_stop, ..surroundings.options(&self.project) };
        Ok((module, self.assembly(module, None, options, &surroundings.levels)?))
    }

    /// The module that the program is assembled for.
    fn target(&self, surroundings: &Surroundings) -> anyhow::Result<&'static Module> {
        let module = surroundings.module.map_or_else(|| self.written_module(), |module| Ok(Some(module)))?;
        Ok(module.unwrap_or(&TMCM_3351))
    }

    /// The text with everything that is known about it; nothing is printed, and errors are not counted.
    ///
    /// # Errors
    /// When the first lines name a module that there is not.
    pub fn analyse(&self, surroundings: &Surroundings) -> anyhow::Result<Assembly> {
        let module = self.target(surroundings)?;
        let options = surroundings.options(&self.project);
        Ok(assemble(&self.path, &self.bytes, module, &options, &|path: &Path| fs::read(path)))
    }

    /// What problems are worth: what the command line says and, behind it, the folder's `gradus.toml`.
    pub fn levels(&self, levels: &Levels) -> anyhow::Result<Levels> {
        levels.and(&self.project)
    }

    fn assembly(
        &self,
        module: &'static Module,
        firmware: Option<Version>,
        options: Options,
        levels: &Levels,
    ) -> anyhow::Result<Assembly> {
        let assembly = assemble(&self.path, &self.bytes, module, &options, &|path: &Path| fs::read(path));
        let levels = self.levels(levels)?;
        let options = LintOptions { allow: levels.allow.clone(), firmware, ..LintOptions::default() };
        let mut problems = lint(&assembly, &options);
        problems.retain(|problem| problem.severity > Severity::Hint || levels.denies(problem));
        print_problems(&problems, &assembly.sources);
        let file = self.path.display();
        let denied = problems.iter().filter(|problem| !problem.is_error() && levels.denies(problem)).count();
        match assembly.problems.iter().filter(|problem| problem.is_error()).count() {
            0 if assembly.commands.is_empty() => Err(self.empty()),
            0 if denied > 0 => bail!("{file} has problems that --deny or gradus.toml denies: {denied}"),
            0 => Ok(assembly),
            1 => bail!("{file} has an error"),
            count => bail!("{file} has {count} errors"),
        }
    }

    fn empty(&self) -> anyhow::Error {
        anyhow!("{} has no command", self.path.display())
    }

    fn is_bin(&self) -> bool {
        self.path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("bin"))
    }
}

/// How many problems of a program are printed; whoever has more mends these first.
const MOST_PRINTED: usize = 50;

/// Prints problems for people, errors first where there are too many to print all.
pub fn print_problems(problems: &[Problem], sources: &[Source]) {
    let style = if terminal::colored_messages() { Style::Colored } else { Style::Plain };
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

/// Reads a file, or the standard input for `-`.
///
/// # Errors
/// When it cannot be read.
pub fn read(file: &Path) -> anyhow::Result<Vec<u8>> {
    if file != Path::new(STANDARD) {
        return fs::read(file).with_context(|| format!("cannot read {}", file.display()));
    }
    let mut bytes = Vec::new();
    io::stdin().read_to_end(&mut bytes).context("cannot read the standard input")?;
    Ok(bytes)
}

/// What the assembler needs besides the source file.
#[derive(clap::Args)]
pub struct Surroundings {
    /// Module the program is for; if left out the one of a line `// gradus: module NAME` in its first lines, or of gradus.toml,
    /// or tmcm-3351; any is a module that the catalogue lacks
    #[arg(long, value_parser = port::program_module(), ignore_case = true)]
    pub module: Option<&'static Module>,
    /// Folder to look in for included files, after the folder of the including file; may be given several times
    #[arg(short = 'I', value_name = "DIR")]
    folders: Vec<PathBuf>,
    /// Define a constant, as the line NAME = VALUE would; may be given several times
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = constant)]
    constants: Vec<String>,
    #[command(flatten)]
    pub levels: Levels,
}

impl Surroundings {
    /// The assembler's options with these folders and constants, and those of a project.
    fn options(&self, project: &Project) -> Options {
        let include_dirs = self.folders.iter().chain(&project.include).cloned().collect();
        let name = |line: &String| line.split_once('=').map_or(String::new(), |(name, _)| name.trim().to_lowercase());
        let given: Vec<String> = self.constants.iter().map(name).collect();
        let theirs = project.defines.iter().filter(|line| !given.contains(&name(line)));
        Options { include_dirs, constants: theirs.chain(&self.constants).cloned().collect(), ..Options::default() }
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
    use super::*;

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
