//! Signals of an axis over time: what a run shows, draws and records.
//!
//! A signal of the table has a short name and is the same thing on every module that has it. Besides, every axis
//! parameter is a signal by its own name. What only a simulated machine knows can be had from a virtual module of this
//! process alone.

use anyhow::{Context, bail};
use gradus_host::{Error, Named, Session, find_axis};
use gradus_sim::{Readings, ServoMachine, StepperAxis, Switches, Vane};
use gradus_tmcl::catalogue::{Ap, Module};

use crate::zone::Zone;

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
    /// The simulated machine's shaft, of a stepper module.
    Shaft,
    /// What an instrument on the simulated machine shows, of a stepper module.
    Machine(Instrument<Readings>),
    /// The same of a servo module.
    Servo(Instrument<ServoMachine>),
}

/// An instrument on a simulated machine.
struct Instrument<M> {
    unit: &'static str,
    /// Digits after the point that mean something.
    decimals: usize,
    read: fn(&M) -> f64,
}

impl<M> Clone for Instrument<M> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<M> Copy for Instrument<M> {}

use Source::{Difference, Parameter, Shaft};

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
    row(
        "shaft",
        &[Shaft, servo("turns", 4, |it| it.position_turns())],
        "where the shaft is, with the switches along its travel",
    ),
    row(
        "shaft_speed",
        &[machine("turns/s", 4, |it| it.speed_rps), servo("turns/s", 4, |it| it.velocity_rpm() / 60.0)],
        "how fast it turns",
    ),
    row("torque", &[machine("Nm", 4, |it| it.torque_nm), servo("Nm", 4, |it| it.torque_nm())], "torque of the motor"),
    row(
        "load_torque",
        &[machine("Nm", 4, |it| it.load_nm), servo("Nm", 4, |it| it.setup().mechanics.load_nm)],
        "load on the shaft",
    ),
    row("phase_a", &[servo("A", 3, |it| it.phase_currents_a()[0])], "current into phase A"),
    row("phase_b", &[servo("A", 3, |it| it.phase_currents_a()[1])], "current into phase B"),
    row("phase_c", &[servo("A", 3, |it| it.phase_currents_a()[2])], "current into phase C"),
    row("duty_a", &[servo("%", 1, |it| duty(it, 0))], "duty of the half bridge A; 0 while the bridge is open"),
    row("duty_b", &[servo("%", 1, |it| duty(it, 1))], "duty of the half bridge B"),
    row("duty_c", &[servo("%", 1, |it| duty(it, 2))], "duty of the half bridge C"),
    row("bus", &[servo("V", 2, |it| it.supply_v())], "voltage at the bridge"),
    row("load_angle", &[machine("deg", 1, |it| it.load_angle_deg)], "electrical angle from the rotor to the field"),
    row("coil_current", &[machine("A", 3, |it| it.current_a)], "current in the motor, RMS"),
    row(
        "winding_temperature",
        &[machine("degC", 1, |it| it.winding_c), servo("degC", 1, |it| it.winding_c())],
        "temperature of the winding",
    ),
    row(
        "driver_temperature",
        &[Parameter(Ap::DriverTemperature), machine("degC", 1, |it| it.driver_c)],
        "temperature of the driver chip",
    ),
];

const fn row(name: &'static str, sources: &'static [Source], description: &'static str) -> Signal {
    Signal { name, sources, description }
}

const fn machine(unit: &'static str, decimals: usize, read: fn(&Readings) -> f64) -> Source {
    Source::Machine(Instrument { unit, decimals, read })
}

const fn servo(unit: &'static str, decimals: usize, read: fn(&ServoMachine) -> f64) -> Source {
    Source::Servo(Instrument { unit, decimals, read })
}

/// Duty of a half bridge in percent.
fn duty(machine: &ServoMachine, phase: usize) -> f64 {
    match machine.bridge() {
        Switches::Open => 0.0,
        Switches::Duties(duties) => 100.0 * duties[phase],
    }
}

