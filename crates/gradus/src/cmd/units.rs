//! `gradus units`
//!
//! Everything is linear: a unit is so many turns, turns per second, or turns per second squared.

use std::io::Write;
use std::str::FromStr;

use anyhow::{Context, bail};
use gradus_host::Session;
use gradus_motion::{Tmc428Units, Units as RampUnits};
use gradus_tmcl::catalogue::{Ap, AxisParameter, MODULES, Module, Unit as Kind};
use serde_json::{Map, Value, json};

use crate::listed::table;
use crate::port;

/// Convert positions, speeds and accelerations
///
/// Converts between the numbers that a module takes ("setting") and units of physics, for a motor and the unit parameters of the
/// module. Each quantity is followed by what the nearest setting amounts to. Without a quantity: what a setting of 1 and the
/// largest one are.
///
/// Speeds are in pps (microsteps per second), rps, rpm or mm/s; accelerations in pps2, rps2, rpm/s or mm/s2; positions in
/// usteps, turns, deg, mm or counts (of the encoder). A number without a unit is a setting.
#[derive(clap::Args)]
#[command(after_long_help = "\
Examples:
  gradus units --module tmcm-351 --pulse-div 3 --ramp-div 7 --speed 100rpm
  gradus units --module tmcm-3351 --travel 5 --speed 20mm/s --acceleration 100mm/s2
  gradus units --module tmcm-351 --speed 2047 --json")]
pub struct Units {
    /// Module
    #[arg(long, value_parser = port::module(MODULES), ignore_case = true, default_value = "tmcm-3351")]
    module: &'static Module,
    #[command(flatten)]
    axis: Axis,
    /// Speed: 100rpm, 2rps, 51200pps, 10mm/s, or a setting
    #[arg(long, value_name = "SPEED", allow_hyphen_values = true)]
    speed: Vec<Quantity>,
    /// Acceleration: 5rps2, 300rpm/s, 51200pps2, 50mm/s2, or a setting
    #[arg(long, value_name = "ACCELERATION", allow_hyphen_values = true)]
    acceleration: Vec<Quantity>,
    /// Position: 1.5turns, 90deg, 20mm, 4096counts, or a setting
    #[arg(long, value_name = "POSITION", allow_hyphen_values = true)]
    position: Vec<Quantity>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// The unit parameters of an axis and what hangs on it. What is not given is the default of the module.
#[derive(clap::Args, Default)]
struct Axis {
    /// Pulse divisor, axis parameter 154 of the TMCM-351
    #[arg(long, value_name = "0..13", value_parser = clap::value_parser!(u8).range(0..=13))]
    pulse_div: Option<u8>,
    /// Ramp divisor, axis parameter 153 of the TMCM-351
    #[arg(long, value_name = "0..13", value_parser = clap::value_parser!(u8).range(0..=13))]
    ramp_div: Option<u8>,
    /// Unit mode, axis parameter 255 of the TMCM-3351: 0 registers, 1 pps
    #[arg(long, value_name = "0|1", value_parser = clap::value_parser!(u8).range(0..=1))]
    unit_mode: Option<u8>,
    /// Position scaler, axis parameter 56 of the TMCM-1617
    #[arg(long, value_parser = clap::value_parser!(u32).range(6..=2_147_483_647))]
    position_scaler: Option<u32>,
    /// Microsteps in a full step: 1, 2, 4 ... 256
    #[arg(long)]
    microsteps: Option<u32>,
    /// Full steps in a turn of the motor
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=65_535))]
    full_steps: Option<u32>,
    /// Counts of the encoder in a turn
    #[arg(long, value_name = "COUNTS", value_parser = clap::value_parser!(u32).range(1..=16_777_215))]
    encoder: Option<u32>,
    /// Travel in mm in a turn, for units with mm
    #[arg(long, value_name = "MM")]
    travel: Option<f64>,
}

/// A number with or without a unit.
#[derive(Clone, Debug)]
struct Quantity {
    number: f64,
    unit: String,
}

impl FromStr for Quantity {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let end = text.find(|c: char| c.is_alphabetic()).unwrap_or(text.len());
        let (number, unit) = text.split_at(end);
        let number = number.trim().parse().ok().filter(|number: &f64| number.is_finite());
        let number = number.ok_or_else(|| format!("`{text}` is no number with a unit, such as 100rpm"))?;
        Ok(Self { number, unit: unit.replace('^', "") })
    }
}

