//! Datagrams and frames, addresses, error statuses (BEHAVIOUR 1).

use gradus_firmware::{Link, LinkKind};
use gradus_tmcl::catalogue::{Mode, TMCM_3351};
use gradus_tmcl::{Instruction, Opcode, Reply, Request, Status, can};

use crate::support::{Bench, frame, instruction, request};

const VERSION: i32 = 0x0D17_010B;

fn bytes(command: &str) -> [u8; 9] {
    request(instruction(command)).emit()
}

/// What a line of that kind answers to bytes.
fn answers(bench: &mut Bench, kind: LinkKind, bytes: &[u8]) -> Vec<[u8; 9]> {
    bench.link = Link::new(9, kind, 0);
    bench.raw(bytes)
}

// Framing.

#[test]
fn datagram_in_any_portions_is_answered_once() {
    let datagram = bytes("GAP 4, 1");
    for first in 0..=9 {
        for second in first..=9 {
            let mut bench = Bench::new();
            let portions = [&datagram[..first], &datagram[first..second], &datagram[second..]];
            let replies: Vec<_> = portions.iter().flat_map(|portion| bench.raw(portion)).collect();
            assert_eq!(replies, [[2, 1, 100, 6, 0, 0, 200, 0, 53]], "cut at {first} and {second}");
        }
    }
}

#[test]
fn several_datagrams_at_once_are_answered_in_order() {
    let mut bench = Bench::new();
    let stream: Vec<u8> = (0..20).flat_map(|number| bytes(&format!("CALC LOAD, {number}"))).collect();
    let values: Vec<i32> = bench.raw(&stream).iter().map(|reply| Reply::parse(reply).unwrap().value).collect();
    assert_eq!(values, (0..20).collect::<Vec<_>>());
}

#[test]
fn receive_takes_no_more_while_replies_wait() {
    let mut bench = Bench::new();
    let stream = bytes("GAP 4, 0").repeat(10);
    let taken = bench.module.receive(&mut bench.link, &stream);
    assert!(taken < stream.len() && taken.is_multiple_of(9), "{taken} bytes taken");
    assert_eq!(bench.drain().len(), taken / 9);
}

#[test]
fn gap_inside_a_datagram_discards_its_beginning() {
    for (gap_us, pause_us, answered) in [(5_000, 5_000, true), (5_000, 5_001, false), (0, 10_000_000, true)] {
        let mut bench = Bench::new();
        bench.link = Link::new(1, LinkKind::Usb, gap_us);
        let datagram = bytes("GAP 4, 0");
        assert!(bench.raw(&datagram[..4]).is_empty());
        bench.advance_us(pause_us);
        let replies = bench.raw(&datagram[4..]);
        assert_eq!(replies.len(), usize::from(answered), "pause of {pause_us} us, limit {gap_us} us");
        bench.advance_us(20_000);
        let expected = if gap_us == 0 || !answered { 1 } else { replies.len() };
        assert_eq!(bench.raw(&datagram).len(), expected, "the next datagram is whole");
    }
}

#[test]
fn wrong_checksum_is_answered_with_status_1_command_0_value_0() {
    let mut datagram = bytes("ROR 0, 1000");
    datagram[8] ^= 0x10;
    let mut bench = Bench::new();
    assert_eq!(bench.raw(&datagram), [[2, 1, 1, 0, 0, 0, 0, 0, 4]]);
    assert_eq!(bench.get(2, 0), 0, "nothing is executed");
}

#[test]
fn nine_zero_bytes_get_one_reply_on_a_usb_like_line() {
    let mut bench = Bench::new();
    assert_eq!(bench.raw(&[0; 9]), [[2, 1, 2, 0, 0, 0, 0, 0, 5]]);
    assert_eq!(answers(&mut bench, LinkKind::Rs485, &[0; 9]).len(), 0);
}

