//! Registers of a servo's chips (commands 146 and 148, WRITE_MC and READ_MC of PyTrinamic).
//!
//! The manual does not name the commands; the maker's tools do: the type is the number of the register, the motor that of the
//! chip. Chip 0 is the controller, a TMC4671. Its registers that have a counterpart here read and write as such: who it is, raw
//! currents, targets, limits, actual values. A position is in 65536 a turn, whatever axis parameter 56 says. Chip 1 is the gate driver, a
//! TMC6100: who it is, its status, and its configuration, which is kept and changes nothing. Date, time and build of the
//! controller are 0, because no source states those of the module's. All else, and writing what can only be read, is an invalid
//! value.

use gradus_motion::foc::Dq;
use gradus_tmcl::Status;
use gradus_tmcl::catalogue::{Ap, AxisParameter};

use crate::drive::servo::servo::Servo;
use crate::ports::{Bridge, RotorInputs, Supply};

const CONTROLLER: u8 = 0;
const GATE_DRIVER: u8 = 1;

/// `4671` in characters, and the version of the production chip: 1.3.
const CONTROLLER_TYPE: i32 = 0x3436_3731;
const CONTROLLER_VERSION: i32 = 0x0001_0003;

/// Version in the gate driver's register IOIN, and its bit for the enabled driver.
const GATE_VERSION: i32 = 0x10 << 24;
const GATE_ENABLED: i32 = 1 << 6;

/// Bit of the gate driver's register GSTAT for a short circuit or under-voltage of its supply.
const GATE_FAULT: i32 = 1 << 2;

/// What a register of the controller stands for.
#[derive(Clone, Copy)]
enum Register {
    ChipInfo,
    ChipInfoAddress,
    AdcRaw,
    AdcRawAddress,
    /// Two halves, the upper one first.
    Pair(Ap, Ap),
    Value(Ap),
    /// The same in 65536 a turn.
    TargetPosition,
    ActualPosition,
}

/// The registers of the controller.
const REGISTERS: &[(u8, Register)] = &[
    (0x00, Register::ChipInfo),
    (0x01, Register::ChipInfoAddress),
    (0x02, Register::AdcRaw),
    (0x03, Register::AdcRawAddress),
    (0x1B, Register::Pair(Ap::MotorType, Ap::PolePairs)),
    (0x5E, Register::Value(Ap::MaxCurrent)),
    (0x5F, Register::Value(Ap::MaxAcceleration)),
    (0x60, Register::Value(Ap::MaxSpeed)),
    (0x64, Register::Pair(Ap::TargetCurrent, Ap::TargetFlux)),
    (0x66, Register::Value(Ap::TargetSpeed)),
    (0x68, Register::TargetPosition),
    (0x69, Register::Pair(Ap::ActualCurrent, Ap::ActualFlux)),
    (0x6A, Register::Value(Ap::ActualSpeed)),
    (0x6B, Register::ActualPosition),
];

fn register(address: u8) -> Result<Register, Status> {
    let row = REGISTERS.iter().find(|(number, _)| *number == address);
    row.map(|(_, register)| *register).ok_or(Status::INVALID_VALUE)
}

/// Which of the kept registers of the gate driver it is.
fn kept(address: u8) -> Result<usize, Status> {
    [0x00, 0x09, 0x0A].iter().position(|number| *number == address).ok_or(Status::INVALID_VALUE)
}

impl Servo {
    pub(crate) fn read_chip<A: Bridge + RotorInputs + Supply>(
        &self,
        chip: u8,
        address: u8,
        port: &mut A,
    ) -> Result<i32, Status> {
        match chip {
            CONTROLLER => Ok(self.read_controller(register(address)?, port)),
            GATE_DRIVER => self.read_gate_driver(address, port),
            _ => Err(Status::INVALID_VALUE),
        }
    }

    fn read_controller<A: Bridge + RotorInputs + Supply>(&self, register: Register, port: &mut A) -> i32 {
        match register {
            Register::ChipInfo => match self.chips.chip_info {
                0 => CONTROLLER_TYPE,
                1 => CONTROLLER_VERSION,
                _ => 0,
            },
            Register::ChipInfoAddress => self.chips.chip_info.into(),
            Register::AdcRaw if self.chips.adc_raw == 0 => self.pair(Ap::AdcI1Raw, Ap::AdcI0Raw, port),
            Register::AdcRaw => 0,
            Register::AdcRawAddress => self.chips.adc_raw.into(),
            Register::Pair(upper, lower) => self.pair(upper, lower, port),
            Register::Value(id) => self.read(id, port),
            Register::TargetPosition => self.control.target_position(),
            Register::ActualPosition => self.control.position(),
        }
    }

    fn pair<A: Bridge + RotorInputs + Supply>(&self, upper: Ap, lower: Ap, port: &mut A) -> i32 {
        self.read(upper, port) << 16 | self.read(lower, port) & 0xFFFF
    }

    fn read_gate_driver<A: Bridge>(&self, address: u8, port: &mut A) -> Result<i32, Status> {
        Ok(match address {
            0x01 if port.is_faulty() => GATE_FAULT,
            0x01 => 0,
            0x04 if self.is_on() => GATE_VERSION | GATE_ENABLED,
            0x04 => GATE_VERSION,
            _ => self.chips.gate_configuration.get(kept(address)?).copied().unwrap_or(0),
        })
    }

    pub(crate) fn write_chip<A: Bridge + RotorInputs>(
        &mut self,
        chip: u8,
        address: u8,
        value: i32,
        port: &mut A,
    ) -> Result<(), Status> {
        match chip {
            CONTROLLER => self.write_controller(register(address)?, value, port),
            GATE_DRIVER => {
                let slot = self.chips.gate_configuration.get_mut(kept(address)?).ok_or(Status::INVALID_VALUE)?;
                *slot = value;
                Ok(())
            }
            _ => Err(Status::INVALID_VALUE),
        }
    }

    fn write_controller<A: Bridge + RotorInputs>(
        &mut self,
        register: Register,
        value: i32,
        port: &mut A,
    ) -> Result<(), Status> {
        let byte = u8::try_from(value).map_err(|_| Status::INVALID_VALUE);
        match register {
            Register::ChipInfoAddress => self.chips.chip_info = byte?,
            Register::AdcRawAddress => self.chips.adc_raw = byte?,
            Register::Pair(Ap::TargetCurrent, _) => return self.push_both(value),
            Register::Value(id) => return self.write(self.writable(id, value)?, value, port),
            Register::TargetPosition => return self.go_inside(value),
            Register::ActualPosition => {
                self.control.set_position(value);
                self.target = self.outside(value);
            }
            Register::ChipInfo | Register::AdcRaw | Register::Pair(..) => return Err(Status::INVALID_VALUE),
        }
        Ok(())
    }

    /// Targets of torque, the upper half, and flux.
    fn push_both(&mut self, value: i32) -> Result<(), Status> {
        let target_ma = Dq { d: i32::from(value as i16), q: value >> 16 };
        self.writable(Ap::TargetCurrent, target_ma.q)?;
        self.writable(Ap::TargetFlux, target_ma.d)?;
        self.push(target_ma)
    }

    /// The row of a parameter that takes this value.
    fn writable(&self, id: Ap, value: i32) -> Result<&'static AxisParameter, Status> {
        let row = self.catalogue.axis_parameters.iter().find(|row| row.id == id);
        row.filter(|row| row.access.writable() && row.accepts(value)).ok_or(Status::INVALID_VALUE)
    }
}
