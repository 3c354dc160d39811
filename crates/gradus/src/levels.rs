//! Which problems of programs end a command with status 1, and which are left out.

use gradus_asm::{Code, Problem, Severity};
use gradus_lab::Project;

/// What is denied: everything from a severity on, or one code.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Denied {
    From(Severity),
    Code(Code),
}

/// What problems are worth.
#[derive(clap::Args, Clone, Default)]
pub struct Levels {
    /// Let a problem count as an error: warnings, hints, or a code; may be given several times
    #[arg(long, value_name = "CODE", value_parser = denied)]
    deny: Vec<Denied>,
    /// Leave out a warning or a hint; may be given several times
    #[arg(long, value_name = "CODE", value_parser = code)]
    pub allow: Vec<Code>,
}

impl Levels {
    /// With what a `gradus.toml` says.
    ///
    /// # Errors
    /// When it names a code that there is not.
    pub fn and(&self, project: &Project) -> anyhow::Result<Self> {
        let said = |key: &str, problem| anyhow::anyhow!("{}: `lint.{key}`: {problem}", project.file.display());
        let mut levels = self.clone();
        for text in &project.lint.deny {
            levels.deny.push(denied(text).map_err(|problem| said("deny", problem))?);
        }
        for text in &project.lint.allow {
            levels.allow.push(code(text).map_err(|problem| said("allow", problem))?);
        }
        Ok(levels)
    }

    /// True for a problem that ends the command with status 1.
    pub fn denies(&self, problem: &Problem) -> bool {
        let is_it = |denied: &Denied| match denied {
            Denied::From(severity) => problem.severity >= *severity,
            Denied::Code(code) => problem.code == *code,
        };
        problem.is_error() || self.deny.iter().any(is_it)
    }
}

fn denied(text: &str) -> Result<Denied, String> {
    match text {
        "errors" => Ok(Denied::From(Severity::Error)),
        "warnings" => Ok(Denied::From(Severity::Warning)),
        "hints" => Ok(Denied::From(Severity::Hint)),
        _ => code(text).map(Denied::Code),
    }
}

/// Takes the code of a problem.
///
/// # Errors
/// When there is none of that name.
pub fn code(text: &str) -> Result<Code, String> {
    Code::named(text).ok_or_else(|| {
        let near = Code::nearest(text).map(|code| format!("; did you mean `{}`?", code.text()));
        format!("there is no code `{text}`{}", near.unwrap_or_default())
    })
}
