//! The identity of a program: 16 hexadecimal digits that tell its versions apart. They protect nothing.

use std::fmt;

use gradus_tmcl::Instruction;

use crate::binary;

/// FNV-1a with 64 bits over the 8 bytes of each command, up to the last one that is not 0: neither the end mark of a download nor
/// the empty memory behind it counts.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
pub struct Identity(u64);

const OFFSET_BASIS: u64 = 0xcbf2_9ce4_8422_2325;
const PRIME: u64 = 0x0000_0100_0000_01b3;

impl Identity {
    /// The identity of a program or of a program memory.
    pub fn of(program: &[Instruction]) -> Self {
        let bytes = used(program).iter().flat_map(binary::bytes);
        Self(bytes.fold(OFFSET_BASIS, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(PRIME)))
    }
}

impl fmt::Display for Identity {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{:016x}", self.0)
    }
}

/// The commands up to the last one that is not 0.
pub(crate) fn used(program: &[Instruction]) -> &[Instruction] {
    let end = program.iter().rposition(|instruction| *instruction != Instruction::default());
    &program[..end.map_or(0, |last| last + 1)]
}

#[cfg(test)]
mod tests {
    use gradus_tmcl::Opcode;

    use super::*;

    #[test]
    fn an_empty_program_has_the_offset_basis() {
        assert_eq!(Identity::of(&[]).to_string(), "cbf29ce484222325");
        assert_eq!(Identity::of(&[Instruction::default(); 5]), Identity::of(&[]));
    }

    #[test]
    fn end_mark_and_padding_do_not_count_but_every_byte_before_does() {
        let stop = Instruction::new(Opcode::STOP, 0, 0, 0);
        let nop = Instruction::default();
        assert_eq!(Identity::of(&[stop, nop, nop]), Identity::of(&[stop]));
        assert_ne!(Identity::of(&[nop, stop]), Identity::of(&[stop]));
        assert_ne!(Identity::of(&[Instruction { value: 1, ..stop }]), Identity::of(&[stop]));
        // Calculated by hand from the definition: 1c 00 00 00 00 00 00 1c.
        assert_eq!(Identity::of(&[stop]).to_string(), "145fa0e702cc33ed");
    }
}
