//! `gradus scan`

use std::io::Write;
use std::ops::RangeInclusive;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::bail;
use gradus_host::scan::{Found, Leg, addresses, plan, ports, scan};
use gradus_host::{Error, Url};
use indicatif::ProgressBar;

use crate::complain;
use crate::interruption::{interrupted, interruption};
use crate::listed::table;
use crate::progress::progress;

/// Find modules
///
/// Asks at every address, and on a serial port at every baud rate, one harmless question; settings of the modules stay as they are. The
/// address of a module as it is delivered comes first, at every rate, which takes about a second; then the rest. A port that
/// answers under any address (USB, TCP) holds one module and is done at once. Ctrl-C ends the search, shows what was found, and says how
/// far it was.
///
/// Exit status: 0 when a module was found, 1 when none was, 130 on Ctrl-C.
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
        let interruption = interruption();
        let ports = if self.all { ports() } else { self.ports };
        if ports.is_empty() {
            bail!("this computer has no serial port and no CAN interface");
        }
        let mut search = Search { interruption, found: Vec::new(), far: None };
        for port in ports {
            let addresses = self.addresses.clone().unwrap_or_else(|| addresses(&port));
            if let Err(error) = search.port(&port, &addresses) {
                complain(format_args!("warning: {error}"));
            }
        }
        show(&search.found, out)?;
        match search.far {
            Some(far) => Err(interrupted(&format!("interrupted {far}"))),
            None if search.found.is_empty() => bail!("no module answers; check power and cables"),
            None => Ok(()),
        }
    }
}

/// A search on one port after the other.
struct Search {
    interruption: Arc<AtomicBool>,
    found: Vec<Found>,
    /// How far it was when it was interrupted, in words.
    far: Option<String>,
}

impl Search {
    /// Searches a port; what was found on one of its lines, at one of its rates, is looked for on no other.
    fn port(&mut self, port: &Url, addresses: &RangeInclusive<u16>) -> Result<(), Error> {
        let legs = plan(port, addresses);
        let mut fits: Option<String> = None;
        for (number, leg) in legs.iter().enumerate() {
            let line = leg.line.to_string();
            if self.far.is_some() || fits.as_ref().is_some_and(|fits| *fits != line) {
                continue;
            }
            let found = self.leg(leg, &format!("in part {} of {}", number + 1, legs.len()))?;
            if !found.is_empty() {
                fits = Some(line);
            }
            self.keep(found);
        }
        Ok(())
    }

    fn leg(&mut self, leg: &Leg, part: &str) -> Result<Vec<Found>, Error> {
        let bar: ProgressBar = progress("scan", leg.addresses.len()).with_message(leg.line.to_string());
        scan(&leg.line, leg.addresses.iter().copied(), |address| {
            bar.inc(1);
            let interrupted = self.interruption.load(Ordering::Relaxed);
            if interrupted {
                self.far = Some(format!("{part}, before address {address} at {}", leg.line));
            }
            !interrupted
        })
    }

    /// Keeps what is new: a module that answers under any address is found by every leg.
    fn keep(&mut self, found: Vec<Found>) {
        for module in found {
            if !self.found.iter().any(|known| known.port == module.port) {
                self.found.push(module);
            }
        }
    }
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