#[test]
fn nine_zero_bytes_bring_a_line_back_into_step() {
    for lost in 1..9 {
        let mut bench = Bench::new();
        let mut replies = bench.raw(&bytes("GAP 4, 0")[lost..]);
        replies.extend(bench.raw(&[0; 9]));
        let rest = 9 - lost;
        replies.extend(bench.raw(&vec![0; 9 - rest]));
        assert_eq!(replies.len(), 2, "{lost} bytes lost");
        assert_eq!(bench.exchange("GAP 4, 0"), (100, 51_200), "{lost} bytes lost");
    }
}

// Addresses.

#[test]
fn usb_like_line_ignores_the_address_and_answers_with_the_own_one() {
    let mut bench = Bench::set_up("SGP 66, 0, 1");
    for address in [0, 1, 2, 77, 255] {
        let request = Request { address, instruction: instruction("GAP 4, 0") };
        assert_eq!(answers(&mut bench, LinkKind::Usb, &request.emit())[0][..2], [2, 1], "address {address}");
    }
}

#[test]
fn rs485_line_answers_the_own_and_the_secondary_address_only() {
    for (secondary, address, answered) in
        [(0, 1, true), (0, 0, false), (0, 2, false), (9, 9, true), (9, 1, true), (9, 0, false), (9, 255, false)]
    {
        let mut bench = Bench::set_up(&format!("SGP 87, 0, {secondary}"));
        let request = Request { address, instruction: instruction("GAP 4, 0") };
        let mut wrong = request.emit();
        wrong[8] ^= 1;
        for datagram in [request.emit(), wrong] {
            let replies = answers(&mut bench, LinkKind::Rs485, &datagram);
            assert_eq!(replies.len(), usize::from(answered), "{secondary}, {datagram:?}");
            assert!(replies.iter().all(|reply| reply[..2] == [2, 1]));
        }
    }
}

#[test]
fn foreign_command_is_not_executed() {
    let mut bench = Bench::new();
    answers(&mut bench, LinkKind::Rs485, &Request { address: 3, instruction: instruction("ROR 0, 1000") }.emit());
    assert_eq!(bench.get(2, 0), 0);
}

#[test]
fn host_address_stands_at_the_head_of_replies() {
    let mut bench = Bench::new();
    assert_eq!(bench.ask("SGP 76, 0, 33"), 33);
    assert_eq!(bench.raw(&bytes("GAP 4, 0"))[0][0], 33);
}

#[test]
fn new_address_holds_after_the_reply() {
    let mut bench = Bench::new();
    assert_eq!(bench.ask("SGP 66, 0, 7"), 7, "this reply still comes from address 1");
    assert_eq!(bench.raw(&bytes("GAP 4, 0"))[0][1], 7);
    assert!(answers(&mut bench, LinkKind::Rs485, &bytes("GAP 4, 0")).is_empty());
    let request = Request { address: 7, instruction: instruction("GAP 4, 0") };
    assert_eq!(answers(&mut bench, LinkKind::Rs485, &request.emit()).len(), 1);
}

#[test]
fn telegram_pause_holds_replies_of_rs485_back() {
    let mut bench = Bench::set_up("SGP 75, 0, 20");
    bench.link = Link::new(9, LinkKind::Rs485, 0);
    bench.advance_us(123);
    assert!(bench.raw(&bytes("GAP 4, 0")).is_empty());
    assert_eq!(bench.link.ready_at(), Some(20_123));
    bench.advance_us(19_999);
    assert!(bench.drain().is_empty());
    bench.advance_us(1);
    assert_eq!(bench.drain().len(), 1);
    assert_eq!(answers(&mut bench, LinkKind::Usb, &bytes("GAP 4, 0")).len(), 1, "not on USB");
}

#[test]
fn new_telegram_pause_holds_after_the_reply() {
    let mut bench = Bench::new();
    assert_eq!(answers(&mut bench, LinkKind::Rs485, &bytes("SGP 75, 0, 20")).len(), 1);
    assert_eq!(answers(&mut bench, LinkKind::Rs485, &bytes("SGP 75, 0, 0")).len(), 0);
}

