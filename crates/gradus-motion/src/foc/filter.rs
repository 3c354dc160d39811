//! First-order low-pass.

/// A low-pass of first order (PT1): each step comes nearer to the input by 1/2^shift of the distance.
///
/// Its time constant is 2^shift steps. Inputs up to 2^23; at rest the output is the input, exactly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pt1 {
    shift: u32,
    /// The output times 2^shift.
    sum: i64,
}

impl Pt1 {
    /// A filter at zero. `shift` from 0 (no filter) to 31.
    pub const fn new(shift: u32) -> Self {
        Self { shift: if shift < 32 { shift } else { 31 }, sum: 0 }
    }

    /// Takes an input and gives the output.
    #[inline]
    pub fn step(&mut self, input: i32) -> i32 {
        let input = i64::from(input);
        // Rounded away from the sum, so that it arrives.
        let distance = (input << self.shift) - self.sum;
        self.sum += (distance + distance.signum() * ((1 << self.shift) - 1)) / (1 << self.shift);
        self.output()
    }

    /// The output, rounded to the nearest.
    #[inline]
    pub fn output(&self) -> i32 {
        ((self.sum + (1 << self.shift >> 1)) >> self.shift) as i32
    }

    /// Starts again at `value`.
    pub fn preset(&mut self, value: i32) {
        self.sum = i64::from(value) << self.shift;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn step_response_is_exponential_and_arrives() {
        for shift in [0, 1, 2, 3, 4, 8] {
            for target in [1, -1, 7, 3_000, -3_000, 8_388_607] {
                let mut filter = Pt1::new(shift);
                for _ in 0..1 << shift {
                    filter.step(target);
                }
                let exact = f64::from(target) * (1.0 - (1.0 - 0.5_f64.powi(shift as i32)).powi(1 << shift));
                assert!((f64::from(filter.output()) - exact).abs() < 1.2, "{} {exact}", filter.output());
                for _ in 0..40 << shift {
                    filter.step(target);
                }
                assert_eq!(filter.output(), target, "shift {shift}");
            }
        }
    }

    #[test]
    fn preset_filter_stays() {
        let mut filter = Pt1::new(3);
        filter.preset(-77);
        assert_eq!((filter.output(), filter.step(-77)), (-77, -77));
    }
}
