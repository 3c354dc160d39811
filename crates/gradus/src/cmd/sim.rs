//! `gradus sim`

use std::io::Write;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::PathBuf;

use gradus_host::VIRTUAL_MODULES;
use gradus_sim::{
    Bench, BenchFile, BusChange, BusKind, Can, Console, Eeprom, EepromError, Endpoint, EndpointError, Machine, Options,
    Profile, Rig, ServeError, Server, Speed,
};
use gradus_tmcl::catalogue::Module;

use crate::port;

/// TCP port that is offered unless told otherwise.
const DEFAULT_TCP_PORT: u16 = 4322;

/// Offer a virtual module to other programs
///
/// Without any endpoint it opens a pseudo-terminal and tcp 127.0.0.1:4322. Prints one line an endpoint, `pty PATH`,
/// `tcp ADDR:PORT` and so on, then `ready`, and serves until it gets SIGINT (Ctrl-C), SIGTERM or SIGHUP (terminal closed). Lines on the standard input work the
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
  load 0 0.2        loads the shaft of axis 0 with 0.2 Nm
  block 0           holds the shaft; `unblock 0` lets it go
  supply 19.5       sets the supply of the motors
  power off         cuts the power; `power on` gives it back
  show              shows the machine
  help              lists all commands

Examples:
  gradus sim                                     a pty and TCP port 4322
  gradus sim --pty ./tmcm --eeprom tmcm.eeprom   settings survive the simulator
  gradus sim --tcp 127.0.0.1:0 --speed 10        a free port, ten times real time
  gradus sim --slcan ./adapter                   a module on CAN, behind a serial adapter
  gradus sim --faults noisy-line                 one datagram in a thousand is garbled
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
    #[arg(long, value_name = "ADDR", value_parser = port::address)]
    tcp: Option<SocketAddr>,
    /// Be a serial CAN adapter (slcan), on a pseudo-terminal that PATH leads to or on a TCP address
    #[arg(long, value_name = "PATH|ADDR")]
    slcan: Option<String>,
    /// Be a socketcand server on a TCP address
    #[arg(long, value_name = "ADDR", value_parser = port::address)]
    socketcand: Option<SocketAddr>,
    /// Take part in the bus of a CAN interface of this computer
    #[arg(long, value_name = "INTERFACE")]
    can: Option<String>,
    /// What goes wrong on the lines: noisy-line, bad-usb-cable or late-replies
    #[arg(long, value_name = "PROFILE")]
    faults: Option<Profile>,
    /// Seed of the dice for --faults: the same seed is the same faults
    #[arg(long, value_name = "NUMBER", default_value_t = 1)]
    seed: u64,
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
        let options = Options { speed: self.speed, allow_remote: self.allow_remote };
        let mut server = Server::open(self.rig()?, &[], options)?;
        for endpoint in self.endpoints() {
            let bus = usize::from(endpoint.is_can());
            server.open_endpoint(bus, &endpoint).map_err(advise)?;
        }
        server.stop_on_signals()?;
        for endpoint in server.endpoints() {
            writeln!(out, "{endpoint}")?;
        }
        writeln!(out, "ready")?;
        out.flush()?;
        Ok(server.run(Console::standard().ok())?)
    }

    /// The module on its USB port and on a CAN bus.
    fn rig(&self) -> anyhow::Result<Rig> {
        let mut rig = Rig::from(self.build()?);
        let can = rig.add_bus("can", BusKind::Can(Can::DEFAULT));
        rig.connect(0, can);
        if let Some(profile) = self.faults {
            for bus in 0..=can {
                rig.change(bus, BusChange::Faults(profile, self.seed));
            }
        }
        Ok(rig)
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
        let slcan = self.slcan.as_ref().map(|place| {
            gradus_sim::address(place).map_or_else(|| Endpoint::SlcanPty(Some(place.into())), Endpoint::SlcanTcp)
        });
        let chosen = [
            self.pty.clone().map(|link| Endpoint::Pty(Some(link))),
            self.tcp.map(Endpoint::Tcp),
            slcan,
            self.socketcand.map(Endpoint::Socketcand),
            self.can.clone().map(Endpoint::Can),
        ];
        let chosen: Vec<Endpoint> = chosen.into_iter().flatten().collect();
        if chosen.is_empty() {
            return vec![Endpoint::Pty(None), Endpoint::Tcp((Ipv4Addr::LOCALHOST, DEFAULT_TCP_PORT).into())];
        }
        chosen
    }
}

/// Names the option that helps.
fn advise(error: ServeError) -> anyhow::Error {
    let remote = matches!(error, ServeError::Endpoint(EndpointError::Remote { .. }));
    let error = anyhow::Error::new(error);
    if remote { error.context("--allow-remote is needed") } else { error }
}
