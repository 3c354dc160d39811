//! Traffic in words: mnemonics, parameter names, units.

use gradus_tmcl::catalogue::{Command, Field, MODULES, Module, OperandKind};
use gradus_tmcl::{Instruction, Opcode, Reply, Request, Status};

use super::{Direction, Packet, Record};
use crate::verdict::{Form, form};
use crate::{Named, verdict};

/// Puts records into words, one after another: what a reply means depends on the request before it.
pub struct Decoder {
    module: &'static Module,
    /// The latest request, with the low byte of its address.
    asked: Option<(u8, Instruction)>,
    /// When the first record came.
    start: Option<std::time::Duration>,
}

impl Decoder {
    /// A decoder that knows the parameters of `module`. A version text that passes shows a better one.
    pub fn new(module: &'static Module) -> Self {
        Self { module, asked: None, start: None }
    }

    /// A line: seconds since the first record, direction, address, what it says.
    pub fn line(&mut self, record: &Record) -> String {
        let start = *self.start.get_or_insert(record.at);
        let seconds = record.at.saturating_sub(start).as_secs_f64();
        format!("{seconds:>12.6}  {}", self.words(record))
    }

    fn words(&mut self, record: &Record) -> String {
        let Some((address, nine)) = nine(&record.packet, self.asked) else {
            return match &record.packet {
                Packet::Serial(bytes) => format!("?     {} bytes: {}", bytes.len(), hex(bytes)),
                Packet::Can(frame) => format!("?     CAN ID {}: {}", frame.id, hex(frame.data())),
                Packet::Notice(text) => format!("!     {text}"),
            };
        };
        match self.direction(record.direction, &nine) {
            Direction::Reply => self.reply(&nine),
            _ => self.request(address, &nine, &record.packet),
        }
    }

    /// Which way nine bytes went. Heard on a shared line, they are a reply if they answer the latest request.
    pub fn direction(&self, known: Direction, nine: &[u8; 9]) -> Direction {
        if known != Direction::Unknown {
            return known;
        }
        let event = Reply::parse(nine).is_ok_and(|reply| reply.status == Status::POSITION_REACHED);
        let answers = self.asked.is_some_and(|(_, request)| answers(request, nine));
        if event || answers { Direction::Reply } else { Direction::Request }
    }

    fn request(&mut self, address: u32, nine: &[u8; 9], packet: &Packet) -> String {
        if let (Packet::Serial(_), Err(error)) = (packet, Request::parse(nine)) {
            return format!("> {address:<3} damaged ({error}): {}", hex(nine));
        }
        let [_, command @ .., _] = *nine;
        let instruction = Instruction::from_bytes(command);
        self.asked = Some((nine[0], instruction));
        let text = match Command::of(instruction.opcode) {
            Some(command) if command.mnemonic.is_empty() => {
                let Instruction { opcode, kind, motor, value } = instruction;
                format!("{} {kind}, {motor}, {value} ({})", opcode.0, command.name)
            }
            _ => instruction.display(self.module).to_string(),
        };
        let meaning = self.parameter(instruction).map(|(named, axis)| {
            if is_write(instruction) { named.shown(axis, named.decode(instruction.value)) } else { named.of(axis) }
        });
        with_meaning(format!("> {address:<3} {text}"), meaning)
    }

    fn reply(&mut self, nine: &[u8; 9]) -> String {
        let asked = self.asked.map(|(_, request)| request).unwrap_or_default();
        match form(asked) {
            Form::Text if nine.iter().skip(1).all(u8::is_ascii_graphic) => {
                let text: String = nine.iter().skip(1).copied().map(char::from).collect();
                let named = MODULES.iter().find(|module| module.version_text.as_slice() == text.as_bytes());
                self.module = named.copied().unwrap_or(self.module);
                return format!("<     {text}");
            }
            Form::Command if Request::parse(nine).is_ok() => {
                let [_, command @ .., _] = *nine;
                return format!("<     {}", Instruction::from_bytes(command).display(self.module));
            }
            _ => {}
        }
        match Reply::parse(nine) {
            Err(error) => format!("<     damaged ({error}): {}", hex(nine)),
            Ok(reply) => {
                let answered = reply.command == asked.opcode && reply.status == Status::OK;
                let parameter = answered.then(|| self.parameter(asked)).flatten().filter(|_| !is_write(asked));
                let meaning = parameter.map(|(named, axis)| named.shown(axis, named.decode(reply.value)));
                with_meaning(format!("< {:<3} {} {}", reply.module, reply.status, reply.value), meaning)
            }
        }
    }

    /// The parameter that a command reads or writes, with its axis.
    fn parameter(&self, instruction: Instruction) -> Option<(Named, u8)> {
        let command = Command::of(instruction.opcode)?;
        let has = |kind| command.operands.iter().any(|operand| operand.field == Field::Kind && operand.kind == kind);
        if has(OperandKind::AxisParameter) {
            return Some((Named::Axis(self.module.axis_parameter(instruction.kind)?), instruction.motor));
        }
        let row = self.module.global_parameter(instruction.motor, instruction.kind)?;
        has(OperandKind::GlobalParameter).then_some((Named::Global { row, number: instruction.kind }, 0))
    }
}

fn is_write(instruction: Instruction) -> bool {
    matches!(instruction.opcode, Opcode::SAP | Opcode::SGP)
}

fn with_meaning(text: String, meaning: Option<String>) -> String {
    meaning.map_or(text.clone(), |meaning| format!("{text:<44}  {meaning}"))
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().join(" ")
}

/// True if nine bytes answer a request.
pub(super) fn answers(request: Instruction, nine: &[u8; 9]) -> bool {
    match form(request) {
        Form::Text => nine.iter().skip(1).all(u8::is_ascii_graphic),
        Form::Command => Request::parse(nine).is_ok(),
        Form::Reply => Reply::parse(nine).is_ok_and(|reply| {
            let known = reply.status.is_ok() || (1..=6).contains(&reply.status.0);
            known && (reply.command == request.opcode || reply.status == Status::WRONG_CHECKSUM)
        }),
    }
}

/// A packet as the nine bytes of a serial datagram, with its address; `None` for what is none.
pub(super) fn nine(packet: &Packet, asked: Option<(u8, Instruction)>) -> Option<(u32, [u8; 9])> {
    match packet {
        Packet::Serial(bytes) => {
            let nine: [u8; 9] = bytes.as_slice().try_into().ok()?;
            Some((nine[0].into(), nine))
        }
        Packet::Can(frame) => {
            let text = asked.is_some_and(|(_, request)| verdict::form(request) == Form::Text);
            let mut nine = [0; 9];
            nine[0] = frame.id as u8;
            nine.get_mut(1..=frame.data().len())?.copy_from_slice(frame.data());
            if !(text && frame.data().iter().all(u8::is_ascii_graphic)) {
                (frame.data().len() >= 7).then_some(())?;
                nine[8] = gradus_tmcl::checksum(&nine[..8]);
            }
            Some((frame.id, nine))
        }
        Packet::Notice(_) => None,
    }
}
