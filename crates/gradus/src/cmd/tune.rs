//! `gradus tune`

use std::fs;
use std::io::Write;
use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Context, bail};
use clap::ValueEnum;
use gradus_host::{Regulator, Session, Step, StepResponse, Trial, find_axis};
use gradus_tmcl::catalogue::Ap;

use crate::plot::{self, Named};
use crate::port::Port;
use crate::span;

/// Give a step to a regulator of a servo and judge what comes of it
///
/// The module samples the answer itself, 2000 times a second, so a real module and a virtual one are judged alike.
/// Prints how long the answer takes to rise, how far it overshoots and when it has settled, and writes a picture where --svg asks for one. For
/// velocity and position the motor must be free to turn; for the current a step in flux is given, which does not turn
/// it.
#[derive(clap::Args)]
#[command(after_long_help = "\
Examples:
  gradus tune velocity --port /dev/ttyACM0
  gradus tune current --port /dev/ttyACM0 --step 2000 --set torque_p=900 --set torque_i=4000
  gradus tune position --bench servo.toml --set commutation_mode=3 --step 655360 --ramp --time 3s")]
pub struct Tune {
    /// Whose target is changed
    regulator: Which,
    #[command(flatten, next_help_heading = "Connection")]
    port: Port,
    /// Axis
    #[arg(long, value_name = "N", default_value_t = 0)]
    axis: u8,
    /// How far: mA, rpm, or 65536 a turn [default: 1000, for the position a turn]
    #[arg(long, value_name = "SIZE", allow_negative_numbers = true)]
    step: Option<i32>,
    /// How long to look [default: 20ms for the current, 500ms for the velocity, 2s for the position]
    #[arg(long, value_name = "DURATION", value_parser = span::parse_period)]
    time: Option<Duration>,
    /// Leave the ramp on
    #[arg(long)]
    ramp: bool,
    /// Set axis parameters before; nothing is stored
    #[arg(long, value_name = "NAME=VALUE", value_parser = assignment)]
    set: Vec<(String, i64)>,
    /// Draw the answer as a picture
    #[arg(long, value_name = "FILE.svg")]
    svg: Option<PathBuf>,
}

#[derive(Clone, Copy, ValueEnum)]
enum Which {
    Velocity,
    Current,
    Position,
}

impl Which {
    /// The size of a step and how long to look at it, and the unit.
    fn details(self) -> (i32, Duration, &'static str) {
        match self {
            Self::Velocity => (1_000, Duration::from_millis(500), "rpm"),
            Self::Current => (1_000, Duration::from_millis(20), "mA"),
            Self::Position => (65_536, Duration::from_secs(2), "turns/65536"),
        }
    }

    /// The flux stands for the current, since it does not turn the motor; a direct-current motor has none.
    fn regulator(self, session: &mut Session, axis: u8) -> anyhow::Result<Regulator> {
        Ok(match self {
            Self::Velocity => Regulator::Velocity,
            Self::Position => Regulator::Position,
            Self::Current if session.get_axis(Ap::MotorType, axis)? == DIRECT_CURRENT => Regulator::Torque,
            Self::Current => Regulator::Flux,
        })
    }
}

/// Value of `motor type`.
const DIRECT_CURRENT: i32 = 1;

fn assignment(text: &str) -> Result<(String, i64), String> {
    let parts =
        text.split_once('=').and_then(|(name, value)| Some((name.trim().to_owned(), value.trim().parse().ok()?)));
    parts.ok_or_else(|| "a parameter and a number are expected: velocity_p=800".into())
}

impl Tune {
    pub fn run(self, out: &mut dyn Write) -> anyhow::Result<()> {
        let mut session = self.port.open()?;
        self.prepare(&mut session)?;
        let (size, time, unit) = self.regulator.details();
        let regulator = self.regulator.regulator(&mut session, self.axis)?;
        let step = Step {
            regulator,
            axis: self.axis,
            size: self.step.unwrap_or(size),
            time: self.time.unwrap_or(time),
            ramp: self.ramp,
        };
        let trial = session.try_step(&step)?;
        writeln!(out, "{}", self.title(&mut session, &trial, regulator, unit)?)?;
        print(out, &trial.response)?;
        writeln!(out, "resolution {:.1} ms, interpolated between samples", trial.period.as_secs_f64() * 1e3)?;
        let Some(file) = &self.svg else { return Ok(()) };
        fs::write(file, picture(&trial, unit)?).with_context(|| format!("cannot write {}", file.display()))?;
        Ok(writeln!(out, "picture   {}", file.display())?)
    }

