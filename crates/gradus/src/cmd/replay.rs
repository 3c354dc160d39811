//! `gradus replay`

use std::io::Write;
use std::path::PathBuf;

use anyhow::bail;
use gradus_host::trace::{Exchange, exchanges};
use gradus_host::{Error, Session};
use gradus_tmcl::catalogue::Module;
use gradus_tmcl::{Opcode, Reply, Status};

use super::trace::records;
use crate::port::Port;
use crate::progress::progress;

/// Send the requests of a recorded file again, and compare the answers
///
/// The requests go to one module, whatever address they were recorded with, at the same intervals. It does what they say: motors
/// move. Each answer that differs in status, command or value is shown.
///
/// Exit status: 0 when all answers are as recorded, 1 when one differs.
#[derive(clap::Args)]
#[command(after_long_help = "\
Examples:
  gradus cmd --trace home.pcapng --port /dev/ttyACM0 'MVP ABS, 0, 51200'
  gradus replay home.pcapng                          the same on a virtual module
  gradus replay home.pcapng --bench stage.toml --no-pauses")]
pub struct Replay {
    /// Recorded file
    #[arg(value_name = "FILE.pcapng")]
    file: PathBuf,
    #[command(flatten, next_help_heading = "Connection")]
    port: Port,
    /// Send each request as soon as the one before is answered
    #[arg(long)]
    no_pauses: bool,
}

impl Replay {
    pub fn run(self, out: &mut dyn Write) -> anyhow::Result<()> {
        let exchanges = exchanges(&records(&self.file)?);
        let mut session = self.port.open()?;
        let module = session.module()?;
        let bar = progress("replay", exchanges.len());
        let (start, mut different) = (session.now(), 0);
        for (index, exchange) in exchanges.iter().enumerate() {
            if !self.no_pauses {
                let early = (start + exchange.at).saturating_sub(session.now());
                session.sleep(early);
            }
            if let Some(difference) = replay(&mut session, exchange, module)? {
                different += 1;
                writeln!(out, "{:>12.6}  {difference}", exchange.at.as_secs_f64())?;
            }
            bar.set_position(index as u64 + 1);
        }
        drop(bar);
        match different {
            0 => Ok(writeln!(out, "{} requests, all answers as recorded", exchanges.len())?),
            count => bail!("{count} of {} answers differ", exchanges.len()),
        }
    }
}

/// Sends a request; what is different about its answer, if anything is.
fn replay(session: &mut Session, exchange: &Exchange, module: &'static Module) -> Result<Option<String>, Error> {
    let answer = match session.relay(exchange.request) {
        Ok(answer) => Some(answer),
        Err(error) if error.is_passing() => None,
        Err(error) => return Err(error),
    };
    let same = answer.map_or(exchange.answer.is_none(), |answer| exchange.agrees(&answer));
    let shown = |answer: Option<[u8; 9]>| answer.map_or("nothing".into(), |answer| words(&answer));
    let text = exchange.request.display(module);
    Ok((!same).then(|| format!("{text}: recorded {}, now {}", shown(exchange.answer), shown(answer))))
}

fn words(answer: &[u8; 9]) -> String {
    match Reply::parse(answer) {
        Ok(Reply { status: Status::OK, command, value, .. }) if command != Opcode::NOP => value.to_string(),
        Ok(Reply { status, value, .. }) => format!("{status} {value}"),
        Err(_) => answer.iter().skip(1).map(|byte| byte.escape_ascii().to_string()).collect(),
    }
}
