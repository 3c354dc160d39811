//! Where a command may stand.

/// Where a command may stand.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Mode {
    /// The module does not have it.
    None,
    /// Only from the host.
    Direct,
    /// Only in a program.
    Standalone,
    /// From the host and in a program.
    Both,
}

impl Mode {
    /// True when the host may send it.
    pub const fn direct(self) -> bool {
        matches!(self, Self::Direct | Self::Both)
    }

    /// True when a program may contain it.
    pub const fn standalone(self) -> bool {
        matches!(self, Self::Standalone | Self::Both)
    }

    /// Wherever one of the two allows it.
    pub(super) const fn or(self, other: Self) -> Self {
        match (self.direct() || other.direct(), self.standalone() || other.standalone()) {
            (true, true) => Self::Both,
            (true, false) => Self::Direct,
            (false, true) => Self::Standalone,
            (false, false) => Self::None,
        }
    }
}
