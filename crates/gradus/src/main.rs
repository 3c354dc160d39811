//! The command line of Gradus.
//!
//! One file a subcommand under `cmd`. Each parses its arguments, asks the libraries, and prints what they say to one
//! writer. Exit status: 0 when all went well, 1 when something failed, 2 when the command line was wrong.

#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod cmd;
mod listed;
mod output;
mod parameter;
mod plot;
mod port;
mod program;
mod progress;
mod recording;
mod reference;
mod signal;
mod span;
mod view;
mod zone;

use std::fmt;
use std::io::{self, Write};
use std::process::ExitCode;

use clap::Parser;

use cmd::Command;

/// Virtual and real TMCL motion-control modules from the command line.
///
/// Gradus assembles TMCL programs, runs them on a virtual module in virtual time or on a real module, and serves virtual
/// modules to other host software on pseudo-terminals and TCP.
#[derive(Parser)]
#[command(version, after_long_help = AFTER_HELP, disable_help_subcommand = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

const AFTER_HELP: &str = "\
Examples:
  gradus run examples/two-positions.tmc --for 60s    run a program on a virtual module
  gradus sim --tcp 127.0.0.1:4322                    offer a virtual module to other programs
  gradus get --port /dev/ttyACM0 actual_position     read a parameter of a real module

Ports (--port):
  sim:tmcm-3351                       a virtual module in this process, in virtual time
  tcp:localhost:4322                  a TCP port that carries serial datagrams
  serial:/dev/ttyACM0?baud=115200     a serial port; the path alone will do
  can:can0?id=1&reply=2               a CAN interface of the Linux kernel
  slcan:/dev/ttyACM0, slcan:HOST:PORT a serial CAN adapter (?bitrate=1000000)
  socketcand:HOST:29536/can0          a CAN bus behind a socketcand server
  Serial lines take ?address=N, the module's address (default 1); CAN takes ?id=N&reply=N (defaults 1 and 2); all take
  ?timeout=MS. ?echo=1 is for adapters that hear themselves, ?rs485=1 for ports whose driver switches the transceiver.
  Instead of a port, --bench stage.toml takes a virtual module with the machine that a bench file describes.

Exit status: 0 when all went well, 1 when something failed, 2 when the command line was wrong.";

fn main() -> ExitCode {
    let cli = Cli::parse();
    let mut out = io::stdout().lock();
    match cli.command.run(&mut out).and_then(|()| Ok(out.flush()?)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) if is_closed_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            complain(format_args!("error: {error:#}"));
            ExitCode::FAILURE
        }
    }
}

/// Writes a line for people on the standard error output; unlike `eprintln`, it takes it that nobody reads it.
fn complain(message: fmt::Arguments) {
    let _ = writeln!(io::stderr(), "{message}");
}

/// True when the reader of our output has gone, `head` for example: it has seen enough.
fn is_closed_pipe(error: &anyhow::Error) -> bool {
    let causes = error.chain().filter_map(|cause| cause.downcast_ref::<io::Error>());
    causes.map(io::Error::kind).any(|kind| kind == io::ErrorKind::BrokenPipe)
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        super::Cli::command().debug_assert();
    }
}
