//! The driver chip of a stepper motor: current scale, CoolStep, temperature and shorts, and what measures and regulates in it.
//!
//! A model after the data sheets of TMC2660 and TMC5160; what they do not state is chosen here, in `stall_guard` and
//! `stealth_chop`:
//! - A current of 0 is none. Any other sets one of 32 steps, `current / 8`: (step + 1)/32 of full scale.
//! - The scale of the coil vector, which a closed loop changes, is exact.
//! - CoolStep regulates between the run current and a half or a quarter of it, at every reading.
//! - StallGuard2 and CoolStep rest while StealthChop is on; the reading is then 0 without a stall.
//! - Too hot means off at 150 degC until the warning at 120 degC is gone. A short switches off until the stage is told to
//!   carry no current.

use crate::field::{Coil, Drive, Field, STEP_S};
use crate::stall_guard::{Found, Sensitivity, StallGuard, on_time};
use crate::stealth_chop::{Amplitude, Measured, StealthChop, volts};
use crate::stepper::Stepper;

/// Settings of the driver chip. Speeds are in 1/256 full steps a second.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct DriverSettings {
    /// The chopper runs (its off time is not 0).
    pub enabled: bool,
    /// Without current the coils are shorted instead of open.
    pub shorted: bool,
    /// StallGuard2 threshold, -64..=63.
    pub stall_threshold: i8,
    /// StallGuard2 reads the mean of four full steps.
    pub stall_filter: bool,
    /// CoolStep, if it is on.
    pub cool_step: Option<CoolStep>,
    /// StealthChop, if it is on.
    pub stealth_chop: Option<StealthChop>,
}

impl Default for DriverSettings {
    fn default() -> Self {
        Self {
            enabled: true,
            shorted: false,
            stall_threshold: 0,
            stall_filter: false,
            cool_step: None,
            stealth_chop: None,
        }
    }
}

/// Settings of CoolStep.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct CoolStep {
    /// Speed above which it works.
    pub above: u32,
    /// A reading below 32 times this raises the current.
    pub low: u8,
    /// A reading of 32 times `low + hysteresis + 1` or more lowers it.
    pub hysteresis: u8,
    /// Steps that a low reading raises the current by.
    pub up: u8,
    /// High readings that lower the current by a step.
    pub down: u8,
    /// The lower limit is a quarter of the run current instead of a half.
    pub quarter: bool,
}

/// What the chip reports.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct DriverState {
    /// StallGuard2 reading, 0..=1023.
    pub load: u16,
    /// Load as the older TMC249 reports it, 0..=7, rising with the load angle; 7 when the rotor does not follow.
    pub strain: u8,
    /// The latest reading was a stall.
    pub stalled: bool,
    /// Switched off because it is too hot.
    pub overheated: bool,
    /// Hotter than the warning threshold.
    pub warm: bool,
    /// The supply is below what the chip needs.
    pub undervoltage: bool,
    /// Coil A, B is shorted.
    pub shorted: [bool; 2],
    /// Coil A, B carries no current though it should.
    pub open: [bool; 2],
    /// Present current step of CoolStep, 0..=31.
    pub current_step: u8,
    /// PWM amplitude of StealthChop, 255 is all voltage.
    pub pwm_scale: u8,
    /// StealthChop is on at this speed.
    pub stealth: bool,
}

/// What is wrong with a coil.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum CoilFault {
    /// Nothing.
    #[default]
    None,
    /// It is not connected.
    Open,
    /// It is shorted to ground.
    Short,
}

/// Supply below which the chip reports it (TMC249: operation from 7 V).
const LEAST_V: f64 = 7.0;

const WARNING_C: f64 = 120.0;
const SHUTDOWN_C: f64 = 150.0;

/// Plant steps in a second.
const STEPS_HZ: f64 = 1.0 / STEP_S;

/// A driver chip with its power stage.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Driver {
    /// Length of the current vector at full scale, in amperes.
    full_scale_a: f64,
    pub(crate) settings: DriverSettings,
    pub(crate) faults: [CoilFault; 2],
    /// Temperature that something else than the board gives it.
    pub(crate) heated_c: Option<f64>,
    current: u8,
    /// What the coil vector is scaled by.
    scale: f64,
    pub(crate) state: DriverState,
    stall_guard: StallGuard,
    amplitude: Amplitude,
    high_readings: u8,
    /// Length of the current vector that is wanted, in amperes.
    wanted_a: f64,
}

impl Driver {
    pub(crate) fn new(full_scale_rms_a: f64) -> Self {
        Self {
            full_scale_a: full_scale_rms_a * std::f64::consts::SQRT_2,
            settings: DriverSettings::default(),
            faults: [CoilFault::None; 2],
            heated_c: None,
            current: 0,
            scale: 1.0,
            state: DriverState::default(),
            stall_guard: StallGuard::default(),
            amplitude: Amplitude::default(),
            high_readings: 0,
            wanted_a: 0.0,
        }
    }

    /// Sets the current at full scale, in amperes RMS.
    pub(crate) fn set_full_scale(&mut self, rms_a: f64) {
        self.full_scale_a = rms_a * std::f64::consts::SQRT_2;
    }

    /// Gives StallGuard2 a noise of so many counts, standard deviation, from a seed.
    pub(crate) fn set_noise(&mut self, counts: f64, seed: u32) {
        self.stall_guard.set_noise(counts, seed);
    }

    /// Sets the run current, 0..=255; true if it is another one.
    #[inline]
    pub(crate) fn set_current(&mut self, current: u8) -> bool {
        if current == self.current {
            return false;
        }
        self.current = current;
        self.state.current_step = current / 8;
        if current == 0 {
            self.state.shorted = [false; 2];
        }
        true
    }

