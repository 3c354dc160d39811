//! Bench files: a module and its machine as TOML.
//!
//! ```toml
//! module = "tmcm-3351"
//!
//! supply = 24.0                            # volts; the default
//! temperature = 25.0                       # of the board in degC; the default
//!
//! [axis.0]
//! motor = "QSH5718-51"                     # the default; "rigid" never loses a step
//! currents = "hybrid"                      # the default; also "electrical" and "quasi-static"
//! inertia = 200                            # of the load at the shaft in gcm^2; the default
//! friction = 0.01                          # Coulomb friction at the shaft in Nm; the default
//! viscous = 0.001                          # viscous friction in Nm per rad/s; the default
//! load = 0.05                              # a weight: torque against the positive direction in Nm; 0 if left out
//! full_steps = 200                         # of a turn; those of the motor if left out
//! travel_per_turn = 5.0                    # lead of the screw in mm, so that all lengths are in mm; 1 if left out: turns
//! reversed = false                         # true: positive turns of the shaft move the carriage in negative direction
//! start = 42.0                             # where the carriage stands when the bench is built; 0 if left out
//! encoder = { counts_per_turn = 4096, index = 0 }   # without an index there is no null channel; `reversed = true`
//! stallguard = { noise = 10.0, seed = 1 }  # counts, standard deviation; the defaults, but the seed is the axis' number and 1
//!
//! [axis.0.travel]
//! left = { at = 0.0 }                      # closed here and further left; with a width only so far
//! right = { at = 100.0, normally_closed = true }   # open here and further right, closed elsewhere
//! home = { at = 60.0, width = 2.0, bounce = 0.002 }   # closed from 59.0 to 61.0; the contact bounces for 2 ms
//! ends = { left = -2.0, right = 102.0 }    # end stops
//!
//! [io]
//! enable = true                            # the default
//! inputs = { 3 = true }                    # the others are low
//! analog = { 0 = 512 }                     # ADC value in the range after power-on; the others are 0
//! spi = { 0 = "loop-back", 1 = "74hc595", 2 = ["9F000000: 00C22017"] }   # devices at the chip selects (SAC)
//!
//! [[event]]
//! at = 2.5                                 # seconds of virtual time
//! do = "switch 0 home 1"                   # a line of the console
//! ```
//!
//! Only `module` must be there. What a file does not name does not exist: an axis without `travel` has no switches, one
//! without `encoder` no encoder; but there is always a motor. A key that is not known is an error, so that a misspelt one
//! is not taken for a default.
//!
//! A motor is named ([`MOTORS`](gradus_plant::MOTORS) lists them), or described by its sheet: `motor = { resistance = 0.83,
//! inductance = 2.2, current = 2.8, holding_torque = 1.01, detent_torque = 0.035, inertia = 275, full_steps = 200 }`, in ohm, mH, A
//! RMS, Nm and gcm^2; the last three may be left out. A rigid axis takes `inertia`, `friction`, `viscous` and `load`, and does
//! not feel them. The first current pulls a rotor at most two full steps from its `start` to where the coils point.
//!
//! A TMCM-1617 has one `[servo]` in place of axes. What is here are the defaults, but for `hall_errors`, `load` and the encoder:
//!
//! ```toml
//! module = "tmcm-1617"
//!
//! [servo]
//! motor = "QBL4208-61"                     # or its sheet, see below
//! inertia = 50                             # of the load at the shaft in gcm^2
//! friction = 0.001                         # Coulomb friction at the shaft in Nm
//! viscous = 0.000001                       # viscous friction in Nm per rad/s
//! load = 0.02                              # a weight: torque against the positive direction in Nm; 0 if left out
//! magnet = 0.0                             # where it points at first: electrical degrees ahead of phase A
//! hall = { polarity = 0, direction = 0, offset = 0, order = "abc" }   # how they are wired, see below
//! hall_errors = [2.0, -1.0, 0.0]           # how far the hall sensors are out of place, in electrical degrees
//! encoder = { counts_per_turn = 4096, index = 0 }   # without an index there is no null channel; `reversed = true`
//! source = { resistance = 0.1, capacitance = 1.0, takes_back = false, brake_resistor = 10.0, quiescent = 50 }   # ohm, mF, mA
//! current_noise = 1.0                      # of a reading of the current, in steps of the converter (standard deviation)
//! seed = 1                                 # of that noise: the same seed is the same noise
//! ```
//!
//! `hall` says how the sensors are mounted and wired, by the settings that suit them: with `polarity = 1` axis parameter 90 must be 1,
//! with `direction = 1` axis parameter 91, and axis parameter 93 must be `offset`, 65536 an electrical turn. `order` are the sensors at the
//! three inputs, as wires that have been mixed up. With a `reversed` encoder axis parameter 101 must be 1. A `source` that takes nothing
//! back lets the voltage rise while the motor brakes; the board's `quiescent` current brings it down again.
//!
//! [`SERVO_MOTORS`](gradus_plant::SERVO_MOTORS) lists the motors. The data of a sheet are values from line to line: `motor = {
//! pole_pairs = 4, resistance = 0.72, inductance = 1.2, torque_constant = 0.036, current = 3.47, inertia = 48 }`, in ohm, mH, Nm/A,
//! A and gcm^2; `direct_current = true` is a brushed motor between the phases A and B. Analogue inputs read 0 to 4095.
//!
//! On the SPI bus a `loop-back` is a wire from output to input, a `74hc595` an output chip, and a list of exchanges in hexadecimal
//! digits, sent and received, is a recording that is played back.
//!
//! Several modules on buses are `[[module]]` tables, each with the keys that stand at the top of a file of one module, see
//! `rig_file`.
//!
//! Not here: what the machine does, see `gradus-plant`; what a line of the console does, see [`console`](crate::console).

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use gradus_plant::Surroundings;
use gradus_tmcl::catalogue::Module;
use serde::Deserialize;
use toml::Spanned;
use toml::de::DeTable;

