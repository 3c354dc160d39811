//! A served rig for tests of sessions.
#![allow(dead_code)] // each test file uses a part

use std::thread::{self, JoinHandle};

use gradus_host::Url;
use gradus_sim::{Bench, BusChange, BusKind, Can, Endpoint, Options, Rig, Serial, Server, Speed, Stopper};
use gradus_tmcl::catalogue::{Gp, TMCM_3351};

/// A served rig; it ends with its owner.
pub struct Served {
    url: String,
    stopper: Stopper,
    thread: Option<JoinHandle<()>>,
}

impl Served {
    /// A module on a USB port, as a terminal.
    pub fn terminal(faults: &str, seed: u64) -> Self {
        let mut rig = Rig::from(Bench::with_defaults(&TMCM_3351));
        rig.change(0, BusChange::Faults(faults.parse().unwrap(), seed));
        Self::serve(rig, Endpoint::Pty(None))
    }

    /// Modules with these addresses, or CAN IDs, on a bus of this kind.
    pub fn new(kind: BusKind, addresses: &[i32], faults: &str) -> Self {
        let mut rig = Rig::default();
        let bus = rig.add_bus("bus", kind);
        for address in addresses {
            let mut bench = Bench::with_defaults(&TMCM_3351);
            assert!(bench.set_global(Gp::SerialAddress, *address % 256));
            assert!(bench.set_global(Gp::CanId, *address));
            let module = rig.add_module("module", bench);
            rig.connect(module, bus);
        }
        if !faults.is_empty() {
            rig.change(bus, BusChange::Faults(faults.parse().unwrap(), 1));
        }
        let any = "127.0.0.1:0".parse().unwrap();
        let can = matches!(kind, BusKind::Can(_));
        Self::serve(rig, if can { Endpoint::SlcanTcp(any) } else { Endpoint::Tcp(any) })
    }

    fn serve(rig: Rig, endpoint: Endpoint) -> Self {
        let options = Options { speed: Speed::default(), allow_remote: false };
        let mut server = Server::open(rig, &[endpoint], options).unwrap();
        let url = match &server.endpoints()[0] {
            Endpoint::SlcanTcp(address) => format!("slcan:{address}"),
            Endpoint::Tcp(address) => format!("tcp:{address}"),
            Endpoint::Pty(Some(path)) => format!("serial:{}", path.display()),
            _ => unreachable!(),
        };
        let stopper = server.stopper().unwrap();
        let thread = Some(thread::spawn(move || server.run(None).unwrap()));
        Self { url, stopper, thread }
    }

    pub fn segment(addresses: &[i32], faults: &str) -> Self {
        Self::new(BusKind::Serial(Serial::rs485(1_000_000).without_timing()), addresses, faults)
    }

    pub fn can(ids: &[i32]) -> Self {
        Self::new(BusKind::Can(Can { bit_rate: 1_000_000, timing: false }), ids, "")
    }

    pub fn url(&self, options: &str) -> Url {
        format!("{}{options}", self.url).parse().unwrap()
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        self.stopper.stop();
        self.thread.take().unwrap().join().unwrap();
    }
}