/// The units of a quantity, the setting first.
struct Scale {
    quantity: &'static str,
    row: &'static AxisParameter,
    /// The largest setting.
    max: f64,
    units: Vec<(&'static str, f64)>,
}

impl Units {
    pub fn run(self, out: &mut dyn Write) -> anyhow::Result<()> {
        let scales = self.axis.scales(self.module)?;
        let given = [&self.speed, &self.acceleration, &self.position];
        let nothing = given.iter().all(|given| given.is_empty());
        let mut lists = Vec::new();
        for (scale, given) in scales.iter().zip(given) {
            let mut columns = if nothing { scale.ends() } else { Vec::new() };
            for quantity in given {
                columns.extend(scale.columns(quantity, self.module)?);
            }
            lists.push((scale, columns));
        }
        lists.retain(|(_, columns)| !columns.is_empty());
        if self.json {
            let list: Vec<Value> = lists.iter().flat_map(|(scale, columns)| scale.json(columns)).collect();
            return Ok(writeln!(out, "{}", serde_json::to_string_pretty(&list)?)?);
        }
        let tables: Vec<String> = lists.iter().map(|(scale, columns)| scale.table(columns)).collect();
        Ok(writeln!(out, "{}", tables.join("\n\n"))?)
    }
}

impl Scale {
    /// A setting of 1 and the largest one.
    fn ends(&self) -> Vec<(String, f64)> {
        [1.0, self.max].map(|setting| (digits(setting), setting * self.units[0].1)).into()
    }

    /// A quantity in turns and seconds, and the nearest setting.
    fn nearest(&self, Quantity { number, unit }: &Quantity, module: &Module) -> anyhow::Result<(f64, f64)> {
        let name = if unit.is_empty() { "setting" } else { unit };
        let size = self.units.iter().find(|(known, _)| *known == name).map(|(_, size)| *size);
        let exact = number * size.with_context(|| self.no_unit(unit))?;
        let setting = (exact / self.units[0].1).round();
        let given = format!("{number}{unit}");
        if setting.abs() > self.max {
            let (quantity, number, max) = (self.quantity, self.row.number, self.max);
            let farther = match self.row.unit {
                Kind::Tmc428Speed => "; a smaller --pulse-div reaches farther",
                Kind::Tmc428Acceleration => "; a smaller --pulse-div or --ramp-div reaches farther",
                _ => "",
            };
            bail!(
                "{quantity} {given} is a setting of {}; the {} takes up to {max} (axis parameter {number}){farther}",
                digits(setting),
                module.name
            );
        }
        Ok((exact, setting))
    }

    /// A quantity and the nearest setting, in turns and seconds.
    fn columns(&self, quantity: &Quantity, module: &Module) -> anyhow::Result<Vec<(String, f64)>> {
        let (exact, setting) = self.nearest(quantity, module)?;
        let given = format!("{}{}", quantity.number, quantity.unit);
        let nearest = (digits(setting), setting * self.units[0].1);
        Ok(if given == nearest.0 { vec![nearest] } else { vec![(given, exact), nearest] })
    }

    fn no_unit(&self, unit: &str) -> String {
        let known: Vec<&str> = self.units[1..].iter().map(|(name, _)| *name).collect();
        let travel = if unit.starts_with("mm") { "; units with mm need --travel" } else { "" };
        format!("`{unit}` is no unit of {} here, but {}{travel}", self.quantity, known.join(", "))
    }

    fn table(&self, columns: &[(String, f64)]) -> String {
        let numbers = columns.iter().map(|(of, _)| format!("{of}#"));
        let heading: Vec<String> = [self.quantity.to_string()].into_iter().chain(numbers).collect();
        let mut table = table(heading.iter().map(String::as_str));
        for (name, size) in &self.units {
            let values = columns.iter().map(|(_, turns)| digits(turns / size));
            table.add_row([name.to_string()].into_iter().chain(values));
        }
        table.trim_fmt()
    }