// Replies.

#[test]
fn command_without_a_result_echoes_its_value() {
    for command in [
        "ROR 0, 1234",
        "ROL 1, 77",
        "SAP 4, 0, 1000",
        "SGP 0, 2, -5",
        "SIO 0, 2, 1",
        "SCO 3, 0, 42",
        "CALC ADD, 17",
        "CALCV ADD, 3, 9",
        "COMP 5",
        "SIV 8",
    ] {
        assert_eq!(Bench::new().ask(command), instruction(command).value, "{command}");
    }
}

#[test]
fn failing_command_echoes_its_value() {
    for (command, status) in [("SAP 6, 0, 4711", 4), ("SAP 3, 0, 4712", 3), ("DATA 99, 0, 0, 4713", 2), ("JA 4714", 6)]
    {
        assert_eq!(Bench::new().exchange(command), (status, instruction(command).value), "{command}");
    }
}

#[test]
fn suppressed_replies_come_only_to_what_reads_and_to_special_commands() {
    let cases = [
        ("GAP 4, 0", true),
        ("GGP 66, 0", true),
        ("GIO 0, 0", true),
        ("DATA 134, 0, 0, 0", true),
        ("DATA 136, 0, 0, 0", true),
        ("GAP 254, 0", true),
        ("SAP 4, 0, 1000", false),
        ("SAP 254, 0, 1000", false),
        ("GCO 1, 0", false),
        ("MVP ABS, 0, 10", false),
        ("DATA 99, 0, 0, 0", false),
        ("DATA 131, 0, 0, 0", false),
        ("SGP 255, 0, 1", false),
        ("SGP 255, 0, 0", true),
    ];
    for (command, answered) in cases {
        let mut bench = Bench::new();
        bench.raw(&bytes("SGP 255, 0, 1"));
        assert_eq!(bench.raw(&bytes(command)).len(), usize::from(answered), "{command}");
    }
}

#[test]
fn suppressed_replies_include_those_to_wrong_checksums_and_downloads() {
    let mut bench = Bench::new();
    bench.raw(&bytes("SGP 255, 0, 1"));
    assert!(bench.raw(&[1, 6, 0, 0, 0, 0, 0, 0, 0]).is_empty());
    assert!(bench.raw(&bytes("DATA 132, 0, 0, 0")).is_empty());
    assert!(bench.raw(&bytes("CALC LOAD, 3")).is_empty());
    assert!(bench.raw(&bytes("DATA 133, 0, 0, 0")).is_empty());
    assert_eq!(bench.raw(&bytes("DATA 134, 0, 0, 0"))[0][1..8], instruction("CALC LOAD, 3").to_bytes());
}

// CAN.

fn on_can(bench: &mut Bench, frame: can::Frame) -> Option<can::Frame> {
    bench.link = Link::new(9, LinkKind::Can, 0);
    bench.module.poll(bench.now);
    bench.module.receive_frame(&mut bench.link, &frame);
    bench.module.transmit_frame(&mut bench.link)
}

fn can_frame(id: u32, extended: bool, bytes: &[u8]) -> can::Frame {
    can::Frame::new(id, extended, bytes).unwrap()
}

#[test]
fn can_reply_has_as_many_bytes_and_the_kind_of_identifier_of_the_request() {
    for (extended, len) in [(false, 7), (false, 8), (true, 7), (true, 8)] {
        let reply = on_can(&mut Bench::new(), frame(1, extended, instruction("GAP 4, 0"), len));
        let expected = [1, 100, 6, 0, 0, 200, 0, 0];
        assert_eq!(reply, Some(can_frame(2, extended, &expected[..len])), "{extended}, {len}");
    }
}

