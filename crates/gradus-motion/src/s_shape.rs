//! The planner of S-shaped ramps: from distance, speed, acceleration and limits to all stages of constant jerk.
//!
//! One function does the thinking: [`Shape::toward`] changes to a constant speed in the shortest time, by four segments
//! at most. A move follows the way to its top speed as long as it can still stop, which a bisection tells to the last
//! bit, cruises if it has got there, and then follows the way to rest. Segments that are not reached have no length, so
//! a move from rest to rest is the shortest that the limits allow.
//!
//! A target that lies behind where the axis can come to rest turns it round. If bow 2 equals bow 4 it passes through zero
//! speed with the acceleration that it has, as the TMC4361A does, so the way there and back takes the shortest time; with
//! a deceleration above the highest acceleration, it has come down to that at zero. If the bows differ, the axis comes to
//! rest first. A start speed holds from rest only, a stop speed to rest only: an axis that turns through has neither.
//!
//! From rest a start speed comes with the highest acceleration, as far as top speed and distance allow: bow 1 is left
//! out, as the TMC4361A does.
//!
//! A plan is made once and carried out to its end: when to begin to stop is not asked again while stopping. Only a
//! change from outside, or rest away from the target, makes a new one, from the present speed and acceleration.
//!
//! Units are microsteps and ticks, in `f64`. Only `+ - * /` and comparisons are used, which round alike everywhere, and
//! the work is bounded: some 60 ways to rest a segment or start searched, of which a plan has three at most.

use crate::gains::Gains;
use crate::s_plan::{Motion, Plan, Segment, largest};
use crate::tick_rate::{FRACTION_BITS, JERK_BITS};

/// Distance in microsteps to the target that the last tick of an S-shaped ramp bridges. The rounding of a plan leaves
/// some 2^-50 of the way, and less than 2^-20 of the longest there is.
pub(crate) const ROUNDING: f64 = 1.0 / 65_536.0;

/// How the speed of an axis changes in one sense, up or down.
#[derive(Clone, Copy, Debug)]
struct Slope {
    /// Largest acceleration or deceleration.
    limit: f64,
    /// Jerk that raises it.
    rise: f64,
    /// Jerk that lowers it to zero.
    fall: f64,
}

impl Slope {
    /// What an acceleration adds to the speed until it is zero.
    fn release(&self, acceleration: f64) -> f64 {
        acceleration * acceleration / (2.0 * self.fall)
    }

    /// Changes the speed by `change` in the shortest time, to end with no acceleration; `acceleration` is the present
    /// one in the sense of the slope. `against` is the jerk that ends one in the opposite sense.
    fn segments(&self, change: f64, acceleration: f64, against: f64) -> [Segment; 4] {
        let (first, change, base) = if acceleration < 0.0 {
            let lost = acceleration * acceleration / (2.0 * against);
            (Segment::new(against, -acceleration / against), change + lost, 0.0)
        } else if acceleration > self.limit {
            let gained = self.release(acceleration) - self.release(self.limit);
            (Segment::new(-self.fall, (acceleration - self.limit) / self.fall), change - gained, self.limit)
        } else {
            (Segment::default(), change, acceleration)
        };
        let peak = self.peak(change, base);
        let hold = Segment::new(0.0, self.hold(change, base, peak));
        [first, Segment::new(self.rise, (peak - base) / self.rise), hold, Segment::new(-self.fall, peak / self.fall)]
    }

    /// Highest acceleration on the way.
    fn peak(&self, change: f64, base: f64) -> f64 {
        let square = (2.0 * change + base * base / self.rise) / (1.0 / self.rise + 1.0 / self.fall);
        square_root(square).max(base).min(self.limit)
    }

    /// Time at the highest acceleration, if that is the limit.
    fn hold(&self, change: f64, base: f64, peak: f64) -> f64 {
        if peak < self.limit || self.limit == 0.0 {
            return 0.0;
        }
        let rise = (peak * peak - base * base) / (2.0 * self.rise);
        ((change - rise - self.release(peak)) / peak).max(0.0)
    }
}

/// The limits of S-shaped ramps.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shape {
    up: Slope,
    down: Slope,
    start_speed: f64,
    stop_speed: f64,
}

