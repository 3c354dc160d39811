//! What passes on the buses of a rig, for a trace.

use gradus_tmcl::can::Frame;

/// Something that has passed on a bus: what reaches the modules, with the line's faults in it, and what they say.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Passed {
    /// When, in microseconds of virtual time.
    pub at_us: u64,
    /// The bus.
    pub bus: usize,
    /// The host that it comes from or goes to; on CAN everybody hears everything, and this is 0.
    pub host: usize,
    /// True for what a module says.
    pub from_module: bool,
    /// What.
    pub what: Content,
}

/// What passes.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Content {
    /// Bytes on a serial line, in whatever pieces.
    Bytes(Vec<u8>),
    /// What a module says on a serial line besides datagrams, in one piece: text, or the samples of a bulk download.
    Loose(Vec<u8>),
    /// A CAN frame.
    Frame(Frame),
    /// Nothing on the bus: what a module's bench has to say by itself, see [`Notice`](crate::Notice).
    Notice(String),
}

/// Keeps what passes on one bus, if somebody wants it.
#[derive(Debug, Default)]
pub(crate) struct Log(Option<Vec<Passed>>);

impl Log {
    pub(crate) fn begin(&mut self) {
        self.0.get_or_insert_default();
    }

    pub(crate) fn add(&mut self, at_us: u64, host: usize, from_module: bool, what: impl FnOnce() -> Content) {
        if let Some(log) = &mut self.0 {
            log.push(Passed { at_us, bus: 0, host, from_module, what: what() });
        }
    }

    pub(crate) fn take(&mut self) -> Vec<Passed> {
        self.0.as_mut().map(std::mem::take).unwrap_or_default()
    }
}
