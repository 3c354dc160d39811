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

/// Fraction bits of a velocity in rpm, and of the error that the velocity regulator sees.
pub(crate) const VELOCITY_BITS: u32 = 16;

/// A PI regulator's settings for each cycle: `output = P e / 256 + sum of I e / 65536`, where the sum has a new term
/// every 32 us for flux and torque and every 256 us for the velocity. A cycle adds its share of a term. The error `e` has
/// `FRACTION` fraction bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PiGains<const FRACTION: u32 = 0> {
    p_q8: i64,
    i_per_cycle_q32: i64,
}

/// Gains of a velocity regulator.
pub type VelocityGains = PiGains<VELOCITY_BITS>;

/// Terms of the integral in a second, times four to be whole: one each 32 us, and one each 256 us.
const QUARTER_TERMS_CURRENT: u64 = 125_000;
const QUARTER_TERMS_VELOCITY: u64 = 15_625;

/// Slowest PWM of the module.
const SLOWEST_HZ: u32 = 25_000;

impl PiGains {
    /// For flux or torque: errors in mA, output a voltage.
    ///
    /// The gain of a cycle's integral is rounded by less than 1.2e-10 (half a step of 2^-32).
    pub fn current(settings: PiSettings, pwm_hz: u32) -> Self {
        Self::new(settings, pwm_hz, QUARTER_TERMS_CURRENT)
    }
}

impl VelocityGains {
    /// For the velocity: errors in 1/65536 rpm, output a current in mA.
    pub fn velocity(settings: PiSettings, pwm_hz: u32) -> Self {
        Self::new(settings, pwm_hz, QUARTER_TERMS_VELOCITY)
    }
}

impl<const FRACTION: u32> PiGains<FRACTION> {
    fn new(settings: PiSettings, pwm_hz: u32, quarter_terms: u64) -> Self {
        let cycles = 4 * u64::from(pwm_hz.max(SLOWEST_HZ));
        // 16 fraction bits of I, 16 more.
        let i_per_cycle_q32 = ((u64::from(settings.i) << 16) * quarter_terms + cycles / 2) / cycles;
        Self { p_q8: i64::from(settings.p), i_per_cycle_q32: i_per_cycle_q32 as i64 }
    }
}

/// Largest error that a regulator sees, in mA or rpm; more is taken for this.
const MAX_ERROR: i64 = 1 << 18;

/// What a PI regulator remembers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pi<const FRACTION: u32 = 0> {
    integral_q32: i64,
    error: i64,
}

/// A velocity regulator.
pub type VelocityPi = Pi<VELOCITY_BITS>;

impl<const FRACTION: u32> Pi<FRACTION> {
    /// Output for this error, within `-limit..=limit` (0 to 32767). [`integrate`](Self::integrate) completes the cycle.
    ///
    /// The integral part is rounded down, the proportional as well: the output is at most 2 less than exact arithmetic
    /// gives.
    #[inline]
    pub fn output(&mut self, gains: &PiGains<FRACTION>, error: i64, limit: i32) -> i32 {
        self.error = within(error, MAX_ERROR << FRACTION);
        let sum = ((gains.p_q8 * self.error) >> (8 + FRACTION)) + (self.integral_q32 >> 32);
        within(sum, limit.into()) as i32
    }

    /// Adds the error of this cycle to the integral, which keeps within the output's limit. When the `output` was
    /// `limited`, an error of the same sign adds nothing: the integral does not wind up.
    #[inline]
    pub fn integrate(&mut self, gains: &PiGains<FRACTION>, output: i32, limited: bool, limit: i32) {
        let winds_up = limited && (self.error * i64::from(output)) > 0;
        if !winds_up {
            let limit_q32 = i64::from(limit) << 32;
            let sum = self.integral_q32 + ((gains.i_per_cycle_q32 * self.error) >> FRACTION);
            self.integral_q32 = within(sum, limit_q32);
        }
    }

    /// One cycle of a regulator that stands alone.
    #[inline]
    pub fn cycle(&mut self, gains: &PiGains<FRACTION>, error: i64, limit: i32) -> i32 {
        let output = self.output(gains, error, limit);
        self.integrate(gains, output, output.abs() >= limit, limit);
        output
    }

    /// Sets the integral so that the output is `output` as long as there is no error.
    pub fn preset(&mut self, output: i32) {
        self.integral_q32 = i64::from(output) << 32;
    }

    /// Error of the last cycle in mA or rpm, rounded down.
    pub fn error(&self) -> i32 {
        (self.error >> FRACTION) as i32
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
            step(PiGains::current(defaults, pwm_hz), pwm_hz, 32.0);
            step(PiGains::velocity(defaults, pwm_hz), pwm_hz, 256.0);
        }
    }

    /// An error of 1000 for 10 ms at P and I of 300.
    fn step<const FRACTION: u32>(gains: PiGains<FRACTION>, pwm_hz: u32, term_us: f64) {
        let error = 1_000 << FRACTION;
        let mut pi = Pi::default();
        assert_eq!(pi.cycle(&gains, error, LIMIT), 1_171, "P: 300 * 1000 / 256");
        for _ in 1..pwm_hz / 100 {
            pi.cycle(&gains, error, LIMIT);
        }
        let exact = 1_171.875 + (300.0 * 1_000.0 / 65_536.0) * (10_000.0 / term_us);
        let got = pi.output(&gains, error, LIMIT);
        assert!((f64::from(got) - exact).abs() < 2.0, "{got} {exact} after 10 ms at {pwm_hz} Hz");
        assert_eq!(pi.error(), 1_000);
    }

    #[test]
    fn velocity_error_of_a_fraction_of_an_rpm_is_not_lost() {
        let gains = PiGains::velocity(PiSettings { p: 300, i: 100 }, 25_000);
        let mut pi = VelocityPi::default();
        // 0.01 rpm for 10 s: 0.01 * 100 / 65536 mA each 256 us.
        for _ in 0..250_000 {
            pi.cycle(&gains, 655, LIMIT);
        }
        let exact = 655.0 / 65_536.0 * 100.0 / 65_536.0 * 10.0 / 256e-6;
        assert!((f64::from(pi.error_sum()) / 65_536.0 - exact).abs() < 0.001, "{} {exact}", pi.error_sum());
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
        let velocity_gains = PiGains::velocity(PiSettings { p: 32_767, i: 32_767 }, 1);
        let mut velocity = VelocityPi::default();
        for error in [i64::MAX, i64::MIN, 0, -1, i64::MIN, i64::MAX] {
            for _ in 0..1_000 {
                assert!(pi.cycle(&gains, error, LIMIT).abs() <= LIMIT);
                assert!(velocity.cycle(&velocity_gains, error, LIMIT).abs() <= LIMIT);
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