impl Shape {
    pub(crate) fn new(gains: &Gains, bows: [i128; 4]) -> Self {
        let [rise_up, fall_up, rise_down, fall_down] = bows.map(jerk_per_tick);
        Self {
            up: Slope { limit: per_tick(gains.acceleration), rise: rise_up, fall: fall_up },
            down: Slope { limit: per_tick(gains.brake.upper.step), rise: rise_down, fall: fall_down },
            start_speed: per_tick(gains.start_speed),
            stop_speed: per_tick(gains.brake.last.base),
        }
    }

    /// A plan to go on by `distance` (microsteps; infinite in velocity mode) with at most `top_speed` (48 fraction
    /// bits); empty if the axis stands and has nothing to do, or cannot.
    pub(crate) fn plan(&self, motion: Motion, distance: f64, top_speed: i64) -> Plan {
        let top_speed = speed_per_tick(top_speed);
        let motion = Motion { position: 0.0, ..motion };
        if self.is_backwards(motion, distance) {
            self.forwards(motion.reversed(), -distance, top_speed).reversed()
        } else {
            self.forwards(motion, distance, top_speed)
        }
    }

    /// Whether the target is behind where the axis can come to rest, or behind an axis that does not turn through. If the
    /// axis comes to rest there, the target lies in the direction of motion.
    fn is_backwards(&self, motion: Motion, distance: f64) -> bool {
        let beyond = distance - if self.turns_through() { self.rest(motion) } else { 0.0 };
        if motion.speed != 0.0 && beyond.abs() <= ROUNDING { self.heads_back(motion) } else { beyond < 0.0 }
    }

    fn forwards(&self, motion: Motion, distance: f64, top_speed: f64) -> Plan {
        let mut plan = Plan::new(motion.speed, motion.acceleration);
        let fits = |end: Motion| self.rest(end) <= distance;
        if motion.speed == 0.0 && motion.acceleration == 0.0 {
            if top_speed == 0.0 || self.up.limit == 0.0 {
                return plan;
            }
            self.start(&mut plan, distance, top_speed);
        } else if top_speed == 0.0 || self.is_to_rest_first(motion) {
            return self.brake(motion);
        } else {
            self.turn(&mut plan, top_speed, fits);
        }
        if plan.follow_while(self.toward(plan.end, top_speed), fits) {
            self.cruise(&mut plan, distance, top_speed);
        }
        plan.rest(self.way_to_rest(plan.end));
        plan
    }

    /// Whether an axis that turns round passes through zero speed with the acceleration that it has.
    fn turns_through(&self) -> bool {
        self.up.fall == self.down.fall
    }

    /// Whether an axis that shall go forwards has to come to rest before.
    fn is_to_rest_first(&self, motion: Motion) -> bool {
        let backwards = motion.speed < 0.0 || self.heads_back(motion);
        backwards && (self.up.limit == 0.0 || !self.turns_through())
    }

    /// Whether the axis goes backwards when its acceleration has been brought to zero.
    fn heads_back(&self, motion: Motion) -> bool {
        if self.turns_through() { self.released(motion) < 0.0 } else { motion.speed < 0.0 }
    }

    /// Turns an axis that goes backwards, or is about to, and follows it to no speed as long as `fits` holds.
    fn turn(&self, plan: &mut Plan, top_speed: f64, fits: impl Fn(Motion) -> bool) {
        let Motion { acceleration, .. } = plan.end;
        if acceleration < 0.0 && self.heads_back(plan.end) {
            plan.push(Segment::new(self.down.fall, -acceleration / self.down.fall));
        }
        if plan.end.speed < 0.0 {
            plan.follow_while(self.toward_zero(plan.end, top_speed), |end| end.speed <= 0.0 && fits(end));
        }
    }

    /// The way from a negative speed beyond zero, with an acceleration at zero that is allowed there and does not lead
    /// above the top speed.
    fn toward_zero(&self, motion: Motion, top_speed: f64) -> [Segment; 4] {
        let beyond = self.down.release(self.up.limit.min(self.down.limit)).min(top_speed);
        self.down.segments(beyond - motion.speed, motion.acceleration, self.up.fall)
    }

    /// The first stage of an axis that stands: a step to the start speed, and if there is one to the highest
    /// acceleration, as far as top speed and distance allow.
    fn start(&self, plan: &mut Plan, distance: f64, top_speed: f64) {
        let speed = self.fastest_start(self.start_speed.min(top_speed), distance);
        let fits = |acceleration| {
            let start = Motion { position: 0.0, speed, acceleration };
            self.released(start) <= top_speed && self.rest(start) <= distance
        };
        let acceleration = match self.up.limit {
            _ if self.start_speed == 0.0 => 0.0,
            limit if fits(limit) => limit,
            limit => largest(limit, fits),
        };
        plan.push(Segment::default());
        plan.end_with(speed, acceleration);
    }

