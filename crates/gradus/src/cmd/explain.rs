//! `gradus explain`

use std::io::Write;
use std::path::Path;

use anyhow::anyhow;
use gradus_asm::Code;
use gradus_host::{NameError, Named, find, find_axis, find_global};
use gradus_tmcl::catalogue::{MODULES, Module, TMCM_3351};

use crate::{port, project};

/// Explain a parameter or a problem
///
/// A parameter by its name or number: what it is for, what it takes and what its values mean. A problem by the code that stands in
/// brackets behind `error` or `warning`: what it is, why it is bad, and how it is put right.
#[derive(clap::Args)]
#[command(after_long_help = "\
Examples:
  gradus explain max_speed
  gradus explain 140 --module tmcm-351
  gradus explain --bank 0 77
  gradus explain out-of-range
  gradus explain                     lists the codes of problems")]
pub struct Explain {
    /// Name, symbol in programs or number of a parameter, or code of a problem; without it the codes are listed
    #[arg(value_name = "NAME|NUMBER|CODE")]
    what: Option<String>,
    /// Module; if left out the one of gradus.toml, or tmcm-3351
    #[arg(long, value_parser = port::module(MODULES), ignore_case = true)]
    module: Option<&'static Module>,
    /// Bank of a global parameter: 0 settings, 2 user variables, 3 interrupts
    #[arg(long, value_name = "N")]
    bank: Option<u8>,
}

impl Explain {
    pub fn run(self, out: &mut dyn Write) -> anyhow::Result<()> {
        let Some(what) = &self.what else { return list(out) };
        if let Some(code) = Code::named(what).filter(|_| self.bank.is_none()) {
            return Ok(write!(out, "{}", code.explanation())?);
        }
        let module =
            self.module.map_or_else(|| project::near(Path::new("")).map(|it| project::module(&it)), |it| Ok(Some(it)));
        let module = module?.unwrap_or(&TMCM_3351);
        let found = match self.bank {
            Some(bank) => find_global(module, bank, what),
            None => find(module, what).or_else(|error| find_axis(module, what).map_err(|_| error)),
        };
        match found {
            Ok(named) => Ok(out.write_all(parameter(&named, module).as_bytes())?),
            Err(error) => Err(unknown(error, what, module)),
        }
    }
}

/// A name that looks like no parameter may be meant for a code.
fn unknown(error: NameError, what: &str, module: &Module) -> anyhow::Error {
    let unlike = matches!(&error, NameError::Unknown { suggestions, .. } if suggestions.is_empty());
    match Code::nearest(what).filter(|_| unlike) {
        Some(code) => anyhow!(
            "`{what}` is neither a parameter of the {} nor a problem code; did you mean `{}`?",
            module.name,
            code.text()
        ),
        None => error.into(),
    }
}

fn list(out: &mut dyn Write) -> anyhow::Result<()> {
    for code in Code::ALL {
        let severity = code.page().lines().nth(2).unwrap_or("").trim_end_matches('.').to_lowercase();
        writeln!(out, "{:28} {severity}", code.text())?;
    }
    Ok(())
}

fn parameter(named: &Named, module: &Module) -> String {
    let (min, max) = named.limits();
    let unit = named.unit().text();
    let (symbol, description) = match named {
        Named::Axis(row) => (row.symbol, row.description),
        Named::Global { row, .. } => ("", row.description),
    };
    let mut text = format!("{named} of the {}\n\n{description}\n\n", module.name);
    let default = named.default().map(|value| value.to_string()).unwrap_or_default();
    let rows = [
        ("range", format!("{min} to {max} {unit}")),
        ("default", default),
        ("access", format!("{} ({})", named.access().text(), access(named.access().text()))),
        ("in programs", symbol.into()),
    ];
    for (name, value) in rows.iter().filter(|(_, value)| !value.is_empty()) {
        text += &format!("{name:<12} {}\n", value.trim_end());
    }
    for choice in named.values().choices() {
        let numbers = if choice.first == choice.last {
            choice.first.to_string()
        } else {
            format!("{}-{}", choice.first, choice.last)
        };
        text += &format!("{:>12} {}\n", numbers, choice.text);
    }
    text
}

/// What the letters of an access mean.
fn access(text: &str) -> &'static str {
    match text {
        "R" => "read only",
        "RW" => "read and write",
        "RWE" => "read and write, stored on command",
        "RWA" => "read and write, stored at every write",
        _ => "read and write",
    }
}
