//! The encoder of an axis: counter in microsteps, null channel, speeds (TMCM-3351 manual §6.2, axis parameters 131, 132, 198,
//! 199, 201, 209 to 213).
//!
//! The null event is latched by the hardware, so that it is exact at any speed; the firmware asks for it in each control
//! tick, and before it reads the encoder.
//!
//! Where the manual is silent:
//! - A null event is where the channels come to their levels, not all the time that they stay there.
//! - Bits 4 and 5 of the mode together are bit 4. A mode with bit 5 alone is spent after one event until it is written
//!   again; it still reads as it was written.
//! - Clearing makes the place of the event position 0. The position of the motor stays.

use gradus_tmcl::catalogue::{Ap, MotionChip};

use crate::drive::stepper::axis::Axis;
use crate::drive::stepper::settings::Settings;
use crate::drive::stepper::speed::Speeds;
use crate::ports::{AxisInputs, NullEvent};

/// Turns encoder counts into microsteps: counts * microsteps a turn / counts a turn, plus an offset that SAP 209 sets.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Encoder {
    last: i32,
    counts: i64,
    /// Microsteps a count, 32 fractional bits; derived when a parameter changes.
    constant_q32: i64,
    offset: i32,
    /// The counter has changed since power-on: there is an encoder.
    moved: bool,
    /// What the next null event does, `None` if nothing.
    null: Option<OnNull>,
    /// What is read of the position until the next null event, if that is held.
    held: Option<i32>,
}

/// What a null event does besides latching the positions.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OnNull {
    /// Makes the encoder's position there 0.
    pub(crate) clears: bool,
    /// Leaves all later events alone.
    pub(crate) once: bool,
    /// Only an event brings a new value to axis parameter 209.
    pub(crate) holds: bool,
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
        self.moved |= raw != self.last;
        self.counts = self.counts.wrapping_add(i64::from(raw.wrapping_sub(self.last)));
        self.last = raw;
        let microsteps = (i128::from(self.counts) * i128::from(self.constant_q32) + (1 << 31)) >> 32;
        (microsteps as i32).wrapping_add(self.offset)
    }

    /// Whether it says anything: it has counted since power-on, and a count is some microsteps.
    pub(crate) fn is_there(&self) -> bool {
        self.moved && self.constant_q32 != 0
    }

    /// Makes the position at the counter's value `raw` `position`.
    pub(crate) fn set_position(&mut self, position: i32, raw: i32) {
        self.last = raw;
        self.counts = 0;
        self.offset = position;
        self.held = self.held.map(|_| position);
    }
}

/// Bits of the encoder mode (axis parameter 201).
const A_HIGH: i32 = 1;
const B_HIGH: i32 = 1 << 1;
const N_HIGH: i32 = 1 << 2;
const IGNORE_AB: i32 = 1 << 3;
const EVERY: i32 = 1 << 4;
const NEXT: i32 = 1 << 5;
const CLEAR: i32 = 1 << 8;

impl OnNull {
    fn new(mode: i32) -> Option<Self> {
        let acts = mode & (EVERY | NEXT) != 0;
        acts.then_some(Self { clears: mode & CLEAR != 0, once: mode & EVERY == 0, holds: false })
    }
}

fn null_event(mode: i32) -> NullEvent {
    let ab = (mode & IGNORE_AB == 0).then_some((mode & A_HIGH != 0, mode & B_HIGH != 0));
    NullEvent { n: mode & N_HIGH != 0, ab }
}

impl Settings {
    /// Microsteps in so many counts (axis parameters 140, 202 and 210).
    fn encoder_scale(&self) -> (i64, i64) {
        match self.chip {
            MotionChip::Tmc428 => self.prescaler(),
            _ => (self.microsteps_per_turn(), i64::from(self.get(Ap::EncoderResolution))),
        }
    }

    /// What a null event does, and what it is (axis parameter 201; 210 of the TMCM-351).
    fn encoder_null(&self) -> (Option<OnNull>, NullEvent) {
        let mode = self.get(Ap::EncoderMode);
        match self.chip {
            MotionChip::Tmc428 => self.prescaler_null(),
            _ => (OnNull::new(mode), null_event(mode)),
        }
    }
}

