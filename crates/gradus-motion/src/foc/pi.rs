//! Regulators.

use super::within;

/// P and I as the user sets them, from 0 to 32767.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PiSettings {
    /// Proportional part, 256 for one.
    pub p: u16,
    /// Integral part; what it stands for depends on the regulator.
    pub i: u16,
}

/// A PI regulator's settings for each cycle: `output = P e / 256 + sum of I e / 65536`, where the sum has a new term
/// every 32 us for flux and torque and every 256 us for the velocity. A cycle adds its share of a term.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PiGains {
    p_q8: i64,
    i_per_cycle_q32: i64,
}

/// Terms of the integral in a second, times four to be whole: one each 32 us, and one each 256 us.
const QUARTER_TERMS_CURRENT: u64 = 125_000;
const QUARTER_TERMS_VELOCITY: u64 = 15_625;

impl PiGains {
    /// For flux or torque: errors in mA, output a voltage.
    ///
    /// The gain of a cycle's integral is rounded by less than 1.2e-10 (half a step of 2^-32).
    pub fn current(settings: PiSettings, pwm_hz: u32) -> Self {
        Self::new(settings, pwm_hz, QUARTER_TERMS_CURRENT)
    }

    /// For the velocity: errors in rpm, output a current in mA.
    pub fn velocity(settings: PiSettings, pwm_hz: u32) -> Self {
        Self::new(settings, pwm_hz, QUARTER_TERMS_VELOCITY)
    }

    fn new(settings: PiSettings, pwm_hz: u32, quarter_terms: u64) -> Self {
        let cycles = 4 * u64::from(pwm_hz.max(1));
        // 16 fraction bits of I, 16 more.
        let i_per_cycle_q32 = ((u64::from(settings.i) << 16) * quarter_terms + cycles / 2) / cycles;
        Self { p_q8: i64::from(settings.p), i_per_cycle_q32: i_per_cycle_q32 as i64 }
    }
}

/// Largest error that a regulator sees; more is taken for this.
const MAX_ERROR: i32 = 1 << 20;

/// What a PI regulator remembers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pi {
    integral_q32: i64,
    error: i32,
}

impl Pi {
    /// Output for this error, within `-limit..=limit` (0 to 32767). [`integrate`](Self::integrate) completes the cycle.
    ///
    /// The integral part is rounded down, the proportional as well: the output is at most 2 less than exact arithmetic
    /// gives.
    #[inline]
    pub fn output(&mut self, gains: &PiGains, error: i32, limit: i32) -> i32 {
        self.error = error.clamp(-MAX_ERROR, MAX_ERROR);
        let sum = ((gains.p_q8 * i64::from(self.error)) >> 8) + (self.integral_q32 >> 32);
        within(sum, limit.into()) as i32
    }

    /// Adds the error of this cycle to the integral, which keeps within the output's limit. When the `output` was
    /// `limited`, an error of the same sign adds nothing: the integral does not wind up.
    #[inline]
    pub fn integrate(&mut self, gains: &PiGains, output: i32, limited: bool, limit: i32) {
        let winds_up = limited && (i64::from(self.error) * i64::from(output)) > 0;
        if !winds_up {
            let limit_q32 = i64::from(limit) << 32;
            let sum = self.integral_q32 + gains.i_per_cycle_q32 * i64::from(self.error);
            self.integral_q32 = within(sum, limit_q32);
        }
    }

    /// One cycle of a regulator that stands alone.
    #[inline]
    pub fn cycle(&mut self, gains: &PiGains, error: i32, limit: i32) -> i32 {
        let output = self.output(gains, error, limit);
        self.integrate(gains, output, output.abs() >= limit, limit);
        output
    }

    /// Sets the integral so that the output is `output` as long as there is no error.
    pub fn preset(&mut self, output: i32) {
        self.integral_q32 = i64::from(output) << 32;
    }

    /// Error of the last cycle.
    pub fn error(&self) -> i32 {
        self.error
    }

    /// The integral in steps of 1/65536 of the output.
    pub fn error_sum(&self) -> i32 {
        (self.integral_q32 >> 16) as i32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMIT: i32 = 32_767;

    #[test]
    fn default_gains_mean_what_they_mean_on_the_module() {
        let defaults = PiSettings { p: 300, i: 300 };
        for pwm_hz in [25_000, 50_000, 100_000] {
            for (gains, term_us) in
                [(PiGains::current(defaults, pwm_hz), 32.0), (PiGains::velocity(defaults, pwm_hz), 256.0)]
            {
                let mut pi = Pi::default();
                assert_eq!(pi.cycle(&gains, 1_000, LIMIT), 1_171, "P: 300 * 1000 / 256");
                for _ in 1..pwm_hz / 100 {
                    pi.cycle(&gains, 1_000, LIMIT);
                }
                let exact = 1_171.875 + (300.0 * 1_000.0 / 65_536.0) * (10_000.0 / term_us);
                let got = pi.output(&gains, 1_000, LIMIT);
                assert!((f64::from(got) - exact).abs() < 2.0, "{got} {exact} after 10 ms at {pwm_hz} Hz");
            }
        }
    }

    #[test]
    fn integral_leaves_the_limit_as_soon_as_the_error_turns() {
        let gains = PiGains::current(PiSettings { p: 0, i: 32_767 }, 25_000);
        let mut pi = Pi::default();
        for _ in 0..10_000 {
            assert!(pi.cycle(&gains, 20_000, 5_000) <= 5_000);
        }
        assert_eq!(pi.cycle(&gains, 20_000, 5_000), 5_000);
        pi.cycle(&gains, -100, 5_000);
        assert!(pi.cycle(&gains, -100, 5_000) < 5_000);
    }

    #[test]
    fn extreme_errors_and_gains_keep_the_limit() {
        let gains = PiGains::current(PiSettings { p: 32_767, i: 32_767 }, 25_000);
        let mut pi = Pi::default();
        for error in [i32::MAX, i32::MIN, 0, -1, i32::MIN, i32::MAX] {
            for _ in 0..1_000 {
                assert!(pi.cycle(&gains, error, LIMIT).abs() <= LIMIT);
            }
        }
    }

    #[test]
    fn preset_regulator_begins_with_that_output() {
        let gains = PiGains::velocity(PiSettings { p: 300, i: 100 }, 25_000);
        let mut pi = Pi::default();
        pi.preset(-1_234);
        assert_eq!(pi.cycle(&gains, 0, LIMIT), -1_234);
        assert_eq!(pi.error_sum(), -1_234 << 16);
    }
}
