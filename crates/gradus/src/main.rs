//! The command line of Gradus.
//!
//! One file a subcommand under `cmd`. Each parses its arguments, asks the libraries, and prints what they say to one
//! writer. Exit status: 0 when all went well, 1 when something failed, 2 when the command line was wrong;
//! `exit` has the others.

#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod axes;
mod cmd;
mod ending;
mod exit;
mod findings;
mod interruption;
mod json;
mod levels;
mod listed;
mod output;
mod parameter;
mod plot;
mod port;
mod program;
mod progress;
mod project;
mod recording;
mod reference;
mod signal;
mod sources;
mod span;
mod terminal;
mod value;
mod view;
mod watch;
mod zone;

use std::env;
use std::fmt;
use std::io::{self, Write};
use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches, Parser};

use cmd::Command;
use exit::Exit;
use terminal::Color;

/// Virtual and real TMCL motion-control modules from the command line.
///
/// Gradus assembles TMCL programs, runs them on a virtual module in virtual time or on a real module, and serves virtual
/// modules to other host software on pseudo-terminals and TCP.
#[derive(Parser)]
#[command(version, after_long_help = AFTER_HELP)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Colours in messages; auto is on a terminal, unless NO_COLOR is set or TERM is dumb
    #[arg(long, global = true, value_name = "WHEN", value_enum, default_value_t, display_order = 1000)]
    color: Color,
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

Exit status: 0 when all went well, 1 when something failed, 2 when the command line was wrong, 130 after Ctrl-C. `gradus run`
has 3 and 4 besides, see `gradus run --help`.";

fn main() -> ExitCode {
    let color = Color::of(env::args_os().map(|argument| argument.to_string_lossy().into_owned())).choose();
    let matches = Cli::command().color(color).get_matches();
    let cli = Cli::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
    if cli.command.ends_on_signals()
        && let Err(error) = interruption::end_on_signals()
    {
        complain(format_args!("warning: signals end this program without its last words: {error}"));
    }
    let mut out = io::stdout().lock();
    match cli.command.run(&mut out).and_then(|()| Ok(out.flush()?)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) if is_closed_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            explain(&error);
            Exit::status(&error)
        }
    }
}

/// The last line of a program that failed, unless all is said.
fn explain(error: &anyhow::Error) {
    let text = format!("{error:#}");
    if !text.is_empty() {
        complain(format_args!("error: {text}"));
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
    use clap::CommandFactory as _;

    #[test]
    fn the_command_line_is_consistent() {
        super::Cli::command().debug_assert();
    }
}
