//! What surrounds a module.

/// Supply and climate.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Surroundings {
    /// Supply voltage in volts.
    pub supply_v: f64,
    /// Temperature of the board in degrees Celsius.
    pub temperature_c: f64,
}

impl Default for Surroundings {
    /// 24.0 V and 25 degC.
    fn default() -> Self {
        Self { supply_v: 24.0, temperature_c: 25.0 }
    }
}
