//! What a session has seen of its line.

use std::fmt;
use std::time::Duration;

/// Counts of a session, from its beginning.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Statistics {
    /// Commands that the caller asked for.
    pub requests: u64,
    /// Commands that got their answer.
    pub answers: u64,
    /// Requests sent again.
    pub retries: u64,
    /// Requests without an answer in time.
    pub silent: u64,
    /// Answers that came damaged.
    pub damaged: u64,
    /// Requests that the module got damaged.
    pub damaged_requests: u64,
    /// Late, foreign and doubled answers, which were thrown away.
    pub drained: u64,
    /// Questions by which the session got in step.
    pub probes: u64,
    /// Time between request and answer.
    pub round_trips: Histogram,
}

/// How often a time was how long: one class a power of two of microseconds.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Histogram {
    /// Class 0 holds 0 us, class n holds 2^(n-1) to 2^n - 1 us; the last one all above.
    classes: [u64; CLASSES],
    longest: Duration,
}

/// Up to 2^23 us, which is 8 s.
const CLASSES: usize = 24;

impl Histogram {
    /// Adds a time.
    pub fn add(&mut self, time: Duration) {
        let us = u64::try_from(time.as_micros()).unwrap_or(u64::MAX);
        let class = (u64::BITS - us.leading_zeros()) as usize;
        self.classes[class.min(CLASSES - 1)] += 1;
        self.longest = self.longest.max(time);
    }

    /// How many times there are.
    pub fn count(&self) -> u64 {
        self.classes.iter().sum()
    }

    /// The longest time.
    pub fn longest(&self) -> Duration {
        self.longest
    }

    /// A time that `percent` of all times do not exceed, rounded up to the end of its class.
    pub fn percentile(&self, percent: u64) -> Duration {
        let wanted = (self.count() * percent).div_ceil(100);
        let mut seen = 0;
        let class = self.classes.iter().position(|count| {
            seen += count;
            seen >= wanted
        });
        end_of(class.unwrap_or_default()).min(self.longest)
    }
}

/// The longest time of a class.
fn end_of(class: usize) -> Duration {
    Duration::from_micros((1 << class) - 1)
}

impl fmt::Display for Histogram {
    /// One line a class that has times.
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        const BAR: u64 = 40;
        let most = self.classes.iter().max().copied().unwrap_or_default().max(1);
        for (class, count) in self.classes.iter().enumerate().filter(|(_, count)| **count > 0) {
            let bar = "#".repeat((count * BAR).div_ceil(most) as usize);
            let end = if class + 1 == CLASSES { self.longest } else { end_of(class) };
            writeln!(f, "  up to {:>9.3} ms  {count:>9}  {bar}", end.as_secs_f64() * 1e3)?;
        }
        Ok(())
    }
}

impl fmt::Display for Statistics {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let rows = [
            ("requests", self.requests),
            ("answered", self.answers),
            ("sent again", self.retries),
            ("without answer", self.silent),
            ("damaged answers", self.damaged),
            ("damaged requests", self.damaged_requests),
            ("drained answers", self.drained),
            ("probes", self.probes),
        ];
        for (name, count) in rows {
            writeln!(f, "{name:<17}{count:>9}")?;
        }
        let ms = |time: Duration| time.as_secs_f64() * 1e3;
        let (half, most) = (self.round_trips.percentile(50), self.round_trips.percentile(99));
        writeln!(
            f,
            "round trip: half within {:.3} ms, 99 % within {:.3} ms, longest {:.3} ms",
            ms(half),
            ms(most),
            ms(self.round_trips.longest())
        )?;
        write!(f, "{}", self.round_trips)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_the_ends_of_classes() {
        let mut histogram = Histogram::default();
        assert_eq!(histogram.percentile(50), Duration::ZERO);
        for us in [0, 1, 3, 100, 100, 100, 100, 100, 5000, 70_000_000] {
            histogram.add(Duration::from_micros(us));
        }
        assert_eq!(histogram.count(), 10);
        assert_eq!(histogram.percentile(10), Duration::ZERO);
        assert_eq!(histogram.percentile(50), Duration::from_micros(127));
        assert_eq!(histogram.percentile(90), Duration::from_micros(8191));
        assert_eq!(histogram.longest(), Duration::from_secs(70));
    }
}
