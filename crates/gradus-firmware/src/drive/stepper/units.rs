//! Unit mode: pps, or the registers of the ramp generator (TMCM-3351 manual §6.6, axis parameter 255).
//!
//! With axis parameter 255 = 0 the speeds of the ramp (2, 4, 15, 18, 20, 194, 195, and those of ROR and ROL) are in 1/256 pps, its
//! accelerations (5, 16, 17, 19, 21) in 1/4 pps^2; those are the registers of the TMC4361A. Bows are pps^3 in either mode.
//!
//! Where the manual is silent:
//! - The registers stay when the mode changes: the motor goes on as it was, and the parameters read in the new units, rounded
//!   to the nearest and at most 2^31 - 1. Their range in units of the registers is that of 31 bits.
//! - Speeds and accelerations that are read only (3, 131, 132), and all other parameters, are in pps and pps^2 in either mode,
//!   as their registers are.

use gradus_motion::Units;
use gradus_tmcl::catalogue::{Ap, AxisParameter, MotionChip};

use crate::drive::stepper::settings::Settings;

const SPEEDS: [Ap; 7] = [
    Ap::TargetSpeed,
    Ap::MaxSpeed,
    Ap::StartVelocity,
    Ap::BreakVelocity,
    Ap::StopVelocity,
    Ap::ReferenceSearchSpeed,
    Ap::ReferenceSwitchSpeed,
];

const ACCELERATIONS: [Ap; 5] =
    [Ap::MaxAcceleration, Ap::StartAcceleration, Ap::MaxDeceleration, Ap::FinalDeceleration, Ap::StopDeceleration];

impl Settings {
    /// Units of the ramp's speeds and accelerations.
    pub(crate) fn units(&self) -> Units {
        match (self.chip, self.get(Ap::UnitMode)) {
            (MotionChip::Tmc4361, 0) => Units::TMC4361A,
            _ => Units::PPS,
        }
    }

    /// SAP 255: gives the same speeds and accelerations in other units.
    pub(crate) fn set_unit_mode(&mut self, mode: i32) {
        let before = self.units();
        self.set(Ap::UnitMode, mode);
        let after = self.units();
        for id in SPEEDS {
            self.set(id, converted(self.get(id), before.speed_bits, after.speed_bits));
        }
        for id in ACCELERATIONS {
            self.set(id, converted(self.get(id), before.acceleration_bits, after.acceleration_bits));
        }
    }

    /// Whether a parameter takes the value.
    pub(crate) fn accepts(&self, row: &AxisParameter, value: i32) -> bool {
        if !self.accepts_bow(row.id, value) {
            return false;
        }
        let in_registers = self.units() != Units::PPS && (SPEEDS.contains(&row.id) || ACCELERATIONS.contains(&row.id));
        if in_registers { value != i32::MIN && (value >= 0 || row.min < 0) } else { row.accepts(value) }
    }
}

// Bows.
impl Settings {
    /// The products of bows and their factor (axis parameters 22 to 25, and 35) have a limit.
    fn accepts_bow(&self, id: Ap, value: i32) -> bool {
        match id {
            Ap::BowScaling => BOWS.into_iter().all(|bow| is_bow(self.get(bow), value)),
            _ if BOWS.contains(&id) => is_bow(value, self.get(Ap::BowScaling)),
            _ => true,
        }
    }
}

/// The largest bow in pps^3 as the manual prints it.
const MOST_BOW: i64 = 467_837_000_000;

const BOWS: [Ap; 4] = [Ap::Bow1, Ap::Bow2, Ap::Bow3, Ap::Bow4];

fn is_bow(bow: i32, factor: i32) -> bool {
    i64::from(bow) * i64::from(factor) <= MOST_BOW
}

fn converted(value: i32, from_bits: u8, to_bits: u8) -> i32 {
    let fine = (i64::from(value) << to_bits << 1) >> from_bits;
    ((fine + 1) >> 1).clamp(i64::from(-i32::MAX), i64::from(i32::MAX)) as i32
}
