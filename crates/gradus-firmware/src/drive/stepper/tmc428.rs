//! What the axes of the TMCM-351 have of their own (firmware 4.45): the units and modes of the TMC428, the encoder's
//! prescaler, and the wiring of the switches.
//!
//! Where the manuals are silent:
//! - Axis parameters 0 and 2 are registers of the chip: a target is gone to in position mode only, a speed is turned with in
//!   velocity mode only. A write to axis parameter 138 changes the mode and goes on with what the registers hold.
//! - MVP approaches its target in ramp mode. For soft mode write 1 to axis parameter 138, then targets to axis parameter 0.
//! - The reference switch is the left one. Of the three switches of mode 3 two share that input, so either closes it.
//! - The load stops the motor (205) at constant speed only, which is not while it approaches a target.
//! - While the driver mixes its decay modes (203) it measures no load: 206 reads 0, and nothing is taken for a stall.
//! - A deviation from the encoder leaves the position as it is: every motion is stopped again until one of the two is written.
//! - Full steps (211) are the places between two microsteps where both coils have the same current.
//! - The bits of axis parameter 210 act when it is written; an index that is waited for once is waited for again then.

use gradus_motion::{Approach, Generator, Tmc428Limits, Tmc428Units};
use gradus_tmcl::Status;
use gradus_tmcl::catalogue::{Ap, MotionChip};

use crate::drive::stepper::axis::{Axis, Part};
use crate::drive::stepper::encoder::OnNull;
use crate::drive::stepper::settings::Settings;
use crate::ports::{AxisInputs, NullEvent, StepperStage, Switches};

/// Values of axis parameter 138.
const RAMP_MODE: i32 = 0;
const SOFT_MODE: i32 = 1;
const VELOCITY_MODE: i32 = 2;

/// Flags of the encoder prescaler (axis parameter 210).
const REVERSED: i32 = 1;
const EVERY: i32 = 1 << 1;
const CLEAR: i32 = 1 << 2;
const HOLD: i32 = 1 << 3;
const ACTIVE_HIGH: i32 = 1 << 4;

// Settings.
impl Settings {
    /// Limits of the ramp (axis parameters 4, 5, 130, 153 and 154).
    pub(crate) fn tmc428_limits(&self) -> Tmc428Limits {
        let get = |id| self.get(id).clamp(0, 2047) as u16;
        let divisor = |id| self.get(id).clamp(0, 13) as u8;
        Tmc428Limits {
            units: Tmc428Units { pulse_div: divisor(Ap::PulseDivisor), ramp_div: divisor(Ap::RampDivisor) },
            min_speed: get(Ap::MinSpeed),
            max_speed: get(Ap::MaxSpeed),
            acceleration: get(Ap::MaxAcceleration),
        }
    }

    /// The tolerance of the reference switch counts in three-switch mode only (axis parameters 141 and 193).
    pub(crate) fn reference_tolerance(&self) -> Option<u32> {
        const THREE_SWITCHES: i32 = 3;
        let applies = self.chip == MotionChip::Tmc428 && self.get(Ap::ReferenceSearchMode) == THREE_SWITCHES;
        applies.then(|| self.unsigned(Ap::ReferenceSwitchTolerance))
    }

    /// The mode of a reference search as the other module counts them. Three-switch mode is as mode 2, since the reference
    /// switch shares the input of the left one.
    pub(crate) fn search_mode(&self) -> i32 {
        let mode = self.get(Ap::ReferenceSearchMode);
        if self.chip == MotionChip::Tmc428 { mode.min(2) } else { mode }
    }

    /// The factor of the encoder prescaler: so many microsteps in so many counts.
    pub(crate) fn prescaler(&self) -> (i64, i64) {
        let code = self.get(Ap::EncoderPrescaler);
        let parts = if code & 1 << 16 != 0 { 5 } else { 16 };
        let microsteps = i64::from((code & 0xffff) >> 9) * parts + i64::from(code >> 5 & 15);
        (if code & REVERSED != 0 { -microsteps } else { microsteps }, parts)
    }

    /// What the index does, and its level.
    pub(crate) fn prescaler_null(&self) -> (Option<OnNull>, NullEvent) {
        let code = self.get(Ap::EncoderPrescaler);
        let on_null = OnNull { clears: code & CLEAR != 0, once: code & EVERY == 0, holds: code & HOLD != 0 };
        let event = NullEvent { n: code & ACTIVE_HIGH != 0, ab: None };
        ((on_null.clears || on_null.holds).then_some(on_null), event)
    }
}

