//! Limits of a ramp per control tick.

use core::array;

use crate::brake::Brake;
use crate::tick_rate::{MAX_JERK, TickRate};

/// Limits per control tick: see [`Limits::gains`](crate::Limits::gains). Speeds are microsteps a tick, accelerations microsteps a tick each
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
