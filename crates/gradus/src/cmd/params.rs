//! `gradus params`

use std::io::Write;

use gradus_host::normalise;
use gradus_plant::{MOTORS, Motor};
use gradus_tmcl::catalogue::{AxisParameter, Choice, GlobalParameter, MODULES, Module, Values};
use serde::Serialize;

use crate::listed::table;
use crate::{port, reference};

/// List the parameters of a module
///
/// Access: R read only, RW read and write, RWE stored in the EEPROM on demand, RWA stored in the EEPROM at every write.
#[derive(clap::Args)]
pub struct Params {
    /// Module
    #[arg(long, value_parser = port::module(MODULES), ignore_case = true, default_value = "tmcm-3351")]
    module: &'static Module,
    /// Print all that the catalogue knows, as JSON
    #[arg(long)]
    json: bool,
    /// Print parameters, ports, interrupts and commands with what they mean, as a page of the book
    #[arg(long, conflicts_with = "json")]
    markdown: bool,
    /// List the motors that a bench file knows by name, with the speeds up to which 24 V and 48 V suffice
    #[arg(long, conflicts_with_all = ["json", "markdown", "module"])]
    motor: bool,
}

impl Params {
    pub fn run(self, out: &mut dyn Write) -> anyhow::Result<()> {
        if self.motor {
            return Ok(writeln!(out, "{}", motors())?);
        }
        if self.markdown {
            return Ok(out.write_all(reference::page(self.module)?.as_bytes())?);
        }
        if self.json {
            return Ok(writeln!(out, "{}", serde_json::to_string_pretty(&Catalogue::of(self.module))?)?);
        }
        let mut axis = table(["AP#", "name", "symbol", "min#", "max#", "unit", "default#", "access"]);
        for row in self.module.axis_parameters {
            let (name, unit) = (normalise(row.name), row.unit.text());
            let numbers = [row.number.to_string(), row.min.to_string(), row.max.to_string(), default(row.default)];
            let [number, min, max, default] = numbers;
            axis.add_row([&*number, &name, row.symbol, &min, &max, unit, &default, row.access.text()]);
        }
        let mut global = table(["bank#", "GP#", "name", "min#", "max#", "default#", "access"]);
        for row in self.module.global_parameters {
            let (bank, numbers, name) = (row.bank.to_string(), numbers(row), normalise(row.name));
            let (min, max, default) = (row.min.to_string(), row.max.to_string(), default(row.default));
            global.add_row([&*bank, &numbers, &name, &min, &max, &default, row.access.text()]);
        }
        Ok(writeln!(out, "{}\n\n{}", axis.trim_fmt(), global.trim_fmt())?)
    }
}

/// The stepper motors of the catalogue, and their limit speeds in rpm.
fn motors() -> String {
    let mut rows = table(["motor", "ohm#", "mH#", "A rms#", "Nm#", "gcm2#", "24 V rpm#", "48 V rpm#"]);
    for (name, motor) in MOTORS {
        let Motor { resistance_ohm, inductance_h, current_a, holding_torque_nm, inertia_kgm2, .. } = *motor;
        let [at_24, at_48] = [24.0, 48.0].map(|volts| format!("{:.0}", 60.0 * motor.limit_rps(volts)));
        let data = [resistance_ohm, inductance_h * 1e3, current_a, holding_torque_nm, inertia_kgm2 * 1e7];
        let [ohm, mh, amps, nm, gcm2] = data.map(|value| format!("{}", (value * 1e3).round() / 1e3));
        rows.add_row([*name, &ohm, &mh, &amps, &nm, &gcm2, &at_24, &at_48]);
    }
    rows.trim_fmt()
}

fn default(value: Option<i64>) -> String {
    value.map_or_else(String::new, |value| value.to_string())
}

fn numbers(row: &GlobalParameter) -> String {
    if row.first == row.last { row.first.to_string() } else { format!("{}-{}", row.first, row.last) }
}

#[derive(Serialize)]
struct Catalogue {
    module: &'static str,
    axes: u8,
    axis_parameters: Vec<Axis>,
    global_parameters: Vec<Global>,
}

#[derive(Serialize)]
struct Axis {
    number: u8,
    symbol: &'static str,
    unit: &'static str,
    #[serde(flatten)]
    row: Row,
}

#[derive(Serialize)]
struct Global {
    bank: u8,
    first: u8,
    last: u8,
    #[serde(flatten)]
    row: Row,
}

/// What both tables have.
#[derive(Serialize)]
struct Row {
    name: String,
    min: i64,
    max: i64,
    default: Option<i64>,
    access: &'static str,
    /// True when `values` are numbers of bits.
    bits: bool,
    values: Vec<Meaning>,
    description: &'static str,
}

#[derive(Serialize)]
struct Meaning {
    first: i64,
    last: i64,
    text: &'static str,
}

impl Catalogue {
    fn of(module: &Module) -> Self {
        Self {
            module: module.name,
            axes: module.axes,
            axis_parameters: module.axis_parameters.iter().map(Axis::of).collect(),
            global_parameters: module.global_parameters.iter().map(Global::of).collect(),
        }
    }
}

impl Axis {
    fn of(row: &AxisParameter) -> Self {
        let &AxisParameter { number, symbol, unit, name, min, max, default, access, values, description, .. } = row;
        let (bits, values) = meanings(values);
        let row = Row { name: normalise(name), min, max, default, access: access.text(), bits, values, description };
        Self { number, symbol, unit: unit.text(), row }
    }
}

impl Global {
    fn of(row: &GlobalParameter) -> Self {
        let &GlobalParameter { bank, first, last, name, min, max, default, access, values, description, .. } = row;
        let (bits, values) = meanings(values);
        let row = Row { name: normalise(name), min, max, default, access: access.text(), bits, values, description };
        Self { bank, first, last, row }
    }
}

fn meanings(values: Values) -> (bool, Vec<Meaning>) {
    let meaning = |choice: &Choice| Meaning { first: choice.first, last: choice.last, text: choice.text };
    (matches!(values, Values::Bits(_)), values.choices().iter().map(meaning).collect())
}
