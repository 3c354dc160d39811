//! A module of each kind on hardware that does nothing, linked without std, without an allocator and without a way to panic.
//!
//! `cargo build --release` is the proof; running it answers some datagrams, exit status 0 if the answers are right. On a
//! microcontroller the traits below would touch pins.

#![no_std]
#![no_main]

use core::ffi::c_int;
use core::hint::black_box;
use core::panic::PanicInfo;

use gradus_firmware::{
    AxisInputs, Bridge, DriverSettings, DriverState, InputCircuit, Io, Link, LinkKind, Module, NullEvent, Ports,
    RotorInputs, Servo, StepperStage, Steppers, Store, Supply, Switches,
};
use gradus_tmcl::can::Frame;
use gradus_tmcl::catalogue::{self, TMCM_351, TMCM_1617, TMCM_3351};
use gradus_tmcl::{Instruction, Opcode, Request, Status};

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
    type Axes = Steppers;
    type Axis = Axis;
    type Io = Pins;

    fn axis(&mut self, axis: usize) -> &mut Axis {
        let [first, second, third] = &mut self.axes;
        match axis {
            0 => first,
            1 => second,
            _ => third,
        }
    }

    fn io(&mut self) -> &mut Pins {
        &mut self.io
    }
}

impl StepperStage for Axis {
    fn set_coils(&mut self, phase: i32, current: u8) {
        black_box((phase, current));
    }

    fn set_scale(&mut self, scale: u8) {
        black_box(scale);
    }

    fn configure(&mut self, _settings: &DriverSettings) {}

    fn driver(&mut self) -> DriverState {
        DriverState::default()
    }
}

impl AxisInputs for Axis {
    fn switches(&mut self) -> Switches {
        Switches::default()
    }

    fn encoder(&mut self) -> i32 {
        black_box(0)
    }

    fn watch_null(&mut self, event: Option<NullEvent>) {
        black_box(event);
    }

    fn take_null(&mut self) -> Option<i32> {
        black_box(None)
    }
}

/// The board of a servo.
struct Drive {
    bridge: HalfBridges,
    io: Pins,
}

struct HalfBridges;

impl Ports for Drive {
    type Axes = Servo;
    type Axis = HalfBridges;
    type Io = Pins;

    fn axis(&mut self, _axis: usize) -> &mut HalfBridges {
        &mut self.bridge
    }

    fn io(&mut self) -> &mut Pins {
        &mut self.io
    }
}

impl Bridge for HalfBridges {
    fn shunts(&mut self) -> [u16; 2] {
        black_box([0x7fff; 2])
    }

    fn set_duties(&mut self, duties: Option<[u16; 3]>) {
        black_box(duties);
    }

    fn rest(&mut self) {}

    fn set_frequency(&mut self, hz: u32) {
        black_box(hz);
    }

    fn is_faulty(&mut self) -> bool {
        black_box(false)
    }
}

impl RotorInputs for HalfBridges {
    fn hall(&mut self) -> u8 {
        black_box(1)
    }

    fn encoder(&mut self) -> i32 {
        black_box(0)
    }

    fn encoder_levels(&mut self) -> u8 {
        black_box(0)
    }

    fn watch_null(&mut self, event: Option<NullEvent>) {
        black_box(event);
    }

    fn take_null(&mut self) -> Option<i32> {
        black_box(None)
    }
}

impl Supply for HalfBridges {
    fn voltage_dv(&mut self) -> i32 {
        black_box(240)
    }

    fn temperature_c(&mut self) -> i32 {
        black_box(25)
    }

    fn set_brake_chopper(&mut self, on: bool) {
        black_box(on);
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

    fn set_circuit(&mut self, circuit: InputCircuit) {
        black_box(circuit);
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

/// Turns motor 0 for a second and asks where it is, once over a serial line and once over CAN.
fn answers<P: Ports>(catalogue: &'static catalogue::Module, ports: P) -> Option<[u8; 2]> {
    let mut module = Module::new(catalogue, ports, Erased);
    let mut line = Link::new(0, black_box(LinkKind::Usb), 5_000);
    let mut bus = Link::new(1, LinkKind::Can, 0);
    for (opcode, kind, value) in [(Opcode::SAP, 15, 2), (Opcode::ROR, 0, 1_000), (Opcode::GAP, 1, 0)] {
        let instruction = black_box(Instruction::new(opcode, kind, 0, value));
        module.receive(&mut line, &Request { address: 1, instruction }.emit());
        module.receive_frame(&mut bus, &Frame::request(1, &instruction));
        module.poll(1_000_000);
    }
    let replies = [module.transmit(&mut line)?, module.transmit(&mut line)?, module.transmit(&mut line)?];
    let frames = [module.transmit_frame(&mut bus)?, module.transmit_frame(&mut bus)?, module.transmit_frame(&mut bus)?];
    Some([replies[2][2], *frames[2].data().get(1)?])
}

/// Asks in text where motor 0 is, and counts the characters of the answer `BA 100 0`.
fn characters() -> usize {
    let mut module = Module::new(&TMCM_351, Board { axes: [Axis; 3], io: Pins }, Erased);
    let mut line = Link::new(0, black_box(LinkKind::Usb), 0);
    for setting in [(Opcode::SGP, 67, 32), (Opcode::ASCII_MODE, 0, 0)] {
        let instruction = Instruction::new(setting.0, setting.1, 0, setting.2);
        module.receive(&mut line, &Request { address: 1, instruction }.emit());
        module.transmit(&mut line);
    }
    module.receive(&mut line, black_box(b"A GAP 1, 0\r"));
    core::iter::from_fn(|| module.transmit_byte(&mut line)).count()
}

#[unsafe(no_mangle)]
extern "C" fn main() -> c_int {
    if characters() != b"BA 100 0\r".len() {
        return 1;
    }
    let stepper = answers(&TMCM_3351, Board { axes: [Axis; 3], io: Pins });
    let older = answers(&TMCM_351, Board { axes: [Axis; 3], io: Pins });
    let servo = answers(&TMCM_1617, Drive { bridge: HalfBridges, io: Pins });
    c_int::from([stepper, older, servo] != [Some([Status::OK.0; 2]); 3])
}

/// The hosted target's `compiler_builtins` is built for unwinding and names this; with `panic = "abort"` nobody calls it.
#[cfg(not(target_os = "none"))]
#[unsafe(no_mangle)]
extern "C" fn rust_eh_personality() {}

unsafe extern "C" {
    /// Defined nowhere: where the optimizer has left a way to panic, the link fails.
    fn the_firmware_can_panic() -> !;
}

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    // SAFETY: no program that calls this can be linked.
    unsafe { the_firmware_can_panic() }
}
