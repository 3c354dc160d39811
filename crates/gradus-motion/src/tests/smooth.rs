//! A watcher for S-shaped ramps: every tick is checked against speed, acceleration and jerk as the user set them.

use std::{array, mem};

use super::*;

/// Distance to the target that a move may bridge in its last tick.
const ARRIVAL: f64 = 1.0 / 65_536.0;

/// Distance that a move may pass its target by, and come back: 2^-20 microsteps, with 32 fraction bits.
const PASSING: i64 = 1 << 12;

/// Jerk in pps^3 that two readings of an acceleration may be apart by their rounding: 2 * 2^-48 * (10 kHz)^3.
const READING: f64 = 0.0072;

/// Limits with bows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Curved {
    pub(super) limits: Limits,
    pub(super) bows: [u64; 4],
}

impl Curved {
    pub(super) fn new(max_speed_pps: u32, acceleration: u32, deceleration: u32, bows: [u64; 4]) -> Self {
        Self { limits: trapezoid(max_speed_pps, acceleration, deceleration), bows }
    }

    pub(super) fn ramp(&self) -> Ramp {
        Ramp::new(self.limits.gains(TICK_HZ).s_shaped(self.bows))
    }

    /// Jerk limit by what it does: raises or lowers, an acceleration or a deceleration.
    pub(super) fn bow(&self, index: usize) -> f64 {
        if self.bows[index] == 0 { f64::INFINITY } else { self.bows[index] as f64 }
    }

    pub(super) fn highest_bow(&self) -> f64 {
        (0..4).map(|index| self.bow(index)).fold(0.0, f64::max)
    }

    /// Acceleration and deceleration.
    pub(super) fn accelerations(&self) -> [f64; 2] {
        [accelerations(&self.limits).1, decelerations(&self.limits).1]
    }
}

/// Speed and acceleration at a tick, in pps and pps^2.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    pub(super) speed: f64,
    pub(super) acceleration: f64,
}

impl Sample {
    pub(super) fn of(ramp: &Ramp) -> Self {
        let hz = f64::from(TICK_HZ);
        Self { speed: pps(ramp), acceleration: ramp.curve_acceleration() as f64 * hz * hz / 2f64.powi(48) }
    }
}

/// An S-shaped ramp that panics in the tick in which it breaks a limit.
#[derive(Clone, Debug)]
pub(super) struct Smooth {
    pub(super) ramp: Ramp,
    pub(super) curved: Curved,
    top_speed_pps: f64,
    ticks: u64,
}

impl Smooth {
    pub(super) fn new(curved: Curved) -> Self {
        Self { ramp: curved.ramp(), curved, top_speed_pps: f64::from(curved.limits.max_speed_pps), ticks: 0 }
    }

    pub(super) fn move_to(&mut self, target: i32) {
        self.top_speed_pps = f64::from(self.curved.limits.max_speed_pps);
        self.ramp.move_to(target);
    }

    pub(super) fn rotate(&mut self, speed_pps: i32) {
        self.top_speed_pps = f64::from(speed_pps).abs();
        self.ramp.rotate(speed_pps);
    }

    /// Changes the limits. Lower bows are not held against an axis that is changing its speed.
    pub(super) fn set(&mut self, curved: Curved) {
        let before = mem::replace(&mut self.curved, curved).bows;
        if self.ramp.curve_acceleration() != 0 {
            self.curved.bows = array::from_fn(|bow| before[bow].max(curved.bows[bow]));
        }
        self.ramp.set_gains(curved.limits.gains(TICK_HZ).s_shaped(curved.bows));
        if self.ramp.is_positioning() {
            self.top_speed_pps = f64::from(curved.limits.max_speed_pps);
        }
    }

    pub(super) fn tick(&mut self) {
        let before = self.ramp;
        self.ramp.tick();
        self.ticks += 1;
        let (from, to) = (Sample::of(&before), Sample::of(&self.ramp));
        check_sample(&self.curved, self.top_speed_pps, from, to);
        let moved = self.ramp.position_q32().wrapping_sub(before.position_q32()) as f64 / 2f64.powi(32);
        let rounding = match (self.ramp.is_idle(), self.ramp.is_positioning() && self.ramp.at_target()) {
            (true, true) => ARRIVAL,
            (true, false) => 1.0, // to the microstep below
            _ => ROUNDING,
        };
        assert!(check_travel(&self.curved, from, to, moved, rounding), "{from:?} to {to:?}: moved {moved}");
    }

    pub(super) fn run(&mut self, ticks: u32) {
        for _ in 0..ticks {
            self.tick();
        }
    }

    /// Runs until idle at the target and returns the duration in seconds.
    pub(super) fn arrive(&mut self) -> f64 {
        let start = self.ticks;
        while !self.ramp.is_idle() {
            self.tick();
            assert!(self.ticks - start < 10_000_000, "never idle: {:?} {:?}", self.curved, Sample::of(&self.ramp));
        }
        assert!(self.ramp.at_target(), "idle away from the target: {:?}", self.ramp);
        assert_eq!(self.ramp.position_q32(), i64::from(self.ramp.target()) << 32);
        (self.ticks - start) as f64 / f64::from(TICK_HZ)
    }

