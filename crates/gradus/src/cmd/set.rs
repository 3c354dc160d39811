//! `gradus set`

use std::io::Write;

use anyhow::bail;

use crate::parameter::Place;
use crate::port::Port;
use crate::value;

/// Write a parameter
///
/// The module checks the value; what it accepts is read back and shown. For names see `gradus get --help`.
#[derive(clap::Args)]
#[command(after_long_help = "\
Examples:
  gradus set --port /dev/ttyACM0 max_speed 20000
  gradus set --port /dev/ttyACM0 --axis 1 target_speed -5000
  gradus set --port /dev/ttyACM0 max_speed 100rpm
  gradus set --port /dev/ttyACM0 max_speed 51.2mm/s --travel 5
  gradus set --port /dev/ttyACM0 user_variable_5 42")]
pub struct Set {
    #[command(flatten, next_help_heading = "Connection")]
    port: Port,
    #[command(flatten)]
    place: Place,
    /// Parameter; a number is that of an axis parameter unless --bank is given
    #[arg(value_name = "NAME|NUMBER")]
    parameter: String,
    /// New value: 1000, 0x100, 0b101, 50% of the largest value, or a quantity with a unit as 100rpm, 2rps2, 90deg, 10mm/s
    #[arg(allow_hyphen_values = true)]
    value: String,
    /// Travel in mm in a turn of the motor, for units with mm
    #[arg(long, value_name = "MM")]
    travel: Option<f64>,
}

impl Set {
    pub fn run(self, out: &mut dyn Write) -> anyhow::Result<()> {
        let mut session = self.port.open()?;
        let (named, axis) = self.place.find(&mut session, &self.parameter)?;
        let value = value::parse(&self.value, &named, &mut session, axis, self.travel)?;
        let Some(value) = named.encode(value) else { bail!("{named} takes {}, not {}", named.range(), self.value) };
        session.command(named.write(axis, value))?;
        let value = named.decode(session.command(named.read(axis))?);
        Ok(writeln!(out, "{}", named.shown(axis, value))?)
    }
}
