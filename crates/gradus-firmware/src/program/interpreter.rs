//! The program interpreter: what runs between registers and the rest of the module.
//!
//! An instruction takes a fixed virtual time. One that fails is skipped and remembered in global parameter 131.

use gradus_tmcl::catalogue::Mode;
use gradus_tmcl::{Instruction, Opcode, Status, WaitFor};

use crate::drive::axes::Axes;
use crate::module::Module;
use crate::ports::{Ports, Store};
use crate::program::cpu::{Exit, Flags, Registers};
use crate::program::interrupts::Context;
use crate::program::program::{NEVER, State};
use crate::storage::coordinates::EEPROM;

/// A WAIT that has begun.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Wait {
    pub(crate) condition: WaitFor,
    pub(crate) axis: usize,
    /// When the time is up; never without a time-out.
    pub(crate) deadline_us: u64,
}

/// A tick of WAIT in microseconds.
const WAIT_TICK_US: u64 = 10_000;

/// `WAIT ..., -1` takes the accumulator.
const ACCUMULATOR: i32 = -1;

impl<P: Ports, S: Store> Module<P, S> {
    /// Runs the program's instructions that lie before `until_us`; comes back early when one of them may have changed what
    /// is due next.
    pub(crate) fn run_program(&mut self, until_us: u64) {
        let step_us = u64::from(self.catalogue.instruction_us);
        while self.program.at_us < until_us {
            let single = self.program.is_debugged();
            if single && self.program.is_at_breakpoint() {
                self.program.stop();
                return;
            }
            self.program.pass_breakpoint = false;
            let limit = if single { self.program.at_us + 1 } else { until_us };
            let exit = self.program.run(&mut self.variables, limit, step_us);
            let goes_on = self.leave(exit);
            if single {
                self.program.end_step();
            }
            if !goes_on {
                return;
            }
        }
    }

    /// Deals with what ended a run of register instructions; false when the schedule may have changed.
    fn leave(&mut self, exit: Exit) -> bool {
        match exit {
            Exit::Time => true,
            Exit::End => {
                self.program.wrap_counter();
                self.program.stop();
                false
            }
            Exit::Fault(status) => {
                self.program.record_error(status);
                self.advance();
                true
            }
            Exit::Module(instruction) => {
                self.now = self.program.at_us;
                if let Err(status) = self.execute_in_program(&instruction) {
                    self.program.record_error(status);
                    self.advance();
                }
                // Nothing else is due than before.
                loads_accumulator(&instruction)
            }
        }
    }

    /// To the next instruction, one instruction time later.
    fn advance(&mut self) {
        let registers = &mut self.program.cpu.registers;
        registers.pc = registers.pc.saturating_add(1);
        self.spend_instruction();
    }

    fn spend_instruction(&mut self) {
        self.program.at_us = self.program.at_us.saturating_add(u64::from(self.catalogue.instruction_us));
    }

    fn execute_in_program(&mut self, instruction: &Instruction) -> Result<(), Status> {
        match instruction.opcode {
            Opcode::STOP => {
                self.advance();
                self.program.stop();
                self.program.wrap_counter();
                return Ok(());
            }
            Opcode::RST => {
                self.program.cpu.restart(instruction.value);
                self.interrupts.saved = None;
                self.spend_instruction();
                return Ok(());
            }
            Opcode::WAIT => return self.begin_wait(instruction),
            Opcode::RETI => return self.leave_handler(),
            Opcode::EI | Opcode::DI | Opcode::VECT => self.configure_interrupt(instruction)?,
            _ => {
                self.in_program(instruction.opcode)?;
                let value = self.execute(instruction)?;
                if loads_accumulator(instruction) {
                    self.program.cpu.registers.load(value);
                }
            }
        }
        self.advance();
        Ok(())
    }

    /// # Errors
    /// [`Status::INVALID_COMMAND`] for a command that the module lacks, [`Status::NOT_AVAILABLE`] for a control command.
    fn in_program(&self, opcode: Opcode) -> Result<(), Status> {
        match self.catalogue.mode(opcode) {
            Mode::None => Err(Status::INVALID_COMMAND),
            Mode::Direct => Err(Status::NOT_AVAILABLE),
            Mode::Standalone | Mode::Both => Ok(()),
        }
    }

