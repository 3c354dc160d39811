//! TMCL on CAN: seven data bytes, the identifier is the address.

use crate::{Instruction, Reply};

/// A CAN frame that carries a command or a reply.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Frame {
    /// Identifier, 11 or 29 bits.
    pub id: u32,
    /// True for a 29-bit identifier.
    pub extended: bool,
    data: [u8; 8],
    len: u8,
}

impl Frame {
    /// A frame with up to eight bytes; `None` if there are more.
    pub fn new(id: u32, extended: bool, bytes: &[u8]) -> Option<Self> {
        let mut data = [0; 8];
        data.get_mut(..bytes.len())?.copy_from_slice(bytes);
        Some(Self { id, extended, data, len: bytes.len() as u8 })
    }

    /// A command in seven bytes.
    pub fn request(id: u32, instruction: &Instruction) -> Self {
        let mut data = [0; 8];
        data[..7].copy_from_slice(&instruction.to_bytes());
        Self { id, extended: false, data, len: 7 }
    }

    /// The command in this frame; hosts send seven or eight bytes, the eighth is meaningless.
    pub fn instruction(&self) -> Option<Instruction> {
        let [head @ .., _] = self.data;
        (self.len >= 7).then(|| Instruction::from_bytes(head))
    }

    /// The answer to this frame: as many bytes as the request, the same kind of identifier. The first byte is the low byte
    /// of the module's CAN ID, which the caller puts into [`Reply::module`].
    pub fn answer(&self, id: u32, reply: &Reply) -> Self {
        let [_, body @ .., _] = reply.emit();
        let mut data = [0; 8];
        data[..7].copy_from_slice(&body);
        Self { id, extended: self.extended, data, len: self.len.max(7) }
    }

    /// The data bytes.
    pub fn data(&self) -> &[u8] {
        self.data.get(..usize::from(self.len)).unwrap_or(&self.data)
    }
}