/// Turns of the shaft.
fn turns(axis: &StepperAxis, microsteps: f64) -> f64 {
    microsteps / f64::from(axis.microsteps_per_turn())
}

/// Where the carriage works its switches, in turns of the shaft.
fn switches(axis: &StepperAxis) -> Vec<Zone> {
    let turns = |position: i64| turns(axis, position as f64);
    let travel = axis.travel;
    let vanes = [("left", travel.left), ("right", travel.right), ("home", travel.home)];
    let zone =
        |(name, vane): (_, Option<_>)| vane.map(|vane: Vane| Zone { name, range: (turns(vane.from), turns(vane.to)) });
    vanes.into_iter().filter_map(zone).collect()
}

/// The table as it stands in the help.
pub fn list() -> String {
    let line = |signal: &Signal| {
        let simulated = if signal.is_simulated() { " (only a simulated machine knows it)" } else { "" };
        format!("  {:<21}{}{simulated}\n", signal.name, signal.description)
    };
    SIGNALS.iter().map(line).collect()
}

impl Signal {
    fn is_simulated(&self) -> bool {
        self.sources.iter().all(|source| matches!(source, Shaft | Source::Machine(_) | Source::Servo(_)))
    }

    fn origin(&self, module: &'static Module) -> Option<Origin> {
        self.sources.iter().find_map(|source| source.on(module))
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
            Self::Shaft => (!module.is_servo()).then_some(Origin::Shaft),
            Self::Machine(instrument) => (!module.is_servo()).then_some(Origin::Machine(instrument)),
            Self::Servo(instrument) => module.is_servo().then_some(Origin::Servo(instrument)),
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
    Shaft,
    Machine(Instrument<Readings>),
    Servo(Instrument<ServoMachine>),
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
        let Some(origin) = signal.origin(module) else {
            bail!("the {} has no signal `{name}`; {}", module.name, there_is(module));
        };
        if matches!(origin, Origin::Shaft | Origin::Machine(_) | Origin::Servo(_)) && session.bench().is_none() {
            let port = session.port();
            bail!("only a simulated machine knows `{name}`, not {port}; run on sim:MODULE or with --bench");
        }
        Ok(Self { name: signal.name.into(), origin })
    }

    /// Unit of its values, empty for a plain number.
    pub fn unit(&self) -> &'static str {
        match &self.origin {
            Origin::Parameter(named) | Origin::Difference(named, _) => named.unit().text(),
            Origin::Shaft => "turns",
            Origin::Machine(instrument) => instrument.unit,
            Origin::Servo(instrument) => instrument.unit,
        }
    }

    /// Digits after the point that mean something.
    pub fn decimals(&self) -> usize {
        match &self.origin {
            Origin::Parameter(_) | Origin::Difference(..) => 0,
            Origin::Shaft => 4,
            Origin::Machine(instrument) => instrument.decimals,
            Origin::Servo(instrument) => instrument.decimals,
        }
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
            Origin::Shaft => readings(session, axis).map_or(f64::NAN, |(it, axis)| turns(axis, it.position)),
            Origin::Machine(instrument) => readings(session, axis).map_or(f64::NAN, |(it, _)| (instrument.read)(&it)),
            Origin::Servo(instrument) => servo_machine(session, axis).map_or(f64::NAN, instrument.read),
        })
    }

    /// Where something holds along its values.
    pub fn zones(&self, session: &mut Session, axis: u8) -> Vec<Zone> {
        match &self.origin {
            Origin::Shaft => readings(session, axis).map_or_else(Vec::new, |(_, axis)| switches(axis)),
            _ => Vec::new(),
        }
    }
}

/// What the instruments on the simulated machine of an axis show, and that machine.
fn readings(session: &mut Session, axis: u8) -> Option<(Readings, &StepperAxis)> {
    let bench = session.bench()?;
    let readings = bench.readings(axis.into())?;
    Some((readings, &bench.machine().axes.get(usize::from(axis))?.plant))
}

