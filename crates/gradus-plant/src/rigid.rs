//! A rigid rotor: it is where the coil vector points.

use crate::microsteps::MICROSTEPS_PER_FULL_STEP;

/// Four full steps, after which the coil vector is the same again.
const ELECTRICAL_PERIOD: i64 = 4 * MICROSTEPS_PER_FULL_STEP as i64;

/// A rotor that never loses a step.
///
/// Without current it stays where it is. The first vector after that pulls it to the nearest place with that
/// electrical angle, at most two full steps away, as a real motor does. At an end stop it stays there.
#[derive(Clone, PartialEq, Debug, Default)]
pub(crate) struct RigidRotor {
    position: i64,
    /// The vector that holds the rotor, `None` without current.
    held_at: Option<i32>,
    pub(crate) blocked: bool,
}

impl RigidRotor {
    /// Applies a coil vector. `phase` counts microsteps and wraps; between two calls with current the rotor follows its
    /// difference, however large.
    #[inline]
    pub(crate) fn follow(&mut self, phase: i32, ends: [Option<i64>; 2]) {
        if self.blocked {
            self.held_at = None;
            return;
        }
        let wanted = self.position
            + match self.held_at {
                Some(last) => i64::from(phase.wrapping_sub(last)),
                None => nearest(i64::from(phase) - self.position),
            };
        let [left, right] = ends;
        self.position = wanted.max(left.unwrap_or(i64::MIN)).min(right.unwrap_or(i64::MAX));
        self.held_at = (self.position == wanted).then_some(phase);
    }

    /// Takes the current away.
    pub(crate) fn release(&mut self) {
        self.held_at = None;
    }

    /// Position in microsteps, 0 where it was first.
    #[inline]
    pub(crate) fn position(&self) -> i64 {
        self.position
    }

    /// Puts the rotor somewhere else, by hand.
    pub(crate) fn place(&mut self, position: i64) {
        self.position = position;
        self.held_at = None;
    }
}

/// The shortest way to the same electrical angle: `distance` within half a period to either side.
fn nearest(distance: i64) -> i64 {
    (distance + ELECTRICAL_PERIOD / 2).rem_euclid(ELECTRICAL_PERIOD) - ELECTRICAL_PERIOD / 2
}
