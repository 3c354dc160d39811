//! The transformations of Clarke and Park, which keep amplitudes.

/// 1/sqrt(3) with 16 fraction bits.
const INV_SQRT_3_Q16: i64 = 37_837;

/// A vector in the frame of the stator: `alpha` points along phase A, `beta` a quarter turn ahead.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AlphaBeta {
    /// Along phase A.
    pub alpha: i32,
    /// A quarter electrical turn ahead.
    pub beta: i32,
}

/// A vector in the frame of the rotor: `d` along the magnet (flux), `q` a quarter turn ahead (torque).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dq {
    /// Flux.
    pub d: i32,
    /// Torque.
    pub q: i32,
}

impl AlphaBeta {
    /// Clarke transformation of the currents of phases A and B, from -32768 to 32767 each; C is what the two leave. The
    /// worst error is 1.
    #[inline]
    pub fn from_phases([a, b]: [i32; 2]) -> Self {
        let beta = (i64::from(a + 2 * b) * INV_SQRT_3_Q16 + (1 << 15)) >> 16;
        Self { alpha: a, beta: beta as i32 }
    }

    /// Park transformation; `angle` is the [`sin_cos`](super::sin_cos) of the rotor. Components from -65536 to 65536;
    /// the worst error against exact sines is 2.
    #[inline]
    pub fn to_rotor(self, angle: (i32, i32)) -> Dq {
        let (sin, cos) = angle;
        Dq { d: turned(self.alpha, cos, self.beta, sin), q: turned(self.beta, cos, self.alpha, -sin) }
    }
}

impl Dq {
    /// Inverse Park transformation; ranges and error as of [`AlphaBeta::to_rotor`].
    #[inline]
    pub fn to_stator(self, angle: (i32, i32)) -> AlphaBeta {
        let (sin, cos) = angle;
        AlphaBeta { alpha: turned(self.d, cos, self.q, -sin), beta: turned(self.d, sin, self.q, cos) }
    }
}

/// `x * a + y * b`, the factors with 15 fraction bits, rounded.
#[inline]
fn turned(x: i32, a: i32, y: i32, b: i32) -> i32 {
    ((i64::from(x) * i64::from(a) + i64::from(y) * i64::from(b) + (1 << 14)) >> 15) as i32
}

#[cfg(test)]
mod tests {
    use super::super::sin_cos;
    use super::*;

    const TAU: f64 = core::f64::consts::TAU;

    #[test]
    fn clarke_gives_amplitude_and_angle_of_three_sines() {
        let mut worst = 0.0_f64;
        for a in (-32_768..=32_767).step_by(331) {
            for b in (-32_768..=32_767).step_by(173) {
                let vector = AlphaBeta::from_phases([a, b]);
                assert_eq!(vector.alpha, a);
                worst = worst.max((f64::from(vector.beta) - f64::from(a + 2 * b) / 3.0_f64.sqrt()).abs());
            }
        }
        assert!((0.5..=1.0).contains(&worst), "{worst}");
    }

    #[test]
    fn park_and_its_inverse_are_as_exact_as_stated() {
        let mut worst = 0.0_f64;
        for angle in (i16::MIN..=i16::MAX).step_by(7) {
            let exact = f64::from(angle) * TAU / 65_536.0;
            for (x, y) in [(65_536, -65_536), (65_536, 65_536), (-65_536, 12_345), (1_000, 1)] {
                let (sin, cos) = exact.sin_cos();
                let (fx, fy) = (f64::from(x), f64::from(y));
                let rotor = AlphaBeta { alpha: x, beta: y }.to_rotor(sin_cos(angle));
                let stator = Dq { d: x, q: y }.to_stator(sin_cos(angle));
                for (got, exact) in [
                    (rotor.d, fx * cos + fy * sin),
                    (rotor.q, fy * cos - fx * sin),
                    (stator.alpha, fx * cos - fy * sin),
                    (stator.beta, fx * sin + fy * cos),
                ] {
                    worst = worst.max((f64::from(got) - exact).abs());
                }
            }
        }
        assert!((1.9..=2.0).contains(&worst), "{worst}");
    }
}
