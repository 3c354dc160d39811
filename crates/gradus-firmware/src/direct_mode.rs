//! Commands: direct mode, and what the interpreter shares with it.
//!
//! Where the manual is silent: suppressed replies (global parameter 255) include those to wrong checksums and to downloaded
//! commands, so that a line with the setting is silent but for what it asks for. The command that writes the parameter
//! follows its new value.

use gradus_tmcl::catalogue::{Ap, Gp, Mode, Model};
use gradus_tmcl::{Instruction, MoveKind, Opcode, Search, Status};

use crate::drive::axes::Axes;
use crate::links::link::{Answer, Link};
use crate::module::Module;
use crate::ports::{Ports, Store};
use crate::program::program::State;
use crate::storage::coordinates::EEPROM;

/// Value that commands 137 and 255 ask for.
const CONFIRMATION: i32 = 1234;

/// Type of command 138: an event for every MVP.
const EVERY_MOVE: u8 = 1;

/// First control command.
const FIRST_CONTROL: u8 = 128;

impl<P: Ports, S: Store> Module<P, S> {
    /// Answers a command of a host.
    pub(crate) fn answer(&mut self, link: &Link, instruction: &Instruction) -> Answer {
        if self.program.downloading && instruction.opcode.0 < FIRST_CONTROL {
            let status = self.download(*instruction);
            return self.plain(instruction.opcode, status, instruction.value);
        }
        match instruction.opcode {
            Opcode::READ_MEMORY => return self.read_program(instruction.value),
            Opcode::FIRMWARE_VERSION if instruction.kind == 0 => return Answer::Special(*self.catalogue.version_text),
            Opcode::FACTORY_SETTINGS if instruction.value == CONFIRMATION => {
                self.restore_factory_settings();
                return Answer::None;
            }
            _ => {}
        }
        match self.direct(link, instruction) {
            Ok(value) => self.plain(instruction.opcode, Status::OK, value),
            Err(status) => self.plain(instruction.opcode, status, instruction.value),
        }
    }

    /// A plain reply, or none if global parameter 255 suppresses it.
    pub(crate) fn plain(&self, opcode: Opcode, status: Status, value: i32) -> Answer {
        let reads = matches!(opcode, Opcode::GAP | Opcode::GGP | Opcode::GIO);
        if reads || self.globals.get(Gp::SuppressReply) == 0 { Answer::Plain(status, value) } else { Answer::None }
    }

    fn direct(&mut self, link: &Link, instruction: &Instruction) -> Result<i32, Status> {
        self.in_direct_mode(instruction.opcode)?;
        let value = instruction.value;
        match instruction.opcode {
            Opcode::EI | Opcode::DI | Opcode::VECT => self.configure_interrupt(instruction).map(|()| value),
            Opcode::GIV => Ok(self.indexed_variable().unwrap_or(value)),
            opcode if opcode.0 >= FIRST_CONTROL => self.control(link, instruction),
            Opcode::GGP => self.execute(instruction),
            _ => match self.program.cpu.registers.compute(instruction, &mut self.variables) {
                Some(result) => result,
                None => self.execute(instruction),
            },
        }
    }

    /// # Errors
    /// [`Status::INVALID_COMMAND`] for an unknown command, [`Status::NOT_AVAILABLE`] for one of programs only and for a
    /// control command that the module lacks.
    fn in_direct_mode(&self, opcode: Opcode) -> Result<(), Status> {
        match self.catalogue.mode(opcode) {
            // Opcode 0 is in no list; a host sends nine zeros to bring the line back into step.
            Mode::None if opcode.0 >= FIRST_CONTROL => Err(Status::NOT_AVAILABLE),
            Mode::None => Err(Status::INVALID_COMMAND),
            // BEHAVIOUR 1 accepts these two, against the manual's tables.
            Mode::Standalone if matches!(opcode, Opcode::COMP | Opcode::VECT) => Ok(()),
            Mode::Standalone => Err(Status::NOT_AVAILABLE),
            Mode::Direct | Mode::Both => Ok(()),
        }
    }

