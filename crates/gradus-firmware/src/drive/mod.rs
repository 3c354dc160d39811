//! The drive: axes with their hardware, and the ticks that move them.

pub(crate) mod axes;
pub(crate) mod servo;
pub(crate) mod stepper;
pub(crate) mod ticks;
