//! The ramp generator of an axis, whichever its module has.

use crate::course::Course;
use crate::gains::Gains;
use crate::interpolation::Line;
use crate::ramp::Ramp;
use crate::tmc428::Tmc428Gains;
use crate::tmc428_ramp::Tmc428Ramp;

/// What a control tick needs of the limits of an axis.
#[derive(Clone, Copy, Debug)]
pub enum Profile {
    /// Limits in microsteps and seconds.
    Physical(Gains),
    /// Limits in units of the TMC428.
    Tmc428(Tmc428Gains),
}

/// A ramp generator. Speeds and accelerations are in the units of its limits: pps and pps^2, or those of the TMC428.
#[derive(Clone, Copy, Debug)]
#[allow(clippy::large_enum_variant)] // nothing is allocated
pub enum Generator {
    /// Trapezoids, six-point and S-shaped ramps.
    Physical(Ramp),
    /// The TMC428's ramps.
    Tmc428(Tmc428Ramp),
}

use Generator::{Physical, Tmc428};

impl Generator {
    /// An axis at rest at position 0, which is also its target.
    pub fn new(profile: Profile) -> Self {
        match profile {
            Profile::Physical(gains) => Physical(Ramp::new(gains)),
            Profile::Tmc428(gains) => Tmc428(Tmc428Ramp::new(gains)),
        }
    }

    /// Replaces the limits; a profile of another kind begins anew.
    pub fn set_profile(&mut self, profile: Profile) {
        match (&mut *self, profile) {
            (Physical(ramp), Profile::Physical(gains)) => ramp.set_gains(gains),
            (Tmc428(ramp), Profile::Tmc428(gains)) => ramp.set_gains(gains),
            _ => *self = Self::new(profile),
        }
    }

    /// Position mode: go to `target`.
    pub fn move_to(&mut self, target: i32) {
        match self {
            Physical(ramp) => ramp.move_to(target),
            Tmc428(ramp) => ramp.move_to(target),
        }
    }

    /// Velocity mode: change to `speed` and keep it.
    pub fn rotate(&mut self, speed: i32) {
        match self {
            Physical(ramp) => ramp.rotate(speed),
            Tmc428(ramp) => ramp.rotate(speed),
        }
    }

    /// Velocity mode: brake to rest with a deceleration of its own, in pps^2. The TMC428 has none besides its acceleration.
    pub fn soft_stop(&mut self, deceleration_pps2: u32) {
        match self {
            Physical(ramp) => ramp.soft_stop(deceleration_pps2),
            Tmc428(ramp) => ramp.rotate(0),
        }
    }

    /// Velocity mode: stand still at once.
    pub fn hard_stop(&mut self) {
        match self {
            Physical(ramp) => ramp.hard_stop(),
            Tmc428(ramp) => ramp.hard_stop(),
        }
    }

    /// Overwrites the position counter, see [`Ramp::set_position`].
    pub fn set_position(&mut self, position: i32) {
        match self {
            Physical(ramp) => ramp.set_position(position),
            Tmc428(ramp) => ramp.set_position(position),
        }
    }

    /// Overwrites the target without a change of mode.
    pub fn set_target(&mut self, target: i32) {
        match self {
            Physical(ramp) => ramp.set_target(target),
            Tmc428(ramp) => ramp.set_target(target),
        }
    }

    /// Advances by one control tick.
    #[inline]
    pub fn tick(&mut self) {
        match self {
            Physical(ramp) => ramp.tick(),
            Tmc428(ramp) => ramp.tick(),
        }
    }

    /// A control tick that a line leads.
    pub fn follow<const N: usize>(&mut self, line: &Line<N>, axis: usize) {
        match self {
            Physical(ramp) => line.lead(axis, ramp),
            Tmc428(ramp) => ramp.follow(line, axis),
        }
    }

    /// What a line has to know of the axis.
    pub fn course(&self) -> Course<'_> {
        match self {
            Physical(ramp) => ramp.course(),
            Tmc428(ramp) => ramp.course(),
        }
    }
}

// What can be read.
impl Generator {
    /// Position counter in microsteps. It wraps.
    #[inline]
    pub fn position(&self) -> i32 {
        match self {
            Physical(ramp) => ramp.position(),
            Tmc428(ramp) => ramp.position(),
        }
    }

    /// Target position in microsteps, as last set.
    pub fn target(&self) -> i32 {
        match self {
            Physical(ramp) => ramp.target(),
            Tmc428(ramp) => ramp.target(),
        }
    }

    /// Speed, rounded towards zero.
    #[inline]
    pub fn speed(&self) -> i32 {
        match self {
            Physical(ramp) => ramp.speed_pps(),
            Tmc428(ramp) => ramp.speed(),
        }
    }

    /// Acceleration, rounded towards zero; 0 at constant speed.
    #[inline]
    pub fn acceleration(&self) -> i32 {
        match self {
            Physical(ramp) => ramp.acceleration_pps2(),
            Tmc428(ramp) => ramp.acceleration(),
        }
    }

    /// Whether the position equals the target and, in position mode, the axis stands.
    #[inline]
    pub fn at_target(&self) -> bool {
        match self {
            Physical(ramp) => ramp.at_target(),
            Tmc428(ramp) => ramp.at_target(),
        }
    }

    /// Whether the axis is in position mode.
    pub fn is_positioning(&self) -> bool {
        match self {
            Physical(ramp) => ramp.is_positioning(),
            Tmc428(ramp) => ramp.is_positioning(),
        }
    }

    /// Whether the axis stands and has nothing to do: ticks may be left out.
    #[inline]
    pub fn is_idle(&self) -> bool {
        match self {
            Physical(ramp) => ramp.is_idle(),
            Tmc428(ramp) => ramp.is_idle(),
        }
    }
}
