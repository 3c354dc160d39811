//! `gradus check`

use std::collections::{BTreeMap, HashMap, HashSet};
use std::fs;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::ValueEnum;
use gradus_asm::{Assembly, Changed, Code, LintOptions, Problem, Severity, Style, apply_fixes, lint, render};

use crate::exit::Exit;
use crate::findings::{self, Finding};
use crate::levels::Levels;
use crate::program::{ProgramFile, Surroundings};
use crate::{complain, sources, terminal};

/// Look for mistakes in programs
///
/// Reports errors, warnings (what the module will hardly do as its author expects) and hints, each with its place, what to do about
/// it, and a code that `gradus explain` explains. In a folder, the .tmc files that no other one includes are the programs.
///
/// A comment `// gradus: allow(CODE)` leaves out a finding of its line, `// gradus: allow-file(CODE)` those of its file.
///
/// Exit status: 0 when nothing is denied, which is errors unless --deny says more; 1 when something is; 2 when the command line is
/// wrong or a file cannot be read.
#[derive(clap::Args)]
#[command(after_long_help = "\
Examples:
  gradus check home.tmc
  gradus check --deny warnings .                     for a continuous integration
  gradus check --fix home.tmc                        changes what keeps the program's bytes
  gradus check --stdin home.tmc < buffer             for an editor")]
pub struct Check {
    /// Programs, and folders with programs
    #[arg(required_unless_present = "stdin", value_name = "FILE|DIR")]
    files: Vec<PathBuf>,
    #[command(flatten)]
    surroundings: Surroundings,
    /// How the findings are printed
    #[arg(long, value_name = "FORMAT", value_enum, default_value_t)]
    format: Format,
    /// Apply the fixes that keep the program's bytes
    #[arg(long)]
    fix: bool,
    /// Apply also fixes that change the program: later addresses move, and hosts may start routines by address
    #[arg(long = "unsafe", requires = "fix")]
    unsafe_too: bool,
    /// Count the findings by code at the end
    #[arg(long)]
    statistics: bool,
    /// Propose names of the built-in files for numbers too
    #[arg(long)]
    pedantic: bool,
    /// Read the program from the standard input, as if it stood in this file
    #[arg(long, value_name = "NAME", conflicts_with_all = ["files", "fix"])]
    stdin: Option<PathBuf>,
}

/// How findings are printed.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, ValueEnum)]
enum Format {
    /// For people
    #[default]
    Text,
    /// One object with all of them
    Json,
    /// Annotations of a GitHub workflow
    Github,
    /// A SARIF 2.1.0 log
    Sarif,
}

/// A program with what was found in it.
struct Checked {
    assembly: Assembly,
    problems: Vec<Problem>,
    levels: Levels,
}

/// How often fixes are applied and the rest looked at again.
const ROUNDS: usize = 10;

impl Check {
    pub fn run(self, out: &mut dyn Write) -> anyhow::Result<()> {
        let mut checked = self.programs().map_err(|error| Exit::with(2, format!("{error:#}")))?;
        forget_used_elsewhere(&mut checked);
        forget_repeated(&mut checked);
        self.print(&checked, out)?;
        let denied =
            checked.iter().flat_map(|it| it.problems.iter().filter(|problem| it.levels.denies(problem))).count();
        match (denied, self.format) {
            (0, _) => Ok(()),
            (1, Format::Text) => Err(Exit::with(1, "1 problem is denied")),
            (count, Format::Text) => Err(Exit::with(1, format!("{count} problems are denied"))),
            _ => Err(Exit::with(1, "")),
        }
    }

    fn programs(&self) -> anyhow::Result<Vec<Checked>> {
        if let Some(name) = &self.stdin {
            let mut bytes = Vec::new();
            io::stdin().read_to_end(&mut bytes).context("cannot read the standard input")?;
            return Ok(vec![self.check(&ProgramFile::named(name.clone(), bytes)?)?]);
        }
        let files = sources::programs(&self.files)?;
        files
            .iter()
            .map(|file| if self.fix { self.mend(file) } else { self.check(&ProgramFile::read(file)?) })
            .collect()
    }

    fn check(&self, file: &ProgramFile) -> anyhow::Result<Checked> {
        let levels = file.levels(&self.surroundings.levels)?;
        let assembly = file.analyse(&self.surroundings)?;
        let options = LintOptions { allow: levels.allow.clone(), pedantic: self.pedantic, ..LintOptions::default() };
        Ok(Checked { problems: lint(&assembly, &options), assembly, levels })
    }

