//! The driver chip of a stepper motor: current scale, StallGuard2, CoolStep, StealthChop, temperature and shorts.
//!
//! A model after the data sheets of TMC2660 and TMC5160; what they do not state is chosen here:
//! - A current of 0 is none. Any other sets one of 32 steps, `current / 8`: (step + 1)/32 of full scale.
//! - The scale of the coil vector, which a closed loop changes, is exact.
//! - StallGuard2 measures over a full step of the coil vector. `s = min(1, 1.6 E/V)` is the share of its range that the
//!   back-EMF `E` of that speed at supply `V` opens up; the reading is `1000 s (1 - |sin d|) m + 25 (threshold - 20 s)`, between
//!   0 and 1023, with the mean load angle `d` (beyond 90 degrees: 0) and the share `m` of the full step that the rotor
//!   has followed. So the threshold that makes the reading 0 just at 90 degrees is `20 s`. The first term fades below one
//!   turn a second and above `E = 0.8 V`, and has 3 % of noise, from a seed that is always the same. A reading of 0 is a stall.
//! - CoolStep regulates between the run current and a half or a quarter of it, at every reading.
//! - StallGuard2 and CoolStep rest while StealthChop is on; the reading is then 0 without a stall.
//! - Too hot means off at 150 degC until the warning at 120 degC is gone. A short switches off until the stage is told to
//!   carry no current.

use crate::stepper::{Coil, Drive, Field, Reading, Stepper};

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

/// Settings of StealthChop.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct StealthChop {
    /// Speed below which it works.
    pub below: u32,
    /// PWM amplitude that a step frequency of 62 500 microsteps a second adds, in 1/255.
    pub gradient: u8,
    /// PWM amplitude at rest, in 1/255.
    pub amplitude: u8,
    /// The amplitude is regulated to the current that is wanted; `gradient` and `amplitude` have no influence then.
    pub autoscale: bool,
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

/// PWM scale at which the RMS voltage is that of the supply (TMC5160: 248/256 of the peak).
const PWM_FULL: f64 = 374.0;

/// Supply below which the chip reports it (TMC249: operation from 7 V).
const LEAST_V: f64 = 7.0;

const WARNING_C: f64 = 120.0;
const SHUTDOWN_C: f64 = 150.0;

