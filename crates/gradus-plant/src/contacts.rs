//! The contacts of switches, which bounce.

use crate::travel::{Switch, Travel};

/// Microseconds of a step of the plant.
pub const STEP_US: u64 = 100;

/// The contacts of an axis: while one bounces it is open or closed at random, from a seed that is always the same.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Contacts {
    /// What the travel said last, and what the contact says.
    closed: [bool; Switch::ALL.len()],
    levels: [bool; Switch::ALL.len()],
    /// Steps that each contact still bounces.
    bouncing: [u64; Switch::ALL.len()],
    noise: u32,
}

impl Default for Contacts {
    fn default() -> Self {
        Self { closed: [false; 3], levels: [false; 3], bouncing: [0; 3], noise: 1 }
    }
}

impl Contacts {
    /// Contacts that have rested for long.
    pub(crate) fn rest(&mut self, travel: &Travel, position: i64) {
        self.closed = Switch::ALL.map(|switch| travel.closes(switch, position));
        (self.levels, self.bouncing) = (self.closed, [0; 3]);
    }

    /// A step of the plant with the carriage at `position`.
    pub(crate) fn step(&mut self, travel: &Travel, position: i64) {
        for switch in Switch::ALL {
            let index = switch as usize;
            let closed = travel.closes(switch, position);
            if closed != self.closed[index] {
                self.closed[index] = closed;
                self.bouncing[index] = u64::from(travel.bounce_us[index]) / STEP_US;
            }
            self.levels[index] = if self.bouncing[index] > 0 { self.bounce(index) } else { closed };
        }
    }

    fn bounce(&mut self, index: usize) -> bool {
        self.bouncing[index] -= 1;
        self.noise ^= self.noise << 13;
        self.noise ^= self.noise >> 17;
        self.noise ^= self.noise << 5;
        self.noise & 0x100 != 0
    }

    pub(crate) fn levels(&self) -> [bool; Switch::ALL.len()] {
        self.levels
    }

    pub(crate) fn are_quiet(&self) -> bool {
        self.bouncing == [0; 3]
    }
}
