//! Limits of a ramp as the user sets them, and the same per control tick.

use core::array;

use crate::plan::Brake;

/// Fraction bits of a position, a speed (microsteps a tick) and an acceleration (microsteps a tick, each tick).
pub(crate) const FRACTION_BITS: u32 = 48;

/// Largest speed, and largest change of speed in a tick; leaves room for sums of two.
const MAX_PER_TICK: i64 = 1 << 60;

/// Fraction bits of a jerk (microsteps a tick, each tick, each tick), and of what an S-shaped ramp sums up. One pps^3
/// at 10 kHz is 4.7e9 in the last place.
pub(crate) const JERK_BITS: u32 = 72;

/// Largest jerk: brings any acceleration within a part of a tick.
const MAX_JERK: i128 = 1 << (20 + JERK_BITS);

/// What speeds and accelerations are given in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Units {
    /// Speeds are in 2^-`speed_bits` microsteps per second.
    pub speed_bits: u8,
    /// Accelerations are in 2^-`acceleration_bits` microsteps per second squared.
    pub acceleration_bits: u8,
}

impl Units {
    /// Whole microsteps and seconds.
    pub const PPS: Self = Self { speed_bits: 0, acceleration_bits: 0 };
    /// The registers of the TMC4361A: speeds with 8 fraction bits, accelerations with 2.
    pub const TMC4361A: Self = Self { speed_bits: 8, acceleration_bits: 2 };
}

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

/// Limits per control tick: see [`Limits::gains`]. Speeds are microsteps a tick, accelerations microsteps a tick each
/// tick, both with 48 fraction bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Gains {
    pub(crate) rate: TickRate,
    pub(crate) top_speed: i64,
    pub(crate) start_speed: i64,
    pub(crate) break_speed: i64,
    pub(crate) start_acceleration: i64,
    pub(crate) acceleration: i64,
    pub(crate) brake: Brake,
    /// Jerks of an S-shaped ramp, 72 fraction bits.
    pub(crate) bows: Option<[i128; 4]>,
}

impl Gains {
    /// The same limits for an S-shaped ramp with these bows, in microsteps per second cubed (TMCM-3351 axis parameters
    /// 22 to 25, each multiplied by 35): bow 1 raises the acceleration, bow 2 lowers it, bow 3 raises the deceleration,
    /// bow 4 lowers it.
    ///
    /// The manual is silent about zeros; a bow of zero does not limit its change, as if it were very large. Break
    /// speed, start acceleration and final deceleration do not count. Motion begins with a step to the start speed
    /// and ends with a step from the stop speed; the acceleration is zero at both.
    ///
    /// Bows are rounded up, by less than 6 * 2^-72 microsteps a tick cubed: 1.3e-9 of 1 pps^3 at 10 kHz.
    ///
    /// ```
    /// use gradus_motion::{Limits, Ramp};
    ///
    /// let limits = Limits { max_speed_pps: 51_200, acceleration: 51_200, deceleration: 51_200, ..Limits::default() };
    /// let mut ramp = Ramp::new(limits.gains(10_000).s_shaped([512_000; 4]));
    /// ramp.move_to(51_200);
    /// let mut ticks = 0;
    /// while !ramp.is_idle() {
    ///     ramp.tick();
    ///     ticks += 1;
    /// }
    /// assert_eq!((ramp.position(), ticks), (51_200, 21_025)); // 2.1024984 s are the shortest time
    /// ```
    pub fn s_shaped(self, bows: [u64; 4]) -> Self {
        Self { bows: Some(bows.map(|bow| self.rate.jerk_per_tick(bow))), ..self }
    }

    /// These limits of an axis that moves by `length`, lowered so that an axis that moves by the shorter `distance` in
    /// the same time stays within `other`.
    pub(crate) fn lowered(&self, other: &Self, length: u32, distance: u32) -> Self {
        let scaled = |other: i128| other * i128::from(length) / i128::from(distance.max(1));
        let lower = |own: i64, other: i64| i128::from(own).min(scaled(i128::from(other))) as i64;
        let slowest =
            |below_break: i64, above: i64| if other.break_speed == 0 { above } else { above.min(below_break) };
        let acceleration = slowest(other.start_acceleration, other.acceleration);
        let deceleration = slowest(other.brake.last.step, other.brake.upper.step);
        Self {
            top_speed: lower(self.top_speed, other.top_speed),
            start_speed: lower(self.start_speed, other.start_speed),
            start_acceleration: lower(self.start_acceleration, acceleration),
            acceleration: lower(self.acceleration, acceleration),
            brake: Brake::new(
                lower(self.brake.last.base, other.brake.last.base),
                lower(self.brake.last.step, deceleration),
                self.break_speed,
                lower(self.brake.upper.step, deceleration),
            ),
            bows: self.bows.map(|own| {
                let other = other.bows.unwrap_or([MAX_JERK; 4]);
                array::from_fn(|bow| own[bow].min(scaled(other[bow])))
            }),
            ..*self
        }
    }
}

/// Conversion between seconds and ticks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TickRate {
    hz: u32,
    units: Units,
}

impl TickRate {
    fn new(hz: u32, units: Units) -> Self {
        Self { hz: hz.max(1), units }
    }

    /// Microsteps a tick.
    pub(crate) fn speed_per_tick(self, speed: u32) -> i64 {
        per_tick(speed, u128::from(self.hz) << self.units.speed_bits)
    }

    /// Change of speed in a tick.
    fn step_per_tick(self, acceleration: u32) -> i64 {
        per_tick(acceleration, u128::from(self.hz).pow(2) << self.units.acceleration_bits)
    }

    /// Change of speed in a tick of braking, where zero means that nothing limits it.
    pub(crate) fn deceleration_per_tick(self, deceleration: u32) -> i64 {
        if deceleration == 0 { MAX_PER_TICK } else { self.step_per_tick(deceleration) }
    }

    /// Change of acceleration in a tick, in whole sixths, where zero means that nothing limits it.
    fn jerk_per_tick(self, pps3: u64) -> i128 {
        const MOST: u64 = 1 << 54; // far above the 2^39 that the axis parameters make; leaves room for the shift
        if pps3 == 0 {
            return MAX_JERK;
        }
        let ticks = u128::from(self.hz).pow(3);
        let sixths = (u128::from(pps3.min(MOST)) << JERK_BITS).div_ceil((6 * ticks).max(1));
        (sixths as i128).min(MAX_JERK / 6) * 6
    }

    /// Microsteps per second, rounded towards zero but for the last places of the fraction.
    pub(crate) fn pps(self, speed: i64) -> i32 {
        per_second(speed, u64::from(self.hz))
    }

    /// Microsteps per second squared, rounded in the same way.
    pub(crate) fn pps2(self, step: i64) -> i32 {
        per_second(step, u64::from(self.hz).pow(2))
    }
}

fn per_tick(value: u32, ticks: u128) -> i64 {
    let scaled = (u128::from(value) << FRACTION_BITS).div_ceil(ticks.max(1));
    scaled.min(MAX_PER_TICK as u128) as i64
}

fn per_second(value: i64, ticks: u64) -> i32 {
    const ROUNDING: i128 = 2; // of the value's last place: a share of a line is rounded down
    let scaled = ((i128::from(value.unsigned_abs()) + ROUNDING) * i128::from(ticks)) >> FRACTION_BITS;
    scaled.min(i128::from(i32::MAX)) as i32 * value.signum() as i32
}
