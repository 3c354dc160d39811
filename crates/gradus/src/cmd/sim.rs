//! `gradus sim`

use std::io::Write;
use std::net::{Ipv4Addr, SocketAddr, ToSocketAddrs};
use std::path::PathBuf;

use gradus_host::VIRTUAL_MODULES;
use gradus_sim::{
    Bench, BenchFile, Console, Eeprom, EepromError, Endpoint, EndpointError, Machine, Options, ServeError, Server,
    Speed,
};
use gradus_tmcl::catalogue::Module;

use crate::port;

/// TCP port that is offered unless told otherwise.
const DEFAULT_TCP_PORT: u16 = 4322;

/// Offer a virtual module to other programs
///
/// Without --pty and --tcp it opens a pseudo-terminal and tcp 127.0.0.1:4322. Prints one line an endpoint, `pty PATH` or
/// `tcp ADDR:PORT`, then `ready`, and serves until it gets SIGINT (Ctrl-C), SIGTERM or SIGHUP (terminal closed). Lines on the standard input work the
/// machine by hand.
///
/// A bench file gives the module a machine with travel, switches and encoders, and says what happens to it later.
#[derive(clap::Args)]
#[command(after_long_help = "\
Lines on the standard input:
  in 3 1            sets digital input 3
  analog 0 512      sets analogue input 0
  enable 0          drives the ENABLE input low
  switch 0 left 1   holds a switch of axis 0; `auto` gives it back to the travel
  power off         cuts the power; `power on` gives it back
  show              shows the machine
  help              lists all commands

Examples:
  gradus sim                                     a pty and TCP port 4322
  gradus sim --pty ./tmcm --eeprom tmcm.eeprom   settings survive the simulator
  gradus sim --tcp 127.0.0.1:0 --speed 10        a free port, ten times real time
  gradus sim --bench stage.toml                  a module with the machine of a bench file")]
pub struct Sim {
    /// Module
    #[arg(value_parser = port::module(VIRTUAL_MODULES), ignore_case = true, default_value = "tmcm-3351")]
    module: &'static Module,
    /// Bench file, which says what the module is and what it drives
    #[arg(long, value_name = "FILE.toml", conflicts_with = "module")]
    bench: Option<PathBuf>,
    /// Open a pseudo-terminal and make PATH a symbolic link to it
    #[arg(long, value_name = "PATH")]
    pty: Option<PathBuf>,
    /// Listen on a TCP address; port 0 picks a free one
    #[arg(long, value_name = "ADDR", value_parser = address)]
    tcp: Option<SocketAddr>,
    /// File that keeps the EEPROM; created if it does not exist
    #[arg(long, value_name = "FILE")]
    eeprom: Option<PathBuf>,
    /// Virtual seconds a second, or as many as the computer manages
    #[arg(long, value_name = "FACTOR|max", default_value_t, allow_hyphen_values = true)]
    speed: Speed,
    /// Let other computers connect; anybody who can reach the address can move the motors
    #[arg(long)]
    allow_remote: bool,
}

impl Sim {
    pub fn run(self, out: &mut dyn Write) -> anyhow::Result<()> {
        let bench = self.build()?;
        let options = Options { speed: self.speed, allow_remote: self.allow_remote };
        let mut server = Server::open(bench, &self.endpoints(), options).map_err(advise)?;
        server.stop_on_signals()?;
        for endpoint in server.endpoints() {
            writeln!(out, "{endpoint}")?;
        }
        writeln!(out, "ready")?;
        out.flush()?;
        Ok(server.run(Console::standard().ok())?)
    }

    fn build(&self) -> anyhow::Result<Bench> {
        let Some(file) = &self.bench else {
            return Ok(Bench::new(self.module, Machine::new(self.module.axes.into()), self.memory(self.module)?));
        };
        let file = BenchFile::read(file)?;
        let memory = self.memory(file.module)?;
        Ok(file.build(memory))
    }

    fn memory(&self, module: &Module) -> Result<Eeprom, EepromError> {
        self.eeprom.as_ref().map_or_else(|| Ok(Eeprom::of(module)), |file| Eeprom::open(file, module))
    }

    fn endpoints(&self) -> Vec<Endpoint> {
        let pty = self.pty.clone().map(|link| Endpoint::Pty(Some(link)));
        let chosen: Vec<Endpoint> = pty.into_iter().chain(self.tcp.map(Endpoint::Tcp)).collect();
        if chosen.is_empty() {
            return vec![Endpoint::Pty(None), Endpoint::Tcp((Ipv4Addr::LOCALHOST, DEFAULT_TCP_PORT).into())];
        }
        chosen
    }
}

/// The address of a host by name or number; where a name has several, one that IPv4 clients reach.
fn address(text: &str) -> Result<SocketAddr, String> {
    let found = text.to_socket_addrs().ok().and_then(|all| all.min_by_key(SocketAddr::is_ipv6));
    found.ok_or_else(|| {
        "a host of this computer and a port are expected: 127.0.0.1:4322, localhost:0, [::1]:4322".into()
    })
}

/// Names the option that helps.
fn advise(error: ServeError) -> anyhow::Error {
    let remote = matches!(error, ServeError::Endpoint(EndpointError::Remote { .. }));
    let error = anyhow::Error::new(error);
    if remote { error.context("--allow-remote is needed") } else { error }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_is_a_host_and_a_port() {
        for text in ["127.0.0.1:4322", "localhost:4322", "0.0.0.0:0", "[::1]:4322"] {
            assert!(address(text).is_ok(), "{text}");
        }
        assert!(address("localhost:4322").is_ok_and(|address| address.ip().is_loopback()));
        for text in ["127.0.0.1", "localhost", "4322", ":4322", "127.0.0.1:99999", ""] {
            assert!(address(text).is_err(), "{text}");
        }
    }
}
