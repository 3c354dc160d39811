//! Between the server's own types and those of the protocol: the only folder that knows the latter.

pub(crate) mod capabilities;
pub(crate) mod read;
pub(crate) mod view;
