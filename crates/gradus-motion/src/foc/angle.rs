//! Sine and cosine of an electrical angle.

/// One, and the coefficients of the series below, with 30 fraction bits.
const ONE: i64 = 1 << 30;

/// Radians, 28 fraction bits, in a turn.
const TAU_Q28: i64 = 1_686_629_713;

/// Sine and cosine of `angle_q16` (65536 a turn), 32768 standing for one.
///
/// Exact at multiples of a quarter turn. The worst error is 0.51, which is 1.6e-5 of one; half of a step is rounding.
#[inline]
pub fn sin_cos(angle_q16: i16) -> (i32, i32) {
    let turn = angle_q16 as u16;
    let quadrant = turn.wrapping_add(1 << 13) >> 14;
    let within = turn.wrapping_sub(quadrant << 14) as i16;
    let (sin, cos) = near_zero(within);
    match quadrant & 3 {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

/// The same within an eighth of a turn to either side of zero, by the Taylor series.
#[inline]
fn near_zero(angle_q16: i16) -> (i32, i32) {
    let x = (i64::from(angle_q16) * TAU_Q28) >> 14;
    let square = mul(x, x);
    // 1 - square * part * inner
    let term = |part: i64, inner: i64| ONE - mul(mul(square, ONE / part), inner);
    let sin = mul(x, term(6, term(20, term(42, ONE))));
    let cos = term(2, term(12, term(30, term(56, ONE))));
    (rounded(sin), rounded(cos))
}

#[inline]
fn mul(a: i64, b: i64) -> i64 {
    (a * b) >> 30
}

/// From 30 fraction bits to 15.
#[inline]
fn rounded(value: i64) -> i32 {
    ((value + (1 << 14)) >> 15) as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn worst_error_over_all_angles_is_as_stated() {
        let mut worst = 0.0_f64;
        for angle in i16::MIN..=i16::MAX {
            let (sin, cos) = sin_cos(angle);
            let (exact_sin, exact_cos) = (f64::from(angle) * core::f64::consts::TAU / 65_536.0).sin_cos();
            worst = worst.max((f64::from(sin) - exact_sin * 32_768.0).abs());
            worst = worst.max((f64::from(cos) - exact_cos * 32_768.0).abs());
        }
        assert!((0.5..=0.51).contains(&worst), "{worst}");
    }

    #[test]
    fn quarters_are_exact() {
        let quarters = [0, 0x4000, i16::MIN, -0x4000].map(sin_cos);
        assert_eq!(quarters, [(0, 32_768), (32_768, 0), (0, -32_768), (-32_768, 0)]);
    }
}
