//! Field-oriented control of a servo: from measured currents and sensors to the duties of a bridge, in integers.
//!
//! [`ServoSettings`] is what the user sets (TMCM-1617 axis parameters 10 to 110), [`ServoGains`] is what a cycle needs,
//! [`Servo`] is what moves. [`Servo::cycle`] runs once a PWM period:
//!
//! ```text
//! Hall, AbnEncoder, OpenLoop -> angle, position, velocity
//! ServoRamp (1 kHz) -> position P and the ramp's velocity -> velocity PI -> CurrentLoop: Clarke, Park, flux PI and torque PI,
//!                                                  circular limit, inverse Park, space-vector modulation -> Duties
//! ```
//!
//! Formats are those of the module:
//! - an electrical angle is an `i16`, 65536 a turn (`angle_q16`);
//! - a position is an `i32` that wraps, 65536 a mechanical turn; inside it is an `i64`, 2^32 a turn (`position_q32`);
//! - a current is in mA, the amplitude of the phase currents; up to 32767. One step of the module's current converter
//!   is taken for 1 mA: no source states the factor, and this one holds the 18 A of the module with their peak;
//! - a voltage is 32767 for the largest sine that the bridge can make, a phase amplitude of supply / sqrt(3);
//! - a velocity is in rpm, mechanical or electrical as the user likes; between the regulators it has 16 fraction bits
//!   (`_q16`);
//! - a duty is 32768 for always on.
//!
//! Regulators are the "classic" ones of the module's controller chip: see [`PiGains`]. A cycle divides nothing, but
//! where a hall sensor changes and in the millisecond's tick of the ramp.

mod angle;
mod commutation;
mod current_loop;
mod encoder;
mod encoder_init;
mod filter;
mod hall;
mod modulation;
mod pi;
mod ramp;
mod servo;
mod settings;
mod turns;
mod vector;

pub use angle::sin_cos;
pub use current_loop::{CurrentGains, CurrentLoop, MotorKind};
pub use encoder::{AbnEncoder, VelocityWindow};
pub use encoder_init::InitState;
pub use filter::Pt1;
pub use hall::{Hall, HallGains, HallSettings};
pub use modulation::{Duties, FULL_VOLTAGE, limit_to_circle};
pub use pi::{Pi, PiGains, PiSettings, VelocityGains, VelocityPi};
pub use ramp::{RampGains, ServoRamp};
pub use servo::{Feedback, Mode, Servo};
pub use settings::{Commutation, EncoderInitMode, EncoderSettings, Sensor, ServoGains, ServoSettings, VelocityUnit};
pub use turns::{CountScale, TurnCounter};
pub use vector::{AlphaBeta, Dq};

/// `value` from `-limit` to `limit`, which is not negative; unlike `clamp` it has no way to panic.
#[inline]
fn within(value: i64, limit: i64) -> i64 {
    value.min(limit).max(-limit)
}
