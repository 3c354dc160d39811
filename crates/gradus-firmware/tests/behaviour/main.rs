//! A whole TMCM-3351 on fake hardware, driven as a host drives it.

mod ascii;
mod capture;
mod closed_loop;
mod coils;
mod control;
mod coordinates;
mod datagrams;
mod driver;
mod eeprom;
mod encoder;
mod events;
mod interrupts;
mod motion;
mod parameters;
mod programs;
mod properties;
mod protection;
mod rotor;
mod stap;
mod stops;
mod support;
mod units;
