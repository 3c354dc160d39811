//! Lines of the ASCII interface.

use std::collections::HashMap;

use gradus_tmcl::ascii::{Editor, Key, Line, LineError, MAX_LINE, Reply, letter};
use gradus_tmcl::catalogue::{Ascii, COMMANDS, EncodeError, TMCM_351};
use gradus_tmcl::{Instruction, Opcode, ParseError, Status, ascii};
use proptest::prelude::*;

fn line(text: &str) -> Result<Line, LineError> {
    Line::parse(text.as_bytes(), &TMCM_351)
}

fn text(reply: &Reply) -> String {
    String::from_utf8(reply.text().bytes().to_vec()).unwrap()
}

/// The lines that the manual prints (§5.6.1, §5.6.2).
#[test]
fn the_examples_of_the_manual() {
    let mut reader = csv::Reader::from_path("tests/ascii-examples.csv").unwrap();
    let rows: Vec<HashMap<String, String>> = reader.deserialize().map(Result::unwrap).collect();
    assert_eq!(rows.len(), 7);
    for row in rows {
        let own = letter(row["address"].parse().unwrap()).unwrap();
        let said = row["line"].as_bytes();
        if row["kind"] == "reply" {
            let (status, value) = (Status(row["status"].parse().unwrap()), row["value"].parse().unwrap());
            let reply = Reply { host: letter(2).unwrap(), module: own, status, value };
            assert_eq!(Reply::parse(said), Some(reply));
            assert_eq!(text(&reply), format!("{}\r", row["line"]));
        } else {
            let want = match row["command"].as_str() {
                "BIN" => Line::Binary,
                command => Line::Command(Instruction::parse(command, &TMCM_351).unwrap()),
            };
            assert_eq!((said[0], Line::parse(&said[1..], &TMCM_351)), (own, Ok(want)), "{}", row["line"]);
        }
    }
}

#[test]
fn words_of_ascii_mode_stand_beside_its_commands() {
    let control = |opcode| Ok(Line::Command(Instruction::new(opcode, 0, 0, 0)));
    assert_eq!(line("RUN"), control(Opcode::RUN_APPLICATION));
    assert_eq!(line(" stop "), control(Opcode::STOP_APPLICATION));
    assert_eq!(line("Bin"), Ok(Line::Binary));
    assert_eq!(line("gap 1,0"), Ok(Line::Command(Instruction::new(Opcode::GAP, 1, 0, 0))));
    assert_eq!(line("UF3"), Ok(Line::Command(Instruction::new(Opcode::UF3, 0, 0, 0))));
}

#[test]
fn what_a_line_cannot_say_has_a_status() {
    for (text, status) in [
        ("", 2),
        ("FLY 1", 2),
        ("GAP 1, zero", 4),
        ("GAP 1", 4),
        ("SAP 4, 0, 1, 2", 4),
        ("SAP 300, 0, 1", 4),
        ("MVP ABS, 0, 4294967296", 4),
        ("CALC ADD, 1", 6),
        ("WAIT TICKS, 0, 100", 6),
        ("DATA 137, 0, 0, 1234", 6),
        ("RUN 5", 2),
    ] {
        assert_eq!(line(text).unwrap_err().status(), Status(status), "{text}");
    }
    assert_eq!(Line::parse(b"GAP \xff", &TMCM_351), Err(ParseError::Command.into()));
    assert_eq!(line("GAP 1"), Err(ParseError::from(EncodeError::Count { got: 1, want: 3 }).into()));
}

#[test]
fn addresses_have_letters_up_to_62() {
    let letters = [(0, '@'), (1, 'A'), (2, 'B'), (26, 'Z'), (33, 'a'), (62, '~')];
    for (address, want) in letters {
        assert_eq!(letter(address), Some(want as u8), "{address}");
        assert_eq!(ascii::address(want as u8), Some(address), "{want}");
    }
    assert_eq!([63, 64, 192, 255].map(letter), [None; 4]);
    assert_eq!([b' ', b'?', 0x7f, 0xff].map(ascii::address), [None; 4]);
}

#[test]
fn backspace_takes_back_and_a_line_feed_is_nothing() {
    let mut editor = Editor::new();
    let keys: Vec<Key> = b"\x08AX\x08\x7f\x7fB\n\r".iter().map(|byte| editor.push(*byte)).collect();
    use Key::{Ended, Erased, Ignored, Typed};
    assert_eq!(keys, [Ignored, Typed, Typed, Erased, Erased, Ignored, Typed, Ignored, Ended]);
    assert_eq!(editor.line(), b"B");
    editor.clear();
    assert_eq!(editor.line(), b"");
}

#[test]
fn a_long_line_is_known_as_such_until_it_is_shortened() {
    let mut editor = Editor::new();
    for _ in 0..=MAX_LINE {
        editor.push(b'A');
    }
    assert!(editor.is_too_long());
    assert_eq!(editor.line(), [b'A'; MAX_LINE]);
    editor.push(0x08);
    assert!(!editor.is_too_long());
    assert_eq!(editor.line(), [b'A'; MAX_LINE]);
}

#[test]
fn what_is_no_reply_is_none() {
    for line in ["", "BA", "BA 100", "BA 300 1", "BA 100 x", "BA100 1", "BA 100 4294967296"] {
        assert_eq!(Reply::parse(line.as_bytes()), None, "{line}");
    }
}

fn ascii_opcode() -> impl Strategy<Value = Opcode> {
    let rows: Vec<Opcode> = COMMANDS.iter().filter(|row| row.ascii == Ascii::Yes).map(|row| row.opcode).collect();
    prop::sample::select(rows)
}

proptest! {
    #[test]
    fn every_command_is_read_back(
        opcode in ascii_opcode(), kind in 0..4_u8, motor in 0..3_u8, value: i32,
    ) {
        let instruction = Instruction::new(opcode, kind, motor, value);
        let printed = instruction.display(&TMCM_351).to_string();
        prop_assert_eq!(line(&printed), Ok(Line::Command(instruction)), "{}", printed);
    }

    #[test]
    fn every_reply_is_read_back(host in 0x40..=0x7e_u8, module in 0x40..=0x7e_u8, status: u8, value: i32) {
        let reply = Reply { host, module, status: Status(status), value };
        let printed = text(&reply);
        let (bytes, end) = printed.as_bytes().split_at(printed.len() - 1);
        prop_assert_eq!((Reply::parse(bytes), end), (Some(reply), b"\r".as_slice()));
    }

    #[test]
    fn any_bytes_are_a_line_or_an_error(bytes in prop::collection::vec(any::<u8>(), 0..80)) {
        let mut editor = Editor::new();
        for byte in &bytes {
            editor.push(*byte);
        }
        prop_assert!(editor.line().len() <= MAX_LINE);
        let _ = Line::parse(editor.line(), &TMCM_351);
        let _ = Reply::parse(&bytes);
    }
}
