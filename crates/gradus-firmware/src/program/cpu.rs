//! Registers of the program interpreter, and every instruction that touches nothing else.
//!
//! Instructions that need the rest of the module (motion, ports, parameters, time, interrupts) are in `interpreter`.

use bitflags::bitflags;
use gradus_tmcl::{Instruction, Opcode, Operation, Status};
use heapless::Vec;

/// User variables of bank 2.
pub(crate) type Variables = [i32; 256];

/// Depth of the stack for CSUB and CALL.
const STACK: usize = 8;

bitflags! {
    /// Result of the last comparison, and the error flags of CLE.
    #[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
    pub(crate) struct Flags: u32 {
        const EQUAL = 1;
        const GREATER = 1 << 1;
        const LESS = 1 << 2;
        /// ETO: a WAIT has timed out.
        const TIMEOUT = 1 << 3;
        /// EAL: external alarm.
        const ALARM = 1 << 4;
        /// EDV: deviation from the encoder.
        const DEVIATION = 1 << 5;
        /// EPO: position error.
        const POSITION = 1 << 6;
        /// ESD: shutdown.
        const SHUTDOWN = 1 << 7;
        const ORDER = Self::EQUAL.bits() | Self::GREATER.bits() | Self::LESS.bits();
        const ERRORS = !Self::ORDER.bits();
    }
}

/// A condition of JC and CALL holds when one of its flags is set: ZE, NZ, EQ, NE, GT, GE, LT, LE, ETO, EAL, EDV, EPO, ESD.
const CONDITIONS: [Flags; 13] = [
    Flags::EQUAL,
    Flags::GREATER.union(Flags::LESS),
    Flags::EQUAL,
    Flags::GREATER.union(Flags::LESS),
    Flags::GREATER,
    Flags::GREATER.union(Flags::EQUAL),
    Flags::LESS,
    Flags::LESS.union(Flags::EQUAL),
    Flags::TIMEOUT,
    Flags::ALARM,
    Flags::DEVIATION,
    Flags::POSITION,
    Flags::SHUTDOWN,
];

/// What CLE clears: ALL, ETO, EAL, EDV, EPO, ESD.
const CLEARED: [Flags; 6] =
    [Flags::ERRORS, Flags::TIMEOUT, Flags::ALARM, Flags::DEVIATION, Flags::POSITION, Flags::SHUTDOWN];

impl Flags {
    /// Sets the order flags to the comparison of `a` with `b`.
    #[inline]
    fn compare(&mut self, a: i32, b: i32) {
        let order = u32::from(a == b) | u32::from(a > b) << 1 | u32::from(a < b) << 2;
        *self = Self::from_bits_retain(self.bits() & Self::ERRORS.bits() | order);
    }

    /// # Errors
    /// [`Status::WRONG_TYPE`] for an unknown condition.
    #[inline]
    fn satisfy(self, condition: u8) -> Result<bool, Status> {
        let mask = CONDITIONS.get(usize::from(condition)).ok_or(Status::WRONG_TYPE)?;
        Ok(self.intersects(*mask))
    }
}

/// The registers, saved and restored around an interrupt; a reset sets them to zero.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct Registers {
    pub(crate) accumulator: i32,
    pub(crate) x: i32,
    pub(crate) flags: Flags,
    /// Address of the next instruction.
    pub(crate) pc: u16,
}

/// Registers and stack.
#[derive(Clone, Debug, Default)]
pub(crate) struct Cpu {
    pub(crate) registers: Registers,
    pub(crate) stack: Stack,
}

/// Where calls return to.
#[derive(Clone, Debug, Default)]
pub(crate) struct Stack {
    pub(crate) addresses: Vec<u16, STACK>,
    /// Address of the latest call or return that was ignored, the stack being full or empty. The module itself does not look
    /// at it; who debugs a program does.
    pub(crate) fault: Option<u16>,
}

impl Stack {
    /// A call at `pc`; false if the stack is full.
    fn call(&mut self, pc: u16) -> bool {
        let called = self.addresses.push(pc.wrapping_add(1)).is_ok();
        if !called {
            self.fault = Some(pc);
        }
        called
    }

    /// Where a return at `pc` leads.
    fn leave(&mut self, pc: u16) -> u16 {
        self.addresses.pop().unwrap_or_else(|| {
            self.fault = Some(pc);
            pc.wrapping_add(1)
        })
    }
}

/// Why [`Cpu::run`] came back.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Exit {
    /// The time is up.
    Time,
    /// The program counter is past the end of memory.
    End,
    /// The instruction at the program counter needs the rest of the module.
    Module(Instruction),
    /// The instruction at the program counter fails.
    Fault(Status),
}

