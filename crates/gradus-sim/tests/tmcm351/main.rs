//! A whole virtual TMCM-351, driven as a host drives it.

mod commands;
mod differences;
mod encoder;
mod memory;
mod motion;
mod programs;
mod reference_search;
mod stall;
mod support;
