//! Speeds measured on counters: the encoder's (axis parameters 131 and 132), and what the ramp has commanded.
//!
//! While an axis has control ticks its counters are sampled every millisecond. The speed of the moment is the count of the
//! latest 8 ms, the averaged speed is that behind a low-pass. Both are made pps only when somebody reads them, so that
//! measuring costs next to nothing; when the axis rests it costs nothing. Of a resting axis the speed is that since its
//! latest sample: 0 if nobody turns the shaft.
//!
//! Where the manual is silent: the low-pass takes a step of `2^-filter` (axis parameter 137) each interval (138, at least
//! 256) and wait (136), in clocks of 16 MHz.

/// Time between two samples, a multiple of the control tick.
const SAMPLE_US: u64 = 1_000;

/// Samples in a window.
const SAMPLES: usize = 8;

const WINDOW_US: u64 = SAMPLES as u64 * SAMPLE_US;
const WINDOWS_PER_S: i128 = 1_000_000 / WINDOW_US as i128;

/// Clocks of the motion controller in a microsecond.
const CLOCKS_PER_US: u64 = 16;

/// Counts a window, 24 fractional bits.
type Rate = i64;
const RATE_BITS: u32 = 24;

/// A low-pass of first order.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LowPass {
    /// What is left of the old mean after a sample, 32 fractional bits.
    kept_q32: u64,
}

impl LowPass {
    /// The filter of axis parameters 136 to 138; its time constant comes out within 1/16 us.
    pub(crate) fn new(wait: u32, filter: u32, interval: u32) -> Self {
        let clocks = u64::from(interval.max(256).saturating_add(wait)) << filter.min(15);
        let sample_clocks = SAMPLE_US * CLOCKS_PER_US;
        Self { kept_q32: (clocks << 32).checked_div(clocks.saturating_add(sample_clocks)).unwrap_or(0) }
    }

    /// The mean after a time of samples that were all `rate`.
    fn settle(self, mean: Rate, rate: Rate, samples: u64) -> Rate {
        let kept = i128::from(power_q32(self.kept_q32, samples));
        rate.wrapping_add(((i128::from(mean.wrapping_sub(rate)) * kept) >> 32) as Rate)
    }
}

/// A number of at most 1 to the power of `exponent`, 32 fractional bits.
fn power_q32(base: u64, mut exponent: u64) -> u64 {
    let times = |a: u64, b: u64| ((u128::from(a) * u128::from(b)) >> 32) as u64;
    let (mut result, mut square) = (1 << 32, base);
    while exponent > 0 {
        if exponent & 1 != 0 {
            result = times(result, square);
        }
        square = times(square, square);
        exponent >>= 1;
    }
    result
}

/// The latest samples of a counter.
#[derive(Clone, Copy, Debug, Default)]
struct Window {
    /// A ring; `oldest` is the one that the next sample replaces.
    counts: [i32; SAMPLES],
    oldest: usize,
    latest: i32,
    rate: Rate,
    mean: Rate,
}

impl Window {
    /// A counter that has stood for long.
    fn standing(count: i32) -> Self {
        Self { counts: [count; SAMPLES], latest: count, ..Self::default() }
    }

    fn push(&mut self, count: i32, filter: LowPass) {
        if let Some(oldest) = self.counts.get_mut(self.oldest) {
            self.rate = i64::from(count.wrapping_sub(*oldest)) << RATE_BITS;
            *oldest = count;
        }
        self.oldest = (self.oldest + 1) % SAMPLES;
        self.latest = count;
        self.mean = filter.settle(self.mean, self.rate, 1);
    }
}

/// Speeds of the encoder and of the ramp of an axis.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Speeds {
    sampled_us: u64,
    encoder: Window,
    /// Microsteps that the ramp has gone.
    ramp: Window,
}

impl Speeds {
    /// Nothing has moved for long.
    pub(crate) fn standing(now: u64, encoder: i32, ramp: i32) -> Self {
        Self { sampled_us: now, encoder: Window::standing(encoder), ramp: Window::standing(ramp) }
    }

    /// True when it is time for a sample.
    #[inline]
    pub(crate) fn are_due(&self, now: u64) -> bool {
        now.saturating_sub(self.sampled_us) >= SAMPLE_US
    }

    /// Takes a sample. The first one after a rest begins anew.
    pub(crate) fn sample(&mut self, now: u64, encoder: i32, ramp: i32, filter: LowPass) {
        if self.rest_us(now).is_some() {
            *self = Self::standing(now, encoder, ramp);
            return;
        }
        self.sampled_us = now;
        self.encoder.push(encoder, filter);
        self.ramp.push(ramp, filter);
    }

    /// How long no sample has been taken, if the axis rests.
    fn rest_us(&self, now: u64) -> Option<u64> {
        Some(now.saturating_sub(self.sampled_us)).filter(|time| *time >= 2 * SAMPLE_US)
    }

