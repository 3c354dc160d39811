//! A servo's encoder: whether it counts what an alignment turns, and its null channel.

use gradus_motion::foc::InitState;
use gradus_tmcl::catalogue::Ap;

use crate::ports::{NullEvent, RotorInputs};
use crate::servo::Servo;

/// Electrical angle that an alignment turns the rotor backwards, 65536 a turn: a quarter turn, or what of it can be told from
/// an encoder that does not count or counts the other way.
const ALIGNMENT: core::ops::Range<i64> = 2_700..30_000;

impl Servo {
    /// Compares what the encoder counts in an alignment with what the rotor turns.
    #[inline]
    pub(crate) fn watch_alignment(&mut self, count: i32) {
        match self.control.init_state() {
            InitState::Start => self.aligned_from = None,
            InitState::Wait | InitState::Estimate if self.derived.aligns => {
                self.aligned_from.get_or_insert(count);
            }
            InitState::Wait | InitState::Estimate => {}
            InitState::Idle => {
                if let Some(from) = self.aligned_from.take()
                    && !ALIGNMENT.contains(&self.electrical_angle_back(count.wrapping_sub(from)))
                {
                    self.protection.fail_init();
                    self.stop();
                }
            }
        }
    }

    /// Electrical angle of so many counts, backwards, 65536 a turn.
    fn electrical_angle_back(&self, counts: i32) -> i64 {
        let back = if self.settings.get(Ap::EncoderDirection) != 0 { i64::from(counts) } else { -i64::from(counts) };
        let steps = i64::from(self.settings.get(Ap::EncoderSteps)).max(1);
        back.saturating_mul(i64::from(self.settings.get(Ap::PolePairs)) << 16).checked_div(steps).unwrap_or(0)
    }

    /// Axis parameters 107 and 108.
    pub(crate) fn arm_null<A: RotorInputs>(&self, port: &mut A) {
        let wanted = self.settings.get(Ap::ClearOnNull) != 0;
        port.watch_null(wanted.then_some(NullEvent { n: true, ab: None }));
    }

    /// Makes the place of the null channel position 0.
    #[inline]
    pub(crate) fn watch_null<A: RotorInputs>(&mut self, port: &mut A) {
        if let Some(count) = port.take_null() {
            self.clear_at(count, port);
        }
    }

    fn clear_at<A: RotorInputs>(&mut self, count: i32, port: &mut A) {
        let since = port.encoder().wrapping_sub(count);
        let inverted = (self.settings.get(Ap::EncoderDirection) != 0) != (self.settings.get(Ap::MotorDirection) != 0);
        let since = i64::from(if inverted { since.wrapping_neg() } else { since });
        let steps = i64::from(self.settings.get(Ap::EncoderSteps)).max(1);
        self.control.set_position((since << 16).checked_div(steps).unwrap_or(0) as i32);
        if self.settings.get(Ap::ClearOnce) != 0 {
            self.settings.set(Ap::ClearOnNull, 0);
            self.arm_null(port);
        }
    }
}
