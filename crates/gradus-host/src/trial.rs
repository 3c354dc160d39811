//! Trials: a step that is given to a regulator of a servo, and what the servo makes of it.

use std::time::Duration;

use gradus_tmcl::catalogue::Ap;
use gradus_tmcl::{Instruction, Opcode};

use crate::{Capture, Error, Session, StepResponse};

/// A regulator of a servo.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Regulator {
    /// Of the flux current, in mA, which has the gains of the torque current but does not turn the motor.
    Flux,
    /// Of the torque current, in mA.
    Torque,
    /// Of the velocity, in rpm.
    Velocity,
    /// Of the position, 65536 a turn unless the module has another position scaler.
    Position,
}

impl Regulator {
    /// Its parameters: those that are tuned.
    pub fn gains(self) -> &'static [Ap] {
        match self {
            Self::Flux | Self::Torque => &[Ap::TorqueP, Ap::TorqueI],
            Self::Velocity => &[Ap::VelocityP, Ap::VelocityI],
            Self::Position => &[Ap::PositionP],
        }
    }

    /// The target, which a host writes.
    fn target(self) -> Ap {
        match self {
            Self::Flux => Ap::TargetFlux,
            Self::Torque => Ap::TargetCurrent,
            Self::Velocity => Ap::TargetSpeed,
            Self::Position => Ap::TargetPosition,
        }
    }

    /// What is sampled: what the regulator is asked for, how far it is off, and the current. The difference, because
    /// the actual velocity and the actual current of the module are low-pass filtered for people to read.
    fn channels(self) -> [Ap; 3] {
        match self {
            Self::Flux => [Ap::TargetFlux, Ap::FluxError, Ap::ActualFlux],
            Self::Torque => [Ap::TargetCurrent, Ap::TorqueError, Ap::ActualCurrent],
            Self::Velocity => [Ap::RampSpeed, Ap::VelocityError, Ap::ActualCurrent],
            Self::Position => [Ap::RampPosition, Ap::PositionError, Ap::ActualCurrent],
        }
    }
}

/// A step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Step {
    /// Whose target it is.
    pub regulator: Regulator,
    /// Of which axis.
    pub axis: u8,
    /// How far it goes, in the unit of the target. The step begins at rest.
    pub size: i32,
    /// For how long to look.
    pub time: Duration,
    /// The ramp stays on if it is.
    pub ramp: bool,
}

/// What came of a step.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// Time from one sample to the next.
    pub period: Duration,
    /// How many of the samples are from before the step.
    pub before: usize,
    /// What the regulator was asked for.
    pub wanted: Vec<f64>,
    /// What there was.
    pub actual: Vec<f64>,
    /// The flux current of a step in flux, else the torque current, in mA and as the module filters it.
    pub current_ma: Vec<f64>,
    /// Where the step began and where it was to end.
    pub way: (f64, f64),
    /// The judgement.
    pub response: StepResponse,
}

/// The part of the time of a trial for which the samples begin before the step.
const LEAD: u32 = 20;
/// A motor has come to rest after so long.
const REST: Duration = Duration::from_millis(500);

impl Session {
    /// Gives a step to a regulator and looks what the servo makes of it, through the module's own capture. Afterwards
    /// velocity and current are taken back to 0, a position is kept, and the ramp is as it was.
    ///
    /// # Errors
    /// When the module is no servo, refuses something, or the line is broken.
    pub fn try_step(&mut self, step: &Step) -> Result<Trial, Error> {
        let ramp = self.get_axis(Ap::VelocityRampEnable, step.axis)?;
        if !step.ramp {
            self.set_axis(Ap::VelocityRampEnable, step.axis, 0)?;
        }
        let trial = self.step_from_rest(step);
        let ended = self.end_step(step);
        self.set_axis(Ap::VelocityRampEnable, step.axis, ramp)?;
        ended.and(trial)
    }

    fn step_from_rest(&mut self, step: &Step) -> Result<Trial, Error> {
        self.stop_motor(step.axis)?;
        self.sleep(REST);
        let base =
            if step.regulator == Regulator::Position { self.get_axis(Ap::ActualPosition, step.axis)? } else { 0 };
        let target = base.saturating_add(step.size);
        let lead = step.time / LEAD;
        let capture = self.capture(step.axis, &step.regulator.channels(), lead + step.time, |session| {
            session.sleep(lead);
            session.set_axis(step.regulator.target(), step.axis, target)
        })?;
        Ok(judge(&capture, f64::from(base), f64::from(target)))
    }

    fn end_step(&mut self, step: &Step) -> Result<(), Error> {
        match step.regulator {
            Regulator::Position => Ok(()),
            Regulator::Flux | Regulator::Torque => self.set_axis(step.regulator.target(), step.axis, 0),
            Regulator::Velocity => self.stop_motor(step.axis),
        }
    }

    fn stop_motor(&mut self, axis: u8) -> Result<(), Error> {
        self.command(Instruction::new(Opcode::MST, 0, axis, 0)).map(drop)
    }
}

/// From the samples to what they mean. The judgement begins with the step.
fn judge(capture: &Capture, from: f64, to: f64) -> Trial {
    let begins = capture.rows.iter().position(|row| row.first().is_some_and(|wanted| f64::from(*wanted) != from));
    let before = begins.unwrap_or(0);
    let column = |of: fn(&[i32]) -> f64| -> Vec<f64> { capture.rows.iter().map(|row| of(row)).collect() };
    let wanted = column(|row| f64::from(row[0]));
    let actual = column(|row| f64::from(row[0]) - f64::from(row[1]));
    let response = StepResponse::of(&actual[before.min(actual.len())..], capture.period, from, to);
    Trial {
        period: capture.period,
        before,
        wanted,
        actual,
        current_ma: column(|row| f64::from(row[2])),
        way: (from, to),
        response,
    }
}
