//! The planner of S-shaped ramps: from distance, speed, acceleration and limits to all stages of constant jerk.
//!
//! One function does the thinking: [`Shape::toward`] changes to a constant speed in the shortest time, by four segments
//! at most. A move follows the way to its top speed as long as it can still stop, which a bisection tells to the last
//! bit, cruises if it has got there, and then follows the way to rest. Segments that are not reached have no length, so
//! a move from rest to rest is the shortest that the limits allow.
//!
//! A plan is made once and carried out to its end: when to begin to stop is not asked again while stopping. Only a
//! change from outside, or rest away from the target, makes a new one, from the present speed and acceleration.
//!
//! Units are microsteps and ticks, in `f64`. Only `+ - * /` and comparisons are used, which round alike everywhere, and
//! the work is bounded: some 60 ways to rest a segment searched, of which a plan has one.

use crate::gains::Gains;
use crate::tick_rate::{FRACTION_BITS, JERK_BITS};

/// Steps of a bisection: all bits of an `f64`, and some.
const BISECTIONS: u32 = 60;

/// Most stages of a plan: a start, four segments to top speed, a cruise and four segments to rest.
const MAX_STAGES: usize = 10;

/// Where an axis is on its way, how fast it goes, and how fast that changes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Motion {
    pub(crate) position: f64,
    pub(crate) speed: f64,
    pub(crate) acceleration: f64,
}

impl Motion {
    pub(crate) fn after(self, Segment { jerk, time }: Segment) -> Self {
        let Self { position, speed, acceleration } = self;
        Self {
            position: position + time * (speed + time * (acceleration / 2.0 + time * jerk / 6.0)),
            speed: speed + time * (acceleration + time * jerk / 2.0),
            acceleration: acceleration + time * jerk,
        }
    }

    fn reversed(self) -> Self {
        Self { position: -self.position, speed: -self.speed, acceleration: -self.acceleration }
    }
}

/// A time of constant jerk.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Segment {
    pub(crate) jerk: f64,
    pub(crate) time: f64,
}

impl Segment {
    fn new(jerk: f64, time: f64) -> Self {
        Self { jerk, time }
    }

    fn reversed(self) -> Self {
        Self { jerk: -self.jerk, ..self }
    }
}

/// A segment of a plan, and the speed and acceleration at its end. They may differ from those that the segment leads
/// to: motion starts and ends with a step of speed if there is a start or stop speed.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Stage {
    pub(crate) segment: Segment,
    pub(crate) speed: f64,
    pub(crate) acceleration: f64,
}

/// What an axis is going to do, from now to rest, or for ever.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Plan {
    stages: [Stage; MAX_STAGES],
    length: usize,
    /// At the end of the last stage.
    end: Motion,
}

impl Plan {
    fn new(speed: f64, acceleration: f64) -> Self {
        Self { end: Motion { position: 0.0, speed, acceleration }, ..Self::default() }
    }

    /// Stage number `index`; the end of the plan is where there is none.
    pub(crate) fn stage(&self, index: usize) -> Option<&Stage> {
        self.stages.get(..self.length)?.get(index)
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.length == 0
    }

    fn push(&mut self, segment: Segment) {
        if let Some(stage) = self.stages.get_mut(self.length) {
            self.end = self.end.after(segment);
            *stage = Stage { segment, speed: self.end.speed, acceleration: self.end.acceleration };
            self.length += 1;
        }
    }

    /// Lets the last stage end with constant `speed`.
    fn settle(&mut self, speed: f64) {
        self.end = Motion { speed, acceleration: 0.0, ..self.end };
        if let Some(stage) = self.length.checked_sub(1).and_then(|last| self.stages.get_mut(last)) {
            *stage = Stage { speed, acceleration: 0.0, ..*stage };
        }
    }

    /// Adds a way that ends at rest.
    fn rest(&mut self, way: [Segment; 4]) {
        way.into_iter().for_each(|segment| self.push(segment));
        self.settle(0.0);
    }

