//! Signals of an axis over time: what a run shows, draws and records.
//!
//! A signal of the table has a short name and is the same thing on every module that has it. Besides, every axis parameter is a
//! signal by its own name. What only a simulated machine knows can be had from a virtual module of this process alone.

use anyhow::{Context, bail};
use gradus_host::{Error, Named, Session, find_axis};
use gradus_sim::Bench;
use gradus_tmcl::catalogue::{Ap, Module};

use crate::recording::Zone;

/// A row of the table.
struct Signal {
    name: &'static str,
    /// The first one that there is counts.
    sources: &'static [Source],
    description: &'static str,
}

/// Where the values come from.
#[derive(Clone, Copy)]
enum Source {
    /// An axis parameter.
    Parameter(Ap),
    /// One axis parameter minus another of the same unit.
    Difference(Ap, Ap),
    /// The simulated machine.
    Machine(Reading),
}

/// What a simulated machine knows of an axis.
#[derive(Clone, Copy)]
struct Reading {
    unit: &'static str,
    /// Digits after the point that mean something.
    decimals: usize,
    read: fn(&mut Bench, usize) -> f64,
    zones: fn(&mut Bench, usize) -> Vec<Zone>,
}

use Source::{Difference, Parameter};

const SIGNALS: &[Signal] = &[
    row("position", &[Parameter(Ap::ActualPosition)], "where the module takes the axis to be"),
    row("target", &[Parameter(Ap::TargetPosition)], "where it is to go"),
    row("speed", &[Parameter(Ap::ActualSpeed)], "speed of the ramp; of the motor on servo modules"),
    row("encoder", &[Parameter(Ap::EncoderPosition)], "position of the encoder"),
    row(
        "deviation",
        &[Parameter(Ap::PositionError), Difference(Ap::ActualPosition, Ap::EncoderPosition)],
        "position minus encoder; position error on servo modules",
    ),
    row("load", &[Parameter(Ap::LoadValue)], "load value of StallGuard"),
    row(
        "current",
        &[Parameter(Ap::ActualCurrent), Parameter(Ap::CoolStepCurrent)],
        "current that the module gives; on stepper modules CoolStep's scale of 0 to 31",
    ),
    row("iq", &[Parameter(Ap::ActualCurrent)], "current that makes torque"),
    row("id", &[Parameter(Ap::ActualFlux)], "current along the flux"),
    row("errors", &[Parameter(Ap::DriverErrorFlags)], "error flags of the driver"),
    row("shaft", &[SHAFT], "where the shaft is, with the switches along its travel"),
];

const fn row(name: &'static str, sources: &'static [Source], description: &'static str) -> Signal {
    Signal { name, sources, description }
}

const SHAFT: Source =
    Source::Machine(Reading { unit: "turns", decimals: 4, read: shaft_turns, zones: switches_in_turns });

fn shaft_turns(bench: &mut Bench, axis: usize) -> f64 {
    let plant = &bench.machine().axes[axis].plant;
    plant.position() as f64 / f64::from(plant.microsteps_per_turn())
}

/// Where the switches are closed.
fn switches_in_turns(bench: &mut Bench, axis: usize) -> Vec<Zone> {
    let plant = &bench.machine().axes[axis].plant;
    let turns = |position: i64| position as f64 / f64::from(plant.microsteps_per_turn());
    let travel = plant.travel;
    let left = travel.left.map(|end| ("left", (f64::NEG_INFINITY, turns(end))));
    let right = travel.right.map(|end| ("right", (turns(end), f64::INFINITY)));
    let home = travel.home.map(|home| {
        let half = home.width as i64 / 2;
        ("home", (turns(home.middle - half), turns(home.middle + half)))
    });
    [left, right, home].into_iter().flatten().map(|(name, range)| Zone { name, range }).collect()
}

/// The table as it stands in the help.
pub fn list() -> String {
    let line = |signal: &Signal| {
        let simulated = if signal.is_simulated() { " (only a simulated machine knows it)" } else { "" };
        format!("  {:<16}{}{simulated}\n", signal.name, signal.description)
    };
    SIGNALS.iter().map(line).collect()
}

impl Signal {
    fn is_simulated(&self) -> bool {
        self.sources.iter().all(|source| matches!(source, Source::Machine(_)))
    }

    fn is_on(&self, module: &'static Module) -> bool {
        self.sources.iter().any(|source| source.on(module).is_some())
    }
}

impl Source {
    fn on(&self, module: &'static Module) -> Option<Origin> {
        let parameter = |id: Ap| module.axis_parameters.iter().find(|row| row.id == id).map(Named::Axis);
        match *self {
            Self::Parameter(id) => parameter(id).map(Origin::Parameter),
            Self::Difference(of, minus) => {
                let (of, minus) = parameter(of).zip(parameter(minus))?;
                (of.unit() == minus.unit()).then_some(Origin::Difference(of, minus))
            }
            Self::Machine(reading) => Some(Origin::Machine(reading)),
        }
    }
}

/// A signal of one module.
pub struct Channel {
    /// Name, as headings have it.
    pub name: String,
    origin: Origin,
}

enum Origin {
    Parameter(Named),
    Difference(Named, Named),
    Machine(Reading),
}

