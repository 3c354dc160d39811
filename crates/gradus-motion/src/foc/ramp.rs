//! The ramp of a servo: velocity and position, a thousand times a second.

use super::within;

/// More than any velocity of the module, and little enough for the ramp's arithmetic.
pub(crate) const FASTEST_RPM: u32 = (1 << 18) - 1;

/// What a tick of a [`ServoRamp`] needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RampGains {
    max_velocity_rpm: i64,
    acceleration_rpm_s: i64,
    velocity_per_ms_q32: i64,
    /// Turns per unit of velocity: 1, or more with electrical velocities.
    units_per_rpm: i64,
}

impl RampGains {
    /// `max_velocity_rpm` from 0 to 200000, `acceleration_rpm_s` from 0 to 100000. `pole_pairs` is 1 for mechanical
    /// velocities, and that of the motor if velocities and acceleration are electrical.
    ///
    /// The acceleration of a tick is rounded by less than 2^-32 rpm.
    pub fn new(max_velocity_rpm: u32, acceleration_rpm_s: u32, pole_pairs: u32) -> Self {
        Self {
            max_velocity_rpm: i64::from(max_velocity_rpm.min(FASTEST_RPM)),
            acceleration_rpm_s: i64::from(acceleration_rpm_s.min(1 << 17)),
            velocity_per_ms_q32: (i64::from(acceleration_rpm_s.min(1 << 17)) << 32) / 1_000,
            units_per_rpm: i64::from(pole_pairs.clamp(1, 255)),
        }
    }
}

/// A ramp with constant acceleration. In position mode it brakes by `v = sqrt(120 a d / 65536)` and ends exactly on its
/// target.
///
/// A velocity keeps 32 fraction bits, a position 32 as well: nothing is lost between ticks. On the way to a target the
/// ramp is never faster than the law allows: a target that comes nearer, or an acceleration that is lowered, takes
/// speed away at once, so it does not overshoot. Away from a target it brakes first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ServoRamp {
    velocity_q32: i64,
    position: i32,
    /// Part of a position step, 32 fraction bits.
    fraction_q32: i64,
}

impl ServoRamp {
    /// One millisecond towards a velocity.
    pub fn tick_velocity(&mut self, gains: &RampGains, target_rpm: i32) {
        let target = within(target_rpm.into(), gains.max_velocity_rpm);
        self.approach(gains, target << 32);
    }

    /// One millisecond towards a position, by the short way round.
    pub fn tick_position(&mut self, gains: &RampGains, target: i32) {
        let distance_q32 = (i64::from(target.wrapping_sub(self.position)) << 32).saturating_sub(self.fraction_q32);
        let direction = distance_q32.signum();
        let top_q32 = (gains.velocity_to_stop(distance_q32.unsigned_abs() >> 32) * direction) << 32;
        self.approach(gains, top_q32);
        if self.velocity_q32.signum() == direction && self.velocity_q32.abs() > top_q32.abs() {
            self.velocity_q32 = top_q32;
        }
        // A millisecond is 65536 / 60000 position steps a rpm.
        let way_q32 = self.velocity_q32 * 2_048 / (1_875 * gains.units_per_rpm).max(1);
        let arrives = way_q32.unsigned_abs() >= distance_q32.unsigned_abs() && way_q32.signum() == direction;
        if arrives {
            self.stand_at(target);
        } else {
            let beyond_q32 = self.fraction_q32 + way_q32;
            self.position = self.position.wrapping_add((beyond_q32 >> 32) as i32);
            self.fraction_q32 = beyond_q32 & 0xFFFF_FFFF;
        }
    }

    fn approach(&mut self, gains: &RampGains, target_q32: i64) {
        let change = target_q32 - self.velocity_q32;
        self.velocity_q32 += within(change, gains.velocity_per_ms_q32);
    }

    /// Goes on from this velocity in 1/65536 rpm.
    pub fn set_velocity_q16(&mut self, rpm_q16: i64) {
        self.velocity_q32 = within(rpm_q16, i64::from(FASTEST_RPM) << 16) << 16;
    }

    /// Goes on from this position.
    pub fn set_position(&mut self, position: i32) {
        self.position = position;
        self.fraction_q32 = 0;
    }

    /// Stands at this position.
    pub fn stand_at(&mut self, position: i32) {
        *self = Self { position, ..Self::default() };
    }

