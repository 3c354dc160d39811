//! `gradus config`

use std::fs;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use gradus_host::{Config, Difference, settings};
use serde_json::json;

use crate::complain;
use crate::json::Json;
use crate::port::Port;
use crate::progress::progress;

/// A module's settings as a text file: save, compare, restore, check
///
/// A configuration holds all parameters that are set up once and then stay, by name, with units and defaults in comments: see `gradus
/// config dump`. What commands and the motion change (positions, target speeds, user variables) is no part of it.
#[derive(clap::Args)]
#[command(after_long_help = "\
Examples:
  gradus config dump --port /dev/ttyACM0 stage.toml      save all settings; comments in an old file stay
  gradus config diff --port /dev/ttyACM0                 what differs from the defaults
  gradus config apply --port /dev/ttyACM0 stage.toml     write what differs, and read it back
  gradus config verify --port /dev/ttyACM0 stage.toml    exit status 1 if anything differs, for cron
  gradus config apply --as-program stage.toml > init.tmc a program that sets what the module does not keep")]
pub struct Configure {
    #[command(subcommand)]
    action: Action,
}

#[derive(clap::Subcommand)]
enum Action {
    /// Read all settings of a module into a file
    ///
    /// In a file that exists the values are renewed; its comments and its order stay. Without a file the configuration is printed.
    Dump {
        #[command(flatten, next_help_heading = "Connection")]
        port: Port,
        /// File to write
        #[arg(value_name = "FILE.toml", conflicts_with = "as_program")]
        file: Option<PathBuf>,
        /// Print a TMCL program instead, which sets what the module does not keep by itself
        #[arg(long)]
        as_program: bool,
    },
    /// Show what differs between a module and a file, or between a module and its defaults
    Diff {
        #[command(flatten, next_help_heading = "Connection")]
        port: Port,
        /// File to compare with; the defaults if left out
        #[arg(value_name = "FILE.toml")]
        file: Option<PathBuf>,
        #[command(flatten)]
        json: Json,
    },
    /// Write to a module what differs from a file
    ///
    /// Each value is read back and compared. Addresses, identifiers and bit rates come last. Nothing is written if the file is for another
    /// kind of module or has a mistake.
    Apply {
        #[command(flatten, next_help_heading = "Connection")]
        port: Port,
        /// The configuration
        #[arg(value_name = "FILE.toml")]
        file: PathBuf,
        /// Let the module keep, over a power-off, the settings that it can store on command (STAP)
        #[arg(long)]
        store: bool,
        /// Print a TMCL program that sets what a module does not keep by itself, instead of asking a module
        #[arg(long, conflicts_with = "store")]
        as_program: bool,
    },
    /// Check that a module is as a file says
    ///
    /// Exit status: 0 when it is, 1 when something differs or the module cannot be read.
    Verify {
        #[command(flatten, next_help_heading = "Connection")]
        port: Port,
        /// The configuration
        #[arg(value_name = "FILE.toml")]
        file: PathBuf,
    },
}

impl Configure {
    pub fn run(self, out: &mut dyn Write) -> anyhow::Result<()> {
        match self.action {
            Action::Dump { port, file, as_program } => dump(&port, file.as_deref(), as_program, out),
            Action::Diff { port, file, json } => differences(&port, file.as_deref(), Some(&json), out).map(drop),
            Action::Apply { file, as_program: true, .. } => Ok(out.write_all(load(&file)?.to_program().as_bytes())?),
            Action::Apply { port, file, store, .. } => apply(&port, &file, store, out),
            Action::Verify { port, file } => match differences(&port, Some(&file), None, out)? {
                0 => Ok(()),
                count => bail!("{} from {}", settings_differ(count), file.display()),
            },
        }
    }
}

fn settings_differ(count: usize) -> String {
    if count == 1 { "1 setting differs".into() } else { format!("{count} settings differ") }
}

fn load(file: &Path) -> anyhow::Result<Config> {
    let text = fs::read_to_string(file).with_context(|| format!("cannot read {}", file.display()))?;
    parse(&text, file)
}