#[test]
fn can_identifiers_are_global_parameters() {
    let mut bench = Bench::set_up("SGP 71, 0, 1000; SGP 70, 0, 2000; SGP 83, 0, 300; SGP 66, 0, 1");
    for (id, answered) in [(1000, true), (300, true), (1, false), (0, false), (2000, false)] {
        let reply = on_can(&mut bench, frame(id, false, instruction("GAP 4, 0"), 7));
        assert_eq!(reply.is_some(), answered, "identifier {id}");
        if let Some(reply) = reply {
            assert_eq!((reply.id, reply.data()[0]), (2000, 1000_u32 as u8));
        }
    }
}

#[test]
fn can_secondary_identifier_0_is_off() {
    let mut bench = Bench::set_up("SGP 71, 0, 5");
    assert_eq!(on_can(&mut bench, frame(0, false, instruction("GAP 4, 0"), 7)), None);
}

#[test]
fn new_can_identifiers_hold_after_the_reply() {
    let mut bench = Bench::new();
    assert_eq!(on_can(&mut bench, frame(1, false, instruction("SGP 71, 0, 9"), 7)).unwrap().data()[0], 1);
    assert_eq!(on_can(&mut bench, frame(9, false, instruction("SGP 70, 0, 3"), 7)).unwrap().id, 2);
    assert_eq!(on_can(&mut bench, frame(9, false, instruction("GAP 4, 0"), 7)).unwrap().id, 3);
}

#[test]
fn short_frames_are_left_alone() {
    for len in 0..7 {
        let frame = can_frame(1, false, &instruction("GAP 4, 0").to_bytes()[..len]);
        assert_eq!(on_can(&mut Bench::new(), frame), None, "{len} bytes");
    }
}

#[test]
fn special_replies_on_can_are_as_long_as_the_request() {
    let mut bench = Bench::new();
    bench.download("CALC LOAD, 5");
    for (command, expected) in
        [("DATA 136, 0, 0, 0", *b"3351V111"), ("DATA 134, 0, 0, 0", [19, 9, 0, 0, 0, 0, 5, 2 + 19 + 9 + 5])]
    {
        for len in [7, 8] {
            let reply = on_can(&mut bench, frame(1, false, instruction(command), len));
            assert_eq!(reply, Some(can_frame(2, false, &expected[..len])), "{command}");
        }
    }
}

#[test]
fn telegram_pause_has_no_effect_on_can() {
    let mut bench = Bench::set_up("SGP 75, 0, 20");
    assert!(on_can(&mut bench, frame(1, false, instruction("GAP 4, 0"), 7)).is_some());
}

#[test]
fn binary_version_on_can() {
    let reply = on_can(&mut Bench::new(), frame(1, false, instruction("DATA 136, 1, 0, 0"), 7)).unwrap();
    assert_eq!(reply.data()[3..7], VERSION.to_be_bytes());
}

// Errors.

#[test]
fn every_opcode_in_direct_mode_answers_as_its_mode_says() {
    for opcode in 0..=255 {
        let instruction = Instruction::new(Opcode(opcode), 0, 0, 0);
        let reply = Bench::new().send(instruction).expect("every command is answered");
        if matches!(instruction.opcode, Opcode::READ_MEMORY | Opcode::FIRMWARE_VERSION) {
            continue;
        }
        let status = Reply::parse(&reply).unwrap().status;
        let accepted = !matches!(status, Status::INVALID_COMMAND | Status::NOT_AVAILABLE);
        match TMCM_3351.mode(instruction.opcode) {
            Mode::None if opcode < 128 => assert_eq!(status, Status::INVALID_COMMAND, "opcode {opcode}"),
            Mode::None => assert_eq!(status, Status::NOT_AVAILABLE, "opcode {opcode}"),
            Mode::Standalone if matches!(opcode, 20 | 37) => assert!(accepted, "opcode {opcode}"),
            Mode::Standalone => assert_eq!(status, Status::NOT_AVAILABLE, "opcode {opcode}"),
            Mode::Direct | Mode::Both => assert!(accepted, "opcode {opcode}: {status}"),
        }
    }
}