impl Channel {
    /// The signal of that name, or the axis parameter.
    ///
    /// # Errors
    /// When there is none on this module, or only behind a virtual one.
    pub fn find(name: &str, session: &mut Session) -> anyhow::Result<Self> {
        let module = session.module()?;
        let Some(signal) = SIGNALS.iter().find(|signal| signal.name.eq_ignore_ascii_case(name)) else {
            let parameter =
                find_axis(module, name).with_context(|| format!("no signal `{name}`; {}", there_is(module)))?;
            return Ok(Self { name: parameter.name(), origin: Origin::Parameter(parameter) });
        };
        if signal.is_simulated() && session.bench().is_none() {
            let port = session.port();
            bail!("only a simulated machine knows `{name}`, not {port}; run on sim:MODULE or with --bench");
        }
        let Some(origin) = signal.sources.iter().find_map(|source| source.on(module)) else {
            bail!("the {} has no signal `{name}`; {}", module.name, there_is(module));
        };
        Ok(Self { name: signal.name.into(), origin })
    }

    /// Unit of its values, empty for a plain number.
    pub fn unit(&self) -> &'static str {
        match &self.origin {
            Origin::Parameter(named) | Origin::Difference(named, _) => named.unit().text(),
            Origin::Machine(reading) => reading.unit,
        }
    }

    /// Digits after the point that mean something.
    pub fn decimals(&self) -> usize {
        if let Origin::Machine(reading) = &self.origin { reading.decimals } else { 0 }
    }

    /// Its value on an axis at this moment.
    ///
    /// # Errors
    /// When the session fails.
    pub fn read(&self, session: &mut Session, axis: u8) -> Result<f64, Error> {
        let mut value = |named: &Named| session.command(named.read(axis)).map(|value| named.decode(value));
        Ok(match &self.origin {
            Origin::Parameter(named) => value(named)? as f64,
            Origin::Difference(of, minus) => (value(of)? - value(minus)?) as f64,
            Origin::Machine(reading) => {
                session.bench().map_or(f64::NAN, |bench| (reading.read)(bench, usize::from(axis)))
            }
        })
    }
}

impl Channel {
    /// Where something holds along its values.
    pub fn zones(&self, session: &mut Session, axis: u8) -> Vec<Zone> {
        let Origin::Machine(reading) = &self.origin else { return Vec::new() };
        session.bench().map_or_else(Vec::new, |bench| (reading.zones)(bench, usize::from(axis)))
    }
}

/// Name and unit.
impl std::fmt::Display for Channel {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self.unit() {
            "" => f.write_str(&self.name),
            unit => write!(f, "{} [{unit}]", self.name),
        }
    }
}

/// What a module has, in words.
fn there_is(module: &'static Module) -> String {
    let names: Vec<&str> = SIGNALS.iter().filter(|signal| signal.is_on(module)).map(|signal| signal.name).collect();
    format!("there is {}, and every axis parameter by its name (`gradus params`)", names.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gradus_tmcl::catalogue::{MODULES, TMCM_351, TMCM_1617, TMCM_3351};

    fn session() -> Session {
        Session::on_bench(Bench::with_defaults(&TMCM_3351)).unwrap()
    }

    fn on(module: &'static Module, name: &str) -> Option<String> {
        let signal = SIGNALS.iter().find(|signal| signal.name == name).unwrap();
        let origin = signal.sources.iter().find_map(|source| source.on(module))?;
        Some(Channel { name: name.into(), origin }.to_string())
    }

    #[test]
    fn every_signal_is_on_some_module_and_hides_no_parameter_of_another_meaning() {
        for signal in SIGNALS {
            assert!(MODULES.iter().any(|module| signal.is_on(module)), "{}", signal.name);
            for module in MODULES {
                assert!(module.axis_parameters.iter().all(|row| gradus_host::normalise(row.name) != signal.name));
            }
        }
    }

    #[test]
    fn a_signal_is_the_same_thing_on_every_module_that_has_it() {
        let cases = [
            ("position", [Some("position [usteps]"), Some("position"), Some("position [usteps]")]),
            ("deviation", [Some("deviation [usteps]"), Some("deviation"), None]),
            ("current", [Some("current"), Some("current [mA]"), None]),
            ("load", [Some("load"), None, Some("load")]),
            ("iq", [None, Some("iq [mA]"), None]),
            ("shaft", [Some("shaft [turns]"); 3]),
        ];
        for (name, expected) in cases {
            let found = [&TMCM_3351, &TMCM_1617, &TMCM_351].map(|module| on(module, name));
            assert_eq!(found.each_ref().map(Option::as_deref), expected, "{name}");
        }
    }

    #[test]
    fn values_are_those_of_the_axis() {
        let mut session = session();
        session.set_axis(Ap::TargetPosition, 1, 51_200).unwrap();
        session.sleep(std::time::Duration::from_secs(5));
        session.set_axis(Ap::EncoderPosition, 1, 51_000).unwrap();
        for (name, expected) in
            [("Position", 51_200.0), ("deviation", 200.0), ("shaft", 1.0), ("max_speed", 51_200.0), ("1", 51_200.0)]
        {
            let channel = Channel::find(name, &mut session).unwrap();
            assert_eq!(channel.read(&mut session, 1).unwrap(), expected, "{name}");
        }
    }

    #[test]
    fn a_name_that_is_none_gets_a_list() {
        let message = |name| format!("{:#}", Channel::find(name, &mut session()).err().unwrap());
        let unknown = message("torqe");
        assert!(unknown.starts_with("no signal `torqe`; there is position, target, speed,"), "{unknown}");
        assert!(message("iq").starts_with("the TMCM-3351 has no signal `iq`; there is position,"), "{}", message("iq"));
    }
}
