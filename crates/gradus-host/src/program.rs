//! Programs in the module: download, read back, run, stop, step, breakpoints.

use std::time::Duration;

use gradus_tmcl::catalogue::Gp;
use gradus_tmcl::{Instruction, Opcode, Status};

use crate::line::downloads::is_control;
use crate::{Error, RETRIES, Session};

/// Types of command 129.
const FROM_HERE: u8 = 0;
const FROM_ADDRESS: u8 = 1;
/// Types of command 135.
const PROGRAM_COUNTER: u8 = 1;
const ACCUMULATOR: u8 = 2;
const X_REGISTER: u8 = 3;
/// Types of command 141.
const ADD: u8 = 0;
const REMOVE: u8 = 1;
const REMOVE_ALL: u8 = 2;
const CAPACITY: u8 = 3;

/// What the program interpreter does.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum State {
    /// It stands.
    Stopped,
    /// It runs.
    Running,
    /// It has been asked for one instruction, and stands behind it.
    Stepping,
    /// It goes back to the start.
    Resetting,
    /// A state that no manual names.
    Unknown(u8),
}

/// The answer of command 135.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct ApplicationStatus {
    /// What the interpreter does.
    pub state: State,
    /// True while a WAIT waits.
    pub waiting: bool,
}

impl ApplicationStatus {
    fn from_value(value: i32) -> Self {
        let [state, waiting, ..] = value.to_be_bytes();
        let state = match state {
            0 => State::Stopped,
            1 => State::Running,
            2 => State::Stepping,
            3 => State::Resetting,
            other => State::Unknown(other),
        };
        Self { state, waiting: waiting != 0 }
    }
}

/// A failure that the interpreter remembers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct ProgramError {
    /// What was wrong with the instruction.
    pub status: Status,
    /// Where it stands.
    pub address: u16,
}

impl ProgramError {
    /// Global parameter 131: the status in the upper half, the address in the lower one; 0 is no failure.
    fn from_value(value: i32) -> Option<Self> {
        let [_, status, high, low] = value.to_be_bytes();
        (status != 0).then_some(Self { status: Status(status), address: u16::from_be_bytes([high, low]) })
    }
}

impl Session {
    /// Writes a program into the module, from address 0, with the end mark behind it. A running program is stopped.
    /// `progress` is told how many commands are written.
    ///
    /// # Errors
    /// When the program does not fit, has a command that cannot be stored, or the module refuses it (global parameter 81
    /// protects against overwriting). Nothing is written in the first two cases.
    pub fn download(&mut self, program: &[Instruction], mut progress: impl FnMut(usize)) -> Result<(), Error> {
        let module = self.module()?;
        let room = module.program_len;
        if program.len() > usize::from(room) {
            return Err(Error::ProgramTooLong { len: program.len(), module: module.name, room });
        }
        if let Some((address, command)) = (0..).zip(program).find(|(_, command)| is_control(command.opcode)) {
            return Err(Error::NotStorable { address, request: self.text(*command) });
        }
        self.begin_download()?;
        let end_mark = (program.len() < usize::from(room)).then(Instruction::default);
        let written = self.write_all(program.iter().copied().chain(end_mark), &mut progress);
        // The module must leave download mode even if a write failed; that failure tells more than the next one.
        let left = self.insist_on(Instruction::new(Opcode::EXIT_DOWNLOAD, 0, 0, 0));
        written.and(left)
    }

    /// A download that does not begin is ended, in case the module got the command and only its answer was lost.
    fn begin_download(&mut self) -> Result<(), Error> {
        self.enter_download(0).inspect_err(|_| {
            if self.downloads() {
                let _ = self.insist_on(Instruction::new(Opcode::EXIT_DOWNLOAD, 0, 0, 0)); // the first failure tells more
            }
            self.line().lock().downloads.forget(self.number);
        })
    }

    fn write_all(
        &mut self,
        commands: impl Iterator<Item = Instruction>,
        progress: &mut impl FnMut(usize),
    ) -> Result<(), Error> {
        let job = self.line().job();
        for (address, command) in (0..).zip(commands) {
            self.line().go_on(job)?;
            self.write(address, command)?;
            progress(usize::from(address) + 1);
        }
        Ok(())
    }

