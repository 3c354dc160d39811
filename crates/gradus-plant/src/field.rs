//! What a stepper motor sees of its driver in a step.

/// Seconds in a step of the plant.
pub(crate) const STEP_S: f64 = 1e-4;

/// One of the two coils.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Coil {
    /// Coil A.
    A,
    /// Coil B.
    B,
}

/// What the power stage does with the coils.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Drive {
    /// All transistors are off: a current flows on through the diodes until it has ended.
    Open,
    /// The coils are shorted: they brake.
    Shorted,
    /// The chopper makes a current vector of this length in amperes.
    Current(f64),
    /// A voltage vector of this length.
    Voltage(f64),
}

/// What a step needs to know.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Field {
    /// Angle of the coil vector in microsteps, and how far it has turned since the last step.
    pub(crate) phase: i32,
    pub(crate) turned: i32,
    /// Microsteps a step that the vector turns on average.
    pub(crate) speed: f64,
    pub(crate) drive: Drive,
    /// Supply voltage.
    pub(crate) volts: f64,
    /// A coil that is not connected.
    pub(crate) broken: Option<Coil>,
    /// End stops in microsteps.
    pub(crate) ends: [Option<i64>; 2],
}