    /// Control commands (TMCM-3351 §3.6.58, BEHAVIOUR 2 and 3).
    fn control(&mut self, link: &Link, instruction: &Instruction) -> Result<i32, Status> {
        let Instruction { kind, value, .. } = *instruction;
        // The TMCM-351 does not look at the types of 135 and 138 (ERRATA 6).
        let is_older = self.catalogue.model == Model::Tmcm351;
        match instruction.opcode {
            Opcode::STOP_APPLICATION => self.program.stop(),
            Opcode::RUN_APPLICATION => self.run_application(kind, value)?,
            Opcode::STEP_APPLICATION => self.start_program(State::Step),
            Opcode::RESET_APPLICATION => self.reset_program(),
            Opcode::ENTER_DOWNLOAD => self.enter_download(value)?,
            Opcode::EXIT_DOWNLOAD => self.program.downloading = false,
            Opcode::APPLICATION_STATUS if is_older => return Ok((self.program.state as i32) << 24),
            Opcode::APPLICATION_STATUS => return self.program.status(kind),
            Opcode::FIRMWARE_VERSION => return self.firmware_version(kind),
            Opcode::POSITION_EVENT if is_older => self.request_event(link.id, EVERY_MOVE, value)?,
            Opcode::POSITION_EVENT => self.request_event(link.id, kind, value)?,
            Opcode::ASCII_MODE => self.enter_ascii()?,
            Opcode::BREAKPOINT => return self.program.breakpoint(kind, value),
            Opcode::CAPTURE => return self.capture(link, instruction),
            Opcode::WRITE_REGISTER => {
                self.axes.write_register(instruction.motor, kind, value, &mut self.ports)?;
                self.wake_axes();
            }
            Opcode::READ_REGISTER => return self.axes.read_register(instruction.motor, kind, &mut self.ports),
            Opcode::GET_INFO => return self.information(kind),
            Opcode::SOFTWARE_RESET if value == CONFIRMATION => self.restart_due = true,
            _ => return Err(Status::INVALID_VALUE),
        }
        Ok(value)
    }

    fn run_application(&mut self, kind: u8, value: i32) -> Result<(), Status> {
        match kind {
            0 => {}
            1 => {
                let address = self.program.address(value)?;
                self.program.stop();
                self.interrupts.saved = None;
                self.program.cpu.registers.pc = address;
            }
            _ => return Err(Status::WRONG_TYPE),
        }
        self.start_program(State::Run);
        Ok(())
    }

    fn firmware_version(&self, kind: u8) -> Result<i32, Status> {
        let (major, minor) = self.catalogue.version;
        match kind {
            1 => Ok(i32::from(self.catalogue.number) << 16 | i32::from(major) << 8 | i32::from(minor)),
            _ => Err(Status::WRONG_TYPE),
        }
    }

    fn request_event(&mut self, link: u32, kind: u8, mask: i32) -> Result<(), Status> {
        if kind > 1 {
            return Err(Status::WRONG_TYPE);
        }
        let motors = self.motors(mask.try_into().map_err(|_| Status::INVALID_VALUE)?)?;
        self.events.request(link, motors, kind == EVERY_MOVE);
        Ok(())
    }

    /// Command 157.
    fn information(&self, kind: u8) -> Result<i32, Status> {
        let (major, minor) = self.catalogue.version;
        Ok(match kind {
            0 => i32::from(self.catalogue.number),
            1 => i32::from(major) << 16 | i32::from(minor),
            // Capabilities: runs TMCL.
            2 => 2,
            // Release type: a local build, whose source has no identity (type 30: a hash of 28 bits, and bit 28 for changes).
            3 => 3,
            30 => 0,
            // Width of parameter and register numbers in bits.
            20 | 21 => 8,
            _ => return Err(Status::WRONG_TYPE),
        })
    }