use crate::console::Change;
use crate::problem::{Misfit, Problem};
use crate::quantity::{celsius, microseconds, supply, virtual_module};
use crate::{Bench, Eeprom, Machine, MachineAxis, MachineIo, ServoDrive, SpiDevice};

use self::axis::AxisTable;
use self::servo::ServoTable;

mod axis;
mod servo;

/// What a bench file says.
#[derive(Clone, Debug)]
pub struct BenchFile {
    /// The module.
    pub module: &'static Module,
    /// The machine as it is when the module is switched on.
    pub machine: Machine,
    /// What changes later, with its virtual time in microseconds.
    pub events: Vec<(u64, Change)>,
}

/// What is wrong with a file of several modules where one is expected.
const SEVERAL: &str =
    "the file describes several modules on buses, which only `gradus sim` can run; expected one module";

/// A file describes several modules if `module` is an array of tables, or if there is a bus.
pub(crate) fn is_rig(text: &str) -> bool {
    let root = DeTable::parse(text);
    let is_rig = |root: &DeTable| {
        root.contains_key("bus") || root.get("module").is_some_and(|module| module.get_ref().is_array())
    };
    root.is_ok_and(|root| is_rig(root.get_ref()))
}

/// Why a bench file cannot be used.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)] // the messages say it
pub enum BenchFileError {
    #[error("cannot read {}", file.display())]
    Read { file: PathBuf, source: io::Error },
    #[error("{}:{problem}", file.display())]
    Wrong { file: PathBuf, problem: Problem },
}

impl BenchFile {
    /// Reads a file.
    ///
    /// # Errors
    /// When it cannot be read or something is wrong with it.
    pub fn read(file: &Path) -> Result<Self, BenchFileError> {
        let text = fs::read_to_string(file).map_err(|source| BenchFileError::Read { file: file.into(), source })?;
        Self::parse(&text).map_err(|problem| BenchFileError::Wrong { file: file.into(), problem })
    }

    /// Understands the text of a bench file.
    ///
    /// # Errors
    /// What is wrong with it first.
    pub fn parse(text: &str) -> Result<Self, Problem> {
        if is_rig(text) {
            return Err(Misfit::new(Some(0..0), SEVERAL).locate(text));
        }
        let document = toml::from_str(text).map_err(|error| Misfit::new(error.span(), error.message()));
        document.and_then(Document::build).map_err(|misfit| misfit.locate(text))
    }

    /// Builds the bench and switches the module on.
    pub fn build(self, eeprom: Eeprom) -> Bench {
        let mut bench = Bench::new(self.module, self.machine, eeprom);
        for (at_us, change) in self.events {
            bench.schedule(at_us, change);
        }
        bench
    }
}

/// The whole file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Document {
    #[serde(deserialize_with = "virtual_module")]
    module: &'static Module,
    #[serde(deserialize_with = "supply", default = "default_supply")]
    supply: f64,
    #[serde(deserialize_with = "celsius", default = "default_temperature")]
    temperature: f64,
    #[serde(default)]
    axis: BTreeMap<Spanned<String>, AxisTable>,
    servo: Option<Spanned<ServoTable>>,
    #[serde(default)]
    io: IoTable,
    #[serde(default)]
    event: Vec<EventTable>,
}

#[derive(Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table with enable, inputs, analog and spi")]
struct IoTable {
    enable: bool,
    inputs: BTreeMap<Spanned<String>, bool>,
    analog: BTreeMap<Spanned<String>, Spanned<i64>>,
    spi: BTreeMap<Spanned<String>, Spanned<SpiTable>>,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "`loop-back`, `74hc595` or a list such as [\"9F000000: 00C22017\"]")]
enum SpiTable {
    Named(SpiName),
    Script(Vec<String>),
}

