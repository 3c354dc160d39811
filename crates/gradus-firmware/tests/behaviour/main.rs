//! A whole TMCM-3351 on fake hardware, driven as a host drives it.

mod control;
mod datagrams;
mod eeprom;
mod interrupts;
mod motion;
mod programs;
mod properties;
mod support;
