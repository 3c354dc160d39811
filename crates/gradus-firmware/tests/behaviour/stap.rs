//! STAP and RSAP, on a module that has them.

use gradus_firmware::{Link, LinkKind, Module};
use gradus_tmcl::catalogue::{Gp, TMCM_351};
use gradus_tmcl::{Instruction, Opcode, Reply};

use crate::support::{Machine, Memory, OWN_LINK, request};

struct Host {
    module: Module<Machine, Memory>,
    link: Link,
}

impl Host {
    fn new(memory: Memory) -> Self {
        let module = Module::new(&TMCM_351, Machine::default(), memory);
        Self { module, link: Link::new(OWN_LINK, LinkKind::Usb, 0) }
    }

    fn power_cycle(self) -> Self {
        Self::new(self.module.into_parts().1)
    }

    fn obey(&mut self, opcode: Opcode, kind: u8, motor: u8, value: i32) -> (u8, i32) {
        self.module.receive(&mut self.link, &request(Instruction::new(opcode, kind, motor, value)).emit());
        let reply = Reply::parse(&self.module.transmit(&mut self.link).unwrap()).unwrap();
        (reply.status.0, reply.value)
    }

    fn get(&mut self, number: u8, axis: u8) -> i32 {
        self.obey(Opcode::GAP, number, axis, 0).1
    }

    fn set(&mut self, number: u8, axis: u8, value: i32) {
        assert_eq!(self.obey(Opcode::SAP, number, axis, value).0, 100);
    }
}

const CURRENT: u8 = 6;

#[test]
fn stored_parameters_are_there_after_power_on_and_others_are_not() {
    let mut host = Host::new(Memory::blank(0xff));
    let default = host.get(CURRENT, 1);
    host.set(CURRENT, 0, 77);
    host.set(CURRENT, 1, 78);
    assert_eq!(host.obey(Opcode::STAP, CURRENT, 0, 5), (100, 5));
    let mut host = host.power_cycle();
    assert_eq!([0, 1].map(|axis| host.get(CURRENT, axis)), [77, default]);
}

#[test]
fn restoring_gives_what_was_stored_or_the_default() {
    let mut host = Host::new(Memory::blank(0));
    let default = host.get(CURRENT, 1);
    host.set(CURRENT, 0, 77);
    host.obey(Opcode::STAP, CURRENT, 0, 0);
    for axis in [0, 1] {
        host.set(CURRENT, axis, 9);
        assert_eq!(host.obey(Opcode::RSAP, CURRENT, axis, 0).0, 100);
    }
    assert_eq!([0, 1].map(|axis| host.get(CURRENT, axis)), [77, default]);
}

#[test]
fn what_cannot_be_stored_is_refused() {
    let mut host = Host::new(Memory::blank(0));
    for opcode in [Opcode::STAP, Opcode::RSAP] {
        assert_eq!(host.obey(opcode, 1, 0, 0).0, 3, "the actual position");
        assert_eq!(host.obey(opcode, 120, 0, 0).0, 3, "no parameter");
        assert_eq!(host.obey(opcode, CURRENT, 3, 0).0, 4, "no axis");
    }
    let lock = TMCM_351.global_parameters.iter().find(|row| row.id == Gp::EepromLock).unwrap();
    host.obey(Opcode::SGP, lock.first, 0, 1234);
    assert_eq!(host.obey(Opcode::STAP, CURRENT, 0, 0).0, 5);
    assert_eq!(host.obey(Opcode::RSAP, CURRENT, 0, 0).0, 100, "a lock does not keep from reading");
}

#[test]
fn factory_settings_forget_stored_parameters() {
    let mut host = Host::new(Memory::blank(0));
    let default = host.get(CURRENT, 0);
    host.set(CURRENT, 0, 77);
    host.obey(Opcode::STAP, CURRENT, 0, 0);
    host.module.receive(&mut host.link, &request(Instruction::new(Opcode::FACTORY_SETTINGS, 0, 0, 1234)).emit());
    let mut host = host.power_cycle();
    assert_eq!(host.get(CURRENT, 0), default);
}
