//! Commands with their operands.

/// Number of a command. Unknown ones are kept by value.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Hash, PartialOrd, Ord)]
pub struct Opcode(pub u8);

/// A command with its operands, seven bytes on the wire and in program memory.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Hash)]
pub struct Instruction {
    /// Command number.
    pub opcode: Opcode,
    /// The type field: kind of move, parameter, port, operation, condition.
    pub kind: u8,
    /// The motor field: axis, bank, mask or user variable.
    pub motor: u8,
    /// The value field.
    pub value: i32,
}

impl Instruction {
    /// Puts the four fields together.
    pub const fn new(opcode: Opcode, kind: u8, motor: u8, value: i32) -> Self {
        Self { opcode, kind, motor, value }
    }

    /// Reads command, type, motor, value (big-endian).
    pub fn from_bytes([opcode, kind, motor, v3, v2, v1, v0]: [u8; 7]) -> Self {
        Self { opcode: Opcode(opcode), kind, motor, value: i32::from_be_bytes([v3, v2, v1, v0]) }
    }

    /// Command, type, motor, value (big-endian).
    pub fn to_bytes(&self) -> [u8; 7] {
        let [v3, v2, v1, v0] = self.value.to_be_bytes();
        [self.opcode.0, self.kind, self.motor, v3, v2, v1, v0]
    }
}

