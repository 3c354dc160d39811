//! Pace: how virtual time follows the wall clock.

use std::fmt;
use std::str::FromStr;
use std::time::{Duration, Instant};

/// How fast virtual time runs.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Speed {
    /// So many virtual seconds a second, a millionth to a million.
    Factor(f64),
    /// As fast as possible while the module has anything to do (motion, a program, a timer, a scheduled change); else as the wall clock.
    Max,
}

/// A virtual second in twelve days; slower, a module only looks dead.
const MIN_FACTOR: f64 = 1e-6;

/// No computer keeps up with more, and months of idling at this factor fit into the module's microseconds.
const MAX_FACTOR: f64 = 1e6;

/// A speed that is neither a number in range nor `max`.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("`{0}` is no speed: give a number from {MIN_FACTOR} to {MAX_FACTOR} (1 is real time) or `max`")]
pub struct SpeedError(String);

impl Default for Speed {
    /// Real time.
    fn default() -> Self {
        Self::Factor(1.0)
    }
}

impl FromStr for Speed {
    type Err = SpeedError;

    fn from_str(text: &str) -> Result<Self, SpeedError> {
        if text == "max" {
            return Ok(Self::Max);
        }
        let factor = text.parse().ok().filter(|factor| (MIN_FACTOR..=MAX_FACTOR).contains(factor));
        factor.map(Self::Factor).ok_or_else(|| SpeedError(text.to_owned()))
    }
}

impl fmt::Display for Speed {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Factor(factor) => factor.fmt(f),
            Self::Max => f.write_str("max"),
        }
    }
}

/// The straight line from wall time to virtual time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pace {
    factor: f64,
    origin: Instant,
    origin_us: u64,
}

impl Pace {
    pub(crate) fn new(speed: Speed, origin: Instant, origin_us: u64) -> Self {
        let factor = match speed {
            Speed::Factor(factor) => factor,
            Speed::Max => 1.0,
        };
        Self { factor, origin, origin_us }
    }

    /// The virtual time, in microseconds, that belongs to a wall time.
    pub(crate) fn virtual_at(&self, wall: Instant) -> u64 {
        let passed = wall.saturating_duration_since(self.origin).as_secs_f64();
        self.origin_us.saturating_add((passed * self.factor * 1e6) as u64)
    }

    /// How long the wall clock takes from `wall` to the virtual time `event_us`.
    pub(crate) fn wait(&self, wall: Instant, event_us: u64) -> Duration {
        let left_us = event_us.saturating_sub(self.virtual_at(wall)) as f64 / self.factor;
        Duration::try_from_secs_f64(left_us * 1e-6).unwrap_or(Duration::MAX)
    }

    /// Lets the line go through the virtual time `now_us` at `wall`.
    pub(crate) fn restart(&mut self, wall: Instant, now_us: u64) {
        (self.origin, self.origin_us) = (wall, now_us);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speeds_are_read() {
        let cases = [
            ("1", Some(Speed::Factor(1.0))),
            ("0.25", Some(Speed::Factor(0.25))),
            ("max", Some(Speed::Max)),
            ("1e6", Some(Speed::Factor(1e6))),
            ("1e7", None),
            ("1e-6", Some(Speed::Factor(1e-6))),
            ("9e-7", None),
            ("0", None),
            ("-1", None),
            ("inf", None),
            ("NaN", None),
            ("fast", None),
            ("", None),
        ];
        for (text, speed) in cases {
            assert_eq!(text.parse().ok(), speed, "{text}");
        }
    }

    #[test]
    fn virtual_time_is_the_factor_times_wall_time() {
        let start = Instant::now();
        for (factor, after_a_second) in [(1.0, 1_000_500), (0.5, 500_500), (100.0, 100_000_500)] {
            let pace = Pace::new(Speed::Factor(factor), start, 500);
            assert_eq!(pace.virtual_at(start + Duration::from_secs(1)), after_a_second, "factor {factor}");
            assert_eq!(pace.wait(start, after_a_second), Duration::from_secs(1), "factor {factor}");
        }
    }

    #[test]
    fn restarted_pace_goes_on_from_there() {
        let start = Instant::now();
        let mut pace = Pace::new(Speed::Factor(2.0), start, 0);
        pace.restart(start + Duration::from_secs(1), 7);
        assert_eq!(pace.virtual_at(start + Duration::from_secs(2)), 2_000_007);
        assert_eq!(pace.virtual_at(start), 7, "before the start of the line");
    }
}