    /// Constant speed until it is time to stop. It is the top speed, unless the axis may not accelerate.
    fn cruise(&self, plan: &mut Plan, distance: f64, top_speed: f64) {
        let speed = if self.up.limit == 0.0 { plan.end.speed.min(top_speed) } else { top_speed };
        plan.settle(speed);
        let slack = distance - self.rest(plan.end);
        if speed > 0.0 {
            plan.push(Segment::new(0.0, (slack / speed).max(0.0)));
            plan.settle(speed); // also if it lasts for ever
        }
    }

    /// Comes to rest.
    fn brake(&self, motion: Motion) -> Plan {
        let mut plan = Plan::new(motion.speed, motion.acceleration);
        plan.rest(self.way_to_rest(plan.end));
        plan
    }

    /// Highest speed up to `most` from which a standing axis can start and still stop in `distance`.
    fn fastest_start(&self, most: f64, distance: f64) -> f64 {
        let fits = |speed| self.rest(Motion { speed, ..Motion::default() }) <= distance;
        if fits(most) { most } else { largest(most, fits) }
    }

    /// Speed that is left when the acceleration has been brought to zero.
    fn released(&self, motion: Motion) -> f64 {
        if motion.acceleration >= 0.0 {
            motion.speed + self.up.release(motion.acceleration)
        } else {
            motion.speed - self.down.release(motion.acceleration)
        }
    }

    /// The shortest way to a constant speed that is not negative, of an axis that goes forwards.
    fn toward(&self, motion: Motion, speed: f64) -> [Segment; 4] {
        if self.released(motion) < speed {
            self.up.segments(speed - motion.speed, motion.acceleration, self.down.fall)
        } else {
            let down = self.down.segments(motion.speed - speed, -motion.acceleration, self.up.fall);
            down.map(Segment::reversed)
        }
    }

    /// The shortest way to rest, whichever way the axis goes.
    fn way_to_rest(&self, motion: Motion) -> [Segment; 4] {
        if self.heads_back(motion) {
            self.way_ahead_to_rest(motion.reversed()).map(Segment::reversed)
        } else {
            self.way_ahead_to_rest(motion)
        }
    }

    /// The way to the stop speed, or to no acceleration if that is below it.
    fn way_ahead_to_rest(&self, motion: Motion) -> [Segment; 4] {
        self.toward(motion, self.stop_speed.min(self.released(motion)).max(0.0))
    }

    /// Where the axis comes to rest by the shortest way.
    fn rest(&self, motion: Motion) -> f64 {
        self.way_to_rest(motion).into_iter().fold(motion, Motion::after).position
    }
}

/// From 48 fraction bits.
fn per_tick(value: i64) -> f64 {
    value as f64 / (1u64 << FRACTION_BITS) as f64
}

/// A speed rounded up to 40 fraction bits, which an `f64` holds exactly: an axis reads the speed it was asked for.
fn speed_per_tick(value: i64) -> f64 {
    const LOST: i64 = (1 << 8) - 1;
    per_tick((value + LOST) & !LOST)
}

/// From 72 fraction bits, in whole sixths, so that a tick can add them exactly.
fn jerk_per_tick(value: i128) -> f64 {
    (value / 6).max(1) as f64 * 6.0 / (1u128 << JERK_BITS) as f64
}

/// Square root by Newton's method, within 2^-51 of the true one; 0 for anything below zero. (`core` has none.)
fn square_root(value: f64) -> f64 {
    const HALF_BIAS: u64 = 1023 << 51;
    if value <= 0.0 {
        return 0.0;
    }
    let mut root = f64::from_bits((value.to_bits() >> 1) + HALF_BIAS); // within 6.1 %
    for _ in 0..4 {
        root = (root + value / root) / 2.0;
    }
    root
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn square_root_is_exact_to_two_places_of_the_last_bits() {
        for number in -3_000..3_000 {
            let value = (f64::from(number) / 10.0).exp2();
            let error = square_root(value) / value.sqrt() - 1.0;
            assert!(error.abs() <= 2f64.powi(-51), "{value}: {error}");
        }
        assert_eq!((square_root(0.0), square_root(-1.0)), (0.0, 0.0));
    }
}
