//! The axis of a servo module.

#![allow(clippy::module_inception)] // the type that the room is named for

pub(crate) mod alignment;
pub(crate) mod chips;
pub(crate) mod parameters;
pub(crate) mod protection;
pub(crate) mod registers;
pub(crate) mod servo;
pub(crate) mod settings;
