//! What survives a loss of power, and the values that it keeps.

pub(crate) mod axis_parameters;
pub(crate) mod coordinates;
pub(crate) mod globals;
pub(crate) mod records;
