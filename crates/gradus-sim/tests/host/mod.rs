//! A bench with a host on a USB-like line.

use gradus_sim::{Bench, Link, LinkKind};
use gradus_tmcl::catalogue::{Ap, TMCM_3351};
use gradus_tmcl::{Instruction, Reply, Request, Status};

pub struct Host {
    pub bench: Bench,
    link: Link,
}

impl Host {
    pub fn new(mut bench: Bench) -> Self {
        let link = bench.attach(LinkKind::Usb, 0);
        Self { bench, link }
    }

    /// The value of the reply to a command that must not fail.
    pub fn ask(&mut self, command: &str) -> i32 {
        let instruction = Instruction::parse(command, &TMCM_3351).unwrap();
        self.bench.send(&mut self.link, &Request { address: 1, instruction }.emit());
        let reply = Reply::parse(&self.bench.take(&mut self.link).unwrap()).unwrap();
        assert_eq!(reply.status, Status::OK, "{command}");
        reply.value
    }

    /// Executes commands between semicolons, none of which may fail.
    pub fn tell(&mut self, commands: &str) {
        for command in commands.split(';').map(str::trim).filter(|command| !command.is_empty()) {
            self.ask(command);
        }
    }

    /// A parameter of axis 0.
    pub fn get(&mut self, id: Ap) -> i32 {
        self.bench.axis_parameter(0, id).unwrap()
    }
}