/// Plant steps in a second.
const STEPS_HZ: f64 = 1.0 / crate::stepper::STEP_S;

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
    gauge: Gauge,
    high_readings: u8,
    noise: u32,
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
            gauge: Gauge::default(),
            high_readings: 0,
            noise: 1,
        }
    }

    /// Sets the current at full scale, in amperes RMS.
    pub(crate) fn set_full_scale(&mut self, rms_a: f64) {
        self.full_scale_a = rms_a * std::f64::consts::SQRT_2;
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

    /// Looks at the temperature and the coils, and says what the coils get. `turned` is in microsteps a step.
    pub(crate) fn drive(&mut self, turned: i32, volts: f64, board_c: f64) -> Drive {
        self.watch_faults(board_c);
        self.state.undervoltage = volts < LEAST_V;
        let state = &self.state;
        if !self.settings.enabled || state.overheated || state.shorted != [false; 2] {
            return Drive::Open;
        }
        if self.current == 0 {
            return if self.settings.shorted { Drive::Shorted } else { Drive::Open };
        }
        let speed = f64::from(turned.unsigned_abs()) * STEPS_HZ;
        let stealth = self.settings.stealth_chop.filter(|stealth| speed < f64::from(stealth.below));
        self.state.stealth = stealth.is_some();
        if stealth.is_none() {
            self.state.pwm_scale = 0;
        }
        match stealth {
            Some(stealth) if !stealth.autoscale => self.unregulated(stealth, speed, volts),
            _ => Drive::Current(self.full_scale_a * self.scale * f64::from(self.current_step(speed) + 1) / 32.0),
        }
    }

    /// The step of the current scale, lowered by CoolStep where it works.
    fn current_step(&mut self, speed: f64) -> u8 {
        let works = |cool: &CoolStep| speed > f64::from(cool.above);
        if self.state.stealth || !self.settings.cool_step.as_ref().is_some_and(works) {
            self.state.current_step = self.current / 8;
        }
        self.state.current_step
    }

    fn unregulated(&mut self, stealth: StealthChop, speed: f64, volts: f64) -> Drive {
        let scale = f64::from(stealth.amplitude) + f64::from(stealth.gradient) * speed / 62_500.0;
        self.state.pwm_scale = scale.min(255.0) as u8;
        Drive::Voltage(volts * std::f64::consts::SQRT_2 * scale.min(255.0) / PWM_FULL)
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

    /// Looks at a step that has been done.
    #[inline]
    pub(crate) fn observe(&mut self, field: &Field, motor: &Stepper) {
        if self.state.stealth {
            self.rest(&motor.reading, field.volts);
        } else if field.turned != 0
            && let Some(reserve) = self.gauge.sample(field, &motor.reading, motor.position())
        {
            let speed = f64::from(field.turned).abs();
            self.measure(reserve, motor.emf_v(speed) / field.volts.max(0.1), motor.rps(speed));
        }
    }

    /// With StealthChop nothing is measured but the voltage.
    fn rest(&mut self, reading: &Reading, volts: f64) {
        (self.state.load, self.state.stalled) = (0, false);
        if self.settings.stealth_chop.is_some_and(|stealth| stealth.autoscale) {
            let rms_v = (0.5 * reading.wanted_square).sqrt();
            self.state.pwm_scale = (PWM_FULL * rms_v / volts.max(0.1)).min(255.0) as u8;
        }
    }

    /// A full step is over: `reserve` is the share of the torque that is left, `emf` the back-EMF as share of the supply.
    fn measure(&mut self, reserve: f64, emf: f64, rps: f64) {
        let range = (1.6 * emf).min(1.0);
        let usable = (2.0 * rps - 1.0).clamp(0.0, 1.0) * (5.0 * (1.0 - emf)).clamp(0.0, 1.0);
        let signal = 1000.0 * range * usable * reserve * (1.0 + 0.03 * self.noise());
        let offset = 25.0 * (f64::from(self.settings.stall_threshold) - 20.0 * range);
        self.state.strain = (7.0 * (1.0 - reserve)).round() as u8;
        let Some(reading) = self.gauge.filter((signal + offset).clamp(0.0, 1023.0), self.settings.stall_filter) else {
            return;
        };
        self.state.load = reading as u16;
        self.state.stalled = self.state.load == 0;
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

    /// A number from -1 to 1 (xorshift).
    fn noise(&mut self) -> f64 {
        self.noise ^= self.noise << 13;
        self.noise ^= self.noise >> 17;
        self.noise ^= self.noise << 5;
        f64::from(self.noise as i32) / 2_147_483_648.0
    }
}

/// Collects what StallGuard2 measures.
#[derive(Clone, PartialEq, Debug, Default)]
struct Gauge {
    full_step: i32,
    /// Since the full step began: steps, the sum of the reserves, microsteps of the vector, and where the rotor was.
    samples: f64,
    reserve: f64,
    turned: i32,
    rotor: f64,
    /// Readings of the filter and their sum.
    filtered: u8,
    sum: f64,
}

impl Gauge {
    /// Takes a step; at the end of a full step gives back the mean reserve of torque.
    #[inline]
    fn sample(&mut self, field: &Field, reading: &Reading, rotor: f64) -> Option<f64> {
        let (sin, cos) = reading.load_angle;
        self.samples += 1.0;
        self.turned = self.turned.saturating_add(field.turned);
        if cos > 0.0 {
            self.reserve += 1.0 - sin.abs();
        }
        let full_step = field.phase >> 8;
        if full_step == self.full_step {
            return None;
        }
        let followed = ((rotor - self.rotor) / f64::from(self.turned)).clamp(0.0, 1.0);
        let reserve = self.reserve / self.samples * if self.turned == 0 { 0.0 } else { followed };
        *self = Self { full_step, rotor, filtered: self.filtered, sum: self.sum, ..Self::default() };
        Some(reserve)
    }

    /// The mean of four readings, once in four, if the filter is on.
    fn filter(&mut self, reading: f64, on: bool) -> Option<f64> {
        if !on {
            (self.filtered, self.sum) = (0, 0.0);
            return Some(reading);
        }
        self.filtered += 1;
        self.sum += reading;
        let mean = (self.filtered >= 4).then_some(self.sum * 0.25);
        if mean.is_some() {
            (self.filtered, self.sum) = (0, 0.0);
        }
        mean
    }
}
