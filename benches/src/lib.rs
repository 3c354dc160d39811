//! A host that sits on the bench: what the benchmarks share.

use gradus_sim::{Bench, Link, LinkKind};
use gradus_tmcl::catalogue::TMCM_3351;
use gradus_tmcl::{Instruction, Opcode, Request};

/// A virtual TMCM-3351 with a host that speaks datagrams to it.
#[derive(Debug)]
pub struct Host {
    /// The module in virtual time.
    pub bench: Bench,
    link: Link,
}

impl Default for Host {
    fn default() -> Self {
        Self::at(Bench::rigid(&TMCM_3351))
    }
}

impl Host {
    /// A host at a module.
    pub fn at(mut bench: Bench) -> Self {
        let link = bench.attach(LinkKind::Usb, 0);
        Self { bench, link }
    }

    /// Sends a command and gives back the reply.
    ///
    /// # Panics
    /// When the module does not answer.
    pub fn command(&mut self, opcode: Opcode, kind: u8, motor: u8, value: i32) -> [u8; 9] {
        let instruction = Instruction { opcode, kind, motor, value };
        self.send(&Request { address: 1, instruction }.emit())
    }

    /// Sends a datagram and gives back the reply.
    ///
    /// # Panics
    /// When the module does not answer.
    pub fn send(&mut self, datagram: &[u8; 9]) -> [u8; 9] {
        self.bench.send(&mut self.link, datagram);
        self.bench.take(&mut self.link).expect("the module answers every datagram")
    }

    /// Downloads a program, one command a line, and starts it.
    ///
    /// # Panics
    /// When a line is not a command.
    pub fn run(&mut self, program: &str) {
        self.command(Opcode::ENTER_DOWNLOAD, 0, 0, 0);
        for line in program.lines().map(str::trim).filter(|line| !line.is_empty()) {
            let instruction = Instruction::parse(line, &TMCM_3351).expect(line);
            self.send(&Request { address: 1, instruction }.emit());
        }
        self.command(Opcode::EXIT_DOWNLOAD, 0, 0, 0);
        self.command(Opcode::RUN_APPLICATION, 1, 0, 0);
    }
}