    fn indexed_variable(&self) -> Option<i32> {
        self.variables.get(usize::try_from(self.program.cpu.registers.x).ok()?).copied()
    }

    /// Commands that direct mode and programs share; gives back the value of the reply.
    pub(crate) fn execute(&mut self, instruction: &Instruction) -> Result<i32, Status> {
        let Instruction { opcode, kind, motor, value } = *instruction;
        let (accumulator, x) = (self.program.cpu.registers.accumulator, self.program.cpu.registers.x);
        match opcode {
            Opcode::GAP => return self.get_axis_parameter(kind, motor),
            Opcode::GAPX => return self.get_axis_parameter(kind, axis_in(x)?),
            Opcode::SAP => self.set_axis_parameter(kind, motor, value)?,
            Opcode::AAP => self.set_axis_parameter(kind, motor, accumulator)?,
            Opcode::SAPX => self.set_axis_parameter(kind, axis_in(x)?, value)?,
            Opcode::AAPX => self.set_axis_parameter(kind, axis_in(x)?, accumulator)?,
            Opcode::STAP => self.store_axis_parameter(kind, motor)?,
            Opcode::RSAP => self.restore_axis_parameter(kind, motor)?,
            Opcode::ROR => self.rotate(motor, value, 1)?,
            Opcode::ROL => self.rotate(motor, value, -1)?,
            Opcode::RORA => self.rotate(motor, accumulator, 1)?,
            Opcode::ROLA => self.rotate(motor, accumulator, -1)?,
            Opcode::RORXA => self.rotate(axis_in(x)?, accumulator, 1)?,
            Opcode::ROLXA => self.rotate(axis_in(x)?, accumulator, -1)?,
            Opcode::MST => self.rotate(motor, 0, 1)?,
            Opcode::MSTX => self.rotate(axis_in(x)?, 0, 1)?,
            Opcode::MVP => return self.move_to_position(MoveKind(kind), motor, value),
            Opcode::MVPA => return self.move_to_position(MoveKind(kind), motor, accumulator),
            Opcode::MVPXA => return self.move_to_position(MoveKind(kind), axis_in(x)?, accumulator),
            Opcode::RFS => return self.reference_search(Search(kind), motor, value),
            Opcode::GGP => return self.get_global(kind, motor),
            Opcode::SGP => self.set_global(kind, motor, value)?,
            Opcode::AGP => self.set_global(kind, motor, accumulator)?,
            Opcode::STGP => self.store_variable(kind, motor)?,
            Opcode::RSGP => self.restore_variable(kind, motor)?,
            Opcode::GIO => return self.get_port(kind, motor),
            Opcode::SIO => self.set_port(kind, motor, value)?,
            Opcode::SAC => return self.exchange(kind, motor, value),
            Opcode::SCO if motor == EEPROM => self.store_coordinates(kind)?,
            Opcode::SCO => self.set_coordinate(kind, motor, value)?,
            Opcode::GCO if motor == EEPROM => self.recall_coordinates(kind)?,
            Opcode::GCO => return self.get_coordinate(kind, motor),
            Opcode::ACO => self.set_coordinate(kind, motor, accumulator)?,
            Opcode::CCO => {
                let position = self.get_id(motor, Ap::ActualPosition)?;
                self.set_coordinate(kind, motor, position)?;
            }
            // A module without user functions of its own does nothing.
            Opcode::UF0 | Opcode::UF1 | Opcode::UF2 | Opcode::UF3 => {}
            Opcode::UF4 | Opcode::UF5 | Opcode::UF6 | Opcode::UF7 => {}
            _ => return Err(Status::INVALID_COMMAND),
        }
        Ok(value)
    }
}

/// The axis that the X register names.
fn axis_in(x: i32) -> Result<u8, Status> {
    u8::try_from(x).map_err(|_| Status::INVALID_VALUE)
}