// The encoder on its axis.
impl Axis {
    /// Makes the encoder fit the resolutions of the settings.
    pub(crate) fn scale_encoder<A: AxisInputs>(&mut self, port: &mut A) {
        let (microsteps, counts) = self.settings.encoder_scale();
        self.encoder.set_scale(microsteps, counts, port.encoder());
    }

    /// Waits for null events as the encoder mode says.
    pub(crate) fn arm_encoder<A: AxisInputs>(&mut self, port: &mut A) {
        let (on_null, event) = self.settings.encoder_null();
        self.encoder.null = on_null;
        port.watch_null(on_null.map(|_| event));
        self.encoder.held = None;
        if on_null.is_some_and(|null| null.holds) {
            self.encoder.held = Some(self.encoder.position(port.encoder()));
        }
    }

    /// Position of the encoder in microsteps.
    pub(crate) fn encoder_position<A: AxisInputs>(&mut self, port: &mut A) -> i32 {
        self.watch_null(port);
        self.encoder.position(port.encoder())
    }

    /// What GAP 209 answers.
    pub(crate) fn shown_encoder_position<A: AxisInputs>(&mut self, port: &mut A) -> i32 {
        let position = self.encoder_position(port);
        self.encoder.held.unwrap_or(position)
    }

    /// Looks for a null event, if one is waited for.
    #[inline]
    pub(crate) fn watch_null<A: AxisInputs>(&mut self, port: &mut A) {
        if let Some(action) = self.encoder.null
            && let Some(raw) = port.take_null()
        {
            self.see_null(action, raw, port);
        }
    }

    /// A null event has come at the counter's value `raw`.
    fn see_null<A: AxisInputs>(&mut self, action: OnNull, raw: i32, port: &mut A) {
        let now = self.encoder.position(port.encoder());
        let then = self.encoder.position(raw);
        // The motor has gone on since as far as the encoder has.
        let since = if self.ramp.is_idle() { 0 } else { now.wrapping_sub(then) };
        self.settings.set(Ap::LatchedPosition, self.ramp.position().wrapping_sub(since));
        self.settings.set(Ap::LatchedEncoderPosition, then);
        if action.clears && self.closed.is_none() {
            self.encoder.set_position(0, raw);
        }
        if action.holds {
            self.encoder.held = Some(self.encoder.position(raw));
        }
        if action.once {
            self.encoder.null = None;
            port.watch_null(None);
        }
    }
}

// Speeds.
impl Axis {
    /// The speeds are 0 from now on.
    pub(crate) fn rest_speeds<A: AxisInputs>(&mut self, now: u64, port: &mut A) {
        self.speeds = Speeds::standing(now, port.encoder(), self.travel);
    }

    /// Takes a sample for the speeds when it is time.
    #[inline]
    pub(crate) fn measure_speeds<A: AxisInputs>(&mut self, now: u64, port: &mut A) {
        if self.speeds.are_due(now) {
            self.speeds.sample(now, port.encoder(), self.travel, self.derived.speed_filter);
            if self.closed.is_some() {
                self.see_mean_speed(now, port);
            }
        }
    }

    /// Speed of the encoder in pps.
    pub(crate) fn measured_speed_pps<A: AxisInputs>(&self, now: u64, port: &mut A) -> i32 {
        self.speeds.now_pps(now, port.encoder(), self.encoder.constant_q32)
    }

    /// Averaged speed of the encoder in pps.
    pub(crate) fn mean_speed_pps<A: AxisInputs>(&self, now: u64, port: &mut A) -> i32 {
        self.speeds.mean_pps(now, port.encoder(), self.encoder.constant_q32, self.derived.speed_filter)
    }

    /// True if the motor is too far from where the encoder says, or its speed is.
    pub(crate) fn deviates<A: AxisInputs>(&mut self, port: &mut A) -> bool {
        let (position, speed_pps) = (self.derived.max_deviation, self.derived.max_speed_deviation_pps);
        let exceeds = |deviation: i32, limit: u32| deviation.unsigned_abs() > limit;
        position != 0 && exceeds(self.ramp.position().wrapping_sub(self.encoder_position(port)), position)
            || speed_pps != 0 && exceeds(self.speeds.deviation_pps(self.encoder.constant_q32), speed_pps)
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
