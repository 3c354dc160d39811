//! The tick of S-shaped ramps: carries out a plan, in integers.
//!
//! Position, speed and acceleration are those of continuous motion at the ticks, so the stages of a plan may end
//! anywhere within a tick. A tick within a stage is a sum of integers and exact to 2^-72 microsteps, for any number of
//! ticks; one in which stages end is divided at their ends. Where a stage ends, the axis takes over the planned speed
//! and acceleration, so that rounding does not add up.

use core::array;

use crate::s_plan::{Motion, Plan, Segment};
use crate::tick_rate::{FRACTION_BITS, JERK_BITS};

const SCALE: f64 = (1u128 << JERK_BITS) as f64;

/// Bits of a speed below those of a position.
const EXTRA_BITS: u32 = JERK_BITS - FRACTION_BITS;

/// An axis on its way through a plan. Numbers have 72 fraction bits.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Curve {
    plan: Plan,
    /// What the plan was made with.
    bows: [i128; 4],
    /// Number of the present stage.
    stage: usize,
    /// Whole ticks left of the stage.
    ticks: u64,
    /// What is left of the stage after them.
    rest: f64,
    speed: i128,
    acceleration: i128,
    /// A sixth of the jerk in whole ticks.
    sixth: i128,
}

impl Curve {
    /// No plan yet, and a speed and acceleration of 48 fraction bits.
    pub(crate) fn new(speed: i64, acceleration: i64, bows: [i128; 4]) -> Self {
        Self {
            plan: Plan::default(),
            bows,
            stage: 0,
            ticks: 0,
            rest: 0.0,
            speed: i128::from(speed) << EXTRA_BITS,
            acceleration: i128::from(acceleration) << EXTRA_BITS,
            sixth: 0,
        }
    }

    /// The bows to plan with when `bows` are set. Lower ones do not hold before the acceleration is zero: an axis that
    /// cannot end its acceleration as fast as it was planned to would exceed its top speed, or turn back. Nor do bows 2
    /// and 4 become unequal before, as the axis may be about to pass through zero speed.
    pub(crate) fn bows(&self, bows: [i128; 4]) -> [i128; 4] {
        if self.acceleration == 0 {
            return bows;
        }
        let mut raised: [i128; 4] = array::from_fn(|bow| bows[bow].max(self.bows[bow]));
        if self.bows[1] == self.bows[3] {
            let fall = raised[1].min(raised[3]);
            (raised[1], raised[3]) = (fall, fall);
        }
        raised
    }

    /// Goes on by another plan, made with `bows`.
    pub(crate) fn follow(self, plan: Plan, bows: [i128; 4]) -> Self {
        let rest = plan.stage(0).map_or(0.0, |stage| stage.segment.time);
        Self { plan, bows, stage: 0, ticks: 0, rest, ..self }
    }

    /// Whether the plan has come to its end.
    pub(crate) fn is_over(&self) -> bool {
        self.plan.stage(self.stage).is_none()
    }

    /// Present speed and acceleration.
    pub(crate) fn motion(&self) -> Motion {
        Motion { position: 0.0, speed: float(self.speed), acceleration: float(self.acceleration) }
    }

    pub(crate) fn stands(&self) -> bool {
        self.speed == 0 && self.acceleration == 0
    }

    /// Microsteps a tick, 48 fraction bits.
    pub(crate) fn speed(&self) -> i64 {
        (self.speed >> EXTRA_BITS) as i64
    }

    /// Microsteps a tick, each tick, 48 fraction bits.
    pub(crate) fn acceleration(&self) -> i64 {
        (self.acceleration >> EXTRA_BITS) as i64
    }

    /// Advances by one control tick and returns the way, rounded to 48 fraction bits.
    pub(crate) fn tick(&mut self) -> i64 {
        const HALF: i128 = 1 << (EXTRA_BITS - 1);
        let travel = if self.ticks > 0 { self.whole_tick() } else { self.divided_tick() };
        ((travel + HALF) >> EXTRA_BITS) as i64
    }

    fn whole_tick(&mut self) -> i128 {
        let travel = self.speed + (self.acceleration >> 1) + self.sixth;
        self.speed += self.acceleration + 3 * self.sixth;
        self.acceleration += 6 * self.sixth;
        self.ticks -= 1;
        travel
    }

    /// A tick in which a stage ends, or several.
    fn divided_tick(&mut self) -> i128 {
        let (mut left, mut travel) = (1.0, 0);
        while let Some(&stage) = self.plan.stage(self.stage) {
            let jerk = stage.segment.jerk;
            if self.rest > left {
                travel += self.advance(jerk, left);
                self.schedule(jerk, self.rest - left);
                return travel;
            }
            travel += self.advance(jerk, self.rest);
            (self.speed, self.acceleration) = (fixed(stage.speed), fixed(stage.acceleration));
            left -= self.rest;
            self.stage += 1;
            self.rest = self.plan.stage(self.stage).map_or(0.0, |next| next.segment.time);
        }
        travel + self.advance(0.0, left)
    }

    /// Advances by a part of a tick.
    fn advance(&mut self, jerk: f64, time: f64) -> i128 {
        let before = self.motion();
        let after = before.after(Segment { jerk, time });
        self.speed += fixed(after.speed - before.speed);
        self.acceleration += fixed(jerk * time);
        fixed(after.position)
    }

    /// Divides the `time` left of a stage into whole ticks and a rest.
    fn schedule(&mut self, jerk: f64, time: f64) {
        self.ticks = time as u64;
        self.rest = time - self.ticks as f64;
        self.sixth = fixed(jerk / 6.0);
    }
}

fn fixed(value: f64) -> i128 {
    (value * SCALE) as i128
}

fn float(value: i128) -> f64 {
    value as f64 / SCALE
}
