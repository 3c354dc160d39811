//! What nine bytes are to a request: its answer, damaged, or something else.

use gradus_tmcl::{Instruction, Opcode, Reply, Request, Status};

/// The two addresses at the head of a reply.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Peer {
    pub host: u8,
    pub module: u8,
}

/// What nine bytes are to a request.
#[derive(PartialEq, Eq, Debug)]
pub enum Verdict {
    /// Its answer.
    Answer,
    /// The answer to something else.
    Foreign,
    /// Damaged on the way.
    Damaged,
    /// The module's word that the request came damaged.
    DamagedRequest,
}

/// What an answer looks like.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Form {
    /// Status, command, value.
    Reply,
    /// Eight characters.
    Text,
    /// A command.
    Command,
}

/// What the answer to a request looks like.
pub fn form(request: Instruction) -> Form {
    match (request.opcode, request.kind) {
        (Opcode::FIRMWARE_VERSION, 0) => Form::Text,
        (Opcode::READ_MEMORY, _) => Form::Command,
        _ => Form::Reply,
    }
}

/// Says what a datagram is to a request to `peer`. `nonce` is the value of the latest probe, whose answer may come twice.
pub fn judge(request: Instruction, peer: Peer, nonce: i32, bytes: &[u8; 9]) -> Verdict {
    match form(request) {
        Form::Reply => judge_reply(request, peer, nonce, bytes),
        Form::Text => match bytes {
            [host, text @ ..] if *host == peer.host && text.iter().all(u8::is_ascii_graphic) => Verdict::Answer,
            // This reply has no checksum; one that fits shows an answer to something else.
            _ if Reply::parse(bytes).is_ok() => Verdict::Foreign,
            _ => Verdict::Damaged,
        },
        // The reply is built as a request is: an address, seven bytes of a command, a checksum. What a module says of a
        // damaged request would pass for a command, see `Session::read_memory`.
        Form::Command => match Request::parse(bytes) {
            Err(_) => Verdict::Damaged,
            Ok(reply) if reply.instruction == complaint(peer) => Verdict::DamagedRequest,
            Ok(reply) if reply.address != peer.host => Verdict::Foreign,
            Ok(_) => Verdict::Answer,
        },
    }
}

/// The command that a module's word about a damaged request looks like where a command is expected.
pub fn complaint(peer: Peer) -> Instruction {
    Instruction::new(Opcode(peer.module), Status::WRONG_CHECKSUM.0, Opcode::NOP.0, 0)
}

fn judge_reply(request: Instruction, peer: Peer, nonce: i32, bytes: &[u8; 9]) -> Verdict {
    let Ok(reply) = Reply::parse(bytes) else { return Verdict::Damaged };
    let probed = reply.command == Opcode::GET_INFO && reply.value == nonce;
    if reply.module != peer.module {
        Verdict::Foreign
    } else if reply.status == Status::WRONG_CHECKSUM && reply.command == Opcode::NOP {
        Verdict::DamagedRequest
    } else if reply.command != request.opcode || probed {
        Verdict::Foreign
    } else {
        Verdict::Answer
    }
}