    /// Sets what is to be set, and waits until the motor can turn.
    fn prepare(&self, session: &mut Session) -> anyhow::Result<()> {
        let module = session.module()?;
        if !module.axis_parameters.iter().any(|row| row.id == Ap::CommutationMode) {
            bail!("the {} is no servo; only a TMCM-1617 has regulators to tune", module.name);
        }
        for (name, value) in &self.set {
            let named = find_axis(module, name)?;
            let Some(value) = named.encode(*value) else { bail!("{named} takes {}, not {value}", named.range()) };
            session.command(named.write(self.axis, value))?;
        }
        if session.get_axis(Ap::CommutationMode, self.axis)? == 0 {
            bail!(
                "the motor is not commutated: set `commutation mode` (axis parameter 15) first, or here with --set \
                 commutation_mode=2 (hall sensors) or 3 (encoder)"
            );
        }
        wait_for_encoder(session, self.axis)
    }

    fn title(&self, session: &mut Session, trial: &Trial, regulator: Regulator, unit: &str) -> anyhow::Result<String> {
        let mut title = format!("{regulator:?} of axis {} from {} to {} {unit}", self.axis, trial.way.0, trial.way.1);
        for (name, gain) in ["P", "I"].iter().zip(regulator.gains()) {
            title += &format!(", {name} {}", session.get_axis(*gain, self.axis)?);
        }
        Ok(title)
    }
}

/// The longest initialisation of an encoder takes 10 s.
const LONGEST_INIT: Duration = Duration::from_secs(12);
const GLANCE: Duration = Duration::from_millis(20);

fn wait_for_encoder(session: &mut Session, axis: u8) -> anyhow::Result<()> {
    let deadline = session.now() + LONGEST_INIT;
    session.sleep(GLANCE);
    while session.get_axis(Ap::EncoderInitState, axis)? != 0 {
        if session.now() > deadline {
            bail!("the encoder is not initialised after {} s (axis parameter 103)", LONGEST_INIT.as_secs());
        }
        session.sleep(GLANCE);
    }
    Ok(())
}

fn print(out: &mut dyn Write, response: &StepResponse) -> anyhow::Result<()> {
    let time =
        |time: Option<Duration>| time.map_or("never".into(), |time| format!("{:.1} ms", time.as_secs_f64() * 1e3));
    writeln!(out, "rise      {} from 10 % to 90 %", time(response.rise))?;
    writeln!(out, "overshoot {:.1} %", response.overshoot_percent)?;
    Ok(writeln!(out, "settling  {} until it stays within 5 %", time(response.settling))?)
}

fn picture(trial: &Trial, unit: &str) -> anyhow::Result<String> {
    let points = |values: &[f64]| -> Vec<(f64, f64)> {
        let time = |row: usize| (row as f64 - trial.before as f64) * trial.period.as_secs_f64();
        values.iter().enumerate().map(|(row, value)| (time(row), *value)).collect()
    };
    let quantity = if unit == "rpm" {
        "velocity"
    } else if unit == "mA" {
        "current"
    } else {
        "position"
    };
    let title = format!("{quantity} [{unit}]");
    let curves = [("wanted", points(&trial.wanted)), ("actual", points(&trial.actual))];
    let current = [("current", points(&trial.current_ma))];
    plot::named_svg(&[Named { title: &title, curves: &curves }, Named { title: "current [mA]", curves: &current }])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_assignment_is_a_name_and_a_number() {
        assert_eq!(assignment("velocity_p = 800"), Ok(("velocity_p".into(), 800)));
        for text in ["velocity_p", "velocity_p=x", "800"] {
            assert!(assignment(text).is_err(), "{text}");
        }
    }

    #[test]
    fn the_picture_shows_wanted_and_actual_values_and_the_current() {
        let trial = Trial {
            period: Duration::from_millis(1),
            before: 1,
            wanted: vec![100.0; 3],
            actual: vec![0.0, 50.0, 100.0],
            current_ma: vec![5.0; 3],
            way: (0.0, 100.0),
            response: StepResponse { rise: None, overshoot_percent: 0.0, settling: None },
        };
        let svg = picture(&trial, "rpm").unwrap();
        for text in ["wanted", "actual", "velocity [rpm]", "current [mA]"] {
            assert!(svg.contains(text), "{text}");
        }
    }
}
