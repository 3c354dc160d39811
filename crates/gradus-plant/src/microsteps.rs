//! The unit of positions.

/// Microsteps in a full step of the motor.
pub const MICROSTEPS_PER_FULL_STEP: u32 = 256;
