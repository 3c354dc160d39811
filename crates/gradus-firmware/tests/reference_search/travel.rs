//! A rigid machine behind a TMCM-3351: three slides with switches, and the host that searches.

use core::ops::RangeInclusive;

use gradus_firmware::{
    AxisInputs, DriverSettings, DriverState, InputCircuit, Io, Link, LinkKind, Module, NullEvent, Ports, StepperStage,
    Steppers, Store, Switches, store_size,
};
use gradus_tmcl::catalogue::TMCM_3351;
use gradus_tmcl::{Instruction, Opcode, Reply, Request, Status};

/// Positions of the machine in microsteps of 1/256 full step, in which a switch is pressed.
pub type Area = RangeInclusive<i32>;

/// Where no slide comes.
pub const NOWHERE: Area = i32::MAX..=i32::MAX;

/// A slide that follows the coils without lag, with an encoder of 4096 counts in 51200 microsteps.
#[derive(Clone, Debug)]
pub struct Slide {
    /// Where the slide was at phase 0.
    pub start: i32,
    pub left: Area,
    pub right: Area,
    pub home: Area,
    /// Levels of the switches when nobody presses them.
    pub released: Switches,
    /// Beyond it the driver reports a stall.
    pub free: Area,
    /// Where the encoder sees the slide.
    pub shaft: fn(&Slide) -> i32,
    /// For so many readings after a switch is pressed or released its level is random.
    pub bounce: u32,
    pub moving: Moving,
}

/// What moves in a slide.
#[derive(Clone, Debug, Default)]
pub struct Moving {
    phase: i32,
    pressed: [bool; 3],
    /// The switches that have changed last, which bounce for so many readings more.
    bouncing: [bool; 3],
    unsettled: u32,
    noise: u32,
}

impl Moving {
    /// The levels of contacts of which these are pressed now.
    fn contacts(&mut self, pressed: [bool; 3], bounce: u32) -> [bool; 3] {
        if pressed != self.pressed {
            self.bouncing = core::array::from_fn(|i| pressed[i] != self.pressed[i]);
            self.pressed = pressed;
            self.unsettled = bounce;
        } else {
            self.unsettled = self.unsettled.saturating_sub(1);
        }
        self.noise = self.noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        // The first reading shows the change.
        let flips = self.unsettled != 0 && self.unsettled != bounce && self.noise >> 31 != 0;
        core::array::from_fn(|i| pressed[i] ^ (flips && self.bouncing[i]))
    }
}

impl Default for Slide {
    fn default() -> Self {
        Self {
            start: 0,
            left: NOWHERE,
            right: NOWHERE,
            home: NOWHERE,
            released: Switches::default(),
            free: i32::MIN..=i32::MAX,
            shaft: Slide::position,
            bounce: 0,
            moving: Moving::default(),
        }
    }
}

impl Slide {
    pub fn position(&self) -> i32 {
        self.start.wrapping_add(self.moving.phase)
    }

    /// The position of a slide that stops where the driver reports a stall.
    pub fn stopped_position(&self) -> i32 {
        self.position().clamp(*self.free.start(), *self.free.end())
    }
}

impl StepperStage for Slide {
    fn set_coils(&mut self, phase: i32, _current: u8) {
        self.moving.phase = phase;
    }

    fn set_scale(&mut self, _scale: u8) {}

    fn configure(&mut self, _settings: &DriverSettings) {}

    fn driver(&mut self) -> DriverState {
        let blocked = !self.free.contains(&self.position());
        DriverState { flags: if blocked { DriverState::STALL } else { 0 }, ..DriverState::default() }
    }
}

impl AxisInputs for Slide {
    fn switches(&mut self) -> Switches {
        let at = self.position();
        let pressed = [&self.left, &self.right, &self.home].map(|area| area.contains(&at));
        let [left, right, home] = self.moving.contacts(pressed, self.bounce);
        let released = self.released;
        Switches { left: left ^ released.left, right: right ^ released.right, home: home ^ released.home }
    }

    fn encoder(&mut self) -> i32 {
        (i64::from((self.shaft)(self)) * 4_096).div_euclid(51_200) as i32
    }

    fn watch_null(&mut self, _event: Option<NullEvent>) {}

    fn take_null(&mut self) -> Option<i32> {
        None
    }
}

/// The ports of the module, of which the search needs only ENABLE.
#[derive(Debug)]
pub struct Board {
    pub enable: bool,
}

impl Io for Board {
    fn inputs(&mut self) -> u8 {
        0
    }

    fn set_outputs(&mut self, _levels: u8) {}

    fn analog(&mut self, _port: u8) -> i32 {
        0
    }

