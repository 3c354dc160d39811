//! When control ticks come.

use crate::program::program::NEVER;

/// Time between two control ticks: whole microseconds and nanoseconds, so that a PWM period need not be a whole number of
/// microseconds.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Period {
    us: u32,
    /// Below 1000.
    ns: u32,
}

impl Period {
    /// A period of that many nanoseconds, at least a microsecond.
    pub const fn from_ns(ns: u32) -> Self {
        if ns < 1000 { Self { us: 1, ns: 0 } } else { Self { us: ns / 1000, ns: ns % 1000 } }
    }

    fn total_ns(self) -> u64 {
        u64::from(self.us) * 1000 + u64::from(self.ns)
    }
}

/// The control ticks of a module: at multiples of the period since power-on, in the microsecond where that falls.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ticks {
    /// When the next one is due; never while all axes rest.
    pub(crate) at_us: u64,
    ns: u32,
}

impl Ticks {
    pub(crate) const NONE: Self = Self { at_us: NEVER, ns: 0 };

    /// The first one after `now`.
    pub(crate) fn start(now: u64, period: Period) -> Self {
        let period_ns = period.total_ns().max(1);
        let next_ns = (now.saturating_mul(1000) / period_ns).saturating_add(1).saturating_mul(period_ns);
        // In a period that begins at a part of a microsecond, the next tick may fall into this one.
        let at_ns = if next_ns / 1000 > now { next_ns } else { next_ns.saturating_add(period_ns) };
        Self { at_us: at_ns / 1000, ns: (at_ns % 1000) as u32 }
    }

    /// The one after this.
    #[inline]
    pub(crate) fn advance(&mut self, period: Period) {
        self.at_us += u64::from(period.us);
        self.ns += period.ns;
        if self.ns >= 1000 {
            self.ns -= 1000;
            self.at_us += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_multiples_of_the_period() {
        for period_ns in [10_000, 33_330, 39_990, 40_000, 100_000] {
            let period = Period::from_ns(period_ns);
            let mut ticks = Ticks::start(0, period);
            for number in 1..10_000 {
                assert_eq!(ticks.at_us, number * u64::from(period_ns) / 1000, "tick {number} of {period_ns} ns");
                ticks.advance(period);
            }
        }
    }

    #[test]
    fn first_tick_lies_after_now_and_on_the_grid() {
        let period = Period::from_ns(33_330);
        let grid: std::vec::Vec<u64> = (1..40).map(|number| number * 33_330 / 1000).collect();
        for now in 0..1000 {
            let expected = grid.iter().copied().find(|at| *at > now);
            assert_eq!(Some(Ticks::start(now, period).at_us), expected, "at {now}");
        }
    }
}
