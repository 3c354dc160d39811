//! Rigid axis: the rotor is where the coil vector points.

use crate::encoder::NullLatch;
use crate::{Encoder, NullEvent, Switch, Travel};

/// Microsteps in a full step of the motor.
pub const MICROSTEPS_PER_FULL_STEP: u32 = 256;

/// Four full steps, after which the coil vector is the same again.
const ELECTRICAL_PERIOD: i64 = 4 * MICROSTEPS_PER_FULL_STEP as i64;

/// A stepper motor that never loses a step, with what it moves.
///
/// Without current the rotor stays where it is. The first vector after that pulls it to the nearest place with that
/// electrical angle, at most two full steps away, as a real motor does.
#[derive(Clone, PartialEq, Debug)]
pub struct RigidAxis {
    position: i64,
    /// The vector that holds the rotor, `None` without current.
    held_at: Option<i32>,
    full_steps_per_turn: u32,
    forced: [Option<bool>; Switch::ALL.len()],
    null: Option<NullLatch>,
    /// Where the switches stand.
    pub travel: Travel,
    /// The encoder on the shaft, if there is one.
    pub encoder: Option<Encoder>,
}

impl RigidAxis {
    /// A motor with `full_steps_per_turn` at position 0, with the default encoder and without switches.
    pub fn new(full_steps_per_turn: u32) -> Self {
        Self {
            position: 0,
            held_at: None,
            full_steps_per_turn,
            forced: [None; Switch::ALL.len()],
            null: None,
            travel: Travel::default(),
            encoder: Some(Encoder::default()),
        }
    }

    /// Applies a coil vector. `phase` counts microsteps and wraps; between two calls with current the rotor follows its
    /// difference, however large.
    #[inline]
    pub fn set_coils(&mut self, phase: i32, current: u8) {
        if current == 0 {
            self.held_at = None;
            return;
        }
        self.position += match self.held_at {
            Some(last) => i64::from(phase.wrapping_sub(last)),
            None => nearest(i64::from(phase) - self.position),
        };
        self.held_at = Some(phase);
    }

    /// Takes the current away.
    pub fn release(&mut self) {
        self.held_at = None;
    }

    /// Position of the rotor in microsteps, 0 where it was first.
    pub fn position(&self) -> i64 {
        self.position
    }

    /// Puts the rotor somewhere else, by hand.
    pub fn place(&mut self, position: i64) {
        self.position = position;
        self.held_at = None;
    }

    /// Microsteps in a turn of the shaft.
    pub fn microsteps_per_turn(&self) -> u32 {
        self.full_steps_per_turn * MICROSTEPS_PER_FULL_STEP
    }

    /// Turns of the shaft as microsteps, rounded.
    pub fn microsteps(&self, turns: f64) -> i64 {
        (turns * f64::from(self.microsteps_per_turn())).round() as i64
    }

    /// True when the switch is closed.
    #[inline]
    pub fn switch(&self, switch: Switch) -> bool {
        self.forced[switch as usize].unwrap_or_else(|| self.travel.closes(switch, self.position))
    }

    /// Holds a switch open or closed, or gives it back to the travel (`None`).
    pub fn force_switch(&mut self, switch: Switch, closed: Option<bool>) {
        self.forced[switch as usize] = closed;
    }

    /// What holds a switch, `None` when the travel decides.
    pub fn forced_switch(&self, switch: Switch) -> Option<bool> {
        self.forced[switch as usize]
    }

    /// Counter of the encoder, wrapping; 0 for ever without one.
    #[inline]
    pub fn encoder_count(&self) -> i32 {
        self.count_from_zero() as i32
    }

    fn count_from_zero(&self) -> i64 {
        self.encoder.map_or(0, |encoder| encoder.count_from_zero(self.position, self.microsteps_per_turn()))
    }

    /// What a null event of the encoder is from now on, `None` if nobody asks for one.
    pub fn watch_null(&mut self, event: Option<NullEvent>) {
        self.null = event.map(|event| NullLatch::new(event, self.count_from_zero()));
    }

