//! The planner of trapezoidal and six-point ramps: from distance, speed and limits to the next phase.
//!
//! A tick first changes the speed, then moves the axis by it. Braking descends a ladder of speeds: the stop speed, then
//! a rung every final deceleration up to the break speed, then a rung every deceleration. The distance needed to rest
//! is the sum of the rungs below the speed, an integer. What is left over when braking begins (the slack) is less than
//! one tick's travel: it becomes one more rung, put in its place in the ladder. So a move ends exactly on its target,
//! no step of the ladder is larger than the deceleration, and nothing is rounded.
//!
//! The planner has no memory. Whatever changes while the axis moves (target, limits, mode), the next phase follows
//! from where the axis is and how fast it goes.

use crate::limits::Gains;

/// A distance too far to matter: the planner's target in velocity mode.
pub(crate) const FAR: i128 = 1 << 124;

/// Some ticks of constant acceleration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Phase {
    /// Change of speed in each tick.
    pub(crate) acceleration: i64,
    /// Ticks left; none only at rest.
    pub(crate) ticks: u32,
}

impl Phase {
    pub(crate) const REST: Self = Self { acceleration: 0, ticks: 0 };

    fn new(acceleration: i64, ticks: i64) -> Self {
        Self { acceleration, ticks: ticks.clamp(0, i64::from(u32::MAX)) as u32 }
    }

    fn one_tick(from: i64, to: i64) -> Self {
        Self::new(to - from, 1)
    }

    fn reversed(self) -> Self {
        Self { acceleration: -self.acceleration, ..self }
    }
}

/// Speeds from `base` upwards, in which the axis brakes by `step` a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Zone {
    pub(crate) base: i64,
    pub(crate) step: i64,
    /// Distance from a speed of `base` to rest.
    below: i128,
}

impl Zone {
    fn rung(&self, index: i64) -> i64 {
        self.base + index * self.step
    }

    /// Number of this zone's rungs lower than `speed`.
    fn rungs_below(&self, speed: i64) -> i64 {
        let above = (speed - self.base).max(0);
        above / self.divisor() + i64::from(above % self.divisor() != 0)
    }

    /// The step, which is never zero; saying so leaves no panic in the code.
    fn divisor(&self) -> i64 {
        self.step.max(1)
    }

    /// Distance to rest when the `count` lowest rungs of this zone are still to come.
    fn distance_of(&self, count: i64) -> i128 {
        let (count, base, step) = (i128::from(count), i128::from(self.base), i128::from(self.step));
        self.below + count * base + step * (count * (count - 1) / 2)
    }
}

/// How an axis slows down.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Brake {
    pub(crate) last: Zone,
    pub(crate) upper: Zone,
}

impl Brake {
    /// Braking by `deceleration` a tick down to `break_speed`, then by `final_deceleration` down to `stop_speed`.
    pub(crate) fn new(stop_speed: i64, final_deceleration: i64, break_speed: i64, deceleration: i64) -> Self {
        let last = Zone { base: stop_speed, step: final_deceleration, below: 0 };
        let base = break_speed.max(stop_speed);
        let below = last.distance_of(last.rungs_below(base));
        Self { last, upper: Zone { base, step: deceleration, below } }
    }

    /// Braking by `deceleration` a tick down to rest.
    pub(crate) fn linear(deceleration: i64) -> Self {
        Self::new(0, deceleration, 0, deceleration)
    }

    fn zone(&self, speed: i64) -> &Zone {
        if speed > self.upper.base { &self.upper } else { &self.last }
    }

    /// Distance that the axis still moves when it brakes as hard as it may.
    fn distance(&self, speed: i64) -> i128 {
        let zone = self.zone(speed);
        zone.distance_of(zone.rungs_below(speed))
    }

    /// Braking from `speed` by way of the ladder, with `extra` as one more rung (it is lower than `speed`).
    fn phase(&self, speed: i64, extra: i64) -> Phase {
        let zone = self.zone(speed);
        let rungs = zone.rungs_below(speed);
        if rungs == 0 {
            return Phase::one_tick(speed, extra); // at or below the stop speed
        }
        let next = zone.rung(rungs - 1).max(extra);
        if speed - next < zone.step {
            Phase::one_tick(speed, next)
        } else {
            Phase::new(-zone.step, (speed - zone.base.max(extra)) / zone.divisor())
        }
    }

