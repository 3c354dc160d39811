//! The driver chip of an axis: what axis parameters 162 to 192 and 204 set, and what it reports (TMCM-3351 manual §4, §6.4, §6.5).
//!
//! The chip does StallGuard2, CoolStep and StealthChop by itself; the firmware gives it their settings. Speeds become those of
//! the coil vector, in 1/256 full steps a second.
//!
//! Where the manual is silent:
//! - A freewheeling mode (204) acts while the standby current is 0 and the drivers are on. Without current the coils are
//!   open (0 and 1) or shorted (2 and 3).
//! - The clock by which a standstill is counted (208, 2^20 clocks) is that of the ramp generator, 16 MHz: 65.5 ms. After power-on as
//!   after a step.
//! - An off time of 0 (167) switches the power stage off without stopping the motion.
//! - The parameters that shape only the chopper (162 to 166, 177, 179, 184, 185, 191) are kept and do nothing more.

use gradus_tmcl::catalogue::{Ap, MotionChip};

use crate::drive::stepper::axis::Axis;
use crate::drive::stepper::settings::Settings;
use crate::ports::{CoolStep, DriverSettings, DriverState, StealthChop, StepperStage};

/// Bits of axis parameter 208; the TMCM-351 has other ones.
const STALL: i32 = DriverState::STALL as i32;
const STANDSTILL: i32 = 1 << 7;

/// Bits of 208 with which a chip has switched itself off: too hot, shorts.
const TMC5160_OFF: u8 = 1 << 1 | 1 << 3 | 1 << 4;
const TMC249_OFF: u8 = 1 << 0 | 1 << 1 | 1 << 4 | 1 << 7;

/// A motor stands still when there was no step for 2^20 clocks of 16 MHz.
const STANDSTILL_US: u64 = (1 << 20) / 16;

impl Axis {
    /// Gives the driver chip its settings.
    pub(crate) fn configure_driver<A: StepperStage>(&self, port: &mut A) {
        let settings = self.settings.driver(self.derived.phase_shift);
        port.configure(&DriverSettings { shorted: settings.shorted && self.powered, ..settings });
    }

    /// What the chip reports, as the parameters read it.
    pub(crate) fn driver_value(&self, id: Ap, driver: DriverState) -> i32 {
        match id {
            Ap::CoolStepCurrent => i32::from(driver.current_step),
            Ap::PwmScale => i32::from(driver.pwm_scale),
            _ => i32::from(driver.stealth_chop),
        }
    }
}

// Flags.
impl Axis {
    /// What GAP 208 answers.
    pub(crate) fn driver_flags<A: StepperStage>(&self, now: u64, port: &mut A) -> i32 {
        let flags = i32::from(port.driver().flags);
        if self.settings.chip == MotionChip::Tmc428 {
            return flags;
        }
        let stall = if self.stalling { flags & STALL } else { 0 };
        let still = now.saturating_sub(self.stepped_at_us) >= STANDSTILL_US;
        flags & !STALL | stall | if still { STANDSTILL } else { 0 }
    }

    /// Whether the chip has switched itself off, because it is too hot or for a short.
    pub(crate) fn is_shut_down<A: StepperStage>(&self, port: &mut A) -> bool {
        let reasons = if self.settings.chip == MotionChip::Tmc428 { TMC249_OFF } else { TMC5160_OFF };
        port.driver().flags & reasons != 0
    }
}

impl Settings {
    fn driver(&self, phase_shift: u32) -> DriverSettings {
        let get = |id| self.get(id).clamp(0, 255) as u8;
        DriverSettings {
            enabled: get(Ap::OffTime) != 0,
            shorted: get(Ap::FreewheelingMode) >= 2,
            stall_threshold: self.get(Ap::StallThreshold).clamp(-64, 63) as i8,
            stall_filter: get(Ap::StallFilter) != 0,
            cool_step: (get(Ap::CoolStepStart) != 0).then(|| CoolStep {
                above: self.vector_speed(Ap::CoolStepSpeed, phase_shift),
                low: get(Ap::CoolStepStart),
                hysteresis: get(Ap::CoolStepHysteresis),
                up: 1 << get(Ap::CoolStepUp).min(3),
                down: [32, 8, 2, 1][usize::from(get(Ap::CoolStepDown).min(3))],
                quarter: get(Ap::CoolStepMin) != 0,
            }),
            stealth_chop: (get(Ap::PwmGradient) != 0).then(|| StealthChop {
                below: self.vector_speed(Ap::PwmThresholdSpeed, phase_shift),
                gradient: get(Ap::PwmGradient),
                amplitude: get(Ap::PwmAmplitude),
                autoscale: get(Ap::PwmAutoscale) != 0,
            }),
        }
    }

    /// A speed in pps as one of the coil vector; the fastest there is, if it is beyond all.
    fn vector_speed(&self, id: Ap, phase_shift: u32) -> u32 {
        (u64::from(self.unsigned(id)) << phase_shift).min(u64::from(u32::MAX)) as u32
    }
}
