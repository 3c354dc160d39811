//! `gradus get`

use std::io::Write;

use comfy_table::Table;
use gradus_host::{Error, Named, Session, axis_parameters, global_parameters};

use crate::listed::table;
use crate::parameter::Place;
use crate::port::Port;

/// Bank of global parameters that `--all` shows unless told otherwise.
const SETTINGS_BANK: u8 = 0;

/// Read a parameter, or all of them
///
/// NAME is written in any case, with spaces, hyphens or underscores; a beginning that fits only one name will do, and so will
/// the symbol used in programs. `gradus params` lists all names.
#[derive(clap::Args)]
#[command(after_long_help = "\
Examples:
  gradus get actual_position
  gradus get --axis 2 max_speed
  gradus get --bank 2 5                   user variable 5
  gradus get --all --port /dev/ttyACM0")]
pub struct Get {
    #[command(flatten, next_help_heading = "Connection")]
    port: Port,
    #[command(flatten)]
    place: Place,
    /// Parameter; a number is that of an axis parameter unless --bank is given
    #[arg(value_name = "NAME|NUMBER", required_unless_present = "all")]
    parameter: Option<String>,
    /// Print the number alone
    #[arg(long, conflicts_with = "all")]
    value: bool,
    /// Read all axis parameters and all global parameters of bank 0; with --axis or --bank only those of the axis or bank
    #[arg(long, conflicts_with = "parameter")]
    all: bool,
}

impl Get {
    pub fn run(self, out: &mut dyn Write) -> anyhow::Result<()> {
        let mut session = self.port.open()?;
        let Some(parameter) = &self.parameter else { return self.list(&mut session, out) };
        let (named, axis) = self.place.find(&mut session, parameter)?;
        let value = named.decode(session.command(named.read(axis))?);
        let text = if self.value { value.to_string() } else { named.shown(axis, value) };
        Ok(writeln!(out, "{text}")?)
    }

    fn list(&self, session: &mut Session, out: &mut dyn Write) -> anyhow::Result<()> {
        if self.place.bank.is_none() {
            writeln!(out, "{}", axis_table(session, self.place.axis)?.trim_fmt())?;
        }
        if self.place.bank.is_none() && self.place.axis.is_none() {
            writeln!(out)?;
        }
        if self.place.axis.is_none() {
            writeln!(out, "{}", global_table(session, self.place.bank.unwrap_or(SETTINGS_BANK))?.trim_fmt())?;
        }
        Ok(())
    }
}

fn axis_table(session: &mut Session, axis: Option<u8>) -> Result<Table, Error> {
    let module = session.module()?;
    let axes: Vec<u8> = axis.map_or_else(|| (0..module.axes).collect(), |axis| vec![axis]);
    let headings: Vec<String> = axes.iter().map(|axis| format!("axis {axis}#")).collect();
    let mut table = table(["AP#", "name"].into_iter().chain(headings.iter().map(String::as_str)).chain(["unit"]));
    for named in axis_parameters(module) {
        let mut row = vec![named.number().to_string(), named.name()];
        for axis in &axes {
            row.push(value(session, &named, *axis)?);
        }
        row.push(named.unit().text().into());
        table.add_row(row);
    }
    Ok(table)
}

fn global_table(session: &mut Session, bank: u8) -> Result<Table, Error> {
    let mut table = table(["GP#", "name", "value#"]);
    let in_bank = |named: &Named| matches!(named, Named::Global { row, .. } if row.bank == bank);
    for named in global_parameters(session.module()?).filter(in_bank) {
        table.add_row([named.number().to_string(), named.name(), value(session, &named, 0)?]);
    }
    Ok(table)
}

/// A value for a table; a dash if the module refuses, as real ones do for some of their own parameters.
fn value(session: &mut Session, named: &Named, axis: u8) -> Result<String, Error> {
    match session.command(named.read(axis)) {
        Ok(value) => Ok(named.decode(value).to_string()),
        Err(Error::Refused { .. }) => Ok("-".into()),
        Err(error) => Err(error),
    }
}
