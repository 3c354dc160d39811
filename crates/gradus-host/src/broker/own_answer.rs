//! What a broker answers by itself, without a look at the line.

use gradus_tmcl::catalogue::Impact;
use gradus_tmcl::{Instruction, Reply, Request, Status};

use super::news::Visit;
use super::rights::Rights;
use crate::line::stop_latch::LatchRequest;
use crate::{Address, Line};

/// The host's address in answers that are the broker's own.
pub const HOST: u8 = 2;

/// Answers what needs no module.
#[derive(Clone)]
pub struct OwnAnswer {
    pub line: Line,
    pub address: Address,
    pub rights: Rights,
}

impl OwnAnswer {
    /// The request in a datagram; `Err`: the answer to it.
    pub fn look_at(&self, datagram: &[u8; 9], visit: &mut Visit) -> Result<Request, [u8; 9]> {
        visit.requests += 1;
        let Ok(request) = Request::parse(datagram) else {
            visit.damaged += 1;
            return Err(self.reply(datagram[0], Status::WRONG_CHECKSUM, Instruction::default(), 0));
        };
        let Request { address, instruction } = request;
        let latch = LatchRequest::of(instruction);
        let reads = matches!(latch, None | Some(LatchRequest::State)) && instruction.impact() == Impact::Reads;
        if self.rights.read_only && !reads {
            return Err(self.refuse(request, visit));
        }
        match latch {
            None => Ok(request),
            Some(latch) => {
                visit.answers += 1;
                Err(self.reply(address, Status::OK, instruction, latch.apply(self.line.latch())))
            }
        }
    }

    /// The answer to what may not be sent.
    pub fn refuse(&self, Request { address, instruction }: Request, visit: &mut Visit) -> [u8; 9] {
        visit.refused += 1;
        self.reply(address, Status::NOT_AVAILABLE, instruction, instruction.value)
    }

    fn reply(&self, address: u8, status: Status, request: Instruction, value: i32) -> [u8; 9] {
        let module = if self.rights.whole_bus { address } else { self.address.module as u8 };
        Reply { host: HOST, module, status, command: request.opcode, value }.emit()
    }
}
