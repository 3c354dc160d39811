//! Incremental encoder with an index.

/// An incremental encoder on the motor shaft: channels A and B in quadrature, and a null channel N.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Encoder {
    /// Counts per turn, four a line.
    pub counts_per_turn: u32,
    /// The count of each turn, one wide, in which the null channel is high; `None`: there is no null channel.
    pub index: Option<u32>,
    /// How far the coupling has slipped: the shaft is so many microsteps ahead of the encoder.
    pub slip: i64,
    /// It counts down when the shaft turns in positive direction.
    pub reversed: bool,
}

/// Levels of an encoder's channels; true is high.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Channels {
    /// Channel A, a quarter of a line ahead of B when the counter goes up.
    pub a: bool,
    /// Channel B.
    pub b: bool,
    /// The null channel.
    pub n: bool,
}

impl Encoder {
    /// What the counter reads at `position`, wrapping. Both are zero at the same place; a count ends exactly where the
    /// next one begins, in either direction.
    pub fn count(&self, position: i64, microsteps_per_turn: u32) -> i32 {
        self.count_from_zero(position, microsteps_per_turn) as i32
    }

    /// The same without the end of the counter's range.
    pub(crate) fn count_from_zero(&self, position: i64, microsteps_per_turn: u32) -> i64 {
        // Wraps only after years at full speed.
        let turned = position.wrapping_sub(self.slip);
        let turned = if self.reversed { turned.wrapping_neg() } else { turned };
        let counts = turned.wrapping_mul(i64::from(self.counts_per_turn));
        counts.div_euclid(i64::from(microsteps_per_turn.max(1)))
    }

    /// The channels where the counter, had it no end, would read `count`: A and B are low at 0, then A goes high.
    pub fn channels(&self, count: i64) -> Channels {
        let within_turn = count.rem_euclid(i64::from(self.counts_per_turn.max(1)));
        Channels {
            a: matches!(count & 3, 1 | 2),
            b: matches!(count & 3, 2 | 3),
            n: self.index.is_some_and(|index| within_turn == i64::from(index)),
        }
    }
}

impl Default for Encoder {
    /// 1024 lines, which are 4096 counts a turn, with the index at 0.
    fn default() -> Self {
        Self { counts_per_turn: 4096, index: Some(0), slip: 0, reversed: false }
    }
}

/// Levels that the channels must come to for a null event.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct NullEvent {
    /// Level of N.
    pub n: bool,
    /// Levels of A and B, `None` if any will do.
    pub ab: Option<(bool, bool)>,
}

impl NullEvent {
    fn holds(self, channels: Channels) -> bool {
        channels.n == self.n && self.ab.is_none_or(|levels| levels == (channels.a, channels.b))
    }
}

/// The latch of an encoder interface: keeps the count at which a null event begins.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct NullLatch {
    event: NullEvent,
    /// The count up to which it has looked.
    seen: i64,
}

impl NullLatch {
    pub(crate) fn new(event: NullEvent, count: i64) -> Self {
        Self { event, seen: count }
    }

    /// The same latch, which has not seen the way to `count`.
    pub(crate) fn skip(self, count: i64) -> Self {
        Self { seen: count, ..self }
    }

    /// Where the latest event has begun on the straight way to `count`, if there was one since the last call.
    pub(crate) fn take(&mut self, encoder: &Encoder, count: i64) -> Option<i64> {
        let way = count - core::mem::replace(&mut self.seen, count);
        // All that can happen happens within four turns, in which A, B and N come back to the same levels.
        let longest = 4 * i64::from(encoder.counts_per_turn);
        let holds = |count| self.event.holds(encoder.channels(count));
        (0..way.abs().min(longest))
            .map(|back| count - back * way.signum())
            .find(|count| holds(*count) && !holds(*count - way.signum()))
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
    fn slipped_encoder_lags_behind_the_shaft() {
        let encoder = Encoder { slip: 25_600, ..Encoder::default() };
        assert_eq!([0, 25_600, 51_200].map(|position| encoder.count(position, 51_200)), [-2048, 0, 2048]);
    }

    #[test]
    fn reversed_encoder_counts_down() {
        let encoder = Encoder { reversed: true, ..Encoder::default() };
        assert_eq!(
            [-51_200, -1, 0, 1, 51_200].map(|position| encoder.count(position, 51_200)),
            [4096, 0, 0, -1, -4096]
        );
    }

    #[test]
    fn counter_wraps_at_the_end_of_its_range() {
        let turns = (i64::from(i32::MAX) + 1) / 4096;
        assert_eq!(Encoder::default().count(turns * 51_200, 51_200), i32::MIN);
    }

    #[test]
    fn one_channel_changes_with_every_count() {
        let encoder = Encoder { index: None, ..Encoder::default() };
        for count in -10..10 {
            let (here, next) = (encoder.channels(count), encoder.channels(count + 1));
            assert!((here.a != next.a) != (here.b != next.b), "after {count}");
        }
    }

    #[test]
    fn index_is_one_count_wide_once_a_turn() {
        let encoder = Encoder { counts_per_turn: 100, index: Some(7), ..Encoder::default() };
        let high: Vec<i64> = (-150..250).filter(|count| encoder.channels(*count).n).collect();
        assert_eq!(high, [-93, 7, 107, 207]);
    }

    #[test]
    fn null_event_begins_where_the_channels_come_to_their_levels() {
        let (low, high) = (false, true);
        let encoder = Encoder { counts_per_turn: 100, index: Some(8), ..Encoder::default() };
        for (n, ab, from, to, expected) in [
            (high, None, 0, 20, Some(8)),
            (high, None, 20, 0, Some(8)),
            (high, None, 0, 8, Some(8)),
            (high, None, 8, 20, None),
            (high, None, 0, 7, None),
            (high, None, 0, 399, Some(308)),
            (high, None, 399, -1_000_000, Some(-999_992)),
            (high, Some((low, low)), 0, 20, Some(8)),
            (high, Some((high, low)), 0, 20, None),
            (low, None, 0, 20, Some(9)),
            (low, None, 20, 0, Some(7)),
            (low, Some((high, high)), 0, 20, Some(18)),
        ] {
            let event = NullEvent { n, ab };
            let mut latch = NullLatch::new(event, from);
            assert_eq!(latch.take(&encoder, to), expected, "{event:?} from {from} to {to}");
            assert_eq!(latch.take(&encoder, to), None, "{event:?} has been taken");
        }
    }
}
