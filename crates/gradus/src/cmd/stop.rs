//! `gradus stop`

use std::io::Write;

use anyhow::{Context, bail};
use gradus_host::{LatchRequest, Place, Session, Url};

use crate::port::Port;

/// Stop the program and all motors, and keep a shared line stopped
///
/// Ends a download, stops the program, and stops every motor of the module. On a line that `gradus serve` shares, nothing that acts
/// passes from then on, from any client, until `gradus stop --release`: moves, settings, outputs, downloads, starts of programs are
/// refused (status 6); what reads passes, and so do MST, 128 and 133. On any other port the stop ends with this command.
///
/// Exit status: 0 when everything was stopped, 1 when something may still move.
#[derive(clap::Args)]
#[command(after_long_help = "\
Examples:
  gradus stop --port tcp:localhost:4322
  gradus stop --port tcp:localhost:4322 --state
  gradus stop --port tcp:localhost:4322 --release")]
pub struct Stop {
    /// Let pass again what acts; nothing starts by that
    #[arg(long, conflicts_with = "state")]
    release: bool,
    /// Say whether the line is stopped, and stop nothing
    #[arg(long)]
    state: bool,
    #[command(flatten, next_help_heading = "Connection")]
    port: Port,
}

impl Stop {
    pub fn run(self, out: &mut dyn Write) -> anyhow::Result<()> {
        let (line, url) = self.port.line()?;
        if let Place::Sim(_) = url.place {
            bail!("a virtual module of this process does nothing that could be stopped; name a port");
        }
        let mut session = Session::new(&line, url.address);
        session.set_timeout(url.timeout);
        match (self.release, self.state) {
            (true, _) => ask(&mut session, LatchRequest::Release, out),
            (_, true) => ask(&mut session, LatchRequest::State, out),
            _ => stop(&mut session, &url, out),
        }
    }
}

fn ask(session: &mut Session, request: LatchRequest, out: &mut dyn Write) -> anyhow::Result<()> {
    match session.ask_latch(request)? {
        Some(stopped) => Ok(writeln!(out, "{}", if stopped { "stopped" } else { "released" })?),
        None => bail!(
            "{} is not shared by `gradus serve`: a stop there ends with the command that makes it",
            session.port()
        ),
    }
}

/// The latch first, so that nothing can act between the stops of two motors.
fn stop(session: &mut Session, port: &Url, out: &mut dyn Write) -> anyhow::Result<()> {
    let held = session.ask_latch(LatchRequest::Stop)?;
    if held.is_none() && session.ask_latch(LatchRequest::State)?.is_some() {
        bail!("{port} is for reading only (`gradus serve --read-only`): stop at another port of the line");
    }
    session.line().stop();
    let halted = session.halt();
    if halted.is_ok() {
        writeln!(out, "stopped: the program and all motors of {port}")?;
    }
    match held {
        Some(_) => writeln!(out, "nothing that acts passes until `gradus stop --release --port {port}`")?,
        None => writeln!(out, "the stop ends with this command: {port} is not shared by `gradus serve`")?,
    }
    halted.context("motors may still move")
}