/// Reads a configuration; its problems are printed.
fn parse(text: &str, file: &Path) -> anyhow::Result<Config> {
    Config::parse(text, &file.display().to_string()).map_err(|error| {
        complain(format_args!("{error}"));
        let count = error.problems.len();
        anyhow::anyhow!("{} has {count} {}", file.display(), if count == 1 { "mistake" } else { "mistakes" })
    })
}

fn dump(port: &Port, file: Option<&Path>, as_program: bool, out: &mut dyn Write) -> anyhow::Result<()> {
    let old = file.map(old_text).transpose()?.flatten();
    let mut session = port.open()?;
    let bar = progress("read", settings(session.module()?).count());
    let config = Config::read(&mut session, |count| bar.set_position(count as u64))?;
    drop(bar);
    if as_program {
        return Ok(out.write_all(config.to_program().as_bytes())?);
    }
    let Some(file) = file else { return Ok(out.write_all(config.to_toml().as_bytes())?) };
    let text = match old {
        None => config.to_toml(),
        Some(old) => {
            let before = parse(&old, file)?;
            if before.module.model != config.module.model {
                bail!(
                    "{} is for a {}, {} is a {}",
                    file.display(),
                    before.module.name,
                    session.port(),
                    config.module.name
                );
            }
            config.update(&old)?
        }
    };
    fs::write(file, text).with_context(|| format!("cannot write {}", file.display()))?;
    Ok(writeln!(out, "{}: {} settings of a {}", file.display(), config.values.len(), config.module.name)?)
}

/// The text of a file; `None` if there is no such file.
fn old_text(file: &Path) -> anyhow::Result<Option<String>> {
    match fs::read_to_string(file) {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
        read => read.map(Some).with_context(|| format!("cannot read {}", file.display())),
    }
}

/// Prints what differs, and says how much.
fn differences(port: &Port, file: Option<&Path>, json: Option<&Json>, out: &mut dyn Write) -> anyhow::Result<usize> {
    let wanted = file.map(load).transpose()?;
    let mut session = port.open()?;
    let (config, whose) = match wanted {
        Some(config) => (config, "in the file"),
        None => (Config::defaults(session.module()?), "by default"),
    };
    let bar = progress("compare", config.values.len());
    let differences = config.differences(&mut session, |count| bar.set_position(count as u64))?;
    drop(bar);
    for Difference { setting, wanted, found } in differences.iter().filter(|_| !json.is_some_and(Json::is_alone)) {
        let unit = setting.named.unit().text();
        writeln!(out, "{}", format!("{setting}: {wanted} {whose}, {found} in the module {unit}").trim_end())?;
    }
    if let Some(json) = json {
        let member = |it: &Difference| json!({ "setting": it.setting.to_string(), "wanted": it.wanted, "found": it.found, "unit": it.setting.named.unit().text() });
        json.write(&[("differences", differences.iter().map(member).collect())], out)?;
    }
    Ok(differences.len())
}

fn apply(port: &Port, file: &Path, store: bool, out: &mut dyn Write) -> anyhow::Result<()> {
    let config = load(file)?;
    let mut session = port.open()?;
    let bar = progress("apply", config.values.len());
    let written = config.apply(&mut session, |count| bar.set_position(count as u64))?;
    drop(bar);
    for Difference { setting, wanted, found } in &written {
        writeln!(out, "{setting}: {found} -> {wanted}")?;
    }
    let (changed, all) = (written.len(), config.values.len());
    writeln!(out, "{changed} of {all} settings written and read back")?;
    if store {
        writeln!(out, "{} settings stored", config.store(&mut session)?)?;
    } else if !config.is_storable() && written.iter().any(|difference| difference.setting.is_axis()) {
        let name = config.module.name;
        writeln!(out, "a {name} forgets axis parameters at power-off; `--as-program` makes a program that sets them")?;
    }
    Ok(())
}
