//! Records in words and in files.

use std::sync::{Arc, Mutex};

use gradus_tmcl::catalogue::{Ap, TMCM_3351};
use gradus_tmcl::{Instruction, Opcode};
use proptest::prelude::*;

use super::*;
use crate::{Line, Session, Url};

fn url() -> Url {
    "sim:tmcm-3351".parse().unwrap()
}

/// What passes while `work` is done.
fn traffic(work: impl FnOnce(&mut Session)) -> Vec<Record> {
    let records = Arc::new(Mutex::new(Vec::new()));
    let line = Line::open(&url()).unwrap();
    let mut session = Session::on_line(&line, &url()).unwrap();
    let kept = Arc::clone(&records);
    line.trace(Box::new(move |record| kept.lock().unwrap().push(record.clone())));
    work(&mut session);
    std::mem::take(&mut records.lock().unwrap())
}

fn example() -> Vec<Record> {
    traffic(|session| {
        session.module().unwrap();
        session.set_axis(Ap::RampType, 0, 1).unwrap();
        session.get_axis(Ap::MaxSpeed, 2).unwrap();
        let _ = session.set_axis(Ap::MaxCurrent, 0, 256);
        session.command(Instruction::parse("SGP 5, 2, -7", &TMCM_3351).unwrap()).unwrap();
        session.command(Instruction::new(Opcode::POSITION_EVENT, 0, 0, 1)).unwrap();
        session.command(Instruction::parse("MVP ABS, 0, 100", &TMCM_3351).unwrap()).unwrap();
        session.wait_event(Duration::from_secs(1)).unwrap();
        session.read_memory(0).unwrap();
    })
}

fn words(records: &[Record]) -> String {
    let mut decoder = Decoder::new(&TMCM_3351);
    let lines: Vec<String> = records.iter().map(|record| decoder.line(record)).collect();
    lines.join("\n")
}

#[test]
fn traffic_is_told_in_mnemonics_names_and_units() {
    insta::assert_snapshot!(words(&example()));
}

#[test]
fn on_a_shared_line_replies_are_known_by_what_they_answer() {
    let heard: Vec<Record> =
        example().into_iter().map(|record| Record { direction: Direction::Unknown, ..record }).collect();
    assert_eq!(words(&heard), words(&example()));
}

#[test]
fn what_is_no_datagram_is_shown_as_it_is() {
    let record = |packet| Record { at: Duration::ZERO, direction: Direction::Request, packet };
    let cases = [
        (Packet::Serial(vec![1, 2, 3]), "?     3 bytes: 01 02 03"),
        (Packet::Serial(vec![1, 6, 4, 0, 0, 0, 0, 0, 0]), "> 1   damaged (checksum 0x00, expected 0x0b): 01 06 04"),
        (Packet::Can(Frame::new(0x80, false, &[1]).unwrap()), "?     CAN ID 128: 01"),
        (Packet::Notice("the search has failed".into()), "!     the search has failed"),
        (Packet::Can(Frame::new(300, false, &[6, 4, 0, 0, 0, 0, 0]).unwrap()), "> 300 GAP 4, 0"),
    ];
    for (packet, expected) in cases {
        let line = words(&[record(packet)]);
        assert!(line.contains(expected), "{line}");
    }
}

fn written(records: &[Record]) -> Vec<u8> {
    let mut file = Vec::new();
    let mut writer = PcapngWriter::new(&mut file).unwrap();
    records.iter().for_each(|record| writer.write(record).unwrap());
    file
}

#[test]
fn a_file_of_another_program_may_count_nanoseconds() {
    // A section, an interface (USER0, resolution 10^-9 s), and a packet of one byte without options.
    let blocks: [&[u32]; 3] = [
        &[0x0a0d_0d0a, 28, 0x1a2b_3c4d, 1, u32::MAX, u32::MAX, 28],
        &[1, 32, 147, 0, 0x0001_0009, 9, 0, 32],
        &[6, 36, 0, 1, 500, 1, 1, 0x55, 36],
    ];
    let mut file: Vec<u8> = blocks.concat().iter().flat_map(|word| word.to_be_bytes()).collect();
    // The first byte comes first in this order: fields of less than a word stand at its beginning.
    file[28 + 8..28 + 12].copy_from_slice(&[0, 147, 0, 0]);
    file[28 + 16..28 + 24].copy_from_slice(&[0, 9, 0, 1, 9, 0, 0, 0]);
    file[60 + 28] = 0x55;
    let records = read_pcapng(&file).unwrap();
    assert_eq!(records[0].at, Duration::from_nanos((1 << 32) + 500));
    assert_eq!(records[0].packet, Packet::Serial(vec![0x55]));
}

#[test]
fn requests_have_their_answers() {
    let exchanges = exchanges(&example());
    assert_eq!(exchanges.len(), 8);
    assert!(exchanges.iter().all(|exchange| exchange.answer.is_some()));
    let mut session = Session::open(&url()).unwrap();
    for exchange in &exchanges {
        assert!(exchange.agrees(&session.relay(exchange.request).unwrap()), "{exchange:?}");
    }
    session.set_axis(Ap::MaxSpeed, 2, 1).unwrap();
    let asked = exchanges.iter().find(|exchange| exchange.request.opcode == Opcode::GAP).unwrap();
    assert!(!asked.agrees(&session.relay(asked.request).unwrap()));
}

fn record() -> impl Strategy<Value = Record> {
    let frame = (0_u32..0x800, any::<bool>(), proptest::collection::vec(any::<u8>(), 0..=8));
    let packet = prop_oneof![
        proptest::collection::vec(any::<u8>(), 0..20).prop_map(Packet::Serial),
        frame.prop_map(|(id, extended, bytes)| Packet::Can(Frame::new(id, extended, &bytes).unwrap())),
        ".{0,40}".prop_map(Packet::Notice),
    ];
    let direction = prop_oneof![Just(Direction::Request), Just(Direction::Reply), Just(Direction::Unknown)];
    (any::<u32>(), direction, packet).prop_map(|(us, direction, packet)| Record {
        at: Duration::from_micros(u64::from(us) * 1_000_003),
        direction,
        packet,
    })
}

proptest! {
    #[test]
    fn records_survive_a_file(records in proptest::collection::vec(record(), 0..20)) {
        prop_assert_eq!(read_pcapng(&written(&records)).unwrap(), records);
    }

    #[test]
    fn a_file_that_is_cut_off_has_what_came_before(records in proptest::collection::vec(record(), 1..5), cut in 1_usize..40) {
        let file = written(&records);
        let read = read_pcapng(&file[..file.len() - cut]).unwrap();
        prop_assert!(read.len() < records.len() && records.starts_with(&read));
    }

    #[test]
    fn no_file_makes_a_panic(mut file in Just(written(&[])), noise in proptest::collection::vec(any::<u8>(), 0..200)) {
        let _ = read_pcapng(&noise);
        file.extend(noise);
        let _ = read_pcapng(&file);
        words(&[Record { at: Duration::ZERO, direction: Direction::Unknown, packet: Packet::Serial(file) }]);
    }
}
