//! The event of command 138 (BEHAVIOUR 2).

use gradus_firmware::{Link, LinkKind};
use gradus_tmcl::{Instruction, Opcode, Reply, Status, can};

use crate::support::{Bench, frame, instruction, request};

/// The event of command 138 with its mask.
fn event(mask: i32) -> [u8; 9] {
    let status = Status::POSITION_REACHED;
    Reply { host: 2, module: 1, status, command: Opcode::POSITION_EVENT, value: mask }.emit()
}

#[test]
fn event_is_confirmed_at_once_and_comes_when_all_motors_have_arrived() {
    let mut bench = Bench::fast();
    assert_eq!(bench.control(138, 0, 5), (100, 5));
    bench.all("MVP ABS, 0, 1000; MVP ABS, 2, 5000; MVP ABS, 1, 100000");
    bench.arrive(0);
    assert!(bench.drain().is_empty(), "motor 2 is still under way");
    bench.arrive(2);
    assert_eq!(bench.drain(), [event(5)], "motor 1 does not count");
    bench.advance_ms(5000);
    assert!(bench.drain().is_empty());
}

#[test]
fn event_counts_only_the_motors_that_were_moved() {
    let mut bench = Bench::fast();
    bench.control(138, 0, 7);
    bench.ask("MVP ABS, 1, 1000");
    bench.arrive(1);
    assert_eq!(bench.drain(), [event(7)]);
}

#[test]
fn target_that_sap_writes_makes_no_event() {
    for kind in [0, 1] {
        let mut bench = Bench::fast();
        bench.control(138, kind, 1);
        bench.ask("SAP 0, 0, 1000");
        bench.arrive(0);
        bench.advance_ms(1000);
        assert!(bench.drain().is_empty(), "type {kind}");
        bench.ask("MVP ABS, 0, 2000");
        bench.arrive(0);
        assert_eq!(bench.drain(), [event(1)], "type {kind}: the MVP after it does");
    }
}

#[test]
fn event_of_type_0_comes_for_the_next_move_only_and_of_type_1_for_every_one() {
    for (kind, moves) in [(0, 1), (1, 3)] {
        let mut bench = Bench::fast();
        bench.control(138, kind, 1);
        let mut events = 0;
        for target in [1000, 2000, 3000] {
            bench.ask(&format!("MVP ABS, 0, {target}"));
            bench.advance_ms(1000);
            events += bench.drain().len();
        }
        assert_eq!(events, moves, "type {kind}");
    }
}

#[test]
fn event_comes_for_a_move_to_where_the_motor_is() {
    let mut bench = Bench::new();
    bench.control(138, 0, 1);
    bench.ask("MVP ABS, 0, 0");
    bench.advance_ms(1);
    assert_eq!(bench.drain(), [event(1)]);
}

#[test]
fn event_goes_to_the_link_that_asked() {
    let mut bench = Bench::fast();
    let mut other = Link::new(2, LinkKind::Usb, 0);
    let ask = request(Instruction::new(Opcode::POSITION_EVENT, 1, 0, 2)).emit();
    bench.module.receive(&mut other, &ask);
    assert!(bench.module.transmit(&mut other).is_some());
    bench.control(138, 1, 1);
    bench.all("MVP ABS, 0, 1000; MVP ABS, 1, 2000");
    bench.advance_ms(1000);
    assert_eq!(bench.drain(), [event(1)]);
    assert_eq!(bench.module.transmit(&mut other), Some(event(2)));
    assert_eq!(bench.module.transmit(&mut other), None);
}

#[test]
fn event_on_can() {
    let mut bench = Bench::fast();
    let mut link = Link::new(2, LinkKind::Can, 0);
    let ask = Instruction::new(Opcode::POSITION_EVENT, 0, 0, 1);
    bench.module.receive_frame(&mut link, &can::Frame::request(1, &ask));
    assert!(bench.module.transmit_frame(&mut link).is_some());
    bench.ask("MVP ABS, 0, 1000");
    bench.advance_ms(1000);
    let frame = bench.module.transmit_frame(&mut link).unwrap();
    assert_eq!((frame.id, frame.data()), (2, &[1, 128, 138, 0, 0, 0, 1][..]));
}

