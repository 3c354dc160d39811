//! A module on hardware that does nothing, linked without std and without an allocator.
//!
//! `cargo build --release` proves that the core crates need neither; running it answers one datagram, exit status 0 if the
//! answer is right. On a microcontroller the four traits below would touch pins.

#![no_std]
#![no_main]

use core::ffi::c_int;
use core::hint::black_box;
use core::panic::PanicInfo;

use gradus_firmware::{AxisInputs, DriverState, Io, Link, LinkKind, Module, Ports, StepperStage, Store, Switches};
use gradus_tmcl::catalogue::TMCM_3351;
use gradus_tmcl::{Instruction, Opcode, Request};

struct Board {
    axes: [Axis; 3],
    io: Pins,
}

#[derive(Clone, Copy)]
struct Axis;

struct Pins;

/// A memory that has just been erased and cannot be written.
struct Erased;

impl Ports for Board {
    type Axis = Axis;
    type Io = Pins;

    fn axis(&mut self, axis: usize) -> &mut Axis {
        let last = self.axes.len() - 1;
        &mut self.axes[axis.min(last)]
    }

    fn io(&mut self) -> &mut Pins {
        &mut self.io
    }
}

impl StepperStage for Axis {
    fn set_coils(&mut self, phase: i32, current: u8) {
        black_box((phase, current));
    }

    fn driver(&mut self) -> DriverState {
        DriverState::default()
    }
}

impl AxisInputs for Axis {
    fn switches(&mut self) -> Switches {
        Switches::default()
    }

    fn encoder(&mut self) -> i32 {
        0
    }
}

impl Io for Pins {
    fn inputs(&mut self) -> u8 {
        black_box(0)
    }

    fn set_outputs(&mut self, levels: u8) {
        black_box(levels);
    }

    fn analog(&mut self, _port: u8) -> i32 {
        0
    }

    fn set_adc_range(&mut self, ten_volts: bool) {
        black_box(ten_volts);
    }

    fn enable(&mut self) -> bool {
        true
    }
}

impl Store for Erased {
    fn read(&mut self, _address: u32, bytes: &mut [u8]) {
        bytes.fill(0xff);
    }

    fn write(&mut self, _address: u32, _byte: u8) {}
}

/// Turns motor 0 for a second and asks where it is.
fn answer() -> Option<[u8; 9]> {
    let mut module = Module::new(&TMCM_3351, Board { axes: [Axis; 3], io: Pins }, Erased);
    let mut link = Link::new(0, LinkKind::Usb, 5_000);
    for (opcode, kind, value) in [(Opcode::ROR, 0, 51_200), (Opcode::GAP, 1, 0)] {
        let request = Request { address: 1, instruction: Instruction::new(opcode, kind, 0, value) };
        module.receive(&mut link, &black_box(request.emit()));
        module.poll(1_000_000);
    }
    module.transmit(&mut link)?;
    module.transmit(&mut link)
}

#[unsafe(no_mangle)]
extern "C" fn main() -> c_int {
    c_int::from(answer().is_none_or(|reply| reply[2] != 100))
}

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    loop {}
}