    /// Velocity of the ramp, towards zero rounded.
    pub fn velocity_rpm(&self) -> i32 {
        (self.velocity_q32 / (1 << 32)) as i32
    }

    /// Velocity of the ramp in 1/65536 rpm, rounded down.
    #[inline]
    pub fn velocity_q16(&self) -> i64 {
        self.velocity_q32 >> 16
    }

    /// Position of the ramp, 65536 a turn.
    pub fn position(&self) -> i32 {
        self.position
    }
}

impl RampGains {
    /// Fastest velocity from which the ramp can stop within `distance` position steps; 1 at least, to arrive at all.
    fn velocity_to_stop(&self, distance: u64) -> i64 {
        let square = 120 * (self.acceleration_rpm_s * self.units_per_rpm) as u64 * distance / 65_536;
        (square.isqrt().max(1) as i64).min(self.max_velocity_rpm)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn velocity_ramp_takes_its_acceleration() {
        let gains = RampGains::new(4_000, 2_000, 1);
        let mut ramp = ServoRamp::default();
        for ms in 1..=1_500 {
            ramp.tick_velocity(&gains, 3_000);
            assert_eq!(ramp.velocity_rpm(), 2 * ms, "after {ms} ms");
        }
        ramp.tick_velocity(&gains, 3_000);
        assert_eq!(ramp.velocity_rpm(), 3_000);
        for _ in 0..5_000 {
            ramp.tick_velocity(&gains, -9_000);
        }
        assert_eq!(ramp.velocity_rpm(), -4_000, "not beyond the maximum");
    }

    #[test]
    fn slow_acceleration_is_not_lost() {
        let gains = RampGains::new(4_000, 1, 1);
        let mut ramp = ServoRamp::default();
        (0..60_001).for_each(|_| ramp.tick_velocity(&gains, 3_000));
        assert_eq!(ramp.velocity_rpm(), 60, "1 rpm/s for a minute");
    }

    #[test]
    fn ten_turns_take_the_time_of_the_trapezoid() {
        let gains = RampGains::new(3_000, 10_000, 1);
        let mut ramp = ServoRamp::default();
        let mut ms = 0;
        while ramp.position() != 655_360 {
            ramp.tick_position(&gains, 655_360);
            ms += 1;
        }
        // 0.3 s up, 0.3 s down with 7.5 turns each: 10 turns are a triangle of 2 sqrt(10 * 60 / 10000) s.
        assert!((485..=495).contains(&ms), "{ms}");
        assert_eq!(ramp.velocity_rpm(), 0);
    }

    proptest! {
        #[test]
        fn position_ramp_arrives_exactly_and_never_overshoots(
            max in 1_u32..200_000,
            acceleration in 1_000_u32..100_000,
            target in any::<i32>(),
            start in any::<i32>(),
            pole_pairs in 1_u32..8,
        ) {
            let target = start.wrapping_add(target >> 6);
            let gains = RampGains::new(max, acceleration, pole_pairs);
            let mut ramp = ServoRamp::default();
            ramp.set_position(start);
            let mut distance = i64::from(target.wrapping_sub(start));
            for _ in 0..200_000 {
                ramp.tick_position(&gains, target);
                let next = i64::from(target.wrapping_sub(ramp.position()));
                let nearer = next.abs() <= distance.abs() && next.signum() * distance.signum() >= 0;
                prop_assert!(nearer, "{next} after {distance}");
                prop_assert!(ramp.velocity_rpm().unsigned_abs() <= max);
                distance = next;
                if distance == 0 && ramp.velocity_rpm() == 0 {
                    break;
                }
            }
            let way = u64::from(target.wrapping_sub(start).unsigned_abs());
            let too_slow = u64::from(max) * 200 * 1_092 / u64::from(pole_pairs) < way;
            prop_assert!(distance == 0 && ramp.velocity_rpm() == 0 || too_slow);
        }
    }

    #[test]
    fn target_behind_a_running_ramp_is_reached_exactly_all_the_same() {
        let gains = RampGains::new(3_000, 10_000, 1);
        let mut ramp = ServoRamp::default();
        (0..300).for_each(|_| ramp.tick_position(&gains, i32::MAX / 2));
        (0..2_000).for_each(|_| ramp.tick_position(&gains, -1_000));
        assert_eq!((ramp.position(), ramp.velocity_rpm()), (-1_000, 0));
    }
}