    /// Highest speed up to `reach` from which the axis, after a tick at that speed, still comes to rest in `distance`.
    fn fastest(&self, reach: i64, distance: i128) -> i64 {
        let fits = |speed: i64, rest: i128| i128::from(speed) + rest <= distance;
        let base = self.upper.base;
        let (zone, reach) = match reach > base && fits(base, self.upper.below) {
            true => (&self.upper, reach),
            false => (&self.last, reach.min(base)),
        };
        if reach <= zone.base || !fits(zone.base, zone.below) {
            return distance.min(i128::from(reach)) as i64;
        }
        let rung = largest(zone.rungs_below(reach) - 1, |rung| fits(zone.rung(rung), zone.distance_of(rung)));
        let speed = distance - zone.distance_of(rung + 1);
        speed.min(i128::from(reach)).max(i128::from(zone.rung(rung))) as i64
    }
}

/// Where a ramp is to go: the planner's question.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Leg<'a> {
    pub(crate) gains: &'a Gains,
    pub(crate) brake: &'a Brake,
    /// Signed distance to the target.
    pub(crate) distance: i128,
    /// Highest speed on the way, not negative.
    pub(crate) top_speed: i64,
}

impl Leg<'_> {
    /// The next phase for an axis that moves with `speed`; [`Phase::REST`] if it stands and has nowhere to go.
    pub(crate) fn next_phase(&self, speed: i64) -> Phase {
        let backwards = if self.distance == 0 { speed < 0 } else { self.distance < 0 };
        if backwards {
            Leg { distance: -self.distance, ..*self }.forwards(-speed).reversed()
        } else {
            self.forwards(speed)
        }
    }

    /// The next phase towards a target ahead.
    fn forwards(&self, speed: i64) -> Phase {
        if speed < 0 {
            return self.brake.phase(-speed, 0).reversed();
        }
        let slack = self.distance - self.brake.distance(speed);
        if speed > self.top_speed || slack < i128::from(speed) {
            let extra = slack.min(i128::from(self.top_speed)).max(0) as i64;
            return self.brake.phase(speed, extra);
        }
        self.speed_up(speed).unwrap_or_else(|| cruise(speed, slack))
    }

    /// As many ticks of full acceleration as top speed, break speed and distance allow, else a tick of less.
    fn speed_up(&self, speed: i64) -> Option<Phase> {
        let gains = self.gains;
        let below_break = speed < gains.break_speed;
        let step = if below_break { gains.start_acceleration } else { gains.acceleration };
        if step == 0 {
            return None;
        }
        let ceiling = if below_break { gains.break_speed.min(self.top_speed) } else { self.top_speed };
        let reach = ceiling.min(speed + step);
        if speed == 0 && gains.start_speed > reach {
            return self.one_tick_up(speed, gains.start_speed);
        }
        let most = ((ceiling - speed) / step).min(i64::from(u32::MAX));
        match largest(most, |ticks| self.reaches(speed, step, ticks)) {
            0 => self.one_tick_up(speed, reach),
            ticks => Some(Phase::new(step, ticks)),
        }
    }

    /// Whether the axis can still stop at the target after `ticks` more ticks of acceleration.
    fn reaches(&self, speed: i64, step: i64, ticks: i64) -> bool {
        let rest = self.brake.distance(speed + step * ticks);
        let (speed, step, ticks) = (i128::from(speed), i128::from(step), i128::from(ticks));
        speed * ticks + step * (ticks * (ticks + 1) / 2) + rest <= self.distance
    }

    /// One tick to `reach`, or as near to it as top speed and distance allow.
    fn one_tick_up(&self, speed: i64, reach: i64) -> Option<Phase> {
        let faster = self.brake.fastest(reach.min(self.top_speed), self.distance);
        (faster > speed).then(|| Phase::one_tick(speed, faster))
    }
}

/// Ticks of constant speed until braking must begin.
fn cruise(speed: i64, slack: i128) -> Phase {
    if speed == 0 {
        return Phase::REST;
    }
    let ticks = slack / i128::from(speed);
    Phase::new(0, ticks.min(i128::from(u32::MAX)) as i64)
}

/// Largest number in `0..=most` that fits, where 0 does, and all below one that fits do.
fn largest(most: i64, fits: impl Fn(i64) -> bool) -> i64 {
    if fits(most) {
        return most;
    }
    let (mut low, mut high) = (0, most);
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if fits(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}