#[derive(Deserialize)]
enum SpiName {
    #[serde(rename = "loop-back")]
    Loopback,
    #[serde(rename = "74hc595")]
    Outputs,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table with at and do")]
struct EventTable {
    #[serde(deserialize_with = "microseconds")]
    at: u64,
    #[serde(rename = "do")]
    line: Spanned<String>,
}

fn default_supply() -> f64 {
    Surroundings::default().supply_v
}

fn default_temperature() -> f64 {
    Surroundings::default().temperature_c
}

impl Default for IoTable {
    fn default() -> Self {
        Self { enable: true, inputs: BTreeMap::new(), analog: BTreeMap::new(), spi: BTreeMap::new() }
    }
}

// From the text to the machine.

impl Document {
    pub(crate) fn build(self) -> Result<BenchFile, Misfit> {
        let surroundings = Surroundings { supply_v: self.supply, temperature_c: self.temperature };
        let (axes, servos) = match self.module.is_servo() {
            true => (Vec::new(), vec![self.servo(surroundings)?]),
            false => (self.axes()?, Vec::new()),
        };
        let events = self.event.iter().map(|event| event.build(self.module)).collect::<Result<_, _>>()?;
        let mut io = self.io.build(MachineIo::of(self.module))?;
        io.surroundings = surroundings;
        Ok(BenchFile { module: self.module, machine: Machine { axes, servos, io }, events })
    }

    fn axes(&self) -> Result<Vec<MachineAxis>, Misfit> {
        if let Some(table) = &self.servo {
            let message = format!("the axes of a {} are `[axis.0]` and so on", self.module.name);
            return Err(Misfit::new(Some(table.span()), message));
        }
        let count = self.module.axes;
        let mut axes: Vec<MachineAxis> = (0..count).map(|number| AxisTable::default().build(number)).collect();
        for (number, table) in &self.axis {
            let index = choose(number, 0..count, "an axis")?;
            axes[usize::from(index)] = table.build(index);
        }
        Ok(axes)
    }

    fn servo(&self, surroundings: Surroundings) -> Result<ServoDrive, Misfit> {
        if let Some(number) = self.axis.keys().next() {
            let message = format!("the axis of a {} is `[servo]`", self.module.name);
            return Err(Misfit::new(Some(number.span()), message));
        }
        let default = ServoTable::default();
        Ok(self.servo.as_ref().map_or(&default, Spanned::get_ref).build(surroundings))
    }
}

impl IoTable {
    fn build(self, mut io: MachineIo) -> Result<MachineIo, Misfit> {
        io.set_enable(self.enable);
        for (port, level) in self.inputs {
            io.set_input(choose(&port, 0..8, "an input")?, level);
        }
        for (port, value) in self.analog {
            let port = choose(&port, io.analog_pins().iter().copied(), "an analogue input")?;
            io.set_analog(port, adc_value(&value, io.full_scale())?);
        }
        for (number, table) in self.spi {
            let chip_select = choose(&number, 0..3, "a chip select")?;
            io.spi[usize::from(chip_select)] = build_spi(&table)?;
        }
        Ok(io)
    }
}

fn build_spi(table: &Spanned<SpiTable>) -> Result<SpiDevice, Misfit> {
    Ok(match table.as_ref() {
        SpiTable::Named(SpiName::Loopback) => SpiDevice::Loopback,
        SpiTable::Named(SpiName::Outputs) => SpiDevice::Outputs(0),
        SpiTable::Script(lines) => {
            let exchanges = lines.iter().map(|line| line.parse()).collect::<Result<_, String>>();
            let exchanges = exchanges.map_err(|message| Misfit::new(Some(table.span()), message))?;
            SpiDevice::Script { exchanges, next: 0 }
        }
    })
}

impl EventTable {
    fn build(&self, module: &Module) -> Result<(u64, Change), Misfit> {
        let misfit = |error| {
            let message = format!("expected a line of the console that changes the machine; {error}");
            Misfit::new(Some(self.line.span()), message)
        };
        let change = Change::parse(self.line.as_ref(), module).map_err(misfit)?;
        Ok((self.at, change))
    }
}

/// What a converter reads.
fn adc_value(value: &Spanned<i64>, full_scale: i32) -> Result<i32, Misfit> {
    let read = i32::try_from(*value.get_ref()).ok().filter(|value| (0..=full_scale).contains(value));
    let message =
        || format!("invalid value: integer `{}`, expected a whole number from 0 to {full_scale}", value.get_ref());
    read.ok_or_else(|| Misfit::new(Some(value.span()), message()))
}

/// A key that is one of these numbers.
fn choose(key: &Spanned<String>, mut numbers: impl Iterator<Item = u8> + Clone, what: &str) -> Result<u8, Misfit> {
    let all = numbers.clone().map(|number| number.to_string()).collect::<Vec<_>>().join(", ");
    let chosen = numbers.find(|number| number.to_string() == *key.as_ref());
    chosen.ok_or_else(|| Misfit::new(Some(key.span()), format!("expected {what}: {all}")))
}

#[cfg(test)]
mod tests;
