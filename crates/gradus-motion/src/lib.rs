//! Motion mathematics in integer arithmetic: the ramps of a positioning axis, coordinated moves, the closed loop of a stepper
//! motor with an encoder ([`closed_loop`]), and field-oriented control ([`foc`]).
//!
//! Three types follow one another: [`Limits`] is what the user sets, in microsteps and seconds; [`Gains`] is what a
//! control tick needs, derived once when a limit or the tick rate changes; [`Ramp`] is what moves.
//!
//! ```
//! use gradus_motion::{Limits, Ramp};
//!
//! let limits = Limits { max_speed_pps: 51_200, acceleration: 51_200, deceleration: 51_200, ..Limits::default() };
//! let mut ramp = Ramp::new(limits.gains(10_000));
//! ramp.move_to(51_200);
//! let mut ticks = 0;
//! while !ramp.is_idle() {
//!     ramp.tick();
//!     ticks += 1;
//! }
//! assert_eq!((ramp.position(), ticks), (51_200, 20_000));
//! ```
//!
//! A ramp is trapezoidal or six-point, or S-shaped if its gains were made with [`Gains::s_shaped`].
//!
//! [`Tmc428Ramp`] is the generator of an older chip with units of its own ([`Tmc428Units`]), and [`Generator`] is either.
//!
//! A tick adds some integers; only where one phase ends and the next begins does it plan, with a bounded number of
//! multiplications and divisions. Trapezoids are planned in integers, and every sum is exact. S-shaped ramps are
//! planned in `f64`, by operations that round alike everywhere. So motion is equal to the bit on every machine, ends
//! exactly on its target and does not drift.
//!
//! Not here: parameter numbers, switches and stops (the firmware calls [`Ramp::hard_stop`] and [`Ramp::soft_stop`]).

#![no_std]
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

#[cfg(test)]
extern crate std;

mod brake;
pub mod closed_loop;
mod course;
pub mod foc;
mod gains;
mod generator;
mod interpolation;
mod limits;
mod plan;
mod ramp;
mod s_plan;
mod s_ramp;
mod s_shape;
mod tick_rate;
mod tmc428;
mod tmc428_ramp;

#[cfg(test)]
mod tests;

pub use course::Course;
pub use gains::Gains;
pub use generator::{Generator, Profile};
pub use interpolation::Line;
pub use limits::Limits;
pub use ramp::Ramp;
pub use tick_rate::Units;
pub use tmc428::{Factor, Tmc428Gains, Tmc428Limits, Tmc428Units};
pub use tmc428_ramp::{Approach, Tmc428Ramp};
