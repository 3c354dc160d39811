//! `gradus start`

use std::io::Write;

use crate::port::{self, Port};

/// Start the program in a module
///
/// Starts at the beginning, with registers and stack empty. A program that runs begins anew.
#[derive(clap::Args)]
#[command(after_long_help = "\
Examples:
  gradus start --port /dev/ttyACM0
  gradus start --port /dev/ttyACM0 --resume     where gradus stop has stopped it")]
pub struct Start {
    /// Go on where the program stands
    #[arg(long)]
    resume: bool,
    /// Do not ask whether to start on a real module that GRADUS_PORT or gradus.toml names
    #[arg(long)]
    yes: bool,
    #[command(flatten, next_help_heading = "Connection")]
    port: Port,
}

impl Start {
    pub fn run(self, out: &mut dyn Write) -> anyhow::Result<()> {
        let mut session = self.port.open_to_act(None, self.yes, "start the program")?;
        port::stays(&mut session)?;
        if !self.resume {
            session.reset()?;
        }
        let from = session.program_counter()?;
        session.run()?;
        Ok(writeln!(out, "the program runs, from address {from}")?)
    }
}
