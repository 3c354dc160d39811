//! How an axis slows down: a ladder of speeds.
//!
//! Braking descends the ladder: the stop speed, then a rung every final deceleration up to the break speed, then a rung
//! every deceleration. The distance needed to rest is the sum of the rungs below the speed, an integer.

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

    pub(crate) fn new(acceleration: i64, ticks: i64) -> Self {
        Self { acceleration, ticks: ticks.clamp(0, i64::from(u32::MAX)) as u32 }
    }

    pub(crate) fn one_tick(from: i64, to: i64) -> Self {
        Self::new(to - from, 1)
    }

    pub(crate) fn reversed(self) -> Self {
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
    pub(crate) fn distance(&self, speed: i64) -> i128 {
        let zone = self.zone(speed);
        zone.distance_of(zone.rungs_below(speed))
    }

    /// Braking from `speed` by way of the ladder, with `extra` as one more rung (it is lower than `speed`).
    pub(crate) fn phase(&self, speed: i64, extra: i64) -> Phase {
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
    pub(crate) fn fastest(&self, reach: i64, distance: i128) -> i64 {
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

/// Largest number in `0..=most` that fits, where 0 does, and all below one that fits do.
pub(crate) fn largest(most: i64, fits: impl Fn(i64) -> bool) -> i64 {
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
