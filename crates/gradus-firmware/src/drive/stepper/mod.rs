//! Axes of stepper motors.

pub(crate) mod axis;
pub(crate) mod closed_loop;
pub(crate) mod driver_chip;
pub(crate) mod encoder;
pub(crate) mod reference_search;
pub(crate) mod search_failure;
pub(crate) mod search_modes;
pub(crate) mod settings;
pub(crate) mod speed;
pub(crate) mod steppers;
pub(crate) mod supervision;
pub(crate) mod tmc428;
pub(crate) mod units;