#[test]
fn errors_are_checked_in_order() {
    let cases = [
        // Unknown command.
        ("DATA 7, 254, 9, -1", 2),
        ("DATA 29, 0, 9, 0", 2),
        ("DATA 58, 0, 0, 0", 2),
        ("DATA 127, 0, 0, 0", 2),
        // Not in this mode.
        ("DATA 21, 99, 9, 7000", 6),
        ("JA 7000", 6),
        ("CSUB 0", 6),
        ("RSUB", 6),
        ("WAIT POS, 0, 0", 6),
        ("STOP", 6),
        ("RETI", 6),
        ("RST 0", 6),
        ("DJNZ 0, 0", 6),
        ("DATA 80, 0, 0, 0", 6),
        ("DATA 139, 0, 0, 0", 6),
        ("DATA 140, 0, 0, 0", 6),
        ("DATA 254, 0, 0, 0", 6),
        // Axis before type and value.
        ("ROR 3, 20000000", 4),
        ("ROL 3, 0", 4),
        ("MST 3", 4),
        ("DATA 4, 7, 3, 0", 4),
        ("SAP 254, 3, 0", 4),
        ("GAP 254, 3", 4),
        ("AAP 254, 3", 4),
        ("DATA 13, 9, 3, 0", 4),
        ("SCO 21, 3, 0", 4),
        ("GCO 21, 3", 4),
        ("CCO 21, 3", 4),
        ("ACO 21, 3", 4),
        ("DATA 39, 1, 255, 0", 4),
        ("DATA 32, 1, 255, 0", 4),
        ("DATA 46, 9, 3, 0", 4),
        ("ROLA 3", 4),
        ("RORA 3", 4),
        // Type, parameter, bank, port.
        ("DATA 4, 7, 0, 0", 3),
        ("DATA 46, 9, 0, 0", 3),
        ("DATA 47, 9, 0, 0", 3),
        ("SAP 254, 0, 0", 3),
        ("GAP 254, 0", 3),
        ("SAP 3, 0, 99999999", 3),
        ("SAP 8, 0, 1", 3),
        ("DATA 13, 9, 0, 0", 3),
        ("SGP 64, 0, 0", 3),
        ("SGP 73, 0, 1234", 3),
        ("SGP 0, 1, 0", 3),
        ("SGP 3, 3, 0", 3),
        ("SGP 0, 4, 0", 3),
        ("SGP 128, 0, 9", 3),
        ("GGP 88, 0", 3),
        ("GGP 0, 1", 3),
        ("AGP 0, 1", 3),
        ("STGP 66, 0", 3),
        ("STGP 56, 2", 3),
        ("STGP 0, 3", 3),
        ("RSGP 56, 2", 3),
        ("RSGP 66, 0", 3),
        ("SIO 0, 0, 9", 3),
        ("SIO 0, 1, 9", 3),
        ("SIO 8, 2, 9", 3),
        ("SIO 10, 0, 1", 3),
        ("GIO 9, 0", 3),
        ("GIO 10, 1", 3),
        ("GIO 0, 3", 3),
        ("SCO 21, 0, 0", 3),
        ("SCO 21, 255, 0", 3),
        ("GCO 21, 255", 3),
        ("CCO 21, 0", 3),
        ("EI 6", 3),
        ("DI 47", 3),
        ("VECT 6, 7000", 3),
        ("DATA 19, 10, 0, 0", 3),
        ("DATA 19, 11, 0, 0", 3),
        ("DATA 33, 11, 0, 0", 3),
        ("DATA 33, 12, 0, 0", 3),
        ("DATA 40, 12, 0, 999", 3),
        ("DATA 45, 10, 0, 0", 3),
        ("DATA 36, 6, 0, 0", 3),
        ("DATA 129, 2, 0, 7000", 3),
        ("DATA 135, 4, 0, 0", 3),
        ("DATA 136, 2, 0, 0", 3),
        ("DATA 138, 2, 0, 99", 3),
        ("DATA 141, 4, 0, 7000", 3),
        ("DATA 157, 4, 0, 0", 3),
        ("DATA 157, 22, 0, 0", 3),
        // Value.
        ("ROR 0, 16777216", 4),
        ("ROL 0, 16777216", 4),
        ("ROL 0, -2147483648", 4),
        ("MVP COORD, 0, 21", 4),
        ("MVP COORD, 0, -1", 4),
        ("MVP COORD, $80, 1", 4),
        ("MVP COORD, $88, 1", 4),
        ("MVP COORD, $C8, 1", 4),
        ("SAP 6, 0, 256", 4),
        ("SAP 6, 0, -1", 4),
        ("SAP 12, 0, 2", 4),
        ("SGP 66, 0, 0", 4),
        ("SGP 39, 3, 4", 4),
        ("SIO 0, 2, 2", 4),
        ("SIO 255, 2, 256", 4),
        ("SIO 255, 2, -2", 4),
        ("SIO 8, 0, 2", 4),
        ("VECT 0, 6144", 4),
        ("VECT 0, -1", 4),
        ("CALC DIV, 0", 4),
        ("CALC MOD, 0", 4),
        ("CALCX DIV", 4),
        ("DATA 40, 0, 0, 256", 4),
        ("DATA 129, 1, 0, 6144", 4),
        ("DATA 132, 0, 0, 6144", 4),
        ("DATA 132, 0, 0, -1", 4),
        ("DATA 137, 0, 0, 1", 4),
        ("DATA 138, 0, 0, 8", 4),
        ("DATA 138, 0, 0, -1", 4),
        ("DATA 141, 0, 0, 6144", 4),
        ("DATA 255, 0, 0, 1", 4),
    ];
    for (command, status) in cases {
        assert_eq!(Bench::new().exchange(command).0, status, "{command}");
    }
}

