//! A whole TMCM-1617 on fake hardware, driven as a host drives it.

mod commands;
mod modes;
mod parameters;
mod properties;
mod protection;
mod registers;
mod support;
mod ticks;
