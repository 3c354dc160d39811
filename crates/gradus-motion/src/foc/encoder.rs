//! ABN encoder: position, angle, measured velocity.

use super::turns::{CountScale, TurnCounter};

/// Longest window of the velocity measurement.
const LONGEST: usize = 32;

/// Measures velocity as the way over the last 8, 16 or 32 cycles.
///
/// The window is the shortest of these that is not shorter than a period of the module's velocity meter (4369 Hz): 0.32
/// ms at 25, 50 and 100 kHz. With 4096 counts a turn, one count there is 46 rpm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VelocityWindow {
    positions_q32: [i64; LONGEST],
    next: usize,
}

impl VelocityWindow {
    /// Binary logarithm of the window's length in cycles.
    pub(crate) fn shift(pwm_hz: u32) -> u32 {
        match pwm_hz {
            0..=34_952 => 3,
            34_953..=69_904 => 4,
            _ => 5,
        }
    }

    /// A window in which the shaft stands at `position_q32`.
    pub fn new(position_q32: i64) -> Self {
        Self { positions_q32: [position_q32; LONGEST], next: 0 }
    }

    /// Takes the position of this cycle; gives the velocity, 2^32 a turn, in a cycle. `shift` from 0 to 5.
    #[inline]
    pub fn update(&mut self, position_q32: i64, shift: u32) -> i64 {
        let window = (1_usize << shift).min(LONGEST);
        let before = self.positions_q32.get(self.next.wrapping_sub(window) % LONGEST).copied().unwrap_or(position_q32);
        if let Some(slot) = self.positions_q32.get_mut(self.next % LONGEST) {
            *slot = position_q32;
        }
        self.next = (self.next + 1) % LONGEST;
        (position_q32.wrapping_sub(before)) >> shift
    }
}

/// An incremental encoder with its counter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AbnEncoder {
    last_count: Option<i32>,
    counter: TurnCounter,
    window: VelocityWindow,
    position_q32: i64,
    velocity_q32: i64,
}

impl AbnEncoder {
    /// An encoder at position 0.
    pub fn new() -> Self {
        Self {
            last_count: None,
            counter: TurnCounter::default(),
            window: VelocityWindow::new(0),
            position_q32: 0,
            velocity_q32: 0,
        }
    }

    /// Reads the counter, which may wrap, once a cycle. The first reading is position 0.
    #[inline]
    pub fn update(&mut self, scale: &CountScale, inverted: bool, window_shift: u32, count: i32) {
        let counts = count.wrapping_sub(self.last_count.unwrap_or(count));
        self.last_count = Some(count);
        self.counter.advance(scale, if inverted { counts.wrapping_neg() } else { counts });
        self.position_q32 = self.counter.position_q32(scale);
        self.velocity_q32 = self.window.update(self.position_q32, window_shift);
    }

    /// Position since the first reading, 2^32 a turn.
    #[inline]
    pub fn position_q32(&self) -> i64 {
        self.position_q32
    }

    /// Velocity, 2^32 a turn, in a cycle.
    #[inline]
    pub fn velocity_q32(&self) -> i64 {
        self.velocity_q32
    }
}

impl Default for AbnEncoder {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn position_starts_at_the_first_reading_and_survives_the_counters_wrap() {
        let scale = CountScale::new(4_096);
        let mut encoder = AbnEncoder::new();
        for (count, position) in
            [(i32::MAX, 0), (i32::MIN, 16), (i32::MIN + 1_023, 16_384), (i32::MAX - 4_095, -65_520)]
        {
            encoder.update(&scale, false, 3, count);
            assert_eq!(encoder.position_q32() >> 16, position, "at {count}");
        }
        let mut inverted = AbnEncoder::new();
        for count in [7, 8] {
            inverted.update(&scale, true, 3, count);
        }
        assert_eq!(inverted.position_q32() >> 16, -16);
    }

    #[test]
    fn velocity_is_the_mean_of_the_window() {
        let scale = CountScale::new(4_096);
        for (pwm_hz, shift) in [(25_000, 3), (50_000, 4), (100_000, 5)] {
            assert_eq!(VelocityWindow::shift(pwm_hz), shift);
            let mut encoder = AbnEncoder::new();
            // 3000 rpm, started at once.
            for cycle in 0..1_000 {
                encoder.update(&scale, false, shift, (i64::from(cycle) * 50 * 4_096 / i64::from(pwm_hz)) as i32);
                let rpm = encoder.velocity_q32() as f64 * f64::from(pwm_hz) * 60.0 / 2.0_f64.powi(32);
                let count_rpm = 60.0 * f64::from(pwm_hz) / 4_096.0 / f64::from(1 << shift);
                let expected = 3_000.0 * f64::from(cycle.min(1 << shift)) / f64::from(1 << shift);
                assert!((rpm - expected).abs() <= count_rpm + 0.1, "{rpm} {expected} at {cycle}");
            }
        }
    }
}
