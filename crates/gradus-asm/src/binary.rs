//! Programs as `.bin` files: eight bytes a command, no header.
//!
//! Opcode, type, motor, value (big-endian), and the sum of these seven bytes modulo 256. The command 0 that marks the end of
//! a downloaded program is not in the file.

use gradus_tmcl::{Instruction, checksum};

/// Why bytes are not a program.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum BinaryError {
    /// The last command is cut off.
    #[error("{length} bytes are not a whole number of commands of 8 bytes")]
    Length {
        /// Length of the file.
        length: usize,
    },
    /// The eighth byte of a command is not the sum of the others.
    #[error("command {address} has the checksum {got:#04x}, its bytes give {want:#04x}")]
    Checksum {
        /// Address of the command, from 0.
        address: usize,
        /// The byte in the file.
        got: u8,
        /// The sum of the seven others.
        want: u8,
    },
}

/// The eight bytes of a command.
pub(crate) fn bytes(instruction: &Instruction) -> [u8; 8] {
    let [a, b, c, d, e, f, g] = instruction.to_bytes();
    [a, b, c, d, e, f, g, checksum(&[a, b, c, d, e, f, g])]
}

/// The contents of a `.bin` file.
pub fn to_bin(program: &[Instruction]) -> Vec<u8> {
    program.iter().flat_map(bytes).collect()
}

/// Reads a `.bin` file.
///
/// # Errors
/// When it ends within a command or a checksum is wrong.
pub fn from_bin(file: &[u8]) -> Result<Vec<Instruction>, BinaryError> {
    let (commands, rest) = file.as_chunks::<8>();
    if !rest.is_empty() {
        return Err(BinaryError::Length { length: file.len() });
    }
    commands.iter().enumerate().map(|(address, bytes)| command(address, bytes)).collect()
}

fn command(address: usize, bytes: &[u8; 8]) -> Result<Instruction, BinaryError> {
    let [head @ .., got] = *bytes;
    let want = checksum(&head);
    if got == want { Ok(Instruction::from_bytes(head)) } else { Err(BinaryError::Checksum { address, got, want }) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gradus_tmcl::Opcode;

    #[test]
    fn a_command_is_eight_bytes_with_a_big_endian_value() {
        let rol = Instruction::new(Opcode::ROL, 0, 1, -2);
        assert_eq!(to_bin(&[rol]), [2, 0, 1, 0xff, 0xff, 0xff, 0xfe, 0xfe]);
        assert_eq!(from_bin(&to_bin(&[rol, rol])), Ok(vec![rol, rol]));
        assert_eq!(from_bin(&[]), Ok(vec![]));
    }

    #[test]
    fn damaged_files_are_refused_with_the_place() {
        let mut file = to_bin(&[Instruction::new(Opcode::MST, 0, 0, 0); 3]);
        file[15] = 7;
        let message = |file: &[u8]| from_bin(file).unwrap_err().to_string();
        assert_eq!(message(&file), "command 1 has the checksum 0x07, its bytes give 0x03");
        assert_eq!(message(&file[..20]), "20 bytes are not a whole number of commands of 8 bytes");
    }
}