/// The simulated machine of a servo.
fn servo_machine(session: &mut Session, axis: u8) -> Option<&ServoMachine> {
    Some(&session.bench()?.machine().servos.get(usize::from(axis))?.plant)
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
    let names: Vec<&str> =
        SIGNALS.iter().filter(|signal| signal.origin(module).is_some()).map(|signal| signal.name).collect();
    format!("there is {}, and every axis parameter by its name (`gradus params`)", names.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gradus_sim::Bench;
    use gradus_tmcl::catalogue::{MODULES, TMCM_351, TMCM_1617, TMCM_3351};

    fn session() -> Session {
        Session::on_bench(Bench::rigid(&TMCM_3351)).unwrap()
    }

    fn on(module: &'static Module, name: &str) -> Option<String> {
        let signal = SIGNALS.iter().find(|signal| signal.name == name).unwrap();
        let origin = signal.origin(module)?;
        Some(Channel { name: name.into(), origin }.to_string())
    }

    #[test]
    fn every_signal_is_on_some_module_and_hides_no_parameter_of_another_meaning() {
        for signal in SIGNALS {
            assert!(MODULES.iter().any(|module| signal.origin(module).is_some()), "{}", signal.name);
            let rows = MODULES.iter().flat_map(|module| module.axis_parameters);
            for row in rows.filter(|row| gradus_host::normalise(row.name) == signal.name) {
                let is_it = |source: &Source| matches!(source, Parameter(id) if *id == row.id);
                assert!(signal.sources.first().is_some_and(is_it), "{}", signal.name);
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
    fn instruments_show_what_the_motor_does() {
        let mut session = Session::on_bench(Bench::with_defaults(&TMCM_3351)).unwrap();
        session.set_axis(Ap::TargetSpeed, 2, 51_200).unwrap();
        session.sleep(std::time::Duration::from_secs(3));
        let mut read = |name, axis| Channel::find(name, &mut session).unwrap().read(&mut session, axis).unwrap();
        assert!((read("shaft_speed", 2) - 1.0).abs() < 0.5, "{}", read("shaft_speed", 2));
        assert!((read("torque", 2) - read("load_torque", 2)).abs() < 0.1, "{}", read("torque", 2));
        assert!(read("coil_current", 2) > 0.5, "{}", read("coil_current", 2));
        assert_eq!((read("shaft_speed", 0), read("torque", 0)), (0.0, 0.0));
        assert!((25.0..30.0).contains(&read("winding_temperature", 2)), "{}", read("winding_temperature", 2));
    }

    #[test]
    fn instruments_show_what_a_servo_does() {
        let mut session = Session::on_bench(Bench::with_defaults(&TMCM_1617)).unwrap();
        let hall_sensors = 2;
        session.set_axis(Ap::CommutationMode, 0, hall_sensors).unwrap();
        session.set_axis(Ap::TargetSpeed, 0, 600).unwrap();
        session.sleep(std::time::Duration::from_secs(2));
        let mut read = |name| Channel::find(name, &mut session).unwrap().read(&mut session, 0).unwrap();
        assert!((read("shaft_speed") - 10.0).abs() < 0.5, "{}", read("shaft_speed"));
        assert!(read("shaft") > 5.0 && (read("bus") - 24.0).abs() < 0.2);
        let currents = ["phase_a", "phase_b", "phase_c"].map(&mut read);
        assert!(currents.iter().sum::<f64>().abs() < 1e-9 && currents[0] != 0.0, "{currents:?}");
        assert!(["duty_a", "duty_b", "duty_c"].map(&mut read).iter().all(|duty| (30.0..70.0).contains(duty)));
    }

    #[test]
    fn a_name_that_is_none_gets_a_list() {
        let message = |name| format!("{:#}", Channel::find(name, &mut session()).err().unwrap());
        let unknown = message("torqe");
        assert!(unknown.starts_with("no signal `torqe`; there is position, target, speed,"), "{unknown}");
        assert!(message("iq").starts_with("the TMCM-3351 has no signal `iq`; there is position,"), "{}", message("iq"));
    }
}
