//! Program memory and its state: download, protection, breakpoints, control commands 128 to 135 and 141.
//!
//! Where the manual is silent:
//! - Command 129 with an address leaves an interrupt handler in which the program was stopped; the stack stays.
//! - In download mode a host cannot read that it is on: its GGP 129 is stored. A program that runs meanwhile, started by command 129,
//!   reads 1, and a capture (command 142) samples it.
//! - Command 131 clears everything of the interrupts, the trigger transitions of bank 3 included.
//! - After the instruction STOP the program counter is behind it, and command 129 type 0 goes on there: a host restarts a program
//!   that way after every move. Behind the last address of memory is 0. Command 128 leaves the counter where it is.
//! - Command 137 keeps the program, but erases one that is protected against disassembling: its protection ends, at once. So does a
//!   start with another magic (global parameter 64 of the TMCM-351).

use gradus_tmcl::catalogue::{Gp, Model};
use gradus_tmcl::{Instruction, Status};
use heapless::Vec;

use crate::links::link::Answer;
use crate::module::Module;
use crate::ports::{Ports, Store};
use crate::program::cpu::{Cpu, Exit, Variables};
use crate::program::interpreter::Wait;
use crate::program::interrupts::Interrupts;
use crate::storage::records::Key;

/// Commands of the largest module.
const MEMORY: usize = 6144;

/// How many breakpoints there can be (BEHAVIOUR 3).
const BREAKPOINTS: usize = 10;

/// What the program does (global parameter 128).
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum State {
    /// It stands.
    #[default]
    Stop = 0,
    /// It runs, or waits.
    Run = 1,
    /// It executes one instruction, or waits (command 130).
    Step = 2,
    /// It stands as after a reset (command 131).
    Reset = 3,
}

/// The stored program and the interpreter's state.
#[derive(Clone, Debug)]
pub(crate) struct Program {
    memory: [Instruction; MEMORY],
    len: usize,
    pub(crate) cpu: Cpu,
    pub(crate) state: State,
    pub(crate) wait: Option<Wait>,
    /// When the next instruction is due; never while the program stands or waits.
    pub(crate) at_us: u64,
    pub(crate) downloading: bool,
    pointer: u16,
    /// Status << 16 | address of the latest failure (global parameter 131).
    pub(crate) last_error: i32,
    breakpoints: Vec<u16, BREAKPOINTS>,
    /// The next instruction is executed even if it has a breakpoint.
    pub(crate) pass_breakpoint: bool,
}

/// A time that does not come.
pub(crate) const NEVER: u64 = u64::MAX;

impl Program {
    pub(crate) fn new(len: u16) -> Self {
        Self {
            memory: [Instruction::default(); MEMORY],
            len: usize::from(len).min(MEMORY),
            cpu: Cpu::default(),
            state: State::Stop,
            wait: None,
            at_us: NEVER,
            downloading: false,
            pointer: 0,
            last_error: 0,
            breakpoints: Vec::new(),
            pass_breakpoint: false,
        }
    }

    /// As after switching on; the memory survives.
    pub(crate) fn restart(&mut self) {
        self.reset();
        self.state = State::Stop;
        self.downloading = false;
        self.pointer = 0;
        self.last_error = 0;
        self.breakpoints.clear();
    }

    /// The memory of this module.
    pub(crate) fn memory(&self) -> &[Instruction] {
        self.memory.get(..self.len).unwrap_or(&[])
    }

    /// Executes register instructions as [`Cpu::run`] does.
    #[inline]
    pub(crate) fn run(&mut self, variables: &mut Variables, until_us: u64, step_us: u64) -> Exit {
        let memory = self.memory.get(..self.len).unwrap_or(&[]);
        self.cpu.run(memory, variables, &mut self.at_us, until_us, step_us)
    }

    pub(crate) fn is_running(&self) -> bool {
        matches!(self.state, State::Run | State::Step)
    }