    fn set_circuit(&mut self, _circuit: InputCircuit) {}

    fn enable(&mut self) -> bool {
        self.enable
    }
}

#[derive(Debug)]
pub struct Machine {
    pub slides: [Slide; 3],
    pub board: Board,
}

impl Ports for Machine {
    type Axes = Steppers;
    type Axis = Slide;
    type Io = Board;

    fn axis(&mut self, axis: usize) -> &mut Slide {
        &mut self.slides[axis]
    }

    fn io(&mut self) -> &mut Board {
        &mut self.board
    }
}

#[derive(Debug)]
pub struct Memory(Vec<u8>);

impl Store for Memory {
    fn read(&mut self, address: u32, bytes: &mut [u8]) {
        for (byte, at) in bytes.iter_mut().zip(address as usize..) {
            *byte = self.0.get(at).copied().unwrap_or(0xff);
        }
    }

    fn write(&mut self, address: u32, byte: u8) {
        self.0[address as usize] = byte;
    }
}

/// A module on its machine, with a host that speaks in commands.
pub struct Bench {
    module: Module<Machine, Memory>,
    link: Link,
    now: u64,
}

impl Bench {
    /// Every axis drives a slide like this one.
    pub fn new(slide: Slide) -> Self {
        let machine = Machine { slides: core::array::from_fn(|_| slide.clone()), board: Board { enable: true } };
        let memory = Memory(vec![0xff; store_size(&TMCM_3351) as usize]);
        Self { module: Module::new(&TMCM_3351, machine, memory), link: Link::new(1, LinkKind::Usb, 0), now: 0 }
    }

    pub fn slide(&mut self, axis: usize) -> &mut Slide {
        &mut self.module.ports().slides[axis]
    }

    pub fn board(&mut self) -> &mut Board {
        &mut self.module.ports().board
    }

    pub fn advance_ms(&mut self, ms: u64) {
        self.now += ms * 1000;
        self.module.poll(self.now);
    }

    /// Status and value of the reply to a command.
    pub fn exchange(&mut self, command: &str) -> (u8, i32) {
        let instruction = Instruction::parse(command, &TMCM_3351).unwrap_or_else(|error| panic!("{command}: {error}"));
        self.obey(instruction)
    }

    fn obey(&mut self, instruction: Instruction) -> (u8, i32) {
        self.module.poll(self.now);
        self.module.receive(&mut self.link, &Request { address: 1, instruction }.emit());
        let reply = self.module.transmit(&mut self.link).expect("no reply");
        let reply = Reply::parse(&reply).expect("wrong checksum");
        (reply.status.0, reply.value)
    }

    /// Stores a program, its commands between semicolons.
    pub fn download(&mut self, program: &str) {
        self.control(Opcode::ENTER_DOWNLOAD, 0);
        for command in program.split(';').map(str::trim) {
            assert_eq!(self.exchange(command).0, Status::LOADED.0, "{command}");
        }
        self.control(Opcode::EXIT_DOWNLOAD, 0);
    }

    /// Starts the stored program.
    pub fn run(&mut self) {
        self.control(Opcode::RUN_APPLICATION, 0);
    }

    fn control(&mut self, opcode: Opcode, value: i32) {
        assert_eq!(self.obey(Instruction::new(opcode, 0, 0, value)).0, 100, "{opcode:?}");
    }

    /// The value of the reply to a command that must not fail.
    pub fn ask(&mut self, command: &str) -> i32 {
        let (status, value) = self.exchange(command);
        assert_eq!(status, 100, "{command}");
        value
    }

    /// Executes commands between semicolons, none of which may fail.
    pub fn all(&mut self, commands: &str) {
        for command in commands.split(';').map(str::trim).filter(|command| !command.is_empty()) {
            self.ask(command);
        }
    }

    pub fn get(&mut self, parameter: u8) -> i32 {
        self.ask(&format!("GAP {parameter}, 0"))
    }

    pub fn is_searching(&mut self) -> bool {
        self.ask("RFS STATUS, 0") != 0
    }

    /// Lets the search of axis 0 end.
    pub fn finish(&mut self) {
        let limit = self.now + 200_000_000;
        while self.is_searching() {
            assert!(self.now < limit, "the search takes too long");
            self.advance_ms(20);
        }
    }

    /// Lets motor 0 come to rest.
    pub fn rest(&mut self) {
        while self.get(3) != 0 {
            self.advance_ms(2);
        }
    }

    /// Where the machine is when axis 0 is at position 0.
    pub fn zero(&mut self) -> i32 {
        let position = self.get(1);
        self.slide(0).position() - position
    }
}
