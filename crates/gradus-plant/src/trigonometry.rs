//! Sine and cosine from additions and multiplications only: equal to the bit on every machine, which those of the platform
//! are not.

/// A quarter turn in radians.
const QUARTER: f64 = std::f64::consts::FRAC_PI_2;

/// Sine and cosine of an angle in turns, below 2^60 turns. The error is at most 1e-11 plus that of the angle.
#[inline]
pub(crate) fn sin_cos(turns: f64) -> (f64, f64) {
    let quarters = 4.0 * turns;
    let nearest = (quarters + if quarters < 0.0 { -0.5 } else { 0.5 }) as i64;
    let (sin, cos) = near_zero((quarters - nearest as f64) * QUARTER);
    match nearest & 3 {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

/// Both series up to an eighth of a turn, in radians.
#[inline]
fn near_zero(x: f64) -> (f64, f64) {
    const SIN: [f64; 5] = [1.0 / 362_880.0, -1.0 / 5_040.0, 1.0 / 120.0, -1.0 / 6.0, 1.0];
    const COS: [f64; 6] = [-1.0 / 3_628_800.0, 1.0 / 40_320.0, -1.0 / 720.0, 1.0 / 24.0, -0.5, 1.0];
    const SIN_11: f64 = -1.0 / 39_916_800.0;
    let square = x * x;
    let sin = SIN.iter().fold(SIN_11, |sum, term| sum * square + term);
    let cos = COS.iter().fold(1.0 / 479_001_600.0, |sum, term| sum * square + term);
    (sin * x, cos)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn error_is_below_its_bound() {
        for step in -40_000..40_000 {
            let turns = f64::from(step) / 7_919.0;
            let (sin, cos) = sin_cos(turns);
            let (right_sin, right_cos) = (turns * std::f64::consts::TAU).sin_cos();
            assert!((sin - right_sin).abs() < 1e-11 && (cos - right_cos).abs() < 1e-11, "{turns} turns: {sin}, {cos}");
        }
    }

    #[test]
    fn quarters_of_a_turn_are_exact() {
        let quarters = [0.0, 0.25, 0.5, 0.75, 1.0, -0.25, 1e9 + 0.5].map(sin_cos);
        let expected = [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)];
        assert_eq!(quarters, expected);
    }
}
