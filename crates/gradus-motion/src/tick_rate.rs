//! Units of a ramp's limits, and their conversion between seconds and control ticks.

/// Fraction bits of a position, a speed (microsteps a tick) and an acceleration (microsteps a tick, each tick).
pub(crate) const FRACTION_BITS: u32 = 48;

/// Largest speed, and largest change of speed in a tick; leaves room for sums of two.
const MAX_PER_TICK: i64 = 1 << 60;

/// Fraction bits of a jerk (microsteps a tick, each tick, each tick), and of what an S-shaped ramp sums up. One pps^3
/// at 10 kHz is 4.7e9 in the last place.
pub(crate) const JERK_BITS: u32 = 72;

/// Largest jerk: brings any acceleration within a part of a tick.
pub(crate) const MAX_JERK: i128 = 1 << (20 + JERK_BITS);

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

/// Conversion between seconds and ticks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TickRate {
    hz: u32,
    units: Units,
}

impl TickRate {
    pub(crate) fn new(hz: u32, units: Units) -> Self {
        Self { hz: hz.max(1), units }
    }

    /// Microsteps a tick.
    pub(crate) fn speed_per_tick(self, speed: u32) -> i64 {
        per_tick(speed, u128::from(self.hz) << self.units.speed_bits)
    }

    /// Change of speed in a tick.
    pub(crate) fn step_per_tick(self, acceleration: u32) -> i64 {
        per_tick(acceleration, u128::from(self.hz).pow(2) << self.units.acceleration_bits)
    }

    /// Change of speed in a tick of braking, where zero means that nothing limits it.
    pub(crate) fn deceleration_per_tick(self, deceleration: u32) -> i64 {
        if deceleration == 0 { MAX_PER_TICK } else { self.step_per_tick(deceleration) }
    }

    /// Change of acceleration in a tick, in whole sixths, where zero means that nothing limits it.
    pub(crate) fn jerk_per_tick(self, pps3: u64) -> i128 {
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
