//! `gradus get`

use std::io::Write;

use comfy_table::Table;
use gradus_host::{Error, Named, Session, axis_parameters, global_parameters};
use serde_json::{Value, json};

use crate::json::Json;
use crate::listed::table;
use crate::parameter::Place;
use crate::port::Port;

/// Bank of global parameters that `--all` shows unless told otherwise.
const SETTINGS_BANK: u8 = 0;

/// Read parameters
///
/// NAME is written in any case, with spaces, hyphens or underscores; a beginning that fits only one name will do, and so will
/// the symbol used in programs. `gradus params` lists all names.
#[derive(clap::Args)]
#[command(after_long_help = "\
Examples:
  gradus get actual_position
  gradus get --axis 2 max_speed actual_speed
  gradus get --bank 2 5                   user variable 5
  gradus get --all --port /dev/ttyACM0")]
pub struct Get {
    #[command(flatten, next_help_heading = "Connection")]
    port: Port,
    #[command(flatten)]
    place: Place,
    /// Parameters; a number is that of an axis parameter unless --bank is given
    #[arg(value_name = "NAME|NUMBER", required_unless_present = "all")]
    parameters: Vec<String>,
    /// Print the number alone
    #[arg(long, conflicts_with = "all")]
    value: bool,
    /// Read all axis parameters and all global parameters of bank 0; with --axis or --bank only those of the axis or bank
    #[arg(long, conflicts_with = "parameters")]
    all: bool,
    #[command(flatten)]
    json: Json,
}

impl Get {
    pub fn run(self, out: &mut dyn Write) -> anyhow::Result<()> {
        let mut session = self.port.open()?;
        if self.all {
            return self.list(&mut session, out);
        }
        // All names first: nothing is asked where one is wrong.
        let found: Vec<(Named, u8)> =
            self.parameters.iter().map(|text| self.place.find(&mut session, text)).collect::<Result<_, _>>()?;
        let mut members = Vec::new();
        for (named, axis) in found {
            let value = named.decode(session.command(named.read(axis))?);
            members.push(as_json(&named, axis, Some(value)));
            if !self.json.is_alone() {
                writeln!(out, "{}", if self.value { value.to_string() } else { named.shown(axis, value) })?;
            }
        }
        self.write(&mut session, members, out)
    }

    fn write(&self, session: &mut Session, members: Vec<Value>, out: &mut dyn Write) -> anyhow::Result<()> {
        let module = session.module()?.name;
        self.json.write(&[("module", json!(module)), ("parameters", members.into())], out)
    }

    /// Every parameter that `--all` shows, for programs.
    fn all_json(&self, session: &mut Session, out: &mut dyn Write) -> anyhow::Result<()> {
        let module = session.module()?;
        let axes = self.place.axis.map_or(0..module.axes, |axis| axis..axis.saturating_add(1));
        let bank = self.place.bank.unwrap_or(SETTINGS_BANK);
        let of_axes = { axes }.flat_map(|axis| axis_parameters(module).map(move |named| (named, axis)));
        let in_bank = |named: &Named| matches!(named, Named::Global { row, .. } if row.bank == bank);
        let globals = global_parameters(module).filter(in_bank).map(|named| (named, 0));
        let mut wanted: Vec<(Named, u8)> = Vec::new();
        if self.place.bank.is_none() {
            wanted.extend(of_axes);
        }
        if self.place.axis.is_none() {
            wanted.extend(globals);
        }
        let mut members = Vec::new();
        for (named, axis) in wanted {
            members.push(as_json(&named, axis, read(session, &named, axis)?));
        }
        self.write(session, members, out)
    }

    fn list(&self, session: &mut Session, out: &mut dyn Write) -> anyhow::Result<()> {
        if self.json.is_alone() {
            return self.all_json(session, out);
        }
        if self.place.bank.is_none() {
            writeln!(out, "{}", axis_table(session, self.place.axis)?.trim_fmt())?;
        }
        if self.place.bank.is_none() && self.place.axis.is_none() {
            writeln!(out)?;
        }
        if self.place.axis.is_none() {
            writeln!(out, "{}", global_table(session, self.place.bank.unwrap_or(SETTINGS_BANK))?.trim_fmt())?;
        }
        if self.json.is_wanted() { self.all_json(session, out) } else { Ok(()) }
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
    Ok(read(session, named, axis)?.map_or_else(|| "-".into(), |value| value.to_string()))
}

/// A value; `None` if the module refuses.
fn read(session: &mut Session, named: &Named, axis: u8) -> Result<Option<i64>, Error> {
    match session.command(named.read(axis)) {
        Ok(value) => Ok(Some(named.decode(value))),
        Err(Error::Refused { .. }) => Ok(None),
        Err(error) => Err(error),
    }
}

fn as_json(named: &Named, axis: u8, value: Option<i64>) -> Value {
    let place = match named {
        Named::Axis(_) => ("axis", axis),
        Named::Global { row, .. } => ("bank", row.bank),
    };
    json!({
        "name": named.name(),
        "number": named.number(),
        place.0: place.1,
        "value": value,
        "unit": named.unit().text(),
        "meaning": value.and_then(|value| named.meaning(value)),
    })
}