impl Cpu {
    /// Runs instructions, one each `step_us`, the first at `*at_us`, as long as they lie before `until_us`.
    #[inline]
    pub(crate) fn run(
        &mut self,
        memory: &[Instruction],
        variables: &mut Variables,
        at_us: &mut u64,
        until_us: u64,
        step_us: u64,
    ) -> Exit {
        let mut registers = self.registers;
        let mut at = *at_us;
        let exit = loop {
            if at >= until_us {
                break Exit::Time;
            }
            let Some(instruction) = memory.get(usize::from(registers.pc)) else { break Exit::End };
            match registers.execute(instruction, variables, &mut self.stack) {
                Some(Ok(_)) => {}
                Some(Err(status)) => break Exit::Fault(status),
                None => break Exit::Module(*instruction),
            }
            at += step_us;
        };
        self.registers = registers;
        *at_us = at;
        exit
    }

    /// RST: stack, registers and flags as after a reset, going on at the address.
    pub(crate) fn restart(&mut self, target: i32) {
        let stack = Stack { fault: self.stack.fault, ..Stack::default() };
        *self = Self { registers: Registers { pc: address(target), ..Registers::default() }, stack };
    }
}

impl Registers {
    /// Executes an instruction in a program and moves the program counter; `None` if it needs the rest of the module.
    #[inline]
    fn execute(
        &mut self,
        instruction: &Instruction,
        variables: &mut Variables,
        stack: &mut Stack,
    ) -> Option<Result<(), Status>> {
        // No memory reaches so far that this wraps.
        let next = self.pc.wrapping_add(1);
        let taken = match instruction.opcode {
            Opcode::JC => self.flags.satisfy(instruction.kind),
            Opcode::JA => Ok(true),
            Opcode::CSUB => Ok(stack.call(self.pc)),
            Opcode::CALL => self.flags.satisfy(instruction.kind).map(|holds| holds && stack.call(self.pc)),
            Opcode::DJNZ => Ok(decrement(variables, instruction.kind) != 0),
            Opcode::RSUB => {
                self.pc = stack.leave(self.pc);
                return Some(Ok(()));
            }
            _ => self.compute(instruction, variables)?.map(|_| false),
        };
        Some(taken.map(|taken| self.pc = if taken { address(instruction.value) } else { next }))
    }

    /// Executes an instruction that only computes, in a program or in direct mode; gives back the value it found, or `None`
    /// if it is not such an instruction.
    #[inline]
    pub(crate) fn compute(
        &mut self,
        instruction: &Instruction,
        variables: &mut Variables,
    ) -> Option<Result<i32, Status>> {
        let Instruction { opcode, kind, motor, value } = *instruction;
        Some(match opcode {
            Opcode::NOP => Ok(value),
            Opcode::CALC => self.calc(Operation(kind), value),
            Opcode::COMP => {
                self.flags.compare(self.accumulator, value);
                Ok(value)
            }
            Opcode::CALCX => self.calcx(Operation(kind)).map(|()| value),
            Opcode::CALCVV => self.calcvv(Operation(kind), motor, value, variables).map(|()| value),
            Opcode::CALCVA | Opcode::CALCVX | Opcode::CALCAV | Opcode::CALCXV => {
                let variable = &mut variables[usize::from(motor)];
                let register =
                    if matches!(opcode, Opcode::CALCVA | Opcode::CALCAV) { &mut self.accumulator } else { &mut self.x };
                let (a, b) = if matches!(opcode, Opcode::CALCVA | Opcode::CALCVX) {
                    (variable, register)
                } else {
                    (register, variable)
                };
                self.flags.apply(Operation(kind), a, b).map(|()| value)
            }
            Opcode::CALCV => self.calcv(Operation(kind), motor, value, variables).map(|()| value),
            Opcode::SGP if motor == VARIABLES => {
                variables[usize::from(kind)] = value;
                Ok(value)
            }
            Opcode::GGP if motor == VARIABLES => Ok(self.load(variables[usize::from(kind)])),
            Opcode::AGP if motor == VARIABLES => {
                variables[usize::from(kind)] = self.accumulator;
                Ok(value)
            }
            Opcode::SIV | Opcode::AIV => {
                let new = if opcode == Opcode::SIV { value } else { self.accumulator };
                if let Some(variable) = self.indexed(variables) {
                    *variable = new;
                }
                Ok(value)
            }
            Opcode::GIV => {
                let found = self.indexed(variables).copied();
                Ok(found.map_or(self.accumulator, |found| self.load(found)))
            }
            Opcode::CLE => self.clear_errors(kind).map(|()| value),
            _ => return None,
        })
    }