    /// Speed of the encoder at this moment in pps, with the counter at `encoder` and `scale_q32` microsteps a count.
    pub(crate) fn now_pps(&self, now: u64, encoder: i32, scale_q32: i64) -> i32 {
        pps(self.rate(now, encoder), scale_q32)
    }

    /// Averaged speed of the encoder in pps.
    pub(crate) fn mean_pps(&self, now: u64, encoder: i32, scale_q32: i64, filter: LowPass) -> i32 {
        let samples = self.rest_us(now).unwrap_or(0) / SAMPLE_US;
        pps(filter.settle(self.encoder.mean, self.rate(now, encoder), samples), scale_q32)
    }

    fn rate(&self, now: u64, encoder: i32) -> Rate {
        let Some(rest_us) = self.rest_us(now) else { return self.encoder.rate };
        let counts = i128::from(encoder.wrapping_sub(self.encoder.latest)) << RATE_BITS;
        (counts * i128::from(WINDOW_US)).checked_div(i128::from(rest_us)).unwrap_or(0) as Rate
    }

    /// How much faster the ramp is than the encoder, both averaged alike, in pps.
    pub(crate) fn deviation_pps(&self, scale_q32: i64) -> i32 {
        pps(self.ramp.mean, 1 << 32).saturating_sub(pps(self.encoder.mean, scale_q32))
    }
}

/// A rate of counts of `scale_q32` microsteps each as pps.
fn pps(rate: Rate, scale_q32: i64) -> i32 {
    let pps = i128::from(rate) * i128::from(scale_q32) * WINDOWS_PER_S;
    let pps = (pps + (1 << (RATE_BITS + 31))) >> (RATE_BITS + 32);
    pps.clamp(i128::from(i32::MIN), i128::from(i32::MAX)) as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One microstep a count.
    const ONE: i64 = 1 << 32;

    /// A counter that goes on by `counts` every millisecond.
    fn after(samples: u64, counts: i32, filter: LowPass) -> Speeds {
        let mut speeds = Speeds::standing(0, 0, 0);
        for sample in 1..=samples {
            speeds.sample(sample * 1_000, counts * sample as i32, 0, filter);
        }
        speeds
    }

    #[test]
    fn low_pass_has_the_time_constant_of_its_parameters() {
        // Time constant in us; after that time the mean of a step is 63.2 %, within half a sample's share.
        for (wait, filter, interval, constant_us) in
            [(0, 7, 500, 4_000), (0, 7, 0, 2_048), (255, 15, 65_535, 134_737_920), (0, 10, 16_000, 1_024_000)]
        {
            let low_pass = LowPass::new(wait, filter, interval);
            let mean = low_pass.settle(0, 1 << 40, constant_us / 1_000) as f64 / (1_u64 << 40) as f64;
            let tolerance = 0.5 / (constant_us as f64 / 1e3);
            assert!((mean - 0.632).abs() < tolerance.max(0.001), "{wait} {filter} {interval}: {mean}");
        }
    }

    #[test]
    fn speed_of_the_moment_is_that_of_eight_milliseconds() {
        for (samples, pps) in [(0, 0), (1, 250), (4, 1_000), (8, 2_000), (50, 2_000)] {
            let speeds = after(samples, 2, LowPass::default());
            assert_eq!(speeds.now_pps(samples * 1_000, 2 * samples as i32, ONE), pps, "after {samples} ms");
        }
    }

    #[test]
    fn speeds_keep_their_sign_and_end_at_the_ends_of_the_range() {
        for (counts, scale, pps) in [
            (-2, ONE, -2_000),
            (2, -ONE, -2_000),
            (2, 0, 0),
            (i32::MAX / 8, ONE << 8, i32::MAX),
            (i32::MIN / 8, ONE << 8, i32::MIN),
        ] {
            assert_eq!(after(8, counts, LowPass::default()).now_pps(8_000, counts.wrapping_mul(8), scale), pps);
        }
    }

    #[test]
    fn mean_of_a_resting_axis_dies_away() {
        let filter = LowPass::new(0, 7, 500);
        let speeds = after(100, 2, filter);
        let mean = |now| speeds.mean_pps(now, 200, ONE, filter);
        assert_eq!(mean(100_000), 2_000);
        // The share of a sample is 1/5.
        assert!((mean(104_000) - 819).abs() <= 1, "{}", mean(104_000));
        assert_eq!([mean(200_000), mean(u64::MAX)], [0, 0]);
    }

    #[test]
    fn shaft_that_is_turned_at_rest_has_the_speed_since_then() {
        let filter = LowPass::new(0, 7, 500);
        let speeds = Speeds::standing(0, 0, 0);
        assert_eq!(speeds.now_pps(100_000, 4_096, ONE), 40_960);
        assert_eq!(speeds.mean_pps(100_000, 4_096, ONE, filter), 40_960);
    }
}
