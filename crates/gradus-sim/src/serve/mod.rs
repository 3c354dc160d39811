//! A bench for real hosts, in step with the wall clock.

mod adapter;
#[cfg(all(target_os = "linux", feature = "socketcan"))]
mod can_socket;
mod endpoint;
mod fuzz;
mod line;
mod pace;
mod process;
mod protocol;
mod pty;
mod server;
mod socketcand;
mod source;
mod terminal;
mod visitors;
mod waiter;

pub use endpoint::{Endpoint, EndpointError, EndpointParseError, address};
pub use fuzz::fuzz_adapters;
pub use pace::{Speed, SpeedError};
pub use process::allow_many_endpoints;
pub use server::{Options, ServeError, Server, Stopper};
pub use terminal::Console;
