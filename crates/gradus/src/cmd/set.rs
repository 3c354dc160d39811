//! `gradus set`

use std::io::Write;

use anyhow::bail;

use crate::parameter::Place;
use crate::port::Port;

/// Write a parameter
///
/// The module checks the value; what it accepts is read back and shown. For names see `gradus get --help`.
#[derive(clap::Args)]
#[command(after_long_help = "\
Examples:
  gradus set --port /dev/ttyACM0 max_speed 20000
  gradus set --port /dev/ttyACM0 --axis 1 target_speed -5000
  gradus set --port /dev/ttyACM0 user_variable_5 42")]
pub struct Set {
    #[command(flatten, next_help_heading = "Connection")]
    port: Port,
    #[command(flatten)]
    place: Place,
    /// Parameter; a number is that of an axis parameter unless --bank is given
    #[arg(value_name = "NAME|NUMBER")]
    parameter: String,
    /// New value
    #[arg(allow_negative_numbers = true)]
    value: i64,
}

impl Set {
    pub fn run(self, out: &mut dyn Write) -> anyhow::Result<()> {
        let mut session = self.port.open()?;
        let (named, axis) = self.place.find(&mut session, &self.parameter)?;
        let Some(value) = named.encode(self.value) else {
            bail!("{named} takes {}, not {}", named.range(), self.value)
        };
        session.command(named.write(axis, value))?;
        let value = named.decode(session.command(named.read(axis))?);
        Ok(writeln!(out, "{}", named.shown(axis, value))?)
    }
}
