//! `gradus trace`

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use anyhow::Context;
use gradus_host::Url;
use gradus_host::trace::{Decoder, Record, Sniffer, read_pcapng};
use gradus_tmcl::catalogue::{MODULES, Module};

use crate::interruption::{interrupted, interruption};
use crate::{port, span};

/// Show the traffic of a line in words
///
/// Listens to a line that others talk on (an RS-485 segment, a CAN bus) and says nothing itself, or reads a file that was recorded with
/// --trace. Each datagram is a line: time in seconds, direction (> to a module, < from one), address, command, and what the
/// catalogue knows of its parameter. Ends on Ctrl-C.
///
/// A port that only one program can have is not listened to but recorded where it is used: every command has --trace, and `gradus
/// sim` and `gradus serve` too.
#[derive(clap::Args)]
#[command(after_long_help = "\
Examples:
  gradus trace --port 'serial:/dev/ttyUSB0?baud=115200'
  gradus trace --port can:can0 --write bus.pcapng --for 1m
  gradus sim --trace sim.pcapng
  gradus trace sim.pcapng")]
pub struct Trace {
    /// Recorded file
    #[arg(value_name = "FILE.pcapng", required_unless_present = "port")]
    file: Option<PathBuf>,
    /// Line to listen to
    #[arg(long, value_name = "URL", conflicts_with = "file")]
    port: Option<Url>,
    /// Record what is heard as well
    #[arg(long, value_name = "FILE.pcapng", requires = "port")]
    write: Option<PathBuf>,
    /// Time to listen: 500ms, 60s, 2m, 1h
    #[arg(long = "for", value_name = "DURATION", value_parser = span::parse, requires = "port")]
    time: Option<Duration>,
    /// Module whose parameters are named, until one that passes says what it is
    #[arg(long, value_parser = port::module(MODULES), ignore_case = true, default_value = "tmcm-3351")]
    module: &'static Module,
}

/// How long the line is listened to at once.
const GLANCE: Duration = Duration::from_millis(50);

impl Trace {
    pub fn run(self, out: &mut dyn Write) -> anyhow::Result<()> {
        let mut decoder = Decoder::new(self.module);
        if let Some(url) = &self.port {
            return self.listen(url, &mut decoder, out);
        }
        for record in self.file.as_deref().map(records).transpose()?.into_iter().flatten() {
            writeln!(out, "{}", decoder.line(&record))?;
        }
        Ok(())
    }

    fn listen(&self, url: &Url, decoder: &mut Decoder, out: &mut dyn Write) -> anyhow::Result<()> {
        let interruption = interruption();
        let mut line = Sniffer::open(url)?;
        let mut recorder = self.write.as_deref().map(port::recorder).transpose()?;
        let start = Instant::now();
        while !interruption.load(Ordering::Relaxed) && self.time.is_none_or(|time| start.elapsed() < time) {
            let Some(record) = line.listen(GLANCE).with_context(|| url.to_string())? else { continue };
            if let Some(recorder) = &mut recorder {
                recorder(&record);
            }
            writeln!(out, "{}", decoder.line(&record))?;
            out.flush()?;
        }
        if interruption.load(Ordering::Relaxed) { Err(interrupted("")) } else { Ok(()) }
    }
}

/// The records of a file.
///
/// # Errors
/// When it cannot be read or is no pcapng file.
pub fn records(file: &Path) -> anyhow::Result<Vec<Record>> {
    let bytes = fs::read(file).with_context(|| format!("cannot read {}", file.display()))?;
    read_pcapng(&bytes).with_context(|| file.display().to_string())
}
