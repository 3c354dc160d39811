//! `gradus fmt`

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use gradus_asm::{Formatted, Source, format};
use similar::TextDiff;

use crate::exit::Exit;
use crate::program::{STANDARD, read};
use crate::{complain, sources};

/// Format programs
///
/// Gives programs and included files one form: labels, indentation, capitals, spaces and comments. Numbers, names and the text of
/// comments stay as they are, and so does the program. A line with a mistake is left as it is.
///
/// Exit status: 0 when all went well, 1 with --check when a file would change or has a line with a mistake, 2 when a file cannot be
/// read or written.
#[derive(clap::Args)]
#[command(after_long_help = "\
Examples:
  gradus fmt home.tmc
  gradus fmt --check .               for a continuous integration
  gradus fmt - < home.tmc            from the standard input to the standard output")]
pub struct Fmt {
    /// Files, and folders with all .tmc and .inc files in them; - is the standard input
    #[arg(required = true, value_name = "FILE|DIR")]
    files: Vec<PathBuf>,
    /// Write nothing, and say which files would change
    #[arg(long)]
    check: bool,
    /// Write nothing, and show what would change
    #[arg(long)]
    diff: bool,
}

impl Fmt {
    pub fn run(self, out: &mut dyn Write) -> anyhow::Result<()> {
        let files = sources::all(&self.files).map_err(failure)?;
        let mut wrong = 0;
        for file in &files {
            wrong += usize::from(!self.file(file, out)?);
        }
        match wrong {
            0 => Ok(()),
            _ if !self.check => Ok(()),
            1 => Err(Exit::with(1, "1 file is not in form")),
            count => Err(Exit::with(1, format!("{count} files are not in form"))),
        }
    }

    /// Formats a file; false if it was not in form.
    fn file(&self, file: &Path, out: &mut dyn Write) -> anyhow::Result<bool> {
        let bytes = read(file).map_err(failure)?;
        let new = format(&bytes).map_err(|error| failure(anyhow!("{}: {error}", file.display())))?;
        report(file, &new);
        let in_form = new.text.as_bytes() == bytes;
        if self.diff {
            difference(file, &Source::new(file, &bytes).text, &new.text, out)?;
        } else if self.check && !in_form {
            writeln!(out, "{}", file.display())?;
        } else if !self.check && file == Path::new(STANDARD) {
            out.write_all(new.text.as_bytes())?;
        } else if !self.check && !in_form {
            let written = fs::write(file, &new.text);
            written.with_context(|| format!("cannot write {}", file.display())).map_err(failure)?;
            writeln!(out, "{}", file.display())?;
        }
        Ok(in_form && new.left.is_empty())
    }
}

/// What people should know of a file.
fn report(file: &Path, new: &Formatted) {
    if new.is_converted {
        complain(format_args!("{}: was Windows-1252, is UTF-8 now", file.display()));
    }
    for line in &new.left {
        complain(format_args!("{}:{line}: has a mistake and is left as it is; see gradus check", file.display()));
    }
}

fn difference(file: &Path, old: &str, new: &str, out: &mut dyn Write) -> anyhow::Result<()> {
    let name = file.display().to_string();
    let diff = TextDiff::from_lines(old, new);
    Ok(write!(out, "{}", diff.unified_diff().header(&name, &name))?)
}

/// Files that cannot be read or written end the command with status 2.
fn failure(error: anyhow::Error) -> anyhow::Error {
    Exit::with(2, format!("{error:#}"))
}
