//! Voltages as duties of a bridge: circular limit and space-vector modulation.

use super::vector::{AlphaBeta, Dq};

/// The largest voltage, by its amplitude: a phase amplitude of supply / sqrt(3), which is all that space-vector
/// modulation can make.
pub const FULL_VOLTAGE: i32 = 32_767;

/// Duties of the half bridges A, B and C: how long the upper switch is on, from 0 to 32768 (always).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Duties {
    /// Phases A, B, C.
    pub q15: [u16; 3],
}

/// Half of the time up.
const HALF: i32 = 1 << 14;

/// Duty steps in a step of voltage along phase A: 32768 / (32767 sqrt(3)), 16 fraction bits; and along beta, sqrt(3)/2
/// of it.
const ALONG_A_Q16: i64 = 37_838;
const ALONG_BETA_Q16: i64 = 32_769;

impl Duties {
    /// All half bridges at half: no voltage between phases.
    pub const ZERO: Self = Self { q15: [HALF as u16; 3] };

    /// Space-vector modulation: sines with the third harmonic that keeps the highest and the lowest phase equally far
    /// from the rails.
    ///
    /// The amplitude may be up to [`FULL_VOLTAGE`]; duties that would go beyond the rails stop there. The worst error
    /// of the voltage between two phases is 1.6 of 32768 of the supply.
    #[inline]
    pub fn three_phase(voltage: AlphaBeta) -> Self {
        let along_a = i64::from(voltage.alpha) * ALONG_A_Q16;
        let along_beta = i64::from(voltage.beta) * ALONG_BETA_Q16;
        let [a, b, c] = [along_a, along_beta - along_a / 2, -along_beta - along_a / 2];
        let middle = (a.max(b).max(c) + a.min(b).min(c)) / 2;
        let duty = |phase: i64| (((phase - middle + (1 << 15)) >> 16) + i64::from(HALF)).clamp(0, 1 << 15) as u16;
        Self { q15: [duty(a), duty(b), duty(c)] }
    }

    /// A direct-current motor between A and B: [`FULL_VOLTAGE`] gives it the whole supply. Voltages beyond stop there.
    /// The worst error is 1 of 32768 of the supply.
    #[inline]
    pub fn single_phase(voltage: i32) -> Self {
        let half = (voltage.clamp(-FULL_VOLTAGE, FULL_VOLTAGE) + voltage.signum()) / 2;
        Self { q15: [(HALF + half) as u16, (HALF - half) as u16, HALF as u16] }
    }
}

/// Shortens a vector to [`FULL_VOLTAGE`], keeping its direction; true if that was needed. Components from -32767 to
/// 32767.
///
/// The shortened vector is never too long, and at most 3 too short.
#[inline]
pub fn limit_to_circle(vector: Dq) -> (Dq, bool) {
    let square = i64::from(vector.d) * i64::from(vector.d) + i64::from(vector.q) * i64::from(vector.q);
    if square <= i64::from(FULL_VOLTAGE) * i64::from(FULL_VOLTAGE) {
        return (vector, false);
    }
    let factor = inverse_sqrt_q30((square * RATIO_Q30) >> 30);
    let scaled = |component: i32| {
        let magnitude = (i64::from(component.abs()) * factor) >> 30;
        magnitude as i32 * component.signum()
    };
    (Dq { d: scaled(vector.d), q: scaled(vector.q) }, true)
}

/// 2^30 / 32767^2 with 30 fraction bits, rounded up.
const RATIO_Q30: i64 = (1_i64 << 60) / (32_767 * 32_767) + 1;

/// 1/sqrt(x) for x from 1 to 2, both with 30 fraction bits: a straight line and two steps of Newton's, which come from
/// below.
#[inline]
fn inverse_sqrt_q30(x: i64) -> i64 {
    const THREE_HALVES: i64 = 3 << 29;
    let line = 1_368_377_000 - ((x * 314_490_000) >> 30);
    let newton = |y: i64| (y * (THREE_HALVES - ((((x * y) >> 30) * y) >> 31))) >> 30;
    newton(newton(line))
}

