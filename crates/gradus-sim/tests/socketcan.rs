//! A CAN interface of Linux. There is none in a container: `conformance/can-vm` runs these tests in a virtual machine.
#![cfg(all(target_os = "linux", feature = "socketcan"))]

use std::thread;
use std::time::{Duration, Instant};

use gradus_sim::{Bench, BusKind, Can, Endpoint, Options, Rig, Server};
use gradus_tmcl::catalogue::{Gp, TMCM_3351};
use socketcan::{CanDataFrame, CanFrame, CanSocket, EmbeddedFrame, ExtendedId, Id, Socket, StandardId};

const INTERFACE: &str = "can0";

fn standard(id: u16) -> Id {
    StandardId::new(id).unwrap().into()
}

/// Sends a command and waits for the frame that answers it.
fn ask(socket: &CanSocket, id: Id, data: &[u8]) -> (Id, Vec<u8>) {
    socket.write_frame(&CanFrame::Data(CanDataFrame::new(id, data).unwrap())).unwrap();
    let start = Instant::now();
    while start.elapsed() < Duration::from_secs(10) {
        if let CanFrame::Data(frame) = socket.read_frame_timeout(Duration::from_secs(10)).unwrap() {
            return (frame.id(), frame.data().to_vec());
        }
    }
    panic!("no answer");
}

#[test]
#[ignore = "needs can0: conformance/can-vm has it"]
fn modules_answer_on_a_can_interface() {
    let mut rig = Rig::default();
    let bus = rig.add_bus("can", BusKind::Can(Can::DEFAULT));
    for (id, reply) in [(1, 0x101), (3, 0x103)] {
        let mut bench = Bench::rigid(&TMCM_3351);
        assert!(bench.set_global(Gp::CanId, id) && bench.set_global(Gp::CanReplyId, reply));
        let module = rig.add_module("module", bench);
        rig.connect(module, bus);
    }
    let mut server = Server::open(rig, &[Endpoint::Can(INTERFACE.into())], Options::default()).unwrap();
    let stopper = server.stopper().unwrap();
    let thread = thread::spawn(move || server.run(None));
    let socket = CanSocket::open(INTERFACE).unwrap();
    for value in 0..100 {
        assert_eq!(
            ask(&socket, standard(1), &[9, 9, 2, 0, 0, 0, value]),
            (standard(0x101), vec![1, 100, 9, 0, 0, 0, value])
        );
        assert_eq!(
            ask(&socket, standard(3), &[10, 9, 2, 0, 0, 0, 0, 0]),
            (standard(0x103), vec![3, 100, 10, 0, 0, 0, 0, 0])
        );
    }
    let (long, answer) = (ExtendedId::new(1).unwrap().into(), ExtendedId::new(0x101).unwrap().into());
    assert_eq!(ask(&socket, long, &[10, 9, 2, 0, 0, 0, 0]), (answer, vec![1, 100, 10, 0, 0, 0, 99]));
    stopper.stop();
    thread.join().unwrap().unwrap();
}

#[test]
fn missing_interface_is_named() {
    let mut rig = Rig::default();
    rig.add_bus("can", BusKind::Can(Can::DEFAULT));
    let error = Server::open(rig, &[Endpoint::Can("can77".into())], Options::default()).unwrap_err();
    assert_eq!(error.to_string(), "cannot open the CAN interface can77; it must be up: `ip link set can77 up`");
}
