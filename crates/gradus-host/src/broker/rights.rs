//! What clients of a broker may do.

/// What clients may do.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Rights {
    /// True: the address in a request counts, and all modules of the line can be reached.
    pub whole_bus: bool,
    /// True: clients may read and nothing else; the rest is refused with status 6.
    pub read_only: bool,
}