    /// Sets the scale of the coil vector, 255 is 1; true if it is another one.
    #[inline]
    pub(crate) fn set_scale(&mut self, scale: u8) -> bool {
        let before = core::mem::replace(&mut self.scale, f64::from(scale) / 255.0);
        self.scale != before
    }

    pub(crate) fn temperature_c(&self, board_c: f64) -> f64 {
        self.heated_c.unwrap_or(board_c)
    }

    /// Looks at the temperature and the coils, and says what the coils get. The speed is in microsteps a step.
    pub(crate) fn drive(&mut self, turned: f64, supply_v: f64, board_c: f64) -> Drive {
        self.watch_faults(board_c);
        self.state.undervoltage = supply_v < LEAST_V;
        let state = &self.state;
        if !self.settings.enabled || state.overheated || state.shorted != [false; 2] {
            return Drive::Open;
        }
        if self.current == 0 {
            return if self.settings.shorted { Drive::Shorted } else { Drive::Open };
        }
        let speed = turned.abs() * STEPS_HZ;
        let stealth = self.stealth(speed);
        self.state.stealth = stealth.is_some();
        self.wanted_a = self.full_scale_a * self.scale * f64::from(self.current_step(speed) + 1) / 32.0;
        let scale = stealth.map(|stealth| self.amplitude.scale(stealth, speed));
        self.state.pwm_scale = scale.unwrap_or(0.0) as u8;
        scale.map_or(Drive::Current(self.wanted_a), |scale| Drive::Voltage(volts(scale, supply_v)))
    }

    /// The settings of StealthChop, if it works at a speed.
    fn stealth(&self, speed: f64) -> Option<StealthChop> {
        self.settings.stealth_chop.filter(|stealth| speed < f64::from(stealth.below))
    }

    /// The step of the current scale, lowered by CoolStep where it works.
    fn current_step(&mut self, speed: f64) -> u8 {
        let works = |cool: &CoolStep| speed > f64::from(cool.above);
        if self.state.stealth || !self.settings.cool_step.as_ref().is_some_and(works) {
            self.state.current_step = self.current / 8;
        }
        self.state.current_step
    }

    fn watch_faults(&mut self, board_c: f64) {
        let temperature_c = self.temperature_c(board_c);
        self.state.warm = temperature_c >= WARNING_C;
        self.state.overheated = temperature_c >= SHUTDOWN_C || self.state.overheated && self.state.warm;
        let driving = self.current != 0 && self.settings.enabled;
        for (index, fault) in self.faults.into_iter().enumerate() {
            self.state.open[index] = driving && fault == CoilFault::Open;
            self.state.shorted[index] |= driving && fault == CoilFault::Short;
        }
    }

    /// The coil that is not connected.
    pub(crate) fn broken(&self) -> Option<Coil> {
        match self.faults {
            [CoilFault::Open, _] => Some(Coil::A),
            [_, CoilFault::Open] => Some(Coil::B),
            _ => None,
        }
    }

    /// True if the chip would do nothing more while nothing changes.
    #[inline]
    pub(crate) fn is_at_rest(&self) -> bool {
        self.current == 0 || self.stall_guard.is_standing()
    }

    /// Looks at a step that has been done.
    #[inline]
    pub(crate) fn observe(&mut self, field: &Field, motor: &Stepper) {
        let settings = &self.settings;
        let told = Sensitivity { threshold: settings.stall_threshold, filter: settings.stall_filter };
        let found = self.stall_guard.sample(field, motor, told, self.wanted_a);
        match field.drive {
            Drive::Voltage(_) => self.observe_voltage(field, motor),
            Drive::Current(_) if self.stall_guard.is_standing() => {
                (self.state.load, self.state.stalled) = (on_time(field, motor), false);
            }
            _ => {
                if let Some(found) = found {
                    self.take(found);
                }
            }
        }
    }

    /// With StealthChop nothing is measured but the current.
    fn observe_voltage(&mut self, field: &Field, motor: &Stepper) {
        (self.state.load, self.state.stalled) = (0, false);
        if let Some(stealth) = self.settings.stealth_chop {
            let measured = Measured {
                phase: field.phase,
                lacking_a: self.wanted_a - motor.reading.current_square.sqrt(),
                resistance_ohm: motor.resistance_ohm(),
                supply_v: field.volts,
            };
            self.amplitude.regulate(stealth, measured);
        }
    }

    /// A full step is over.
    fn take(&mut self, found: Found) {
        self.state.strain = (7.0 * (1.0 - found.reserve)).round() as u8;
        let Some(load) = found.load else { return };
        (self.state.load, self.state.stalled) = (load, load == 0);
        if let Some(cool) = self.settings.cool_step {
            self.regulate(cool);
        }
    }

    fn regulate(&mut self, cool: CoolStep) {
        let full = self.current / 8;
        let least = ((full + 1) >> if cool.quarter { 2 } else { 1 }).max(1) - 1;
        let load = self.state.load;
        let mut step = self.state.current_step;
        if load < 32 * u16::from(cool.low) {
            self.high_readings = 0;
            step += cool.up;
        } else if load >= 32 * (u16::from(cool.low) + u16::from(cool.hysteresis) + 1) {
            self.high_readings += 1;
            if self.high_readings >= cool.down {
                self.high_readings = 0;
                step = step.saturating_sub(1);
            }
        }
        self.state.current_step = step.clamp(least, full);
    }
}
