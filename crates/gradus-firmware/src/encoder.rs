//! The encoder counter of an axis, in microsteps (TMCM-3351 manual §6.2).

/// Turns encoder counts into microsteps: counts * microsteps a turn / counts a turn, plus an offset that SAP 209 sets.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Encoder {
    last: i32,
    counts: i64,
    /// Microsteps a count, 32 fractional bits; derived when a parameter changes.
    constant_q32: i64,
    offset: i32,
}

impl Encoder {
    /// Sets the scale, keeping the position that is read now. No counts a turn: the position stands still.
    pub(crate) fn set_scale(&mut self, microsteps_per_turn: i64, counts_per_turn: i64, raw: i32) {
        let position = self.position(raw);
        self.constant_q32 = (microsteps_per_turn << 32).checked_div(counts_per_turn).unwrap_or(0);
        self.set_position(position, raw);
    }

    /// Position in microsteps, for the counter's value `raw`.
    pub(crate) fn position(&mut self, raw: i32) -> i32 {
        self.counts = self.counts.wrapping_add(i64::from(raw.wrapping_sub(self.last)));
        self.last = raw;
        let microsteps = (i128::from(self.counts) * i128::from(self.constant_q32) + (1 << 31)) >> 32;
        (microsteps as i32).wrapping_add(self.offset)
    }

    /// Makes the position that is read now `position`.
    pub(crate) fn set_position(&mut self, position: i32, raw: i32) {
        self.last = raw;
        self.counts = 0;
        self.offset = position;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_become_microsteps() {
        let mut encoder = Encoder::default();
        encoder.set_scale(51_200, 4_096, 7);
        encoder.set_position(0, 7);
        for (raw, want) in [(7, 0), (8, 13), (9, 25), (4_103, 51_200), (7 - 4_096, -51_200)] {
            assert_eq!(encoder.position(raw), want, "raw {raw}");
        }
    }

    #[test]
    fn counter_wraps_without_a_jump() {
        let mut encoder = Encoder::default();
        encoder.set_scale(51_200, -4_096, i32::MAX);
        encoder.set_position(100, i32::MAX);
        assert_eq!(encoder.position(i32::MIN + 4_095), 100 - 51_200);
    }
}