    /// Goes to `target` without turning back or passing it, but for rounding.
    pub(super) fn arrive_straight_at(&mut self, target: i32) -> f64 {
        let mut check = self.clone();
        self.move_to(target);
        check.move_to(target);
        let direction = i64::from(check.ramp.distance().signum());
        let left = |ramp: &Ramp| (i64::from(target) << 32).wrapping_sub(ramp.position_q32()).wrapping_mul(direction);
        while !check.ramp.is_idle() {
            let before = left(&check.ramp);
            check.ramp.tick();
            let after = left(&check.ramp);
            assert!(after <= before + PASSING && after >= -PASSING, "{before} to {after} / 2^32 microsteps to go");
        }
        self.arrive()
    }
}

fn within(value: f64, limit: f64) -> bool {
    value <= limit * (1.0 + ROUNDING) + 1e-6
}

/// Asserts that a tick keeps speed, acceleration and jerk limits. What is above a limit that was lowered may only fall.
pub(super) fn check_sample(curved: &Curved, top_speed: f64, from: Sample, to: Sample) {
    let slows_down = to.speed.abs() <= from.speed.abs() || from.acceleration * from.speed > 0.0;
    assert!(within(to.speed.abs(), top_speed) || slows_down, "{from:?} to {to:?}: speed of {curved:?}");
    let [up, down] = curved.accelerations();
    let limit = match to.acceleration * to.speed {
        _ if to.speed.abs() < 1e-3 => up.max(down),
        sense if sense >= 0.0 => up,
        _ => down,
    };
    let falls = to.acceleration.abs() < from.acceleration.abs();
    assert!(within(to.acceleration.abs(), limit) || falls, "{from:?} to {to:?}: acceleration of {curved:?}");
    let jerk = (to.acceleration - from.acceleration).abs() * f64::from(TICK_HZ);
    assert!(within(jerk, allowed_jerk(curved, from, to) + READING), "{from:?} to {to:?}: jerk {jerk} of {curved:?}");
    let steps = f64::from(curved.limits.start_speed_pps.max(curved.limits.stop_speed_pps));
    let change = (to.speed - from.speed).abs();
    assert!(within(change, reach(curved, from, to) + steps), "{from:?} to {to:?}: step of speed of {curved:?}");
}

/// Most that the speed can change in a tick between these accelerations.
fn reach(curved: &Curved, from: Sample, to: Sample) -> f64 {
    let hz = f64::from(TICK_HZ);
    from.acceleration.abs().max(to.acceleration.abs()) / hz + curved.highest_bow() / hz / hz
}

/// Whether the way of a tick fits the speeds at its ends.
fn check_travel(curved: &Curved, from: Sample, to: Sample, moved: f64, rounding: f64) -> bool {
    let steps = f64::from(curved.limits.start_speed_pps.max(curved.limits.stop_speed_pps));
    let mean = (from.speed + to.speed) / 2.0 / f64::from(TICK_HZ);
    (moved - mean).abs() <= (reach(curved, from, to) + steps) / f64::from(TICK_HZ) + rounding
}

/// The highest of the bows that count in this tick; all where speed or acceleration passes through zero; none where an
/// axis starts with a start speed.
fn allowed_jerk(curved: &Curved, from: Sample, to: Sample) -> f64 {
    if curved.limits.start_speed_pps > 0 && from.speed == 0.0 && from.acceleration == 0.0 {
        return f64::INFINITY;
    }
    if from.speed * to.speed <= 0.0 || from.acceleration * to.acceleration <= 0.0 {
        return curved.highest_bow();
    }
    let speeds_up = from.acceleration * from.speed > 0.0;
    let [rise, fall] = if speeds_up { [curved.bow(0), curved.bow(1)] } else { [curved.bow(2), curved.bow(3)] };
    let rises = to.acceleration.abs() > from.acceleration.abs();
    if rises { rise } else { fall.max(rise) } // in the tick of the peak the acceleration rises, then falls
}

prop_compose! {
    /// Unequal accelerations and bows, with which some top speed is reached within some seconds.
    pub(super) fn curved(top_speed_pps: f64)(
        speed in 0.05..1.0, accelerations in [-1.0..8.0, -1.0..8.0],
        bows in [-1.0..8.0, -1.0..8.0, -1.0..8.0, -1.0..8.0], turns_through: bool,
    ) -> Curved {
        let scaled = |value: f64, exponent: f64| (value * exponent.exp2()).clamp(1.0, 2e9);
        let [up, down] = accelerations.map(|exponent: f64| scaled(top_speed_pps, exponent));
        let bow = |index: usize| scaled(if index < 2 { up } else { down }, bows[index]) as u64;
        let last = bow(if turns_through { 1 } else { 3 });
        Curved::new((top_speed_pps * speed) as u32 + 1, up as u32, down as u32, [bow(0), bow(1), bow(2), last])
    }
}

prop_compose! {
    /// The same with start and stop speeds.
    pub(super) fn stepped(top_speed_pps: f64)(
        curved in curved(top_speed_pps), ends in [-0.3..0.3, -0.3..0.3],
    ) -> Curved {
        let [start_speed_pps, stop_speed_pps] = ends.map(|part: f64| (top_speed_pps * part.max(0.0)) as u32);
        Curved { limits: Limits { start_speed_pps, stop_speed_pps, ..curved.limits }, ..curved }
    }
}