    /// Stops; the program counter stays.
    pub(crate) fn stop(&mut self) {
        self.state = State::Stop;
        self.wait = None;
        self.at_us = NEVER;
    }

    /// Behind the last address of memory is 0: global parameter 130 stays in its range.
    pub(crate) fn wrap_counter(&mut self) {
        if usize::from(self.cpu.registers.pc) >= self.len {
            self.cpu.registers.pc = 0;
        }
    }

    /// Program counter, stack, registers and flags to zero.
    pub(crate) fn reset(&mut self) {
        self.stop();
        self.state = State::Reset;
        self.cpu = Cpu::default();
    }

    /// The program counter to zero; all else stays as it is.
    pub(crate) fn rewind(&mut self) {
        self.stop();
        self.state = State::Reset;
        self.cpu.registers.pc = 0;
    }

    /// Goes on at the program counter.
    pub(crate) fn start(&mut self, state: State, now: u64) {
        if !self.is_running() {
            self.last_error = 0;
            self.cpu.stack.fault = None;
        }
        self.state = state;
        self.pass_breakpoint = true;
        if self.wait.is_none() {
            self.at_us = now;
        }
    }

    /// Goes on at another address from now on; false for an address past the end of memory.
    pub(crate) fn go_to(&mut self, value: i32, now: u64) -> bool {
        let Ok(address) = self.address(value) else { return false };
        self.cpu.registers.pc = address;
        if self.wait.take().is_some() {
            self.at_us = now;
        }
        true
    }

    /// True while it goes one instruction at a time: in steps, or with breakpoints.
    #[inline]
    pub(crate) fn is_debugged(&self) -> bool {
        self.state == State::Step || !self.breakpoints.is_empty()
    }

    /// A step is one instruction, a WAIT with its waiting.
    pub(crate) fn end_step(&mut self) {
        if self.state == State::Step && self.wait.is_none() {
            self.at_us = NEVER;
        }
    }

    pub(crate) fn is_at_breakpoint(&self) -> bool {
        !self.pass_breakpoint && self.breakpoints.contains(&self.cpu.registers.pc)
    }

    pub(crate) fn record_error(&mut self, status: Status) {
        self.last_error = i32::from(status.0) << 16 | i32::from(self.cpu.registers.pc);
    }

    /// Command 141.
    ///
    /// # Errors
    /// [`Status::INVALID_VALUE`] for an address outside the memory or one breakpoint too many.
    pub(crate) fn breakpoint(&mut self, kind: u8, value: i32) -> Result<i32, Status> {
        const ADD: u8 = 0;
        const REMOVE: u8 = 1;
        const REMOVE_ALL: u8 = 2;
        const CAPACITY: u8 = 3;
        match kind {
            ADD => {
                let address = self.address(value)?;
                if !self.breakpoints.contains(&address) {
                    self.breakpoints.push(address).map_err(|_| Status::INVALID_VALUE)?;
                }
            }
            REMOVE => {
                let address = self.address(value)?;
                self.breakpoints.retain(|other| *other != address);
            }
            REMOVE_ALL => self.breakpoints.clear(),
            CAPACITY => return Ok(BREAKPOINTS as i32),
            _ => return Err(Status::WRONG_TYPE),
        }
        Ok(value)
    }

    /// # Errors
    /// [`Status::INVALID_VALUE`] past the end of memory.
    pub(crate) fn address(&self, value: i32) -> Result<u16, Status> {
        let address = u16::try_from(value).map_err(|_| Status::INVALID_VALUE)?;
        if usize::from(address) < self.len { Ok(address) } else { Err(Status::INVALID_VALUE) }
    }

    /// Command 135.
    ///
    /// # Errors
    /// [`Status::WRONG_TYPE`] for an unknown kind.
    pub(crate) fn status(&self, kind: u8) -> Result<i32, Status> {
        let state = (self.state as i32) << 24 | i32::from(self.wait.is_some()) << 16;
        Ok(match kind {
            0 => state | i32::from(self.pointer),
            1 => state | i32::from(self.cpu.registers.pc),
            2 => self.cpu.registers.accumulator,
            3 => self.cpu.registers.x,
            _ => return Err(Status::WRONG_TYPE),
        })
    }
}

