//! Text and bytes are inverse to each other, for everything that fits into a datagram.

use gradus_tmcl::can::Frame;
use gradus_tmcl::catalogue::{COMMANDS, MODULES, Module};
use gradus_tmcl::{Framer, Instruction, Opcode, Reply, Request, Status};
use proptest::prelude::*;

fn module() -> impl Strategy<Value = &'static Module> {
    prop::sample::select(MODULES)
}

/// Any instruction, small fields more often than not so that commands are met with operands that make sense.
fn instruction() -> impl Strategy<Value = Instruction> {
    let opcode = prop_oneof![any::<u8>(), prop::sample::select(COMMANDS).prop_map(|command| command.opcode.0)];
    let byte = || prop_oneof![Just(0), 0..13_u8, any::<u8>()];
    let value = prop_oneof![Just(0), -5..300_i32, any::<i32>()];
    (opcode, byte(), byte(), value)
        .prop_map(|(opcode, kind, motor, value)| Instruction::new(Opcode(opcode), kind, motor, value))
}

proptest! {
    #[test]
    fn instruction_survives_bytes(instruction in instruction()) {
        prop_assert_eq!(Instruction::from_bytes(instruction.to_bytes()), instruction);
    }

    #[test]
    fn bytes_survive_an_instruction(bytes: [u8; 7]) {
        prop_assert_eq!(Instruction::from_bytes(bytes).to_bytes(), bytes);
    }

    #[test]
    fn instruction_survives_text(instruction in instruction(), module in module()) {
        let text = instruction.display(module).to_string();
        prop_assert_eq!(Instruction::parse(&text, module), Ok(instruction), "{}", text);
    }

    #[test]
    fn parser_survives_any_text(text in "\\PC{0,30}", module in module()) {
        let _ = Instruction::parse(&text, module);
    }

    #[test]
    fn parsed_line_survives_its_canonical_form(
        command in prop::sample::select(COMMANDS),
        operands in prop::collection::vec("[ ]?(-?[0-9]{1,3}|\\$[0-9a-f]{1,2}|0x[0-9A-F]{1,2}|%[01]{1,8}|[A-Z]{2,5})[ ]?", 0..5),
        module in module(),
    ) {
        let line = format!("{} {}", command.mnemonic, operands.join(","));
        if let Ok(instruction) = Instruction::parse(&line, module) {
            let text = instruction.display(module).to_string();
            prop_assert_eq!(Instruction::parse(&text, module), Ok(instruction), "{} became {}", line, text);
        }
    }

    #[test]
    fn request_survives_bytes(address: u8, instruction in instruction()) {
        let request = Request { address, instruction };
        prop_assert_eq!(Request::parse(&request.emit()), Ok(request));
    }

    #[test]
    fn reply_survives_bytes(host: u8, module: u8, status: u8, command: u8, value: i32) {
        let reply = Reply { host, module, status: Status(status), command: Opcode(command), value };
        prop_assert_eq!(Reply::parse(&reply.emit()), Ok(reply));
    }

    #[test]
    fn changed_byte_is_noticed(address: u8, instruction in instruction(), at in 0..9_usize, change in 1..=255_u8) {
        let mut bytes = Request { address, instruction }.emit();
        bytes[at] = bytes[at].wrapping_add(change);
        prop_assert!(Request::parse(&bytes).is_err());
    }

    #[test]
    fn instruction_survives_can(id in 0..2048_u32, instruction in instruction()) {
        prop_assert_eq!(Frame::request(id, &instruction).instruction(), Some(instruction));
    }

    #[test]
    fn framer_cuts_any_stream_into_nines(stream: Vec<u8>) {
        let mut framer = Framer::new(0);
        let mut out: Vec<u8> = stream.iter().filter_map(|byte| framer.push(*byte, 0)).flatten().collect();
        out.extend(framer.pending());
        prop_assert_eq!(out, stream);
    }
}
