//! What a step response is judged by.

use std::time::Duration;

/// How something came from one value to another. Times count from the step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepResponse {
    /// From 10 % to 90 % of the way; `None` if it never came so far.
    pub rise: Option<Duration>,
    /// Beyond the end, in percent of the way.
    pub overshoot_percent: f64,
    /// From when on it stays within 5 % of the way around the end; `None` if it does not at the end of the samples.
    pub settling: Option<Duration>,
}

/// Share of the way around the end in which a step has settled; its edge belongs to it, whatever the rounding.
const BAND: f64 = 0.05 + 1e-9;

impl StepResponse {
    /// Judges samples that begin with the step, `period` apart. The way is from `from` to `to`; without a way nothing
    /// can be said, and nothing rises.
    pub fn of(samples: &[f64], period: Duration, from: f64, to: f64) -> Self {
        let share = |sample: &f64| if from == to { 0.0 } else { (sample - from) / (to - from) };
        let after = |index: usize| period * index as u32;
        let reaches = |level: f64| {
            let index = samples.iter().position(|sample| share(sample) >= level)?;
            let before = index.checked_sub(1).map(|before| (before, share(&samples[before])));
            // On the straight line between the two samples around the level.
            Some(before.map_or(Duration::ZERO, |(before, low)| {
                after(before) + period.mul_f64((level - low) / (share(&samples[index]) - low))
            }))
        };
        let highest = samples.iter().map(share).fold(0.0, f64::max);
        let outside = |sample: &f64| (share(sample) - 1.0).abs() > BAND;
        let settled = samples.iter().rposition(outside).map_or(0, |last| last + 1);
        Self {
            rise: reaches(0.1).zip(reaches(0.9)).map(|(low, high)| high - low),
            overshoot_percent: (highest - 1.0).max(0.0) * 100.0,
            settling: (settled < samples.len() && from != to).then(|| after(settled)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: Duration = Duration::from_millis(1);

    fn ms(time: u64) -> Option<Duration> {
        Some(Duration::from_millis(time))
    }

    #[test]
    fn responses_of_known_shape() {
        let line: Vec<f64> = (0..=100).map(f64::from).collect();
        let swings = [0.0, 50.0, 100.0, 120.0, 90.0, 104.0, 100.0, 100.0];
        let falls: Vec<f64> = line.iter().map(|value| 500.0 - 2.0 * value).collect();
        for (samples, from, to, expected) in [
            (&line[..], 0.0, 100.0, (ms(80), 0.0, ms(95))),
            // From 0.2 to 1.8 ms, on the lines between the samples.
            (&swings, 0.0, 100.0, (Some(Duration::from_micros(1600)), 20.0, ms(5))),
            (&falls, 500.0, 300.0, (ms(80), 0.0, ms(95))),
            (&line[..50], 0.0, 100.0, (None, 0.0, None)),
            (&line, 7.0, 7.0, (None, 0.0, None)),
            (&[], 0.0, 1.0, (None, 0.0, None)),
        ] {
            let response = StepResponse::of(samples, PERIOD, from, to);
            assert!((response.overshoot_percent - expected.1).abs() < 1e-9, "{response:?}");
            assert_eq!((response.rise, response.settling), (expected.0, expected.2), "{samples:?}");
        }
    }
}
