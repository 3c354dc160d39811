//! `gradus explain`

use std::io::Write;

use gradus_asm::Code;

use crate::levels;

/// Explain a problem of a program
///
/// Prints what a problem is about, why it is bad, an example, and how to allow it. Without a code it lists them all.
#[derive(clap::Args)]
#[command(after_long_help = "\
Examples:
  gradus explain eeprom-in-loop
  gradus explain                     lists the codes")]
pub struct Explain {
    /// Code of the problem, as `gradus check` prints it
    #[arg(value_parser = levels::code)]
    code: Option<Code>,
}

impl Explain {
    pub fn run(self, out: &mut dyn Write) -> anyhow::Result<()> {
        let Some(code) = self.code else { return list(out) };
        Ok(write!(out, "{}", code.explanation())?)
    }
}

fn list(out: &mut dyn Write) -> anyhow::Result<()> {
    for code in Code::ALL {
        let severity = code.page().lines().nth(2).unwrap_or("").trim_end_matches('.').to_lowercase();
        writeln!(out, "{:28} {severity}", code.text())?;
    }
    Ok(())
}