impl Opcode {
    /// Does nothing; the end mark of a downloaded program.
    pub const NOP: Self = Self(0);
    /// Rotate right.
    pub const ROR: Self = Self(1);
    /// Rotate left.
    pub const ROL: Self = Self(2);
    /// Motor stop.
    pub const MST: Self = Self(3);
    /// Move to position.
    pub const MVP: Self = Self(4);
    /// Set axis parameter.
    pub const SAP: Self = Self(5);
    /// Get axis parameter.
    pub const GAP: Self = Self(6);
    /// Store axis parameter.
    pub const STAP: Self = Self(7);
    /// Restore axis parameter.
    pub const RSAP: Self = Self(8);
    /// Set global parameter.
    pub const SGP: Self = Self(9);
    /// Get global parameter.
    pub const GGP: Self = Self(10);
    /// Store global parameter.
    pub const STGP: Self = Self(11);
    /// Restore global parameter.
    pub const RSGP: Self = Self(12);
    /// Reference search.
    pub const RFS: Self = Self(13);
    /// Set output.
    pub const SIO: Self = Self(14);
    /// Get input.
    pub const GIO: Self = Self(15);
    /// Set axis parameter, axis in X register.
    pub const SAPX: Self = Self(16);
    /// Get axis parameter, axis in X register.
    pub const GAPX: Self = Self(17);
    /// Accu to axis parameter, axis in X register.
    pub const AAPX: Self = Self(18);
    /// Calculate.
    pub const CALC: Self = Self(19);
    /// Compare.
    pub const COMP: Self = Self(20);
    /// Jump conditional.
    pub const JC: Self = Self(21);
    /// Jump always.
    pub const JA: Self = Self(22);
    /// Call subroutine.
    pub const CSUB: Self = Self(23);
    /// Return from subroutine.
    pub const RSUB: Self = Self(24);
    /// Enable interrupt.
    pub const EI: Self = Self(25);
    /// Disable interrupt.
    pub const DI: Self = Self(26);
    /// Wait for an event.
    pub const WAIT: Self = Self(27);
    /// Stop program execution.
    pub const STOP: Self = Self(28);
    /// SPI bus access.
    pub const SAC: Self = Self(29);
    /// Set coordinate.
    pub const SCO: Self = Self(30);
    /// Get coordinate.
    pub const GCO: Self = Self(31);
    /// Capture coordinate.
    pub const CCO: Self = Self(32);
    /// Calculate using the X register.
    pub const CALCX: Self = Self(33);
    /// Accu to axis parameter.
    pub const AAP: Self = Self(34);
    /// Accu to global parameter.
    pub const AGP: Self = Self(35);
    /// Clear error flags.
    pub const CLE: Self = Self(36);
    /// Define interrupt vector.
    pub const VECT: Self = Self(37);
    /// Return from interrupt.
    pub const RETI: Self = Self(38);
    /// Accu to coordinate.
    pub const ACO: Self = Self(39);
    /// Calculate using two user variables.
    pub const CALCVV: Self = Self(40);
    /// Calculate using a user variable and the accumulator.
    pub const CALCVA: Self = Self(41);
    /// Calculate using the accumulator and a user variable.
    pub const CALCAV: Self = Self(42);
    /// Calculate using a user variable and the X register.
    pub const CALCVX: Self = Self(43);
    /// Calculate using the X register and a user variable.
    pub const CALCXV: Self = Self(44);
    /// Calculate using a user variable and a direct value.
    pub const CALCV: Self = Self(45);
    /// Move to position in accumulator.
    pub const MVPA: Self = Self(46);
    /// Move to position in accumulator, axis in X register.
    pub const MVPXA: Self = Self(47);
    /// Restart program.
    pub const RST: Self = Self(48);
    /// Decrement and jump if not zero.
    pub const DJNZ: Self = Self(49);
    /// Rotate left, velocity in accumulator.
    pub const ROLA: Self = Self(50);
    /// Rotate right, velocity in accumulator.
    pub const RORA: Self = Self(51);
    /// Rotate left, velocity in accumulator, axis in X register.
    pub const ROLXA: Self = Self(52);
    /// Rotate right, velocity in accumulator, axis in X register.
    pub const RORXA: Self = Self(53);
    /// Stop motor, axis in X register.
    pub const MSTX: Self = Self(54);
    /// Set indexed variable.
    pub const SIV: Self = Self(55);
    /// Get indexed variable.
    pub const GIV: Self = Self(56);
    /// Accu to indexed variable.
    pub const AIV: Self = Self(57);
    /// User function 0.
    pub const UF0: Self = Self(64);
    /// User function 1.
    pub const UF1: Self = Self(65);
    /// User function 2.
    pub const UF2: Self = Self(66);
    /// User function 3.
    pub const UF3: Self = Self(67);
    /// User function 4.
    pub const UF4: Self = Self(68);
    /// User function 5.
    pub const UF5: Self = Self(69);
    /// User function 6.
    pub const UF6: Self = Self(70);
    /// User function 7.
    pub const UF7: Self = Self(71);
    /// Conditional subroutine call.
    pub const CALL: Self = Self(80);
    /// Stop application.
    pub const STOP_APPLICATION: Self = Self(128);
    /// Run application.
    pub const RUN_APPLICATION: Self = Self(129);
    /// Step application.
    pub const STEP_APPLICATION: Self = Self(130);
    /// Reset application.
    pub const RESET_APPLICATION: Self = Self(131);
    /// Enter download mode.
    pub const ENTER_DOWNLOAD: Self = Self(132);
    /// Exit download mode.
    pub const EXIT_DOWNLOAD: Self = Self(133);
    /// Read program memory.
    pub const READ_MEMORY: Self = Self(134);
    /// Get application status.
    pub const APPLICATION_STATUS: Self = Self(135);
    /// Get firmware version.
    pub const FIRMWARE_VERSION: Self = Self(136);
    /// Restore factory settings.
    pub const FACTORY_SETTINGS: Self = Self(137);
    /// Request target position reached event.
    pub const POSITION_EVENT: Self = Self(138);
    /// Enter ASCII mode.
    pub const ASCII_MODE: Self = Self(139);
    /// Breakpoints.
    pub const BREAKPOINT: Self = Self(141);
    /// Capture (RAMDEBUG).
    pub const CAPTURE: Self = Self(142);
    /// Write a register of a chip (WRITE_MC of PyTrinamic).
    pub const WRITE_REGISTER: Self = Self(146);
    /// Read a register of a chip (READ_MC of PyTrinamic).
    pub const READ_REGISTER: Self = Self(148);
    /// Get information.
    pub const GET_INFO: Self = Self(157);
    /// Software reset.
    pub const SOFTWARE_RESET: Self = Self(255);
}