    /// Adds segments as long as `fits` holds for the end; returns whether it holds for all.
    fn follow_while(&mut self, segments: [Segment; 4], fits: impl Fn(Motion) -> bool) -> bool {
        for segment in segments {
            let part = |time| Segment { time, ..segment };
            if !fits(self.end.after(segment)) {
                self.push(part(largest(segment.time, |time| fits(self.end.after(part(time))))));
                return false;
            }
            self.push(segment);
        }
        true
    }

    fn reversed(mut self) -> Self {
        for stage in &mut self.stages {
            *stage =
                Stage { segment: stage.segment.reversed(), speed: -stage.speed, acceleration: -stage.acceleration };
        }
        Self { end: self.end.reversed(), ..self }
    }
}

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
    pub(crate) fn plan(&self, Motion { speed, acceleration, .. }: Motion, distance: f64, top_speed: i64) -> Plan {
        let top_speed = speed_per_tick(top_speed);
        if distance < 0.0 {
            self.forwards(-speed, -acceleration, -distance, top_speed).reversed()
        } else {
            self.forwards(speed, acceleration, distance, top_speed)
        }
    }

    fn forwards(&self, speed: f64, acceleration: f64, distance: f64, top_speed: f64) -> Plan {
        if speed < 0.0 {
            return self.brake(-speed, -acceleration).reversed();
        }
        let mut plan = Plan::new(speed, acceleration);
        if speed == 0.0 && acceleration == 0.0 {
            if top_speed == 0.0 || self.up.limit == 0.0 {
                return plan;
            }
            plan.push(Segment::default());
            plan.settle(self.fastest_start(self.start_speed.min(top_speed), distance));
        } else if top_speed == 0.0 {
            return self.brake(speed, acceleration);
        }
        let fits = |end: Motion| end.position + self.distance_to_rest(end) <= distance;
        if plan.follow_while(self.toward(plan.end, top_speed), fits) {
            self.cruise(&mut plan, distance, top_speed);
        }
        plan.rest(self.way_to_rest(plan.end));
        plan
    }

    /// Constant speed until it is time to stop. It is the top speed, unless the axis may not accelerate.
    fn cruise(&self, plan: &mut Plan, distance: f64, top_speed: f64) {
        let speed = if self.up.limit == 0.0 { plan.end.speed.min(top_speed) } else { top_speed };
        plan.settle(speed);
        let slack = distance - plan.end.position - self.distance_to_rest(plan.end);
        if speed > 0.0 {
            plan.push(Segment::new(0.0, (slack / speed).max(0.0)));
            plan.settle(speed); // also if it lasts for ever
        }
    }

    /// Comes to rest from a speed that is not negative.
    fn brake(&self, speed: f64, acceleration: f64) -> Plan {
        let mut plan = Plan::new(speed, acceleration);
        plan.rest(self.way_to_rest(plan.end));
        plan
    }

    /// Highest speed up to `most` from which a standing axis can start and still stop in `distance`.
    fn fastest_start(&self, most: f64, distance: f64) -> f64 {
        let fits = |speed| self.distance_to_rest(Motion { speed, ..Motion::default() }) <= distance;
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

    /// The shortest way to a constant speed; both speeds are not negative.
    fn toward(&self, motion: Motion, speed: f64) -> [Segment; 4] {
        if self.released(motion) < speed {
            self.up.segments(speed - motion.speed, motion.acceleration, self.down.fall)
        } else {
            let down = self.down.segments(motion.speed - speed, -motion.acceleration, self.up.fall);
            down.map(Segment::reversed)
        }
    }

    /// The way to the stop speed, or to no acceleration if that is below it.
    fn way_to_rest(&self, motion: Motion) -> [Segment; 4] {
        self.toward(motion, self.stop_speed.min(self.released(motion)).max(0.0))
    }

    fn distance_to_rest(&self, motion: Motion) -> f64 {
        let start = Motion { position: 0.0, ..motion };
        self.way_to_rest(motion).into_iter().fold(start, Motion::after).position
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

/// Largest number in `0..=most` that fits, to the last bit, where `most` does not.
fn largest(most: f64, fits: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0.0, most);
    for _ in 0..BISECTIONS {
        let middle = (low + high) / 2.0;
        if fits(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
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
