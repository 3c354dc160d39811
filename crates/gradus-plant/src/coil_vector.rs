//! The coil vector that the firmware sets, and how fast it turns.

/// Steps over which its speed is averaged: at a coarse microstep resolution it stands for many steps, and then jumps.
const WINDOW: usize = 16;

/// Angle of the coil vector in microsteps, wrapping.
#[derive(Clone, PartialEq, Debug, Default)]
pub(crate) struct CoilVector {
    pub(crate) phase: i32,
    latest: i32,
    /// Where it was in the latest steps, and which of them is the oldest.
    recent: [i32; WINDOW],
    oldest: usize,
}

impl CoilVector {
    /// Takes the vector for a step: the microsteps that it has turned since the step before, and its mean speed in
    /// microsteps a step.
    #[inline]
    pub(crate) fn step(&mut self) -> (i32, f64) {
        let latest = core::mem::replace(&mut self.latest, self.phase);
        let before = core::mem::replace(&mut self.recent[self.oldest], self.phase);
        self.oldest = (self.oldest + 1) % WINDOW;
        let turned = |since: i32| self.phase.wrapping_sub(since);
        (turned(latest), f64::from(turned(before)) * (1.0 / WINDOW as f64))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speed_is_a_mean_of_jumps_and_rests() {
        let mut vector = CoilVector { phase: i32::MAX - 100, ..CoilVector::default() };
        (0..WINDOW).for_each(|_| _ = vector.step());
        for step in 0..100 {
            let jumps = step % 4 == 0;
            vector.phase = vector.phase.wrapping_add(if jumps { 64 } else { 0 });
            let (turned, speed) = vector.step();
            assert_eq!(turned, if jumps { 64 } else { 0 });
            assert!(step < WINDOW || speed == 16.0, "{speed} after {step} steps");
        }
        (0..WINDOW).for_each(|_| _ = vector.step());
        assert_eq!(vector.step(), (0, 0.0));
    }
}
