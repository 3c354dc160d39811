//! Random numbers that are the same each time: xorshift from a seed.

/// A source of random numbers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Noise(u32);

impl Noise {
    /// Each seed has numbers of its own.
    pub(crate) fn new(seed: u32) -> Self {
        let mixed = (seed ^ seed >> 16).wrapping_mul(0x7feb_352d);
        let mut noise = Self((mixed ^ mixed >> 15) | 1);
        (0..8).for_each(|_| _ = noise.next());
        noise
    }

    fn next(&mut self) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        self.0
    }

    /// A number from 0 to 1.
    pub(crate) fn uniform(&mut self) -> f64 {
        f64::from(self.next()) * (1.0 / 4_294_967_296.0)
    }

    /// A number with a mean of 0 and a standard deviation of 1: the sum of twelve halves of a word, at most 6.
    pub(crate) fn normal(&mut self) -> f64 {
        let sum: u32 = (0..6).map(|_| self.next()).map(|word| (word >> 16) + (word & 0xffff)).sum();
        f64::from(sum) * (1.0 / 65_536.0) - 6.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_their_mean_and_deviation() {
        for seed in 0..20 {
            let mut noise = Noise::new(seed);
            let normal: Vec<f64> = (0..10_000).map(|_| noise.normal()).collect();
            let mean = normal.iter().sum::<f64>() / 1e4;
            let square = normal.iter().map(|number| number * number).sum::<f64>() / 1e4;
            assert!(mean.abs() < 0.05 && (square.sqrt() - 1.0).abs() < 0.05, "seed {seed}: {mean}, {square}");
            let mean = (0..10_000).map(|_| noise.uniform()).sum::<f64>() / 1e4;
            assert!((mean - 0.5).abs() < 0.02, "seed {seed}: {mean}");
        }
        assert_ne!(Noise::new(1).next(), Noise::new(2).next());
    }
}