    /// Writes a command to an address. After a failure on the way nobody knows where the next one would be stored, so
    /// the download begins anew at this address.
    fn write(&mut self, address: u16, command: Instruction) -> Result<(), Error> {
        for _ in 0..RETRIES {
            match self.command(command) {
                Err(error) if error.is_passing() => self.enter_download(address)?,
                result => return result.map(drop),
            }
        }
        self.command(command).map(drop)
    }

    /// Lets the module store commands, from an address on.
    fn enter_download(&mut self, address: u16) -> Result<(), Error> {
        self.insist_on(Instruction::new(Opcode::ENTER_DOWNLOAD, 0, 0, address.into()))
    }

    fn insist_on(&mut self, instruction: Instruction) -> Result<(), Error> {
        let status = self.insist(instruction)?.status;
        if status.is_ok() { Ok(()) } else { Err(self.refused(instruction, status)) }
    }

    /// Reads a program back and compares it. `progress` is told how many commands are compared.
    ///
    /// # Errors
    /// At the first difference.
    pub fn verify(&mut self, program: &[Instruction], mut progress: impl FnMut(usize)) -> Result<(), Error> {
        let job = self.line().job();
        for (address, wrote) in (0..).zip(program.iter().copied()) {
            self.line().go_on(job)?;
            let read = self.read_memory(address)?;
            if read != wrote {
                let blank = read == Instruction::default();
                return Err(Error::Verify { address, wrote: self.text(wrote), read: self.text(read), blank });
            }
            progress(usize::from(address) + 1);
        }
        Ok(())
    }

    /// Reads the program in the module, from address 0: up to two commands 0 behind each other, which end it, or all of the
    /// memory. `progress` is told how many commands are read.
    ///
    /// # Errors
    /// When the line is broken or the module refuses. A module that is protected against reading (global parameter 81)
    /// answers commands 0.
    pub fn read_program(&mut self, all: bool, mut progress: impl FnMut(usize)) -> Result<Vec<Instruction>, Error> {
        let job = self.line().job();
        let mut program: Vec<Instruction> = Vec::new();
        for address in 0..self.module()?.program_len {
            self.line().go_on(job)?;
            program.push(self.read_memory(address)?);
            progress(program.len());
            let ended = program.ends_with(&[Instruction::default(); 2]);
            if ended && !all {
                break;
            }
        }
        let used = program.iter().rposition(|command| *command != Instruction::default());
        program.truncate(used.map_or(0, |last| last + 1));
        Ok(program)
    }

    /// True if the module is protected against reading its program (bit 0 of global parameter 81).
    ///
    /// # Errors
    /// When the line is broken or the module refuses.
    pub fn hides_program(&mut self) -> Result<bool, Error> {
        Ok(self.get_global(Gp::CodeProtection, 0)? & 1 != 0)
    }

    /// Starts the program where its program counter stands.
    ///
    /// # Errors
    /// When the module refuses.
    pub fn run(&mut self) -> Result<(), Error> {
        self.control(Opcode::RUN_APPLICATION, FROM_HERE, 0).map(drop)
    }

    /// Starts the program at an address.
    ///
    /// # Errors
    /// When the module refuses, past the end of the memory for example.
    pub fn run_from(&mut self, address: u16) -> Result<(), Error> {
        self.control(Opcode::RUN_APPLICATION, FROM_ADDRESS, i32::from(address)).map(drop)
    }

    /// Stops the program; its program counter stays. Motors go on.
    ///
    /// # Errors
    /// When the module refuses.
    pub fn stop(&mut self) -> Result<(), Error> {
        self.control(Opcode::STOP_APPLICATION, 0, 0).map(drop)
    }

    /// Executes one instruction.
    ///
    /// # Errors
    /// When the module refuses.
    pub fn step(&mut self) -> Result<(), Error> {
        self.control(Opcode::STEP_APPLICATION, 0, 0).map(drop)
    }

    /// Stops the program and puts it back to its start: program counter, stack, registers and flags.
    ///
    /// # Errors
    /// When the module refuses.
    pub fn reset(&mut self) -> Result<(), Error> {
        self.control(Opcode::RESET_APPLICATION, 0, 0).map(drop)
    }

