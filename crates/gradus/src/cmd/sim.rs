//! `gradus sim`

use std::io::Write;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::PathBuf;

use anyhow::{Context as _, bail};
use gradus_host::VIRTUAL_MODULES;
use gradus_host::trace::Gatherer;
use gradus_sim::{
    Bench, BenchFile, BusChange, BusKind, Can, Console, Eeprom, EepromError, Endpoint, EndpointError, LineRates,
    Machine, Options, Profile, Rig, RigFile, Serial, ServeError, Server, Speed,
};
use gradus_tmcl::catalogue::Module;

use crate::{complain, port};

/// TCP port that is offered unless told otherwise.
const DEFAULT_TCP_PORT: u16 = 4322;

/// What a serial line as on USB leaves out.
const NO_SEGMENT: &str = "as on USB: every address is answered, at once, at any baud rate; --rs485 gives the line \
                          address, telegram pause and baud rate";

/// Offer a virtual module to other programs
///
/// Without any endpoint it opens a pseudo-terminal and tcp 127.0.0.1:4322. Prints one line an endpoint, `pty PATH`,
/// `tcp ADDR:PORT` and so on, then `ready`, and serves until it gets SIGINT (Ctrl-C), SIGTERM or SIGHUP (terminal closed). Lines on the standard input work the
/// machine by hand.
///
/// A bench file gives the module a machine with travel, switches and encoders, and says what happens to it later; or it describes
/// several modules on buses, with the endpoints of each bus.
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
  gradus sim --rs485 --pty ./line                an RS-485 line that works as a real one
  gradus sim --slcan ./adapter                   a module on CAN, behind a serial adapter
  gradus sim --faults noisy-line                 one datagram in a thousand is garbled
  gradus sim --bench stage.toml                  a module with the machine of a bench file
  gradus sim --count 100                         a hundred modules, on TCP ports 4322 to 4421")]
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
    /// Make the serial line an RS-485 segment, with the module's address, telegram pause and baud rate; a host on the pseudo-terminal
    /// has the rate that it sets, one on TCP 9600 baud
    #[arg(long, conflicts_with = "count")]
    rs485: bool,
    /// Start so many modules, on as many TCP ports in a row; their axes never lose a step, and rest at no cost
    #[arg(long, value_name = "NUMBER", value_parser = clap::value_parser!(u16).range(1..), conflicts_with_all = ["bench", "pty", "slcan", "socketcand", "can"])]
    count: Option<u16>,
    /// What goes wrong on the lines: noisy-line, bad-usb-cable or late-replies
    #[arg(long, value_name = "PROFILE")]
    faults: Option<Profile>,
    /// Seed of the dice for --faults: the same seed is the same faults
    #[arg(long, value_name = "NUMBER", default_value_t = 1)]
    seed: u64,
    /// File that keeps the EEPROM; created if it does not exist. With --count a folder with a file for each module
    #[arg(long, value_name = "FILE")]
    eeprom: Option<PathBuf>,
    /// Virtual seconds a second, or as many as the computer manages
    #[arg(long, value_name = "FACTOR|max", default_value_t, allow_hyphen_values = true)]
    speed: Speed,
    /// Let other computers connect; anybody who can reach the address can move the motors
    #[arg(long)]
    allow_remote: bool,
    /// Record what passes on the lines, for `gradus trace`, `gradus replay` and Wireshark
    #[arg(long, value_name = "FILE.pcapng")]
    trace: Option<PathBuf>,
}

impl Sim {
    pub fn run(self, out: &mut dyn Write) -> anyhow::Result<()> {
        let options = Options { speed: self.speed, allow_remote: self.allow_remote };
        let Setup { mut rig, endpoints } = self.setup()?;
        if let Some(profile) = self.faults {
            for bus in 0..rig.bus_names().count() {
                rig.change(bus, BusChange::Faults(profile, self.seed));
            }
        }
        gradus_sim::allow_many_endpoints(2 * endpoints.len());
        let mut server = Server::open(rig, &[], options)?;
        for (bus, endpoint) in endpoints {
            server.open_endpoint(bus, &endpoint).map_err(advise)?;
        }
        if let Some(file) = &self.trace {
            let (mut gatherer, mut recorder) = (Gatherer::new(), port::recorder(file)?);
            server.tap(move |passed| gatherer.take(passed, &mut recorder));
        }
        server.stop_on_signals()?;
        if self.is_as_on_usb()? {
            complain(format_args!("{NO_SEGMENT}"));
        }
        for endpoint in server.endpoints() {
            writeln!(out, "{endpoint}")?;
        }
        writeln!(out, "ready")?;
        out.flush()?;
        Ok(server.run(Console::standard().ok())?)
    }