    /// Counter of the encoder where the latest null event has begun, if there was one since the last call.
    pub fn take_null(&mut self) -> Option<i32> {
        let count = self.count_from_zero();
        let latched = self.null.as_mut()?.take(&self.encoder?, count)?;
        Some(latched as i32)
    }
}

impl Default for RigidAxis {
    /// A motor with 1.8 degrees a full step.
    fn default() -> Self {
        Self::new(200)
    }
}

/// The shortest way to the same electrical angle: `distance` within half a period to either side.
fn nearest(distance: i64) -> i64 {
    (distance + ELECTRICAL_PERIOD / 2).rem_euclid(ELECTRICAL_PERIOD) - ELECTRICAL_PERIOD / 2
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis_after(vectors: &[(i32, u8)]) -> RigidAxis {
        let mut axis = RigidAxis::default();
        for (phase, current) in vectors {
            axis.set_coils(*phase, *current);
        }
        axis
    }

    #[test]
    fn rotor_follows_the_vector() {
        let follows = |name, vectors: &[_], position| assert_eq!(axis_after(vectors).position(), position, "{name}");
        follows("one vector", &[(100, 255)], 100);
        follows("there and back", &[(0, 255), (51_200, 255), (-10, 128)], -10);
        follows("phase wraps upwards", &[(0, 1), (i32::MAX, 1), (i32::MIN, 1)], i64::from(i32::MAX) + 1);
        follows("phase wraps downwards", &[(0, 1), (i32::MIN, 1), (i32::MAX, 1)], i64::from(i32::MIN) - 1);
        follows("moved without current", &[(0, 255), (300, 255), (5000, 0)], 300);
        follows("caught again ahead", &[(0, 255), (300, 255), (300, 0), (1024 + 400, 255)], 400);
        follows("restarted at phase 0", &[(0, 255), (51_300, 255), (0, 0), (0, 255)], 51_200);
    }

    #[test]
    fn released_rotor_is_pulled_by_two_full_steps_at_most() {
        for phase in -3000..3000 {
            let mut axis = RigidAxis::default();
            axis.place(70_007);
            axis.set_coils(phase, 1);
            assert!((axis.position() - 70_007).abs() <= 512, "phase {phase}");
            assert_eq!((axis.position() - i64::from(phase)).rem_euclid(1024), 0, "phase {phase}");
        }
    }

    #[test]
    fn forced_switch_ignores_the_travel_until_it_is_given_back() {
        let mut axis = RigidAxis::default();
        axis.travel.left = Some(0);
        for (forced, closed) in [(Some(false), false), (None, true), (Some(true), true)] {
            axis.force_switch(Switch::Left, forced);
            assert_eq!(axis.switch(Switch::Left), closed, "{forced:?}");
        }
    }

    #[test]
    fn encoder_follows_the_rotor_and_may_be_missing() {
        let mut axis = axis_after(&[(0, 9), (51_200, 9)]);
        assert_eq!(axis.encoder_count(), 4096);
        axis.encoder = None;
        assert_eq!(axis.encoder_count(), 0);
    }

    #[test]
    fn null_event_is_latched_between_two_vectors() {
        let mut axis = axis_after(&[(0, 9)]);
        axis.encoder = Some(Encoder { index: Some(100), ..Encoder::default() });
        axis.watch_null(Some(NullEvent { n: true, ab: None }));
        for (phase, expected) in
            [(1_000, None), (1_300, Some(100)), (1_400, None), (51_200, None), (60_000, Some(4_196))]
        {
            axis.set_coils(phase, 9);
            assert_eq!(axis.take_null(), expected, "at {phase}");
        }
        axis.watch_null(None);
        axis.set_coils(0, 9);
        assert_eq!(axis.take_null(), None, "nobody asks");
    }

    #[test]
    fn turns_become_microsteps() {
        assert_eq!([0.5, -2.0, 1e-6].map(|turns| RigidAxis::default().microsteps(turns)), [25_600, -102_400, 0]);
        assert_eq!(RigidAxis::new(400).microsteps_per_turn(), 102_400);
    }
}
