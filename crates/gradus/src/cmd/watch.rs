//! `gradus watch`

use std::io::Write;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use gradus_host::Session;

use crate::interruption::{interrupted, interruption};
use crate::port::{self, Port};
use crate::watch::{Showing, Watch as Look};
use crate::{signal, span};

/// Watch the axes of a module that somebody else drives
///
/// Shows position and speed of the axes, or other signals, draws and records them as `gradus run` does. Only reads: nothing is
/// downloaded, started or stopped. Ends on Ctrl-C or when the time is up; the files are written in either case.
#[derive(clap::Args)]
#[command(after_long_help = after_help())]
pub struct Watch {
    /// Time to watch: 500ms, 60s, 2m, 1h; until Ctrl-C if left out
    #[arg(long = "for", value_name = "DURATION", value_parser = span::parse, allow_hyphen_values = true)]
    time: Option<Duration>,
    #[command(flatten)]
    showing: Showing,
    #[command(flatten, next_help_heading = "Connection")]
    port: Port,
}

fn after_help() -> String {
    format!(
        "\
Signals:
{}  Every axis parameter is a signal too, by its name or number: measured_speed, 206.

Examples:
  gradus watch --port tcp:localhost:4322
  gradus watch --port /dev/ttyACM0 --for 10s --signals position,load --plot load.svg --record load.mcap",
        signal::list()
    )
}

impl Watch {
    pub fn run(self, out: &mut dyn Write) -> anyhow::Result<()> {
        let interruption = interruption();
        let mut session = self.port.open()?;
        port::stays(&mut session)?;
        let mut look = self.showing.prepare(&mut session)?;
        look.start(&mut session);
        let seen = self.watch(&mut session, &mut look, &interruption, out);
        look.write()?;
        seen?;
        if interruption.load(Ordering::Relaxed) { Err(interrupted("")) } else { Ok(()) }
    }

    fn watch(
        &self,
        session: &mut Session,
        look: &mut Look,
        interruption: &AtomicBool,
        out: &mut dyn Write,
    ) -> anyhow::Result<()> {
        loop {
            let time = look.look(session)?;
            let is_last = interruption.load(Ordering::Relaxed) || self.time.is_some_and(|limit| time >= limit);
            look.show(is_last, out)?;
            if is_last {
                return Ok(());
            }
            look.wait(session, self.time);
        }
    }
}
