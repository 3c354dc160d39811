//! The firmware of a virtual module, whatever kind of axes it has.

use gradus_firmware::{LineRates, Link, Module, ProgramView, Register};
use gradus_tmcl::can;
use gradus_tmcl::catalogue::{self, Ap};

use crate::machine::ServoBoard;
use crate::{Eeprom, Machine};

/// The firmware of a virtual module with its machine and memory. A kind of axes is a program of its own, as it is on
/// microcontrollers.
#[derive(Clone, Debug)]
pub enum Firmware {
    /// Of a module with stepper axes.
    Steppers(Box<Module<Machine, Eeprom>>),
    /// Of a servo module.
    Servo(Box<Module<ServoBoard, Eeprom>>),
}

/// Does the same with either.
macro_rules! either {
    ($firmware:expr, $module:ident => $does:expr) => {
        match $firmware {
            Firmware::Steppers($module) => $does,
            Firmware::Servo($module) => $does,
        }
    };
}

impl Firmware {
    /// Switches a module on. The machine is one of such a module, as [`Machine::of`] builds it.
    pub fn new(catalogue: &'static catalogue::Module, machine: Machine, eeprom: Eeprom) -> Self {
        if catalogue.is_servo() {
            Self::Servo(Box::new(Module::new(catalogue, ServoBoard(machine), eeprom)))
        } else {
            Self::Steppers(Box::new(Module::new(catalogue, machine, eeprom)))
        }
    }

    /// As [`Module::reset_to_factory`].
    pub fn reset_to_factory(&mut self) {
        either!(self, module => module.reset_to_factory());
    }

    /// As [`Module::poll`].
    #[inline]
    pub fn poll(&mut self, now: u64) {
        either!(self, module => module.poll(now));
    }

    /// As [`Module::poll_at`].
    #[inline]
    pub fn poll_at(&self) -> Option<u64> {
        either!(self, module => module.poll_at())
    }

    /// As [`Module::receive`].
    pub fn receive(&mut self, link: &mut Link, bytes: &[u8]) -> usize {
        either!(self, module => module.receive(link, bytes))
    }

    /// As [`Module::transmit`].
    #[inline]
    pub fn transmit(&mut self, link: &mut Link) -> Option<[u8; 9]> {
        either!(self, module => module.transmit(link))
    }

    /// As [`Module::receive_frame`].
    pub fn receive_frame(&mut self, link: &mut Link, frame: &can::Frame) {
        either!(self, module => module.receive_frame(link, frame));
    }

    /// As [`Module::transmit_byte`].
    #[inline]
    pub fn transmit_byte(&mut self, link: &mut Link) -> Option<u8> {
        either!(self, module => module.transmit_byte(link))
    }

    /// As [`Module::transmit_frame`].
    pub fn transmit_frame(&mut self, link: &mut Link) -> Option<can::Frame> {
        either!(self, module => module.transmit_frame(link))
    }

    /// As [`Module::get_axis`].
    pub fn get_axis(&mut self, axis: usize, id: Ap) -> Option<i32> {
        either!(self, module => module.get_axis(axis, id))
    }

    /// As [`Module::line_rates`].
    pub fn line_rates(&self) -> LineRates {
        either!(self, module => module.line_rates())
    }

    /// As [`Module::outputs`].
    pub fn outputs(&self) -> u8 {
        either!(self, module => module.outputs())
    }

    /// As [`Module::program_view`].
    pub fn program_view(&self) -> ProgramView<'_> {
        either!(self, module => module.program_view())
    }

    /// As [`Module::set_register`].
    pub fn set_register(&mut self, register: Register, value: i32) -> bool {
        either!(self, module => module.set_register(register, value))
    }

    /// The machine.
    pub fn machine(&mut self) -> &mut Machine {
        match self {
            Self::Steppers(module) => module.ports(),
            Self::Servo(module) => &mut module.ports().0,
        }
    }

    pub(crate) fn machine_ref(&self) -> &Machine {
        match self {
            Self::Steppers(module) => module.ports_ref(),
            Self::Servo(module) => &module.ports_ref().0,
        }
    }

    /// The memory that survives a loss of power.
    pub fn store(&mut self) -> &mut Eeprom {
        either!(self, module => module.store())
    }

    /// The machine and the memory, when the module is switched off.
    pub fn into_parts(self) -> (Machine, Eeprom) {
        match self {
            Self::Steppers(module) => module.into_parts(),
            Self::Servo(module) => {
                let (ServoBoard(machine), eeprom) = module.into_parts();
                (machine, eeprom)
            }
        }
    }
}