    /// Loads the accumulator and compares it with zero.
    pub(crate) fn load(&mut self, value: i32) -> i32 {
        self.accumulator = value;
        self.flags.compare(value, 0);
        value
    }

    #[inline]
    fn calc(&mut self, operation: Operation, operand: i32) -> Result<i32, Status> {
        let result = match operation {
            Operation::NOT => !self.accumulator,
            Operation::SWAP | Operation::COMP => return Err(Status::WRONG_TYPE),
            _ => operate(operation, self.accumulator, operand)?,
        };
        self.load(result);
        Ok(operand)
    }

    /// CALCX works on the accumulator, but NOT and LOAD on the X register (TMCM-3351 §3.6.26).
    fn calcx(&mut self, operation: Operation) -> Result<(), Status> {
        match operation {
            Operation::NOT => self.x = !self.x,
            Operation::LOAD => self.x = self.accumulator,
            Operation::COMP => return Err(Status::WRONG_TYPE),
            _ => self.flags.apply(operation, &mut self.accumulator, &mut self.x)?,
        }
        Ok(())
    }

    fn calcvv(
        &mut self,
        operation: Operation,
        first: u8,
        second: i32,
        variables: &mut Variables,
    ) -> Result<(), Status> {
        if operation.0 > Operation::COMP.0 {
            return Err(Status::WRONG_TYPE);
        }
        let second = u8::try_from(second).map_err(|_| Status::INVALID_VALUE)?;
        let (mut a, mut b) = (variables[usize::from(first)], variables[usize::from(second)]);
        self.flags.apply(operation, &mut a, &mut b)?;
        variables[usize::from(second)] = b;
        variables[usize::from(first)] = a;
        Ok(())
    }

    fn calcv(
        &mut self,
        operation: Operation,
        variable: u8,
        mut operand: i32,
        variables: &mut Variables,
    ) -> Result<(), Status> {
        let variable = &mut variables[usize::from(variable)];
        match operation {
            Operation::SWAP => return Err(Status::WRONG_TYPE),
            Operation::NOT => operand = *variable,
            _ => {}
        }
        self.flags.apply(operation, variable, &mut operand)
    }

    fn indexed<'v>(&self, variables: &'v mut Variables) -> Option<&'v mut i32> {
        variables.get_mut(usize::try_from(self.x).ok()?)
    }

    fn clear_errors(&mut self, flag: u8) -> Result<(), Status> {
        let cleared = CLEARED.get(usize::from(flag)).ok_or(Status::WRONG_TYPE)?;
        self.flags.remove(*cleared);
        Ok(())
    }
}

impl Flags {
    /// `a = a op b` and the flags of the result; COMP compares the two, SWAP exchanges them, NOT is `a = !b`.
    #[inline]
    fn apply(&mut self, operation: Operation, a: &mut i32, b: &mut i32) -> Result<(), Status> {
        match operation {
            Operation::COMP => {
                self.compare(*a, *b);
                return Ok(());
            }
            Operation::SWAP => core::mem::swap(a, b),
            _ => *a = operate(operation, *a, *b)?,
        }
        self.compare(*a, 0);
        Ok(())
    }
}

/// Bank of the user variables.
const VARIABLES: u8 = 2;

/// # Errors
/// [`Status::WRONG_TYPE`] for an unknown operation, [`Status::INVALID_VALUE`] for a division by zero.
#[inline]
fn operate(operation: Operation, a: i32, b: i32) -> Result<i32, Status> {
    let nonzero = if b == 0 { Err(Status::INVALID_VALUE) } else { Ok(b) };
    Ok(match operation {
        Operation::ADD => a.wrapping_add(b),
        Operation::SUB => a.wrapping_sub(b),
        Operation::MUL => a.wrapping_mul(b),
        Operation::DIV => a.wrapping_div(nonzero?),
        Operation::MOD => a.wrapping_rem(nonzero?),
        Operation::AND => a & b,
        Operation::OR => a | b,
        Operation::XOR => a ^ b,
        Operation::NOT => !b,
        Operation::LOAD => b,
        _ => return Err(Status::WRONG_TYPE),
    })
}

fn decrement(variables: &mut Variables, variable: u8) -> i32 {
    let variable = &mut variables[usize::from(variable)];
    *variable = variable.wrapping_sub(1);
    *variable
}

/// A jump target; what lies outside 0..=65534 becomes an address past every memory.
#[inline]
fn address(value: i32) -> u16 {
    u16::try_from(value).unwrap_or(u16::MAX)
}
