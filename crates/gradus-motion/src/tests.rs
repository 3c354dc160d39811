//! Tests of ramps and lines: every tick is checked against the limits as the user set them.

mod changes;
mod closed_loop;
mod extremes;
mod lines;
mod moves;
mod s_changes;
mod s_moves;
mod s_optimal;
mod smooth;
mod tmc428;

use proptest::prelude::*;

use crate::{Limits, Ramp};

const TICK_HZ: u32 = 10_000;

/// Relative error that rounding may cause.
const ROUNDING: f64 = 1e-9;

/// A ramp that panics in the tick in which it breaks a limit.
#[derive(Clone, Debug)]
struct Watched {
    ramp: Ramp,
    limits: Limits,
    /// Highest speed of the present mode, in microsteps per second.
    top_speed_pps: u32,
    ticks: u64,
}

impl Watched {
    fn new(limits: Limits) -> Self {
        Self { ramp: Ramp::new(limits.gains(TICK_HZ)), limits, top_speed_pps: limits.max_speed_pps, ticks: 0 }
    }

    fn at(limits: Limits, position: i32) -> Self {
        let mut watched = Self::new(limits);
        watched.ramp.set_position(position);
        watched
    }

    fn set_limits(&mut self, limits: Limits) {
        self.limits = limits;
        self.ramp.set_gains(limits.gains(TICK_HZ));
        if self.ramp.is_positioning() {
            self.top_speed_pps = limits.max_speed_pps;
        }
    }

    fn move_to(&mut self, target: i32) {
        self.top_speed_pps = self.limits.max_speed_pps;
        self.ramp.move_to(target);
    }

    fn rotate(&mut self, speed_pps: i32) {
        self.top_speed_pps = speed_pps.unsigned_abs();
        self.ramp.rotate(speed_pps);
    }

    fn tick(&mut self) {
        let before = self.ramp;
        self.ramp.tick();
        self.ticks += 1;
        check_step(&self.limits, f64::from(self.top_speed_pps), pps(&before), pps(&self.ramp));
        let moved = self.ramp.position_q32().wrapping_sub(before.position_q32()) as f64 / 2f64.powi(32);
        let expected = pps(&self.ramp) / f64::from(TICK_HZ);
        assert!((moved - expected).abs() < ROUNDING || self.ramp.is_idle(), "moved {moved} instead of {expected}");
    }

    fn run(&mut self, ticks: u32) {
        for _ in 0..ticks {
            self.tick();
        }
    }

    /// Runs until idle and returns the duration in seconds.
    fn run_until_idle(&mut self) -> f64 {
        let start = self.ticks;
        while !self.ramp.is_idle() {
            self.tick();
            assert!(self.ticks - start < 10_000_000, "never idle: {:?}", self.ramp);
        }
        assert_eq!(self.ramp.speed_pps(), 0);
        (self.ticks - start) as f64 / f64::from(TICK_HZ)
    }

    /// Runs until idle at the target and returns the duration in seconds.
    fn arrive(&mut self) -> f64 {
        let duration = self.run_until_idle();
        assert!(self.ramp.at_target(), "idle away from the target: {:?}", self.ramp);
        assert_eq!(self.ramp.position_q32(), i64::from(self.ramp.target()) << 32);
        duration
    }

    /// Goes to `target` without turning back or passing it, and returns the duration in seconds.
    fn arrive_straight_at(&mut self, target: i32) -> f64 {
        self.move_to(target);
        let (start, direction) = (self.ticks, i64::from(self.ramp.distance().signum()));
        let left = |ramp: &Ramp| (i64::from(target) << 32).wrapping_sub(ramp.position_q32()).wrapping_mul(direction);
        let mut before = left(&self.ramp);
        while !self.ramp.is_idle() {
            self.tick();
            assert!(left(&self.ramp) <= before, "turned back");
            before = left(&self.ramp);
            assert!(before >= 0, "{before} / 2^32 microsteps past the target");
        }
        assert!(self.ramp.at_target() && before == 0);
        (self.ticks - start) as f64 / f64::from(TICK_HZ)
    }
}

/// Speed in microsteps per second, not rounded.
fn pps(ramp: &Ramp) -> f64 {
    ramp.speed() as f64 * f64::from(TICK_HZ) / 2f64.powi(48)
}

/// Asserts that a change of speed within one tick keeps the limits.
fn check_step(limits: &Limits, top_speed: f64, from: f64, to: f64) {
    assert!(from * to >= 0.0, "from {from} to {to} pps within a tick");
    let within = |value: f64, limit: f64| value <= limit * (1.0 + ROUNDING) + 1e-6;
    let (from, to) = (from.abs(), to.abs());
    let break_speed = f64::from(limits.break_speed_pps);
    if to > from {
        let (low, high) = accelerations(limits);
        let acceleration = if from < break_speed * (1.0 - ROUNDING) { low } else { high };
        let start = if from == 0.0 { f64::from(limits.start_speed_pps) } else { 0.0 };
        let reach = (from + acceleration / f64::from(TICK_HZ)).max(start).min(top_speed);
        assert!(within(to, reach), "up from {from} to {to} pps, to {reach} is allowed");
    } else if !within(from, f64::from(limits.stop_speed_pps)) {
        let (low, high) = decelerations(limits);
        let deceleration = if within(from, break_speed) { low } else { high };
        assert!(within(from - to, deceleration / f64::from(TICK_HZ)), "down from {from} to {to} pps");
    }
}