/// Bits of global parameter 81.
const NO_DISASSEMBLING: i32 = 1;
const NO_OVERWRITING: i32 = 2;

impl<P: Ports, S: Store> Module<P, S> {
    /// Reads the program at power-on.
    pub(crate) fn restore_program(&mut self) {
        for (address, cell) in self.program.memory.iter_mut().enumerate().take(self.program.len) {
            if let Some(bytes) = self.eeprom.load(Key::Program(address as u16)) {
                *cell = Instruction::from_bytes(bytes);
            }
        }
    }

    /// Command 137: the EEPROM holds no settings any more. They hold until the next start, but for the protection, which the
    /// EEPROM does not know any more. The program that it has hidden is gone before it ends: a power cut in between keeps both.
    pub(crate) fn restore_factory_settings(&mut self) {
        if self.globals.get(Gp::CodeProtection) & NO_DISASSEMBLING != 0 {
            self.erase_program();
        }
        self.globals.set(Gp::CodeProtection, 0);
        self.eeprom.clear_settings();
    }

    pub(crate) fn erase_program(&mut self) {
        self.program.stop();
        for address in 0..self.program.len {
            self.write_program(address, Instruction::default());
        }
    }

    /// Command 132.
    ///
    /// # Errors
    /// [`Status::EEPROM_LOCKED`] when the program is protected against overwriting, [`Status::INVALID_VALUE`] for an address
    /// past the end of memory.
    pub(crate) fn enter_download(&mut self, value: i32) -> Result<(), Status> {
        let address = self.program.address(value)?;
        if self.globals.get(Gp::CodeProtection) & NO_OVERWRITING != 0 {
            return Err(Status::EEPROM_LOCKED);
        }
        self.program.stop();
        self.program.downloading = true;
        self.program.pointer = address;
        Ok(())
    }

    /// Stores a command in download mode; [`Status::INVALID_VALUE`] past the end of memory.
    pub(crate) fn download(&mut self, instruction: Instruction) -> Status {
        let address = usize::from(self.program.pointer);
        if address >= self.program.len {
            return Status::INVALID_VALUE;
        }
        self.write_program(address, instruction);
        self.program.pointer = self.program.pointer.saturating_add(1);
        Status::LOADED
    }

    /// Command 134: the stored command with a check sum, zeros past the end.
    pub(crate) fn read_program(&self, value: i32) -> Answer {
        let hidden = self.globals.get(Gp::CodeProtection) & NO_DISASSEMBLING != 0;
        let found = usize::try_from(value).ok().and_then(|address| self.program.memory().get(address));
        let mut body = [0; 8];
        if let Some(instruction) = found.filter(|_| !hidden) {
            body[..7].copy_from_slice(&instruction.to_bytes());
        }
        let host = self.globals.get(Gp::HostAddress) as u8;
        body[7] = gradus_tmcl::checksum(&body[..7]).wrapping_add(host);
        Answer::Special(body)
    }

    /// Commands 129 and 130.
    pub(crate) fn start_program(&mut self, state: State) {
        self.program.start(state, self.now);
    }

    /// Command 131.
    pub(crate) fn reset_program(&mut self) {
        match self.catalogue.model {
            Model::Tmcm351 => self.program.rewind(), // ERRATA 6
            _ => self.program.reset(),
        }
        self.interrupts = Interrupts::default();
    }

    fn write_program(&mut self, address: usize, instruction: Instruction) {
        if let Some(cell) = self.program.memory.get_mut(address)
            && *cell != instruction
        {
            *cell = instruction;
            self.eeprom.save(Key::Program(address as u16), instruction.to_bytes());
        }
    }
}
