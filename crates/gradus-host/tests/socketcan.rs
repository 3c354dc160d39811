//! A CAN interface of Linux. There is none in a container: `conformance/can-vm` runs these tests in a virtual machine.
#![cfg(all(target_os = "linux", feature = "socketcan"))]

use std::thread;

use gradus_host::scan::scan;
use gradus_host::{Session, Url};
use gradus_sim::{Bench, BusKind, Can, Endpoint, Options, Rig, Server};
use gradus_tmcl::catalogue::{Gp, TMCM_3351};

#[test]
#[ignore = "needs can0: conformance/can-vm has it"]
fn sessions_talk_to_modules_on_a_can_interface() {
    let mut rig = Rig::default();
    let bus = rig.add_bus("can", BusKind::Can(Can { bit_rate: 1_000_000, timing: false }));
    for (id, reply) in [(1, 0x101), (3, 0x103)] {
        let mut bench = Bench::with_defaults(&TMCM_3351);
        assert!(bench.set_global(Gp::CanId, id) && bench.set_global(Gp::CanReplyId, reply));
        let module = rig.add_module("module", bench);
        rig.connect(module, bus);
    }
    let mut server = Server::open(rig, &[Endpoint::Can("can0".into())], Options::default()).unwrap();
    let stopper = server.stopper().unwrap();
    let thread = thread::spawn(move || server.run(None));

    thread::scope(|scope| {
        for (id, reply) in [(1, 0x101), (3, 0x103)] {
            scope.spawn(move || {
                let url: Url = format!("can:can0?id={id}&reply={reply}").parse().unwrap();
                let mut session = Session::open(&url).unwrap();
                assert_eq!(session.module().unwrap().name, "TMCM-3351");
                for value in 0..100 {
                    session.set_global(Gp::UserVariable, 0, value).unwrap();
                    assert_eq!(session.get_global(Gp::UserVariable, 0).unwrap(), value);
                    assert_eq!(session.get_global(Gp::CanId, 0).unwrap(), id);
                }
            });
        }
    });
    let found = scan(&"can:can0".parse().unwrap(), 1..=5, |_| true).unwrap();
    let ports: Vec<&str> = found.iter().map(|found| found.port.as_str()).collect();
    assert_eq!(ports, ["can:can0?reply=257", "can:can0?id=3&reply=259"]);
    stopper.stop();
    thread.join().unwrap().unwrap();
}

#[test]
fn a_missing_interface_is_named() {
    let message = Session::open(&"can:can77".parse().unwrap()).err().unwrap().to_string();
    let expected = ["there is no interface `can77`", "no SocketCAN"];
    assert!(expected.iter().any(|expected| message.contains(expected)), "{message}");
}