/// Accelerations below and above the break speed.
fn accelerations(limits: &Limits) -> (f64, f64) {
    let low = if limits.start_acceleration == 0 { limits.acceleration } else { limits.start_acceleration };
    (f64::from(low), f64::from(limits.acceleration))
}

/// Decelerations below and above the break speed; without any, nothing limits them.
fn decelerations(limits: &Limits) -> (f64, f64) {
    let high = if limits.deceleration == 0 { limits.acceleration } else { limits.deceleration };
    let low = if limits.final_deceleration == 0 { high } else { limits.final_deceleration };
    let unlimited = |value| if value == 0 { f64::INFINITY } else { f64::from(value) };
    (unlimited(low), unlimited(high))
}

/// Duration of a move from rest to rest in continuous time, in seconds.
fn closed_form(limits: &Limits, distance: f64) -> f64 {
    closed_form_from(f64::from(limits.start_speed_pps), limits, distance)
}

/// Duration of a move that begins with `speed` and ends at rest, in continuous time, in seconds.
fn closed_form_from(speed: f64, limits: &Limits, distance: f64) -> f64 {
    let top_speed = f64::from(limits.max_speed_pps);
    let peak = if slopes(speed, limits, top_speed).1 <= distance {
        top_speed
    } else {
        bisect(0.0, top_speed, |peak| slopes(speed, limits, peak).1 <= distance)
    };
    let (time, ramps) = slopes(speed, limits, peak);
    time + (distance - ramps) / peak
}

/// Time and distance of speeding up from `speed` to `peak` and slowing down to the stop speed.
fn slopes(speed: f64, limits: &Limits, peak: f64) -> (f64, f64) {
    let break_speed = f64::from(limits.break_speed_pps);
    let part = |from: f64, to: f64, acceleration: f64| {
        let time = (to - from).max(0.0) / acceleration;
        (time, time * (from + to) / 2.0)
    };
    let slope = |end: f64, (low, high): (f64, f64)| {
        let (lower, upper) = (part(end, peak.min(break_speed), low), part(end.max(break_speed), peak, high));
        (lower.0 + upper.0, lower.1 + upper.1)
    };
    let up = slope(speed.min(peak), accelerations(limits));
    let down = slope(f64::from(limits.stop_speed_pps).min(peak), decelerations(limits));
    (up.0 + down.0, up.1 + down.1)
}

/// Largest number between `low` and `high` that fits.
fn bisect(mut low: f64, mut high: f64, fits: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..200 {
        let middle = (low + high) / 2.0;
        if fits(middle) { low = middle } else { high = middle }
    }
    low
}

fn trapezoid(max_speed_pps: u32, acceleration: u32, deceleration: u32) -> Limits {
    Limits { max_speed_pps, acceleration, deceleration, ..Limits::default() }
}

/// Numbers spread evenly over the orders of magnitude up to 2^`bits` - 1.
fn magnitude(bits: f64) -> impl Strategy<Value = u32> {
    (0.0..bits).prop_map(|exponent: f64| exponent.exp2() as u32)
}

prop_compose! {
    fn any_trapezoid()(speed in magnitude(24.0), up in magnitude(31.0), down in magnitude(31.0)) -> Limits {
        trapezoid(speed, up, down)
    }
}

prop_compose! {
    /// Six-point ramps up to some speed, which they reach and leave within a second or so. A third of the optional
    /// values are zero.
    fn six_point(top_speed_pps: f64)(
        speed in 0.05..1.0, break_speed in -0.5..1.0, ends in [-0.1..0.2, -0.1..0.2],
        main in [0.0..8.0, 0.0..8.0], low in [-4.0..8.0, -4.0..8.0],
    ) -> Limits {
        let of_speed = |part: f64| f64::max(0.0, top_speed_pps * speed * part) as u32;
        let acceleration = |exponent: f64| (top_speed_pps * exponent.exp2()).clamp(1.0, f64::from(i32::MAX)) as u32;
        let optional = |exponent: f64| if exponent < 0.0 { 0 } else { acceleration(exponent) };
        Limits {
            max_speed_pps: of_speed(1.0).max(1),
            acceleration: acceleration(main[0]),
            deceleration: acceleration(main[1]),
            break_speed_pps: of_speed(break_speed),
            start_acceleration: optional(low[0]),
            final_deceleration: optional(low[1]),
            start_speed_pps: of_speed(ends[0]),
            stop_speed_pps: of_speed(ends[1]),
        }
    }
}

/// Top speeds from 1 pps to the highest there is, evenly over the orders of magnitude.
fn top_speed() -> impl Strategy<Value = f64> {
    (0.0..24.0).prop_map(f64::exp2)
}
