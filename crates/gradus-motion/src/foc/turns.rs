//! Counts of a sensor as turns of the shaft.

/// How many counts of a sensor make a turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CountScale {
    counts_per_turn: i64,
    /// 2^48 / counts, rounded up.
    turn_q48_per_count: u64,
}

impl CountScale {
    /// `counts_per_turn` from 1 to 2^24; what lies outside is taken for the nearest of these.
    pub fn new(counts_per_turn: u32) -> Self {
        let counts = u64::from(counts_per_turn.clamp(1, 1 << 24));
        Self { counts_per_turn: counts as i64, turn_q48_per_count: (1_u64 << 48).div_ceil(counts) }
    }
    /// Way of a count, 2^32 a turn, rounded down.
    #[inline]
    pub(crate) fn count_q32(&self) -> i64 {
        (self.turn_q48_per_count >> 16) as i64
    }
}

/// A counter of turns and counts within the turn. It adds up integers only, so it does not drift.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TurnCounter {
    turns: i32,
    count: i64,
}

impl TurnCounter {
    /// Goes on by `counts`. Divides only where that leaves the turn.
    #[inline]
    pub fn advance(&mut self, scale: &CountScale, counts: i32) {
        self.count += i64::from(counts);
        if !(0..scale.counts_per_turn).contains(&self.count) {
            let counts_per_turn = scale.counts_per_turn.max(1);
            self.turns = self.turns.wrapping_add(self.count.div_euclid(counts_per_turn) as i32);
            self.count = self.count.rem_euclid(counts_per_turn);
        }
    }

    /// Position, 2^32 a turn; not less than exact, and by less than 2^-24 turns more. In steps of 1/65536 turn, rounded
    /// down, it is exact.
    #[inline]
    pub fn position_q32(&self, scale: &CountScale) -> i64 {
        let within = (self.count as u64 * scale.turn_q48_per_count) >> 16;
        (i64::from(self.turns) << 32) + within as i64
    }
}

/// Electrical angle of a rotor with `pole_pairs` at `position_q32`.
#[inline]
pub(crate) fn electrical_q32(position_q32: i64, pole_pairs: u32) -> u32 {
    (position_q32 as u32).wrapping_mul(pole_pairs)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn position_is_exact_in_steps_of_the_module() {
        for counts_per_turn in [1, 3, 24, 1_000, 4_096, 10_000, 65_537, 16_777_215, 16_777_216] {
            let scale = CountScale::new(counts_per_turn);
            let mut counter = TurnCounter::default();
            let mut total = 0_i64;
            for step in [1, 1, 5, 4_095, 100_000, -7, -200_000, 1 << 24, -(1 << 30), 12_345] {
                counter.advance(&scale, step);
                total += i64::from(step);
                let exact = (i128::from(total) << 32).div_euclid(i128::from(counts_per_turn)) as i64;
                let got = counter.position_q32(&scale);
                assert!((0..=256).contains(&(got - exact)), "{total} of {counts_per_turn}: {got} {exact}");
                assert_eq!(got >> 16, exact >> 16, "{total} of {counts_per_turn}");
            }
        }
    }

    #[test]
    fn a_million_turns_there_and_back_end_where_they_began() {
        let scale = CountScale::new(10_007);
        let mut counter = TurnCounter::default();
        for counts in [9_999, -9_998] {
            for _ in 0..1_000_000 {
                counter.advance(&scale, counts);
            }
        }
        for _ in 0..1_000 {
            counter.advance(&scale, -1_000);
        }
        assert_eq!(counter, TurnCounter::default());
    }

    #[test]
    fn electrical_angle_turns_as_often_as_there_are_pole_pairs() {
        let turn_and_an_eighth = (9_i64 << 32) / 8;
        assert_eq!(electrical_q32(turn_and_an_eighth, 1), 1 << 29);
        assert_eq!(electrical_q32(turn_and_an_eighth, 4), 1 << 31);
        assert_eq!(electrical_q32(-turn_and_an_eighth, 2), 3 << 30);
    }
}