    /// Stops every motor, also those behind one that fails.
    ///
    /// # Errors
    /// The first failure: when the module refuses or does not answer.
    pub fn stop_motors(&mut self) -> Result<(), Error> {
        let axes = 0..self.module()?.axes;
        let stops: Vec<_> =
            axes.map(|axis| self.command(Instruction::new(Opcode::MST, 0, axis, 0)).map(drop)).collect();
        stops.into_iter().collect()
    }

    /// What the program does.
    ///
    /// # Errors
    /// When the module refuses.
    pub fn application_status(&mut self) -> Result<ApplicationStatus, Error> {
        self.control(Opcode::APPLICATION_STATUS, PROGRAM_COUNTER, 0).map(ApplicationStatus::from_value)
    }

    /// Address of the next instruction.
    ///
    /// # Errors
    /// When the module refuses.
    pub fn program_counter(&mut self) -> Result<i32, Error> {
        self.get_global(Gp::ProgramCounter, 0)
    }

    /// The program's accumulator. Not on the TMCM-351.
    ///
    /// # Errors
    /// When the module refuses.
    pub fn accumulator(&mut self) -> Result<i32, Error> {
        self.control(Opcode::APPLICATION_STATUS, ACCUMULATOR, 0)
    }

    /// The program's X register. Not on the TMCM-351.
    ///
    /// # Errors
    /// When the module refuses.
    pub fn x_register(&mut self) -> Result<i32, Error> {
        self.control(Opcode::APPLICATION_STATUS, X_REGISTER, 0)
    }

    /// Address of the latest call with a full stack, or return with an empty one, since the program's start: a module ignores
    /// both, and only a virtual module of this process tells.
    pub fn stack_fault(&mut self) -> Option<u16> {
        self.bench()?.program()?.stack_fault()
    }

    /// The latest failure inside the program since its start. `None` as well on a real module that does not remember it.
    ///
    /// # Errors
    /// When the module refuses.
    pub fn program_error(&mut self) -> Result<Option<ProgramError>, Error> {
        if let Some(program) = self.bench().and_then(|bench| bench.program()) {
            let error = program.last_error();
            return Ok(error.map(|(status, address)| ProgramError { status: Status(status), address }));
        }
        match self.get_global(Gp::LastError, 0) {
            Ok(value) => Ok(ProgramError::from_value(value)),
            Err(Error::Name(_)) => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// Waits until the program no longer runs, at most for `time`; asks every `period`. True when it no longer does.
    ///
    /// # Errors
    /// When the line is broken or the module refuses.
    pub fn wait_stopped(&mut self, time: Duration, period: Duration) -> Result<bool, Error> {
        let deadline = self.now() + time;
        while self.application_status()?.state == State::Running {
            let left = deadline.saturating_sub(self.now());
            if left.is_zero() {
                return Ok(false);
            }
            self.sleep(period.min(left));
        }
        Ok(true)
    }

    /// Adds a breakpoint: a running program stops before the instruction at `address`.
    ///
    /// # Errors
    /// When there are too many; see [`breakpoint_capacity`](Self::breakpoint_capacity).
    pub fn add_breakpoint(&mut self, address: u16) -> Result<(), Error> {
        self.control(Opcode::BREAKPOINT, ADD, i32::from(address)).map(drop)
    }

    /// Removes a breakpoint.
    ///
    /// # Errors
    /// When the module refuses.
    pub fn remove_breakpoint(&mut self, address: u16) -> Result<(), Error> {
        self.control(Opcode::BREAKPOINT, REMOVE, i32::from(address)).map(drop)
    }

    /// Removes all breakpoints.
    ///
    /// # Errors
    /// When the module refuses.
    pub fn clear_breakpoints(&mut self) -> Result<(), Error> {
        self.control(Opcode::BREAKPOINT, REMOVE_ALL, 0).map(drop)
    }

    /// How many breakpoints there can be.
    ///
    /// # Errors
    /// When the module refuses.
    pub fn breakpoint_capacity(&mut self) -> Result<i32, Error> {
        self.control(Opcode::BREAKPOINT, CAPACITY, 0)
    }

    fn control(&mut self, opcode: Opcode, kind: u8, value: i32) -> Result<i32, Error> {
        self.command(Instruction::new(opcode, kind, 0, value))
    }
}
