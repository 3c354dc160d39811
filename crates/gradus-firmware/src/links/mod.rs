//! Lines to hosts: replies, heartbeats, events, text.

pub(crate) mod ascii;
pub(crate) mod heartbeats;
pub(crate) mod line_rates;
pub(crate) mod link;
pub(crate) mod position_events;
