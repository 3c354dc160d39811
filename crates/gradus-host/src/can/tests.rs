//! Frames and the nine bytes that a session sees of them.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

use gradus_tmcl::{Opcode, Reply, Status};

use super::*;
use crate::Session;

/// Modules with the identifiers 5 and 261, whose low bytes are the same, on a bus with other traffic.
#[derive(Clone, Default)]
struct FakeBus(Arc<Mutex<VecDeque<Frame>>>);

impl FramePort for FakeBus {
    fn send(&mut self, frame: &Frame) -> io::Result<()> {
        let mut bus = self.0.lock().unwrap();
        bus.push_back(Frame::new(0x80, false, &[1]).unwrap());
        let Some(reply_id) = [(5, 2), (261, 3)].iter().find(|(id, _)| *id == frame.id).map(|(_, reply)| *reply) else {
            return Ok(());
        };
        let request = frame.instruction().unwrap();
        if request.opcode == Opcode::FIRMWARE_VERSION && request.kind == 0 {
            let len = frame.data().len();
            bus.push_back(Frame::new(reply_id, false, &b"3351V111"[..len]).unwrap());
            return Ok(());
        }
        let value = if request.opcode == Opcode::GAP { frame.id as i32 } else { request.value };
        let reply = Reply { host: 0, module: frame.id as u8, status: Status::OK, command: request.opcode, value };
        bus.push_back(frame.answer(reply_id, &reply));
        Ok(())
    }

    fn receive(&mut self, _: Duration) -> io::Result<Option<Frame>> {
        Ok(self.0.lock().unwrap().pop_front())
    }
}

fn session(module: u16, reply: Option<u16>) -> Session {
    let link = CanLink {
        port: Box::new(FakeBus::default()),
        opened: Instant::now(),
        reply: None,
        form: Form::Reply,
        check: "",
    };
    Session::over(Box::new(link), "can", Address { module, reply })
}

#[test]
fn a_module_is_asked_under_its_identifier_and_heard_under_its_reply_identifier() {
    for (module, reply) in [(5, Some(2)), (261, Some(3)), (5, None)] {
        let mut session = session(module, reply);
        for _ in 0..10 {
            assert_eq!(session.command(Instruction::new(Opcode::GAP, 1, 0, 0)).unwrap(), i32::from(module));
        }
        assert_eq!(session.module().unwrap().name, "TMCM-3351");
        assert_eq!(session.version_text().unwrap(), "3351V111");
    }
}

#[test]
fn a_wrong_reply_identifier_is_silence() {
    let mut session = session(5, Some(3));
    session.set_timeout(Duration::from_millis(5));
    let message = session.command(Instruction::new(Opcode::GAP, 1, 0, 0)).unwrap_err().to_string();
    assert!(message.contains("no module answers at CAN ID 5"), "{message}");
}

#[test]
fn socketcand_texts_are_frames() {
    let frame = Frame::new(0x7f, false, &[1, 0xab]).unwrap();
    assert_eq!(socketcand::message(&frame), "< send 7F 2 01 AB >");
    assert_eq!(socketcand::message(&Frame::new(1, true, &[]).unwrap()), "< send 00000001 0  >");
    assert_eq!(socketcand::frame("frame 7f 1700000000.123456 01AB"), Some(frame));
    assert_eq!(socketcand::frame("frame 7f 1700000000.123456 01 AB"), Some(frame));
    assert_eq!(socketcand::frame("frame 00000001 1.0 "), Frame::new(1, true, &[]));
    for text in ["", "ok", "frame 7f", "frame xx 1.0 00", "error x y zz", "frame 7f 1.0 0"] {
        let parsed = socketcand::frame(text);
        assert!(parsed.is_none() || text.ends_with(" 0"), "{text}: {parsed:?}");
    }
}
