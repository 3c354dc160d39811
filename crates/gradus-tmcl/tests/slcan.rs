//! Frames as lines of serial CAN adapters.

use gradus_tmcl::can::Frame;
use gradus_tmcl::slcan::{BadLine, Command, LineReader, Text};
use proptest::prelude::*;

fn frame(id: u32, extended: bool, bytes: &[u8]) -> Frame {
    Frame::new(id, extended, bytes).unwrap()
}

fn read(bytes: &[u8]) -> Vec<Result<Command, BadLine>> {
    let mut reader = LineReader::new();
    bytes.iter().filter_map(|byte| reader.push(*byte)).collect()
}

fn text(frame: &Frame, time_ms: Option<u16>) -> String {
    String::from_utf8(Text::frame(frame, time_ms).bytes().to_vec()).unwrap()
}

#[test]
fn frames_are_written_as_adapters_do() {
    let cases = [
        (frame(1, false, &[6, 1, 0, 0, 0, 0, 0]), None, "t001706010000000000\r"),
        (frame(0x7ff, false, &[]), None, "t7FF0\r"),
        (frame(0x1234_abcd, true, &[0xde, 0xad]), None, "T1234ABCD2DEAD\r"),
        (frame(2, false, &[0xff; 8]), Some(59_999), "t0028FFFFFFFFFFFFFFFFEA5F\r"),
        (frame(0x1fff_ffff, true, &[0xff; 8]), Some(0), "T1FFFFFFF8FFFFFFFFFFFFFFFF0000\r"),
    ];
    for (frame, time, line) in cases {
        assert_eq!(text(&frame, time), line);
    }
}

#[test]
fn lines_are_understood() {
    let cases: [(&[u8], Command); 17] = [
        (b"t0017060100000000ff\r", Command::Frame(frame(1, false, &[6, 1, 0, 0, 0, 0, 255]))),
        (b"T000000012FFee\r", Command::Frame(frame(1, true, &[0xff, 0xee]))),
        (b"t00110512AB\r", Command::Frame(frame(1, false, &[5]))),
        (b"r0010\r", Command::Remote { extended: false }),
        (b"R000000010\r", Command::Remote { extended: true }),
        (b"S8\r", Command::BitRate(1_000_000)),
        (b"S0\r", Command::BitRate(10_000)),
        (b"s031C\r", Command::BitTiming),
        (b"O\r", Command::Open),
        (b"L\r", Command::Listen),
        (b"C\r", Command::Close),
        (b"V\r", Command::Version),
        (b"N\r", Command::SerialNumber),
        (b"F\r", Command::Flags),
        (b"Z1\n\r", Command::Timestamps(true)),
        (b"z\r", Command::Sent),
        (b"\r", Command::Empty),
    ];
    for (bytes, command) in cases {
        assert_eq!(read(bytes), [Ok(command)], "{}", bytes.escape_ascii());
    }
}

#[test]
fn what_is_no_command_is_refused_and_the_next_line_is_read() {
    let cases = [
        "t",
        "t001",
        "t0019",
        "t8000",
        "t0012FF",
        "t0011FG",
        "t0011FF1",
        "T200000000",
        "S9",
        "S",
        "s",
        "O1",
        "Z2",
        "x",
    ];
    for line in cases {
        assert_eq!(read(format!("{line}\rC\r").as_bytes()), [Err(BadLine), Ok(Command::Close)], "{line}");
    }
    let long = format!("t{}\rC\r", "0".repeat(1000));
    assert_eq!(read(long.as_bytes()), [Err(BadLine), Ok(Command::Close)]);
    assert_eq!(read(b"O\x07C\r"), [Err(BadLine), Ok(Command::Close)], "an adapter's no ends a line as well");
}

#[test]
fn bit_rates_of_adapters_have_a_line() {
    assert_eq!(Text::bit_rate(500_000).map(|text| text.bytes().to_vec()), Some(b"S6\r".to_vec()));
    assert!(Text::bit_rate(123).is_none());
}

proptest! {
    #[test]
    fn text_and_frame_are_inverse(id in 0..=0x1fff_ffff_u32, extended: bool, bytes in prop::collection::vec(any::<u8>(), 0..=8), time: Option<u16>) {
        let sent = frame(if extended { id } else { id & 0x7ff }, extended, &bytes);
        prop_assert_eq!(read(text(&sent, time).as_bytes()), [Ok(Command::Frame(sent))]);
    }

    #[test]
    fn any_bytes_are_survived(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        let lines = bytes.iter().filter(|byte| matches!(byte, b'\r' | 7)).count();
        prop_assert_eq!(read(&bytes).len(), lines);
    }
}