    /// EI, DI and VECT, also in direct mode.
    ///
    /// # Errors
    /// [`Status::WRONG_TYPE`] for an unknown interrupt, [`Status::INVALID_VALUE`] for a vector past the end of memory.
    pub(crate) fn configure_interrupt(&mut self, instruction: &Instruction) -> Result<(), Status> {
        let interrupt = self.catalogue.interrupt(instruction.kind).ok_or(Status::WRONG_TYPE)?;
        if instruction.opcode == Opcode::VECT {
            let address = self.program.address(instruction.value)?;
            self.interrupts.set_vector(interrupt.number, address);
        } else {
            self.interrupts.enable(interrupt, instruction.opcode == Opcode::EI, self.now);
        }
        Ok(())
    }
}

// WAIT.
impl<P: Ports, S: Store> Module<P, S> {
    fn begin_wait(&mut self, instruction: &Instruction) -> Result<(), Status> {
        let condition = WaitFor(instruction.kind);
        let axis = match condition {
            WaitFor::TICKS => 0,
            WaitFor::RFS if self.catalogue.mode(Opcode::RFS) == Mode::None => return Err(Status::WRONG_TYPE),
            WaitFor::POS | WaitFor::REFSW | WaitFor::LIMSW | WaitFor::RFS => self.axis_index(instruction.motor)?,
            _ => return Err(Status::WRONG_TYPE),
        };
        let ticks = match instruction.value {
            ACCUMULATOR => self.program.cpu.registers.accumulator,
            ticks => ticks,
        };
        let ticks = u64::try_from(ticks).map_err(|_| Status::INVALID_VALUE)?;
        let unlimited = ticks == 0 && condition != WaitFor::TICKS;
        let deadline_us =
            if unlimited { NEVER } else { self.program.at_us.saturating_add(ticks.saturating_mul(WAIT_TICK_US)) };
        self.program.wait = Some(Wait { condition, axis, deadline_us });
        self.program.at_us = NEVER;
        self.check_wait();
        Ok(())
    }

    /// Ends the WAIT when its condition holds or its time is up.
    pub(crate) fn check_wait(&mut self) {
        let Some(wait) = self.program.wait else { return };
        let expired = wait.deadline_us <= self.now;
        if self.holds(&wait) {
            self.end_wait();
        } else if expired {
            if wait.condition != WaitFor::TICKS {
                self.program.cpu.registers.flags.insert(Flags::TIMEOUT);
            }
            self.end_wait();
        }
    }

    fn holds(&mut self, wait: &Wait) -> bool {
        let switches = self.axes.active_switches(wait.axis, &mut self.ports);
        match wait.condition {
            WaitFor::POS => self.axes.is_reached(wait.axis),
            WaitFor::REFSW => switches.home,
            WaitFor::LIMSW => switches.left || switches.right,
            WaitFor::RFS => !self.axes.is_searching(wait.axis),
            _ => false,
        }
    }

    fn end_wait(&mut self) {
        self.program.wait = None;
        self.program.at_us = self.now;
        self.advance();
        self.program.end_step();
    }
}

// Interrupt handlers.
impl<P: Ports, S: Store> Module<P, S> {
    /// Enters the handler of the first pending interrupt, if none runs. Only a running program is interrupted.
    pub(crate) fn enter_handler(&mut self) {
        if self.program.state != State::Run {
            return;
        }
        let Some(vector) = self.interrupts.next() else { return };
        let registers = self.program.cpu.registers;
        let wait = self.program.wait.take();
        if wait.is_some() {
            self.program.at_us = self.now;
        }
        self.interrupts.saved = Some(Context { registers, wait });
        self.program.cpu.registers.pc = vector;
    }

    /// RETI; outside a handler it does nothing. The error flags stay as they are: what came during the handler is not lost, and
    /// what it has cleared does not come back.
    fn leave_handler(&mut self) -> Result<(), Status> {
        let Some(context) = self.interrupts.saved.take() else {
            self.advance();
            return Ok(());
        };
        self.advance();
        let errors = self.program.cpu.registers.flags & Flags::ERRORS;
        let order = context.registers.flags & Flags::ORDER;
        self.program.cpu.registers = Registers { flags: order | errors, ..context.registers };
        self.program.wait = context.wait;
        if context.wait.is_some() {
            self.program.at_us = NEVER;
            self.check_wait();
        }
        Ok(())
    }
}

/// Commands whose value goes to the accumulator of a program.
fn loads_accumulator(instruction: &Instruction) -> bool {
    match instruction.opcode {
        Opcode::GAP | Opcode::GGP | Opcode::GIO | Opcode::GAPX | Opcode::SAC => true,
        Opcode::GCO => instruction.motor != EEPROM,
        _ => false,
    }
}
