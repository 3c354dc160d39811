//! The winding of a motor: it warms with the square of the current.

use crate::field::STEP_S;

/// Time constant in seconds; the sheets of QSH5718 say 22 to 30 minutes.
const CONSTANT_S: f64 = 1_500.0;

/// Kelvin above the surroundings after a long time at the rated current.
const RISE_K: f64 = 80.0;

/// No winding gets warmer: there it has burnt.
const WARMEST_C: f64 = 300.0;

/// Share of the difference to its final temperature that a winding takes in a step.
const SHARE: f64 = STEP_S / CONSTANT_S;

/// A winding with its temperature.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Winding {
    temperature_c: f64,
    /// Where it would come to with the current of the latest step.
    final_c: f64,
}

impl Default for Winding {
    fn default() -> Self {
        Self { temperature_c: 25.0, final_c: 25.0 }
    }
}

impl Winding {
    /// A step with the square of a current as share of the rated one.
    #[inline]
    pub(crate) fn step(&mut self, square: f64, board_c: f64) {
        self.final_c = (board_c + RISE_K * square).min(WARMEST_C);
        self.temperature_c += (self.final_c - self.temperature_c) * SHARE;
    }

    /// Steps in which nothing changes.
    pub(crate) fn pass(&mut self, steps: u64) {
        self.temperature_c = self.temperature_c(steps);
    }

    /// The temperature after such steps: what is left of the difference is a power.
    pub(crate) fn temperature_c(&self, mut steps: u64) -> f64 {
        let (mut left, mut square) = (1.0, 1.0 - SHARE);
        while steps > 0 {
            if steps & 1 != 0 {
                left *= square;
            }
            square *= square;
            steps >>= 1;
        }
        self.final_c + (self.temperature_c - self.final_c) * left
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn winding_is_warm_after_its_time_constant() {
        for (current, expected_c) in [(0.0, 25.0), (0.5, 25.0 + 20.0 * 0.632), (1.0, 25.0 + 80.0 * 0.632)] {
            let mut winding = Winding::default();
            winding.step(current * current, 25.0);
            assert!((winding.temperature_c(15_000_000) - expected_c).abs() < 0.01, "{current}");
            assert!((winding.temperature_c(u64::MAX) - winding.final_c).abs() < 1e-9, "{current}");
        }
    }

    #[test]
    fn rest_is_as_warm_as_its_steps() {
        let (mut stepped, mut rested) = (Winding::default(), Winding::default());
        (0..10_001).for_each(|_| stepped.step(0.8, 40.0));
        rested.step(0.8, 40.0);
        rested.pass(10_000);
        assert!((stepped.temperature_c - rested.temperature_c).abs() < 1e-9);
    }
}
