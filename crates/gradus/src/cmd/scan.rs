//! `gradus scan`

use std::io::Write;
use std::ops::RangeInclusive;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::bail;
use gradus_host::scan::{Found, addresses, lines, ports, scan};
use gradus_host::{Error, Url};
use indicatif::ProgressBar;

use crate::complain;
use crate::interruption::interruption;
use crate::listed::table;
use crate::progress::progress;

/// Find modules
///
/// Asks at every address, and on a serial port at every baud rate, one harmless question; settings of the modules stay as they are. A
/// port that answers under any address (USB, TCP) holds one module and is done at once. Ctrl-C ends the search and shows what
/// was found.
///
/// Exit status: 0 when a module was found, 1 when none was.
#[derive(clap::Args)]
#[command(after_long_help = "\
Examples:
  gradus scan --all                                          all serial ports and CAN interfaces
  gradus scan --port /dev/ttyUSB0                            all rates, all addresses
  gradus scan --port '/dev/ttyUSB0?baud=115200' --addresses 1-16
  gradus scan --port can:can0")]
pub struct Scan {
    /// Ports to search: serial:PATH, tcp:HOST:PORT, can:INTERFACE, ...; a serial port without ?baud=N at all rates
    #[arg(long = "port", value_name = "URL", required_unless_present = "all")]
    ports: Vec<Url>,
    /// Search all serial ports and CAN interfaces of this computer
    #[arg(long, conflicts_with = "ports")]
    all: bool,
    /// Addresses or CAN IDs to ask, as 1-16; all if left out
    #[arg(long, value_name = "FIRST-LAST", value_parser = range)]
    addresses: Option<RangeInclusive<u16>>,
}

/// Reads `1-16` or `7`.
fn range(text: &str) -> Result<RangeInclusive<u16>, String> {
    let (first, last) = text.split_once('-').unwrap_or((text, text));
    let range = first.parse().ok().zip(last.parse().ok()).map(|(first, last): (u16, u16)| first..=last);
    range.filter(|range| !range.is_empty()).ok_or_else(|| "expected is a number or two with a hyphen: 1-16".into())
}

impl Scan {
    pub fn run(self, out: &mut dyn Write) -> anyhow::Result<()> {
        let interrupted = interruption();
        let ports = if self.all { ports() } else { self.ports };
        if ports.is_empty() {
            bail!("this computer has no serial port and no CAN interface");
        }
        let mut found = Vec::new();
        for port in ports {
            let addresses = self.addresses.clone().unwrap_or_else(|| addresses(&port));
            match search(&port, &addresses, &interrupted) {
                Ok(modules) => found.extend(modules),
                Err(error) => complain(format_args!("warning: {error}")),
            }
        }
        show(&found, out)?;
        if found.is_empty() { bail!("no module answers; check power and cables") } else { Ok(()) }
    }
}

/// Searches a port at all its rates; ends with the first one that finds something.
fn search(port: &Url, addresses: &RangeInclusive<u16>, interrupted: &Arc<AtomicBool>) -> Result<Vec<Found>, Error> {
    for line in lines(port) {
        let bar: ProgressBar = progress("scan", addresses.clone().count()).with_message(line.to_string());
        let found = scan(&line, addresses.clone(), |address| {
            bar.set_position(u64::from(address - addresses.start()));
            !interrupted.load(Ordering::Relaxed)
        })?;
        if !found.is_empty() || interrupted.load(Ordering::Relaxed) {
            return Ok(found);
        }
    }
    Ok(Vec::new())
}

fn show(found: &[Found], out: &mut dyn Write) -> anyhow::Result<()> {
    if found.is_empty() {
        return Ok(());
    }
    let mut table = table(["module", "firmware", "address#", "axes#", "port"]);
    for Found { port, module, firmware: (major, minor), address, axes } in found {
        let (firmware, axes) = (format!("{major}.{minor:02}"), if *axes == 0 { "?".into() } else { axes.to_string() });
        table.add_row([module, &firmware, &address.to_string(), &axes, port]);
    }
    Ok(writeln!(out, "{}", table.trim_fmt())?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_one_or_a_range() {
        assert_eq!(range("1-16"), Ok(1..=16));
        assert_eq!(range("7"), Ok(7..=7));
        for text in ["", "-", "5-1", "a-b", "1-99999"] {
            assert!(range(text).is_err(), "{text}");
        }
    }
}
