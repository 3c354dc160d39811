//! `gradus serve`

use std::io::Write;
use std::net::{SocketAddr, TcpListener};
use std::path::PathBuf;

use anyhow::{Context, bail};
use gradus_host::{Broker, Line, MOST_CLIENTS, Place, Rights, Session, Url};

use crate::interruption::end_of_service;
use crate::{complain, port};

/// Share a line between several programs
///
/// Listens on a TCP address; every client has the module for itself, as on a USB port, and gets the answers to its own requests
/// and no others. The line's faults are dealt with here: late and damaged answers never reach a client. With --bus the address in a
/// request counts, and a client reaches every module of the line.
///
/// Prints `tcp ADDR:PORT` and `ready`, then a line for each client that comes and goes; ends on Ctrl-C.
///
/// While one client writes a program into a module, what others send there is refused (status 6); 133 and MST of any client end that
/// download, and what its owner still sends is refused. `gradus stop --port tcp:ADDR:PORT` stops the line: nothing that acts
/// passes until `gradus stop --release`. When the line breaks, all clients are let go, and the port is opened again as soon as
/// that works.
#[derive(clap::Args)]
#[command(after_long_help = "\
Examples:
  gradus serve --port /dev/ttyACM0 --tcp 127.0.0.1:4322
  gradus get --port tcp:127.0.0.1:4322 actual_position
  gradus serve --port '/dev/ttyUSB0?baud=115200' --bus --read-only --tcp 127.0.0.1:4322")]
pub struct Serve {
    /// Port of the module or line to share
    #[arg(long, value_name = "URL")]
    port: Url,
    /// TCP address to listen on; port 0 picks a free one
    #[arg(long, value_name = "ADDR", value_parser = port::address, default_value = "127.0.0.1:4322")]
    tcp: SocketAddr,
    /// The address in a request counts: clients see all modules of the line
    #[arg(long)]
    bus: bool,
    /// Clients may read and nothing else; other commands are refused (status 6)
    #[arg(long)]
    read_only: bool,
    /// How many clients may be connected at a time; who comes then is told of here, and not let in
    #[arg(long, value_name = "N", default_value_t = MOST_CLIENTS, value_parser = most_clients)]
    clients: usize,
    /// Let other computers connect; anybody who can reach the address can move the motors
    #[arg(long)]
    allow_remote: bool,
    /// Record what passes over the line
    #[arg(long, value_name = "FILE.pcapng")]
    trace: Option<PathBuf>,
}

fn most_clients(text: &str) -> Result<usize, &'static str> {
    text.parse().ok().filter(|count| (1..=10_000).contains(count)).ok_or("expected is a number from 1 to 10000")
}

impl Serve {
    pub fn run(self, out: &mut dyn Write) -> anyhow::Result<()> {
        if !self.allow_remote && !self.tcp.ip().is_loopback() {
            bail!("--allow-remote is needed: {} can be reached from other computers", self.tcp);
        }
        if let Place::Sim(module) = self.port.place {
            bail!(
                "time would stand still in a virtual module of this process; `gradus sim {}` serves one",
                module.name.to_lowercase()
            );
        }
        let line = Line::open(&self.port)?;
        if let Some(file) = &self.trace {
            line.trace(port::recorder(file)?);
        }
        let listener = TcpListener::bind(self.tcp).with_context(|| format!("cannot listen on {}", self.tcp))?;
        let stop = end_of_service();
        let rights = Rights { whole_bus: self.bus, read_only: self.read_only };
        if !self.bus {
            let mut session = Session::new(&line, self.port.address);
            session.set_timeout(self.port.timeout);
            session.greet()?;
        }
        writeln!(out, "tcp {}\nready", listener.local_addr()?)?;
        out.flush()?;
        let mut broker = Broker::new(line, self.port.address, self.port.timeout, rights);
        broker.set_most_clients(self.clients);
        broker.reopen_at(self.port);
        broker.serve(&listener, &stop, |news| complain(format_args!("{news}")))?;
        Ok(())
    }
}