    /// Applies fixes until there are none left.
    fn mend(&self, file: &Path) -> anyhow::Result<Checked> {
        for _ in 0..ROUNDS {
            let checked = self.check(&ProgramFile::read(file)?)?;
            let changed = apply_fixes(&checked.problems, &checked.assembly.sources, self.unsafe_too);
            if changed.is_empty() {
                return Ok(checked);
            }
            changed.iter().try_for_each(|changed| write(changed, &checked.assembly))?;
        }
        self.check(&ProgramFile::read(file)?)
    }

    fn print(&self, checked: &[Checked], out: &mut dyn Write) -> anyhow::Result<()> {
        let findings: Vec<Finding> = checked.iter().flat_map(findings_of).collect();
        match self.format {
            Format::Text => text(checked, &findings, out)?,
            Format::Json => writeln!(out, "{:#}", findings::json(&findings))?,
            Format::Github => findings.iter().try_for_each(|finding| writeln!(out, "{}", finding.github()))?,
            Format::Sarif => writeln!(out, "{:#}", findings::sarif(&findings))?,
        }
        if self.statistics { statistics(&findings, self.format, out) } else { Ok(()) }
    }
}

fn findings_of(checked: &Checked) -> impl Iterator<Item = Finding<'_>> {
    checked.problems.iter().map(|problem| Finding { problem, sources: &checked.assembly.sources })
}

fn write(changed: &Changed, assembly: &Assembly) -> anyhow::Result<()> {
    let path = &assembly.sources[changed.source].path;
    fs::write(path, &changed.text).with_context(|| format!("cannot write {}", path.display()))?;
    let fixes = if changed.fixes == 1 { "1 fix".into() } else { format!("{} fixes", changed.fixes) };
    complain(format_args!("{}: {fixes}", path.display()));
    Ok(())
}

/// A name of an included file is unused only if no program that includes the file uses it.
fn forget_used_elsewhere(checked: &mut [Checked]) {
    let key = |it: &Checked, problem: &Problem| {
        let path = it.assembly.sources[problem.span.source].path.clone();
        (path, problem.span.start, problem.code)
    };
    let is_name = |problem: &Problem| matches!(problem.code, Code::UnusedLabel | Code::UnusedConstant);
    let (mut reports, mut users): (HashMap<_, usize>, HashMap<PathBuf, usize>) = Default::default();
    for it in checked.iter() {
        let paths: HashSet<_> = it.assembly.sources.iter().map(|source| source.path.clone()).collect();
        paths.into_iter().for_each(|path| *users.entry(path).or_default() += 1);
        let names = it.problems.iter().filter(|problem| is_name(problem));
        names.for_each(|problem| *reports.entry(key(it, problem)).or_default() += 1);
    }
    for it in checked {
        let kept: Vec<_> = it
            .problems
            .iter()
            .filter(|problem| {
                let key = key(it, problem);
                !is_name(problem) || reports.get(&key) == users.get(&key.0)
            })
            .cloned()
            .collect();
        it.problems = kept;
    }
}

/// What is wrong in an included file is reported once, however many programs include it.
fn forget_repeated(checked: &mut [Checked]) {
    let mut seen = HashSet::new();
    for Checked { assembly, problems, .. } in checked {
        problems.retain(|problem| {
            let path = assembly.sources[problem.span.source].path.clone();
            seen.insert((path, problem.span.start, problem.span.end, problem.code))
        });
    }
}

fn text(checked: &[Checked], findings: &[Finding], out: &mut dyn Write) -> anyhow::Result<()> {
    let style = if terminal::colored_output() { Style::Colored } else { Style::Plain };
    for finding in findings {
        writeln!(out, "{}\n", render(finding.problem, finding.sources, style))?;
    }
    let count = |severity, one: &str| {
        let count = findings.iter().filter(|finding| finding.problem.severity == severity).count();
        format!("{count} {one}{}", if count == 1 { "" } else { "s" })
    };
    let programs = if checked.len() == 1 { "1 program".into() } else { format!("{} programs", checked.len()) };
    let (errors, warnings) = (count(Severity::Error, "error"), count(Severity::Warning, "warning"));
    Ok(writeln!(out, "{programs}: {errors}, {warnings}, {}", count(Severity::Hint, "hint"))?)
}

/// How often each code was found; on the standard error output where the other one is for a tool.
fn statistics(findings: &[Finding], format: Format, out: &mut dyn Write) -> anyhow::Result<()> {
    let mut counts: BTreeMap<Code, usize> = BTreeMap::new();
    findings.iter().for_each(|finding| *counts.entry(finding.problem.code).or_default() += 1);
    let mut counts: Vec<_> = counts.into_iter().collect();
    counts.sort_by_key(|(code, count)| (std::cmp::Reverse(*count), *code));
    for (code, count) in counts {
        match format {
            Format::Text => writeln!(out, "{count:6} {}", code.text())?,
            _ => complain(format_args!("{count:6} {}", code.text())),
        }
    }
    Ok(())
}