#[cfg(test)]
mod tests {
    use super::super::sin_cos;
    use super::*;

    /// Voltages A - B and B - C in steps of 1/32768 of the supply.
    fn between_phases(duties: Duties) -> [f64; 2] {
        let [a, b, c] = duties.q15.map(f64::from);
        [a - b, b - c]
    }

    #[test]
    fn voltages_between_phases_are_as_exact_as_stated() {
        let mut worst = 0.0_f64;
        for angle in (i16::MIN..=i16::MAX).step_by(13) {
            for amplitude in [0, 1, 1_000, 20_000, 32_767] {
                let (sin, cos) = sin_cos(angle);
                let voltage = AlphaBeta { alpha: amplitude * cos / 32_768, beta: amplitude * sin / 32_768 };
                let [ab, bc] = between_phases(Duties::three_phase(voltage));
                let (alpha, beta) = (f64::from(voltage.alpha), f64::from(voltage.beta));
                let unit = 32_768.0 / (32_767.0 * 3.0_f64.sqrt());
                let exact_ab = unit * (1.5 * alpha - 0.75_f64.sqrt() * beta);
                let exact_bc = unit * 3.0_f64.sqrt() * beta;
                worst = worst.max((ab - exact_ab).abs()).max((bc - exact_bc).abs());
            }
        }
        assert!((1.0..=1.6).contains(&worst), "{worst}");
    }

    #[test]
    fn full_amplitude_touches_both_rails_and_no_more() {
        let duties = Duties::three_phase(AlphaBeta { alpha: 0, beta: FULL_VOLTAGE });
        assert_eq!(duties.q15, [16_384, 32_768, 0]);
        let beyond = Duties::three_phase(AlphaBeta { alpha: 65_536, beta: -65_536 });
        assert_eq!(beyond.q15, [32_768, 0, 32_768]);
        assert_eq!(Duties::three_phase(AlphaBeta::default()), Duties::ZERO);
    }

    #[test]
    fn single_phase_spreads_the_voltage_over_two_half_bridges() {
        for (voltage, duties) in
            [(0, [16_384, 16_384]), (32_767, [32_768, 0]), (-32_767, [0, 32_768]), (99_999, [32_768, 0])]
        {
            assert_eq!(Duties::single_phase(voltage).q15[..2], duties, "{voltage}");
        }
        let error =
            |voltage: i32| between_phases(Duties::single_phase(voltage))[0] - f64::from(voltage) * 32_768.0 / 32_767.0;
        let worst = (-32_767..=32_767).map(|voltage| error(voltage).abs()).fold(0.0, f64::max);
        assert!((0.9..=1.0).contains(&worst), "{worst}");
    }

    #[test]
    fn vector_outside_the_circle_is_shortened_to_it() {
        let mut worst = 0.0_f64;
        for d in (-32_767..=32_767).step_by(211) {
            for q in [-32_767, -30_000, -1, 0, 5_000, 23_170, 32_767] {
                let (limited, shortened) = limit_to_circle(Dq { d, q });
                let length = |d: i32, q: i32| f64::from(d).hypot(f64::from(q));
                assert!(length(limited.d, limited.q) <= 32_767.0, "{d} {q}");
                assert_eq!(shortened, length(d, q) > 32_767.0, "{d} {q}");
                if shortened {
                    worst = worst.max(32_767.0 - length(limited.d, limited.q));
                    let cross = f64::from(limited.d) * f64::from(q) - f64::from(limited.q) * f64::from(d);
                    assert!((cross / length(d, q)).abs() < 1.5, "direction of {d} {q}");
                } else {
                    assert_eq!(limited, Dq { d, q });
                }
            }
        }
        assert!((1.0..=3.0).contains(&worst), "{worst}");
    }
}
