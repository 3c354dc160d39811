//! Incremental encoder.

/// An incremental encoder on the motor shaft.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Encoder {
    /// Counts per turn, four a line.
    pub counts_per_turn: u32,
}

impl Encoder {
    /// What the counter reads at `position`, wrapping. Both are zero at the same place; a count ends exactly where the
    /// next one begins, in either direction.
    pub fn count(&self, position: i64, microsteps_per_turn: u32) -> i32 {
        // Wraps only after years at full speed.
        let counts = position.wrapping_mul(i64::from(self.counts_per_turn));
        counts.div_euclid(i64::from(microsteps_per_turn.max(1))) as i32
    }
}

impl Default for Encoder {
    /// 1024 lines, which are 4096 counts a turn.
    fn default() -> Self {
        Self { counts_per_turn: 4096 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn encoder_counts_the_edges_between_microsteps() {
        let cases = [(0, 0), (12, 0), (13, 1), (51_200, 4096), (-1, -1), (-12, -1), (-13, -2), (-51_200, -4096)];
        for (position, count) in cases {
            assert_eq!(Encoder::default().count(position, 51_200), count, "at {position}");
        }
    }

    #[test]
    fn counter_wraps_at_the_end_of_its_range() {
        let turns = (i64::from(i32::MAX) + 1) / 4096;
        assert_eq!(Encoder::default().count(turns * 51_200, 51_200), i32::MIN);
    }
}
