//! Why a reference search ends without a zero.

/// Why a search has found no zero.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum SearchFailure {
    /// A leg has got longer than 1000 turns.
    NoSwitch,
    /// Modes 5 and 6: an end switch is ahead in both directions.
    BothEnds,
    /// The shaft does not follow the motor.
    Blocked,
    /// The motor does not turn: a search speed of 0.
    Still,
    /// The shaft or the switch does not come to rest between two legs.
    Restless,
    /// Something else has stopped the motor: a stall, a deviation from the encoder, its driver.
    Stopped,
}

impl SearchFailure {
    /// The reason in words.
    pub fn reason(self) -> &'static str {
        match self {
            Self::NoSwitch => "no switch within 1000 turns of the motor",
            Self::BothEnds => "an end switch in both directions before the home switch",
            Self::Blocked => "the shaft does not follow the motor",
            Self::Still => "the search speed is 0",
            Self::Restless => "the shaft or the switch does not come to rest within 5 s",
            Self::Stopped => "a stall, a deviation or the driver has stopped the motor",
        }
    }
}
