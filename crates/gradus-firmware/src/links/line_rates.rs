//! The rates of a module's lines.

use gradus_tmcl::rates::{BAUD_RATES, CAN_BIT_RATES};

/// Bits a second of a module's lines. They change when it starts (global parameters 65 and 69).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct LineRates {
    /// Of RS-232 and RS-485.
    pub baud: u32,
    /// Of the CAN bus.
    pub can: u32,
}

impl LineRates {
    /// Those of a module as it is delivered.
    pub const FACTORY: Self = Self { baud: 9600, can: 1_000_000 };

    /// By the values of global parameters 65 and 69; those of the factory for values that there are not.
    pub(crate) fn of(baud: i32, can: i32) -> Self {
        let rate = |rates: &[u32], value: i32| usize::try_from(value).ok().and_then(|value| rates.get(value)).copied();
        Self {
            baud: rate(&BAUD_RATES, baud).unwrap_or(Self::FACTORY.baud),
            can: rate(&CAN_BIT_RATES, can).filter(|rate| *rate > 0).unwrap_or(Self::FACTORY.can),
        }
    }
}