#[test]
fn event_on_can_has_the_form_of_its_request() {
    let mut bench = Bench::fast();
    let mut link = Link::new(2, LinkKind::Can, 0);
    let ask = Instruction::new(Opcode::POSITION_EVENT, 0, 0, 1);
    bench.module.receive_frame(&mut link, &frame(1, true, ask, 8));
    bench.module.receive_frame(&mut link, &frame(1, false, instruction("MVP ABS, 0, 0"), 7));
    bench.advance_ms(1);
    let frames: Vec<_> = core::iter::from_fn(|| bench.module.transmit_frame(&mut link)).collect();
    let forms: Vec<_> = frames.iter().map(|frame| (frame.data()[1], frame.extended, frame.data().len())).collect();
    assert_eq!(forms, [(100, true, 8), (100, false, 7), (128, true, 8)]);
}

#[test]
fn event_does_not_overtake_replies_that_are_held_back() {
    let mut bench = Bench::set_up("SGP 75, 0, 20");
    bench.link = Link::new(2, LinkKind::Rs485, 0);
    let ask = Instruction::new(Opcode::POSITION_EVENT, 0, 0, 1);
    for instruction in [ask, instruction("MVP ABS, 0, 0")] {
        bench.raw(&request(instruction).emit());
    }
    bench.advance_ms(1);
    assert!(bench.drain().is_empty());
    bench.advance_ms(20);
    let statuses: Vec<u8> = bench.drain().iter().map(|reply| reply[2]).collect();
    assert_eq!(statuses, [100, 100, 128]);
}

#[test]
fn mask_0_takes_a_request_back() {
    let mut bench = Bench::fast();
    bench.control(138, 1, 1);
    assert_eq!(bench.control(138, 1, 0), (100, 0));
    bench.ask("MVP ABS, 0, 1000");
    bench.advance_ms(1000);
    assert!(bench.drain().is_empty());
}

#[test]
fn event_waits_until_a_stopped_motor_arrives() {
    let mut bench = Bench::fast();
    bench.control(138, 0, 1);
    bench.ask("MVP ABS, 0, 10000");
    bench.advance_ms(50);
    bench.ask("MST 0");
    bench.advance_ms(500);
    assert!(bench.drain().is_empty());
    bench.ask("MVP ABS, 0, 20");
    bench.advance_ms(500);
    assert_eq!(bench.drain(), [event(1)]);
}

/// A client asks for the event of motor 0.
fn ask(bench: &mut Bench, link: &mut Link) {
    let ask = request(Instruction::new(Opcode::POSITION_EVENT, 1, 0, 1)).emit();
    bench.module.receive(link, &ask);
    assert!(bench.module.transmit(link).is_some_and(|reply| reply[2] == 100));
}

#[test]
fn fifth_client_takes_the_place_of_the_one_that_asked_first() {
    for (asks, heard) in [
        (vec![0, 1, 2, 3], [true, true, true, true, false]),
        (vec![0, 1, 2, 3, 4], [false, true, true, true, true]),
        // Who asks again asked last.
        (vec![0, 1, 2, 3, 0, 4], [true, false, true, true, true]),
    ] {
        let mut bench = Bench::fast();
        let mut links: Vec<Link> = (10..15).map(|id| Link::new(id, LinkKind::Usb, 0)).collect();
        asks.iter().for_each(|client| ask(&mut bench, &mut links[*client]));
        bench.ask("MVP ABS, 0, 1000");
        bench.advance_ms(1000);
        let told: Vec<bool> =
            links.iter_mut().map(|link| bench.module.transmit(link).is_some_and(|it| it == event(1))).collect();
        assert_eq!(told, heard, "{asks:?}");
    }
}
