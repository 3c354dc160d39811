//! The host side of TMCL: links to virtual and real modules, and the [`Session`] that talks over them.
//!
//! A port is named by a [`Url`]. [`Session::open`] opens it, or [`Line::open`] for sessions with several modules of one line;
//! nothing else does. A virtual module with a machine of one's own has no name: [`Session::on_bench`]. Commands, parameters by name, downloads and
//! program control are methods of the session.
//!
//! ```
//! use gradus_host::Session;
//! use gradus_tmcl::catalogue::Ap;
//!
//! let mut session = Session::open(&"sim:tmcm-3351".parse()?)?;
//! session.set_axis(Ap::MaxSpeed, 0, 20_000)?;
//! assert_eq!(session.get_axis(Ap::MaxSpeed, 0)?, 20_000);
//! # Ok::<(), gradus_host::Error>(())
//! ```
//!
//! Not here: the command line and what it prints, see the crate `gradus`.

#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod broker;
mod can;
mod capture;
mod config;
mod error;
mod exchange;
mod fuzz;
mod line;
mod link;
mod name;
mod named;
mod names;
mod parameter;
mod program;
mod refusal;
mod restart;
pub mod scan;
mod serial;
mod session;
mod sim;
mod statistics;
mod step;
mod step_response;
mod stop;
mod tcp;
mod terminal;
pub mod trace;
mod trial;
mod url;
mod verdict;

pub use broker::{Broker, Desk, MOST_CLIENTS, News, Rights, Visit};
pub use can::FramePort;
pub use capture::Capture;
pub use config::{Config, ConfigError, ConfigFileError, Difference, Setting, settings};
pub use error::Error;
pub use fuzz::fuzz_session;
pub use gradus_sim::VIRTUAL_MODULES;
pub use line::Line;
pub use line::stop_latch::LatchRequest;
pub use line::wire::PositionReached;
pub use link::{Address, Framed, Heard, Link, Nature, Stream};
pub use name::normalise;
pub use named::Named;
pub use names::{NameError, axis_parameters, find, find_axis, find_global, global_parameters};
pub use program::{ApplicationStatus, ProgramError, State};
pub use restart::RestartWatch;
pub use session::{RETRIES, Session};
pub use statistics::{Histogram, Statistics};
pub use step_response::StepResponse;
pub use terminal::Terminal;
pub use trial::{Regulator, Step, Trial};
pub use url::{Bus, Place, SlcanPlace, Url, UrlError};

/// The programs of the book's chapter on the libraries are tests.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/src/library.md")]
struct Book;