    fn json(&self, columns: &[(String, f64)]) -> Vec<Value> {
        let values = |turns: f64| self.units.iter().map(move |(name, size)| (name.to_string(), json!(turns / size)));
        let object = |(of, turns): &(String, f64)| json!({ "quantity": self.quantity, "of": of, "values": values(*turns).collect::<Map<_, _>>() });
        columns.iter().map(object).collect()
    }
}

/// The setting of a parameter of motion for a quantity with a unit, under the settings that an axis of a module has now. `travel` is
/// in mm a turn. `None` if the parameter is none of motion.
///
/// # Errors
/// When the unit is none of the parameter's, or the setting beyond its range.
pub fn setting(
    text: &str,
    unit: Kind,
    session: &mut Session,
    axis: u8,
    travel: Option<f64>,
) -> anyhow::Result<Option<i64>> {
    let module = session.module()?;
    let scales = Axis::of(session, axis, travel).scales(module)?;
    let Some(scale) = scales.iter().find(|scale| scale.row.unit == unit && unit != Kind::Plain) else {
        return Ok(None);
    };
    let quantity: Quantity = text.parse().map_err(anyhow::Error::msg)?;
    Ok(Some(scale.nearest(&quantity, module)?.1 as i64))
}

impl Axis {
    /// What an axis of a module has set.
    fn of(session: &mut Session, axis: u8, travel: Option<f64>) -> Self {
        let mut read = |id| session.get_axis(id, axis).ok();
        let mut byte = |id| read(id).and_then(|value| u8::try_from(value).ok());
        let (pulse_div, ramp_div) = (byte(Ap::PulseDivisor), byte(Ap::RampDivisor));
        let unit_mode = byte(Ap::UnitMode);
        let microsteps = byte(Ap::MicrostepResolution).map(|exponent| 1 << exponent.min(8));
        let mut number = |id| read(id).and_then(|value| u32::try_from(value).ok()).filter(|value| *value > 0);
        let (position_scaler, full_steps) = (number(Ap::PositionScaler), number(Ap::FullStepResolution));
        Self { pulse_div, ramp_div, unit_mode, position_scaler, microsteps, full_steps, encoder: None, travel }
    }

    /// Speed, acceleration, position.
    fn scales(&self, module: &'static Module) -> anyhow::Result<[Scale; 3]> {
        self.check(module)?;
        let step = self.step(module)?;
        let scale = |quantity, id, units: Vec<(&'static str, Option<f64>)>| {
            let row = row(module, id).context("the catalogue lacks a parameter of motion")?;
            let (setting, max) = self.setting(row, step.unwrap_or(1.0), module);
            let units = units.into_iter().filter_map(|(name, size)| Some((name, size?)));
            let units = [("setting", setting)].into_iter().chain(units).collect();
            anyhow::Ok(Scale { quantity, row, max: max as f64, units })
        };
        let mm = self.travel.map(|travel| 1.0 / travel);
        let encoder = self.encoder(module).map(|counts| 1.0 / f64::from(counts));
        let speeds = vec![("pps", step), ("rps", Some(1.0)), ("rpm", Some(1.0 / 60.0)), ("mm/s", mm)];
        let accelerations = vec![("pps2", step), ("rps2", Some(1.0)), ("rpm/s", Some(1.0 / 60.0)), ("mm/s2", mm)];
        let turns = [("turns", Some(1.0)), ("deg", Some(1.0 / 360.0)), ("mm", mm), ("counts", encoder)];
        let positions = [("usteps", step)].into_iter().chain(turns).collect();
        Ok([
            scale("speed", Ap::MaxSpeed, speeds)?,
            scale("acceleration", Ap::MaxAcceleration, accelerations)?,
            scale("position", Ap::TargetPosition, positions)?,
        ])
    }

    /// What a setting of 1 is in turns and seconds, and the largest one.
    fn setting(&self, row: &AxisParameter, step: f64, module: &Module) -> (f64, i64) {
        let given = |given: Option<u8>, id| given.unwrap_or_else(|| default(module, id).unwrap_or(1) as u8);
        let chip = Tmc428Units {
            pulse_div: given(self.pulse_div, Ap::PulseDivisor),
            ramp_div: given(self.ramp_div, Ap::RampDivisor),
        };
        let registers = given(self.unit_mode, Ap::UnitMode) == 0;
        let part = |bits: u8| step / f64::from(1_u32 << bits);
        let size = match row.unit {
            Kind::Tmc428Speed => chip.pps(1.0) * step,
            Kind::Tmc428Acceleration => chip.pps2(1.0) * step,
            Kind::Pps if registers => return (part(RampUnits::TMC4361A.speed_bits), i32::MAX.into()),
            Kind::PpsPerSecond if registers => return (part(RampUnits::TMC4361A.acceleration_bits), i32::MAX.into()),
            Kind::Microsteps | Kind::Pps | Kind::PpsPerSecond => step,
            Kind::Rpm | Kind::RpmPerSecond => 1.0 / 60.0,
            // The position of a servo: its scaler is a turn.
            _ => 1.0 / self.position_scaler.map_or(default(module, Ap::PositionScaler).unwrap_or(1) as f64, f64::from),
        };
        (size, row.max)
    }

    /// A microstep in turns; none on a module without.
    fn step(&self, module: &Module) -> anyhow::Result<Option<f64>> {
        let Some(resolution) = row(module, Ap::MicrostepResolution) else { return Ok(None) };
        let most = 1 << resolution.max;
        let microsteps = self.microsteps.unwrap_or(1 << resolution.default.unwrap_or(0));
        if !microsteps.is_power_of_two() || microsteps > most {
            bail!("--microsteps {microsteps}: the {} divides a full step into 1, 2, 4 ... {most}", module.name);
        }
        let full_steps = self.full_steps.or_else(|| default(module, Ap::FullStepResolution)?.try_into().ok());
        Ok(Some(1.0 / f64::from(microsteps) / f64::from(full_steps.unwrap_or(FULL_STEPS))))
    }

