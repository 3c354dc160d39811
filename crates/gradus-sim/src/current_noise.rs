//! Noise of the converters that measure a servo's currents.

/// Two converters with normally distributed noise from a seed.
///
/// In control ticks they convert once a PWM period, however often they are read. At rest each reading is a conversion of its
/// own, with dice of its own; so is that of the first period after a rest.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct CurrentNoise {
    /// Standard deviation in steps.
    steps: f64,
    periods: Dice,
    glances: Dice,
    /// Noise of the period that is under way.
    latched: [f64; 2],
}

impl CurrentNoise {
    pub(crate) fn new(steps: f64, seed: u64) -> Self {
        let mut noise = Self { steps, periods: Dice(seed), glances: Dice(!seed), latched: [0.0; 2] };
        noise.advance();
        noise
    }

    /// The next PWM period.
    #[inline]
    pub(crate) fn advance(&mut self) {
        self.latched = self.periods.pair(self.steps);
    }

    /// What is added to the readings.
    #[inline]
    pub(crate) fn read(&mut self, ticking: bool) -> [f64; 2] {
        if ticking { self.latched } else { self.glances.pair(self.steps) }
    }
}

/// A generator of random numbers (SplitMix64).
#[derive(Clone, PartialEq, Debug)]
struct Dice(u64);

impl Dice {
    #[inline]
    fn pair(&mut self, deviation: f64) -> [f64; 2] {
        if deviation == 0.0 { [0.0; 2] } else { [self.normal() * deviation, self.normal() * deviation] }
    }

    /// Nearly normally distributed with deviation 1, never beyond 3.5: the sum of four dice with 65536 sides.
    #[inline]
    fn normal(&mut self) -> f64 {
        let bits = self.next();
        let sum = (bits & 0xFFFF) + (bits >> 16 & 0xFFFF) + (bits >> 32 & 0xFFFF) + (bits >> 48);
        // Four uniform numbers from 0 to 1 have the mean 2 and the variance 1/3.
        (sum as f64 * (1.0 / 65_536.0) - 2.0) * 1.732_050_807_568_877_2
    }

    #[inline]
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ self.0 >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ mixed >> 31
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_has_its_deviation_and_no_mean() {
        let mut noise = CurrentNoise::new(2.0, 7);
        let readings: Vec<f64> = (0..50_000).flat_map(|_| noise.read(false)).collect();
        let mean = readings.iter().sum::<f64>() / readings.len() as f64;
        let deviation = (readings.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / readings.len() as f64).sqrt();
        assert!(mean.abs() < 0.03 && (deviation - 2.0).abs() < 0.03, "{mean} {deviation}");
        assert_eq!(CurrentNoise::new(0.0, 7).read(false), [0.0; 2]);
    }

    #[test]
    fn period_has_one_reading_whatever_was_read_at_rest() {
        let [mut noise, mut other] = [CurrentNoise::new(1.0, 7), CurrentNoise::new(1.0, 7)];
        assert_eq!(noise.read(true), noise.read(true));
        let at_rest = noise.read(false);
        assert_ne!(at_rest, noise.read(false));
        for _ in 0..3 {
            noise.advance();
            other.advance();
            assert_eq!(noise.read(true), other.read(true));
        }
        assert_ne!(noise.read(true), CurrentNoise::new(1.0, 8).read(true));
    }
}
