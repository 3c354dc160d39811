//! Limits of a ramp as the user sets them.

use crate::brake::Brake;
use crate::gains::Gains;
use crate::tick_rate::{TickRate, Units};

/// Limits of trapezoidal and six-point ramps, in microsteps and seconds. Signless: they hold for both directions.
///
/// Below [`break_speed_pps`](Self::break_speed_pps) the axis speeds up with `start_acceleration` and slows down with
/// `final_deceleration`, above it with `acceleration` and `deceleration` (TMCM-3351 manual, axis parameters 4, 5 and
/// 15 to 20). The manual is silent about zeros; here
/// - a `start_acceleration` or `final_deceleration` of zero stands for `acceleration` or `deceleration`,
/// - a `deceleration` of zero stands for `acceleration`,
/// - with an `acceleration` of zero a standing axis does not start, and a moving one gets no faster,
/// - with `acceleration` and `deceleration` both zero a moving axis that has to slow down does so within one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Limits {
    /// Top speed of position mode, in microsteps per second. Velocity mode has its own target speed.
    pub max_speed_pps: u32,
    /// Acceleration above the break speed, in microsteps per second squared.
    pub acceleration: u32,
    /// Deceleration above the break speed, in microsteps per second squared.
    pub deceleration: u32,
    /// Speed at which the second pair of accelerations takes over; 0 for a plain trapezoid.
    pub break_speed_pps: u32,
    /// Acceleration below the break speed, in microsteps per second squared.
    pub start_acceleration: u32,
    /// Deceleration below the break speed, in microsteps per second squared.
    pub final_deceleration: u32,
    /// Speed that motion starts with at once, as far as top speed and distance allow.
    pub start_speed_pps: u32,
    /// Speed from which motion may end at once.
    pub stop_speed_pps: u32,
}

impl Limits {
    /// What a control tick at `tick_hz` needs of these limits. `tick_hz` is taken as 1 or more; below 1 kHz the
    /// highest speeds are cut off.
    ///
    /// Values are rounded up, by less than 2^-48 microsteps a tick: nothing becomes zero that is not.
    pub fn gains(&self, tick_hz: u32) -> Gains {
        self.gains_in(Units::PPS, tick_hz)
    }

    /// The same if the limits are in other units. The speeds and decelerations that the ramp is told to keep are in these
    /// units too; those that it tells are whole microsteps and seconds.
    pub fn gains_in(&self, units: Units, tick_hz: u32) -> Gains {
        let rate = TickRate::new(tick_hz, units);
        let or = |value, substitute| if value == 0 { substitute } else { value };
        let deceleration = or(self.deceleration, self.acceleration);
        let start_acceleration =
            if self.acceleration == 0 { 0 } else { or(self.start_acceleration, self.acceleration) };
        Gains {
            rate,
            top_speed: rate.speed_per_tick(self.max_speed_pps),
            start_speed: rate.speed_per_tick(self.start_speed_pps),
            break_speed: rate.speed_per_tick(self.break_speed_pps),
            start_acceleration: rate.step_per_tick(start_acceleration),
            acceleration: rate.step_per_tick(self.acceleration),
            brake: Brake::new(
                rate.speed_per_tick(self.stop_speed_pps),
                rate.deceleration_per_tick(or(self.final_deceleration, deceleration)),
                rate.speed_per_tick(self.break_speed_pps),
                rate.deceleration_per_tick(deceleration),
            ),
            bows: None,
        }
    }
}