#[test]
fn axis_in_the_x_register_is_checked_as_an_axis() {
    for x in [-1, 3, 256] {
        for command in ["SAPX 254, 0", "GAPX 254", "AAPX 254", "DATA 47, 9, 0, 0", "ROLXA", "RORXA", "MSTX"] {
            let mut bench = Bench::set_up(&format!("CALC LOAD, {x}; CALCX LOAD"));
            assert_eq!(bench.exchange(command).0, 4, "{command}, X = {x}");
        }
    }
}

#[test]
fn failing_command_changes_nothing() {
    let set_up = "CALC LOAD, 99; CALCX LOAD; SAP 249, 0, 7; SAP 249, 1, 7; SCO 1, 0, 500; SIO 255, 2, 5";
    let commands = [
        "ROR 0, 16777216",
        "MVP COORD, 0, 21",
        "MVP COORD, $C9, 1",
        "SAP 4, 0, -1",
        "CALC DIV, 0",
        "DATA 40, 0, 0, 256",
        "SIO 255, 2, 256",
        "SCO 21, 0, 1",
        "SGP 66, 0, 0",
        "SGP 81, 0, 4",
    ];
    let state = |bench: &mut Bench| {
        let axes = [0, 2, 4, 8].map(|number| [0, 1, 2].map(|axis| bench.get(number, axis)));
        let registers = (bench.accumulator(), bench.x());
        (axes, registers, bench.ask("GIO 255, 2"), bench.ask("GCO 1, 0"), bench.global(81, 0), bench.variable(0))
    };
    for command in commands {
        let mut bench = Bench::set_up(set_up);
        let (before, written) = (state(&mut bench), bench.memory().written());
        assert_ne!(bench.exchange(command).0, 100, "{command}");
        assert_eq!(state(&mut bench), before, "{command}");
        assert_eq!(bench.memory().written(), written, "{command}");
    }
}