// Modes.
impl Axis {
    pub(crate) fn set_approach(&mut self, approach: Approach) {
        if let Generator::Tmc428(ramp) = &mut self.ramp {
            ramp.set_approach(approach);
        }
    }

    /// GAP 138.
    pub(crate) fn ramp_mode(&self) -> i32 {
        match &self.ramp {
            Generator::Tmc428(ramp) if ramp.is_positioning() => match ramp.approach() {
                Approach::Ramp => RAMP_MODE,
                Approach::Soft => SOFT_MODE,
            },
            _ => VELOCITY_MODE,
        }
    }

    /// SAP 138.
    ///
    /// # Errors
    /// [`Status::NOT_AVAILABLE`] while the drivers are off.
    pub(crate) fn set_ramp_mode(&mut self, mode: i32) -> Result<(), Status> {
        match mode {
            VELOCITY_MODE => self.rotate(self.target_speed()),
            _ => self.approach(self.ramp.target(), mode),
        }
    }

    fn approach(&mut self, target: i32, mode: i32) -> Result<(), Status> {
        self.move_to(target)?;
        if mode == SOFT_MODE {
            self.set_approach(Approach::Soft);
        }
        Ok(())
    }

    /// GAP 2.
    pub(crate) fn target_speed(&self) -> i32 {
        match &self.ramp {
            Generator::Tmc428(ramp) if ramp.is_positioning() => ramp.target_speed(),
            _ => self.settings.get(Ap::TargetSpeed),
        }
    }

    /// GAP 3. The chip has a speed within microseconds: until its first control tick a motor that starts has that of this tick,
    /// so that a program does not take it for one that stands.
    pub(crate) fn actual_speed(&self) -> i32 {
        match self.ramp {
            Generator::Tmc428(ramp) if ramp.speed() == 0 && !ramp.is_idle() && !matches!(self.part, Part::Led(_)) => {
                let mut next = ramp;
                next.tick();
                next.speed()
            }
            _ => self.ramp.speed(),
        }
    }

    /// SAP 0: a motion command but for a TMC428 in velocity mode.
    ///
    /// # Errors
    /// [`Status::NOT_AVAILABLE`] while the drivers are off.
    pub(crate) fn set_target_position(&mut self, target: i32) -> Result<(), Status> {
        let mode = self.ramp_mode();
        if self.settings.chip == MotionChip::Tmc428 && mode == VELOCITY_MODE {
            self.ramp.set_target(target);
            return Ok(());
        }
        self.approach(target, mode)
    }

    /// SAP 2: a motion command but for a TMC428 in position mode.
    ///
    /// # Errors
    /// [`Status::NOT_AVAILABLE`] while the drivers are off.
    pub(crate) fn set_target_speed(&mut self, speed: i32) -> Result<(), Status> {
        match &self.ramp {
            Generator::Tmc428(ramp) if ramp.is_positioning() => Ok(()),
            _ => self.rotate(speed),
        }
    }
}

// Driver.
impl Axis {
    /// GAP 206.
    pub(crate) fn load<A: StepperStage>(&self, port: &mut A) -> i32 {
        let mixes = match self.settings.chip {
            MotionChip::Tmc428 => self.ramp.speed().saturating_abs() > self.derived.mixed_decay_above,
            _ => false,
        };
        if mixes { 0 } else { i32::from(port.driver().load) }
    }

    /// True when the load stops the motor.
    pub(crate) fn is_overloaded<A: StepperStage>(&self, port: &mut A) -> bool {
        let limit = self.derived.stall_load;
        let steady = self.ramp.speed() != 0 && self.ramp.acceleration() == 0;
        limit != 0 && steady && self.load(port).unsigned_abs() > limit
    }

    /// The place of the coil vector: that of the ramp, or the full step that it lies in.
    pub(crate) fn coil_phase(&self, phase: i32) -> i32 {
        const FULL_STEP: i32 = 256;
        match self.derived.full_step_speed {
            Some(speed) if self.ramp.speed().unsigned_abs() > speed => (phase & -FULL_STEP) + FULL_STEP / 2,
            _ => phase,
        }
    }
}

// Switches.
impl Axis {
    /// The switch inputs as they are wired.
    #[inline]
    pub(crate) fn switches<A: AxisInputs>(&self, port: &mut A) -> Switches {
        let switches = port.switches();
        match self.settings.chip {
            MotionChip::Tmc428 => {
                let left = switches.left || switches.home;
                Switches { left, home: left, ..switches }
            }
            _ => switches,
        }
    }
}
