//! Where something holds along a signal.

/// Values of a signal at which something holds: where a switch is closed.
#[derive(Clone, PartialEq, Debug)]
pub struct Zone {
    /// What it is.
    pub name: &'static str,
    /// Lowest and highest value, which may be infinite.
    pub range: (f64, f64),
}