    fn setup(&self) -> anyhow::Result<Setup> {
        if let Some(count) = self.count {
            return self.fleet(count);
        }
        if let Some(file) = self.bench.as_deref().map(RigFile::read).transpose()?.flatten() {
            return self.described(&file);
        }
        let mut rig = if self.rs485 { segment(self.build()?) } else { Rig::from(self.build()?) };
        let can = rig.add_bus("can", BusKind::Can(Can::DEFAULT));
        rig.connect(0, can);
        let endpoints = self.endpoints().into_iter().map(|endpoint| (usize::from(endpoint.is_can()), endpoint));
        Ok(Setup { rig, endpoints: endpoints.collect() })
    }

    /// Whether a module alone offers a serial line that is none of RS-485.
    fn is_as_on_usb(&self) -> anyhow::Result<bool> {
        let alone = self.count.is_none() && self.bench.as_deref().map(RigFile::read).transpose()?.flatten().is_none();
        Ok(alone && !self.rs485 && self.endpoints().iter().any(|endpoint| !endpoint.is_can()))
    }

    /// The rig of a bench file, which says itself where its endpoints and memories are.
    fn described(&self, file: &RigFile) -> anyhow::Result<Setup> {
        if !self.chosen_endpoints().is_empty() || self.eeprom.is_some() || self.rs485 {
            bail!(
                "the bench file has several modules: its buses say the endpoints and their kind, its modules the EEPROM files"
            );
        }
        let endpoints = file.endpoints();
        if endpoints.is_empty() {
            bail!(
                "no bus of the bench file has endpoints; add some, such as endpoints = [\"tcp:127.0.0.1:{DEFAULT_TCP_PORT}\"]"
            );
        }
        Ok(Setup { rig: file.build()?, endpoints })
    }

    /// As many modules, each on a line of its own.
    fn fleet(&self, count: u16) -> anyhow::Result<Setup> {
        let first = self.tcp.unwrap_or((Ipv4Addr::LOCALHOST, DEFAULT_TCP_PORT).into());
        if first.port() != 0 && first.port().checked_add(count - 1).is_none() {
            bail!("there are no {count} ports from {} on", first.port());
        }
        let (mut rig, mut endpoints) = (Rig::default(), Vec::new());
        for index in 0..count {
            let bench = Bench::new(self.module, Machine::rigid(self.module), self.memory_of(index)?);
            let module = rig.add_module(&format!("{}", index + 1), bench);
            let bus = rig.add_bus(&format!("usb-{}", index + 1), BusKind::Serial(Serial::USB));
            rig.connect(module, bus);
            let port = if first.port() == 0 { 0 } else { first.port() + index };
            endpoints.push((bus, Endpoint::Tcp((first.ip(), port).into())));
        }
        Ok(Setup { rig, endpoints })
    }

    /// The memory of a module of a fleet.
    fn memory_of(&self, index: u16) -> anyhow::Result<Eeprom> {
        let Some(folder) = &self.eeprom else { return Ok(Eeprom::of(self.module)) };
        std::fs::create_dir_all(folder).with_context(|| format!("cannot make the folder {}", folder.display()))?;
        Ok(Eeprom::open(&folder.join(format!("{:04}.eeprom", index + 1)), self.module)?)
    }

    fn build(&self) -> anyhow::Result<Bench> {
        let Some(file) = &self.bench else {
            return Ok(Bench::new(self.module, Machine::of(self.module), self.memory(self.module)?));
        };
        let file = BenchFile::read(file)?;
        let memory = self.memory(file.module)?;
        Ok(file.build(memory))
    }

    fn memory(&self, module: &Module) -> Result<Eeprom, EepromError> {
        self.eeprom.as_ref().map_or_else(|| Ok(Eeprom::of(module)), |file| Eeprom::open(file, module))
    }

    fn endpoints(&self) -> Vec<Endpoint> {
        let chosen = self.chosen_endpoints();
        if chosen.is_empty() {
            return vec![Endpoint::Pty(None), Endpoint::Tcp((Ipv4Addr::LOCALHOST, DEFAULT_TCP_PORT).into())];
        }
        chosen
    }

    fn chosen_endpoints(&self) -> Vec<Endpoint> {
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
        chosen.into_iter().flatten().collect()
    }
}

/// A module alone on a segment.
fn segment(bench: Bench) -> Rig {
    let mut rig = Rig::default();
    let serial = Serial { strict: true, ..Serial::rs485(LineRates::FACTORY.baud) };
    let bus = rig.add_bus("rs485", BusKind::Serial(serial));
    let module = rig.add_module("module", bench);
    rig.connect(module, bus);
    rig
}

/// Modules on buses, and where hosts find them.
struct Setup {
    rig: Rig,
    endpoints: Vec<(usize, Endpoint)>,
}

/// Names the option that helps.
fn advise(error: ServeError) -> anyhow::Error {
    let remote = matches!(error, ServeError::Endpoint(EndpointError::Remote { .. }));
    let error = anyhow::Error::new(error);
    if remote { error.context("--allow-remote is needed") } else { error }
}
