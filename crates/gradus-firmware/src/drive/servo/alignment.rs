//! The null channel of a servo's encoder.

use gradus_tmcl::catalogue::Ap;

use crate::drive::servo::servo::Servo;
use crate::ports::{NullEvent, RotorInputs};

impl Servo {
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
        self.control.count_from((since << 16).checked_div(steps).unwrap_or(0) as i32);
        if self.settings.get(Ap::ClearOnce) != 0 {
            self.settings.set(Ap::ClearOnNull, 0);
            self.arm_null(port);
        }
    }
}
