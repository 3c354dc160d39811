//! Simulated machines: what hangs on the connectors of a motion-control module.
//!
//! A [`RigidAxis`] turns with the coil vector of its stepper motor, closes switches along its [`Travel`] and moves an
//! [`Encoder`] with an index. Lengths are microsteps of 1/256 full step, a unit that is exact in integers; everything is deterministic.
//!
//! Not here: motors with inertia and load, which lose steps.

mod axis;
mod encoder;
mod surroundings;
mod travel;

pub use axis::{MICROSTEPS_PER_FULL_STEP, RigidAxis};
pub use encoder::{Channels, Encoder, NullEvent};
pub use surroundings::Surroundings;
pub use travel::{Home, Switch, Travel};