    fn encoder(&self, module: &Module) -> Option<u32> {
        let known = default(module, Ap::EncoderResolution).or_else(|| default(module, Ap::EncoderSteps));
        self.encoder.or_else(|| known?.try_into().ok())
    }

    /// Refuses what the module does not have.
    fn check(&self, module: &Module) -> anyhow::Result<()> {
        let options = [
            ("--pulse-div", self.pulse_div.is_some(), Ap::PulseDivisor),
            ("--ramp-div", self.ramp_div.is_some(), Ap::RampDivisor),
            ("--unit-mode", self.unit_mode.is_some(), Ap::UnitMode),
            ("--position-scaler", self.position_scaler.is_some(), Ap::PositionScaler),
            ("--microsteps", self.microsteps.is_some(), Ap::MicrostepResolution),
            ("--full-steps", self.full_steps.is_some(), Ap::MicrostepResolution),
        ];
        for (option, given, id) in options {
            if given && row(module, id).is_none() {
                let have = MODULES.iter().filter(|module| row(module, id).is_some()).map(|module| module.name);
                let have: Vec<&str> = have.collect();
                bail!("{option}: the {} has no such parameter; it is for {}", module.name, have.join(" and "));
            }
        }
        match self.travel {
            Some(travel) if !(travel.is_finite() && travel > 0.0) => bail!("--travel {travel}: it must be above 0 mm"),
            _ => Ok(()),
        }
    }
}

/// Full steps in a turn of a motor of 1.8 degrees.
const FULL_STEPS: u32 = 200;

fn row(module: &Module, id: Ap) -> Option<&'static AxisParameter> {
    module.axis_parameters.iter().find(|row| row.id == id)
}

fn default(module: &Module, id: Ap) -> Option<i64> {
    row(module, id)?.default
}

/// Six digits that mean something, without zeros at the end.
fn digits(number: f64) -> String {
    // A zero has no sign.
    let number = number + 0.0;
    let magnitude = number.abs().max(1e-12).log10().floor() as i32;
    let text = format!("{number:.*}", usize::try_from(5 - magnitude).unwrap_or(0));
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_unit_leads_to_a_setting_and_back() {
        for module in MODULES {
            let axis = Axis { travel: Some(4.0), encoder: Some(4_000), ..Axis::default() };
            for scale in axis.scales(module).unwrap() {
                for setting in [1.0, -2.0, 17.0, 2047.0] {
                    for (name, size) in &scale.units {
                        let number = setting * scale.units[0].1 / size;
                        let columns = scale.columns(&Quantity { number, unit: (*name).into() }, module).unwrap();
                        let of = &columns.last().unwrap().0;
                        assert_eq!(*of, setting.to_string(), "{} {} {number}{name}", module.name, scale.quantity);
                    }
                }
            }
        }
    }

    #[test]
    fn units_are_those_of_the_chips() {
        let size = |axis: Axis, name: &str, quantity: usize| {
            let scale = &axis.scales(Module::named(name).unwrap()).unwrap()[quantity];
            let pps = scale.units.iter().find(|(name, _)| name.starts_with("pps")).unwrap().1;
            scale.units[0].1 / pps
        };
        let divisors = |pulse_div, ramp_div| Axis { pulse_div, ramp_div, ..Axis::default() };
        // The ends of the tables: 16 MHz / 65536, and that squared / 2^29.
        assert_eq!(size(divisors(Some(0), Some(0)), "tmcm-351", 0), 244.140625);
        assert_eq!(size(divisors(Some(13), Some(0)), "tmcm-351", 0), 244.140625 / 8192.0);
        assert!((size(divisors(Some(0), Some(0)), "tmcm-351", 1) - 476_837.158_203_125).abs() < 1e-6);
        let registers = || Axis { unit_mode: Some(0), ..Axis::default() };
        assert_eq!([size(registers(), "tmcm-3351", 0), size(registers(), "tmcm-3351", 1)], [1.0 / 256.0, 0.25]);
    }

    #[test]
    fn digits_are_six_without_zeros() {
        let cases = [(0.0, "0"), (-0.0, "0"), (1.0, "1"), (100.0, "100"), (0.000_078_125, "0.000078125")];
        let more = [(21_333.333, "21333.3"), (2_147_483_647.0, "2147483647"), (-1.5, "-1.5"), (999_999.9, "1000000")];
        for (number, text) in cases.into_iter().chain(more) {
            assert_eq!(digits(number), text);
        }
    }
}
