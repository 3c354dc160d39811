//! A bench for real hosts, in step with the wall clock.

mod endpoint;
mod line;
mod pace;
mod pty;
mod server;
mod terminal;
mod visitors;

pub use endpoint::{Endpoint, EndpointError};
pub use pace::{Speed, SpeedError};
pub use server::{Options, ServeError, Server, Stopper};
pub use terminal::Console;
