//! Every example datagram of the manuals, with the manuals' misprints corrected.

use std::collections::HashMap;

use gradus_tmcl::can::Frame;
use gradus_tmcl::catalogue::Module;
use gradus_tmcl::{Instruction, Opcode, Reply, Request, Status};

/// A row of the table: the module, whether it is a reply, the text of the command (empty for control commands), nine bytes.
struct Example {
    module: &'static Module,
    is_reply: bool,
    text: String,
    bytes: [u8; 9],
}

fn examples() -> Vec<Example> {
    let mut reader = csv::Reader::from_reader(include_str!("vectors.csv").as_bytes());
    reader.deserialize().map(|row| example(&row.unwrap())).collect()
}

fn example(row: &HashMap<String, String>) -> Example {
    let bytes: Vec<u8> = row["bytes"].split(' ').map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect();
    Example {
        module: Module::named(&row["module"]).unwrap(),
        is_reply: row["kind"] == "reply",
        text: row["mnemonic"].clone(),
        bytes: bytes.try_into().unwrap(),
    }
}

fn commands() -> impl Iterator<Item = (Example, Request)> {
    let commands = examples().into_iter().filter(|example| !example.is_reply);
    commands.map(|example| {
        let request = Request::parse(&example.bytes).unwrap();
        (example, request)
    })
}

fn replies() -> impl Iterator<Item = (Example, Reply)> {
    let replies = examples().into_iter().filter(|example| example.is_reply);
    replies.map(|example| {
        let reply = Reply::parse(&example.bytes).unwrap();
        (example, reply)
    })
}

#[test]
fn there_are_116_examples() {
    assert_eq!(examples().len(), 116);
    assert_eq!(commands().count() + replies().count(), 116);
}

#[test]
fn commands_are_read_and_written_byte_for_byte() {
    for (example, request) in commands() {
        assert_eq!(request.address, 1, "{}", example.text);
        assert_eq!(request.emit(), example.bytes, "{}", example.text);
    }
}

#[test]
fn text_and_bytes_of_commands_give_each_other() {
    for (example, request) in commands().filter(|(example, _)| !example.text.is_empty()) {
        assert_eq!(Instruction::parse(&example.text, example.module), Ok(request.instruction), "{}", example.text);
        assert_eq!(request.instruction.display(example.module).to_string(), example.text);
    }
}

#[test]
fn commands_without_text_keep_their_fields() {
    let nameless: Vec<Instruction> =
        commands().filter(|(example, _)| example.text.is_empty()).map(|(_, request)| request.instruction).collect();
    assert_eq!(nameless, [Instruction::new(Opcode::POSITION_EVENT, 1, 0, 5)]);
}

#[test]
fn replies_are_read_and_written_byte_for_byte() {
    for (example, reply) in replies() {
        assert_eq!((reply.host, reply.module), (2, 1), "{}", example.text);
        assert!(reply.status.is_ok(), "{}", example.text);
        assert_eq!(reply.emit(), example.bytes, "{}", example.text);
    }
}

#[test]
fn replies_name_the_command_they_answer() {
    for (example, reply) in replies() {
        let command = match example.text.as_str() {
            "" => Opcode::POSITION_EVENT,
            text => Instruction::parse(text, example.module).unwrap().opcode,
        };
        assert_eq!(reply.command, command, "{}", example.text);
    }
}

#[test]
fn position_event_is_confirmed_and_then_reported() {
    let event = |(_, reply): &(Example, Reply)| reply.command == Opcode::POSITION_EVENT;
    let events: Vec<(Status, i32)> = replies().filter(event).map(|(_, reply)| (reply.status, reply.value)).collect();
    assert_eq!(events, [(Status::OK, 5), (Status::POSITION_REACHED, 5)]);
}

/// The seven bytes between address and checksum, with and without an eighth that means nothing.
fn can_frames(bytes: [u8; 9]) -> [Frame; 4] {
    let frame = |extended, len| {
        let data = [&bytes[1..8], &[0xA5]].concat();
        Frame::new(1, extended, &data[..len]).unwrap()
    };
    [frame(false, 7), frame(false, 8), frame(true, 7), frame(true, 8)]
}

#[test]
fn commands_on_can_are_the_serial_ones_without_address_and_checksum() {
    for (example, request) in commands() {
        for frame in can_frames(example.bytes) {
            assert_eq!(frame.instruction(), Some(request.instruction), "{}", example.text);
        }
        assert_eq!(Frame::request(1, &request.instruction), can_frames(example.bytes)[0], "{}", example.text);
    }
}

#[test]
fn replies_on_can_are_as_long_as_the_request_and_of_its_kind() {
    for (example, reply) in replies() {
        for request in can_frames(example.bytes) {
            let answer = request.answer(2, &reply);
            let data = [&example.bytes[1..8], &[0]].concat();
            assert_eq!((answer.id, answer.extended), (2, request.extended), "{}", example.text);
            assert_eq!(answer.data(), &data[..request.data().len()], "{}", example.text);
        }
    }
}
