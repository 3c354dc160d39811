//! A module on fake hardware, and the words that the tests are written in.
//!
//! [`Bench`] holds the module, its machine and one client on a USB-like line. Commands are text, programs are text with
//! commands between semicolons; both go through real nine-byte datagrams.

use gradus_firmware::{
    AxisInputs, DriverSettings, DriverState, InputCircuit, Io, Link, LinkKind, Module, NullEvent, Ports, StepperStage,
    Steppers, Store, Switches, store_size,
};
use gradus_tmcl::catalogue::{self, Ap, TMCM_351, TMCM_3351};
use gradus_tmcl::{Instruction, Opcode, Reply, Request, can};

use crate::rotor::Rotor;

/// A power stage that remembers what it was told, with switches and an encoder that the test sets.
#[derive(Clone, Debug, Default)]
pub struct Stage {
    pub phase: i32,
    pub current: u8,
    pub scale: u8,
    /// Every coil vector, oldest first, while `recording`.
    pub vectors: Vec<(i32, u8)>,
    pub recording: bool,
    pub switches: Switches,
    pub encoder: i32,
    /// The encoder counts with the phase, 4096 counts in 51200 microsteps.
    pub coupled: bool,
    /// Follows the coil vector as physics has it, and turns the encoder; a vector lasts a control tick.
    pub rotor: Option<Rotor>,
    /// The null event that the module waits for.
    pub null_event: Option<NullEvent>,
    /// Counter at a null event that the module has not taken.
    pub null: Option<i32>,
    pub driver: DriverState,
    /// What the driver chip was told last.
    pub driver_settings: Option<DriverSettings>,
}

impl StepperStage for Stage {
    fn set_coils(&mut self, phase: i32, current: u8) {
        (self.phase, self.current) = (phase, current);
        if self.coupled {
            self.encoder = (i64::from(phase) * 4_096 / 51_200) as i32;
        }
        if let Some(rotor) = &mut self.rotor {
            rotor.turn(phase, f64::from(current) / 255.0 * f64::from(self.scale) / 255.0);
            self.encoder = rotor.count();
        }
        if self.recording {
            self.vectors.push((phase, current));
        }
    }

    fn set_scale(&mut self, scale: u8) {
        self.scale = scale;
    }

    fn configure(&mut self, settings: &DriverSettings) {
        self.driver_settings = Some(*settings);
    }

    fn driver(&mut self) -> DriverState {
        self.driver
    }
}

impl AxisInputs for Stage {
    fn switches(&mut self) -> Switches {
        self.switches
    }

    fn encoder(&mut self) -> i32 {
        self.encoder
    }

    fn watch_null(&mut self, event: Option<NullEvent>) {
        (self.null_event, self.null) = (event, None);
    }

    fn take_null(&mut self) -> Option<i32> {
        self.null.take()
    }
}

/// Ports of the module; the analogue inputs read the number of the port times 100, plus 1 in the 10 V range.
#[derive(Clone, Debug)]
pub struct Board {
    pub inputs: u8,
    pub outputs: u8,
    pub ten_volts: bool,
    pub pull_ups: u8,
    pub enable: bool,
}

impl Io for Board {
    fn inputs(&mut self) -> u8 {
        self.inputs
    }

    fn set_outputs(&mut self, levels: u8) {
        self.outputs = levels;
    }

    fn analog(&mut self, port: u8) -> i32 {
        i32::from(port) * 100 + i32::from(self.ten_volts)
    }

    fn set_circuit(&mut self, circuit: InputCircuit) {
        self.ten_volts = circuit.ten_volts;
        self.pull_ups = circuit.pull_ups;
    }

    fn enable(&mut self) -> bool {
        self.enable
    }
}

/// The hardware of a TMCM-3351.
#[derive(Clone, Debug)]
pub struct Machine {
    pub axes: [Stage; 3],
    pub board: Board,
}

impl Default for Machine {
    fn default() -> Self {
        let board = Board { inputs: 0, outputs: 0xff, ten_volts: true, pull_ups: 0, enable: true };
        Self { axes: Default::default(), board }
    }
}

impl Ports for Machine {
    type Axes = Steppers;
    type Axis = Stage;
    type Io = Board;

    fn axis(&mut self, axis: usize) -> &mut Stage {
        &mut self.axes[axis]
    }

    fn io(&mut self) -> &mut Board {
        &mut self.board
    }
}

/// An EEPROM that counts the writes of every cell, and whose power can fail.
#[derive(Clone, Debug)]
pub struct Memory {
    pub bytes: Vec<u8>,
    pub writes: Vec<u32>,
    /// Writes until the power fails; what is written later is lost.
    pub power: Option<usize>,
}

impl Memory {
    /// A memory in which every byte is `blank`.
    pub fn blank(blank: u8) -> Self {
        let size = store_size(&TMCM_3351) as usize;
        Self { bytes: vec![blank; size], writes: vec![0; size], power: None }
    }

    /// Writes so far.
    pub fn written(&self) -> usize {
        self.writes.iter().map(|count| *count as usize).sum()
    }
}

impl Store for Memory {
    fn read(&mut self, address: u32, bytes: &mut [u8]) {
        let stored = self.bytes.get(address as usize..).unwrap_or(&[]);
        for (i, byte) in bytes.iter_mut().enumerate() {
            *byte = stored.get(i).copied().unwrap_or(0xff);
        }
    }

    fn write(&mut self, address: u32, byte: u8) {
        match &mut self.power {
            Some(0) => return,
            Some(left) => *left -= 1,
            None => {}
        }
        self.bytes[address as usize] = byte;
        self.writes[address as usize] += 1;
    }
}

/// A module with a client on a USB-like line.
pub struct Bench {
    pub module: Module<Machine, Memory>,
    pub link: Link,
    /// Virtual time in microseconds.
    pub now: u64,
}

/// Number of the bench's own link.
pub const OWN_LINK: u32 = 1;

impl Bench {
    /// A new module on a blank EEPROM.
    pub fn new() -> Self {
        Self::with_memory(Memory::blank(0))
    }

    /// A module that is switched on with this memory.
    pub fn with_memory(memory: Memory) -> Self {
        Self::with(Machine::default(), memory)
    }

    pub fn with(machine: Machine, memory: Memory) -> Self {
        Self::of(&TMCM_3351, machine, memory)
    }

    /// Another kind of module.
    pub fn of(catalogue: &'static catalogue::Module, machine: Machine, memory: Memory) -> Self {
        let module = Module::new(catalogue, machine, memory);
        let mut bench = Self { module, link: Link::new(OWN_LINK, LinkKind::Usb, 0), now: 0 };
        bench.advance_us(0);
        bench
    }

    /// A new module on which these commands have been executed without an error.
    pub fn set_up(commands: &str) -> Self {
        let mut bench = Self::new();
        bench.all(commands);
        bench
    }

    /// A new module on which moves are short.
    pub fn fast() -> Self {
        let axis = |axis: u8| format!("SAP 4, {axis}, 200000; SAP 5, {axis}, 1000000; SAP 17, {axis}, 1000000");
        Self::set_up(&[0, 1, 2].map(axis).join(";"))
    }

    /// Switches off and on again.
    pub fn power_cycle(self) -> Self {
        let catalogue = self.module.catalogue();
        let (machine, memory) = self.module.into_parts();
        Self::of(catalogue, machine, memory)
    }

    pub fn memory(&mut self) -> &mut Memory {
        self.module.store()
    }

    pub fn stage(&mut self, axis: usize) -> &mut Stage {
        &mut self.module.ports().axes[axis]
    }

    pub fn board(&mut self) -> &mut Board {
        &mut self.module.ports().board
    }

    // Time.

    pub fn advance_us(&mut self, us: u64) {
        self.now += us;
        self.module.poll(self.now);
    }

    pub fn advance_ms(&mut self, ms: u64) {
        self.advance_us(ms * 1000);
    }

    /// Goes from event to event until the condition holds, at most `limit_ms`; gives back how long it took, in us.
    pub fn until(&mut self, limit_ms: u64, mut holds: impl FnMut(&mut Self) -> bool) -> u64 {
        let start = self.now;
        let limit = start + limit_ms * 1000;
        while !holds(self) {
            let next = self.module.poll_at().expect("nothing will happen any more");
            assert!(next <= limit, "it takes too long");
            self.now = next.max(self.now);
            self.module.poll(self.now);
        }
        self.now - start
    }

    /// Lets a motor arrive; gives back how long it took, in us.
    pub fn arrive(&mut self, axis: u8) -> u64 {
        let axis = usize::from(axis);
        self.until(3_600_000, |bench| {
            bench.peek(axis, Ap::PositionReached) == 1 && bench.peek(axis, Ap::ActualSpeed) == 0
        })
    }

    // Commands.

    /// Sends bytes as they are; gives back what comes now.
    pub fn raw(&mut self, bytes: &[u8]) -> Vec<[u8; 9]> {
        self.module.poll(self.now);
        let mut replies = Vec::new();
        let mut rest = bytes;
        loop {
            let taken = self.module.receive(&mut self.link, rest);
            rest = &rest[taken..];
            replies.extend(self.drain());
            self.text();
            if rest.is_empty() {
                return replies;
            }
        }
    }

    /// Everything that the module has to say now.
    pub fn drain(&mut self) -> Vec<[u8; 9]> {
        core::iter::from_fn(|| self.module.transmit(&mut self.link)).collect()
    }

    /// Everything that the ASCII interface has to say now.
    pub fn text(&mut self) -> String {
        core::iter::from_fn(|| self.module.transmit_byte(&mut self.link)).map(char::from).collect()
    }

    /// The reply to an instruction, if there is one.
    pub fn send(&mut self, instruction: Instruction) -> Option<[u8; 9]> {
        let replies = self.raw(&request(instruction).emit());
        assert!(replies.len() < 2, "one command, {} replies", replies.len());
        replies.first().copied()
    }

    /// The plain reply to an instruction.
    pub fn reply(&mut self, instruction: Instruction) -> Reply {
        let bytes = self.send(instruction).unwrap_or_else(|| panic!("no reply to {instruction:?}"));
        Reply::parse(&bytes).expect("wrong checksum")
    }

    /// Status and value of the reply to an instruction.
    pub fn obey(&mut self, instruction: Instruction) -> (u8, i32) {
        let reply = self.reply(instruction);
        assert_eq!((reply.host, reply.module, reply.command), (2, 1, instruction.opcode), "{instruction:?}");
        (reply.status.0, reply.value)
    }

    /// Status and value of the reply to a command.
    pub fn exchange(&mut self, command: &str) -> (u8, i32) {
        self.obey(instruction(command))
    }

    /// The value of the reply to a command that must not fail.
    pub fn ask(&mut self, command: &str) -> i32 {
        let (status, value) = self.exchange(command);
        assert_eq!(status, 100, "{command}");
        value
    }

    /// Executes commands, none of which may fail.
    pub fn all(&mut self, commands: &str) {
        for command in lines(commands) {
            self.ask(command);
        }
    }

    /// Status and value of the reply to a control command.
    pub fn control(&mut self, opcode: u8, kind: u8, value: i32) -> (u8, i32) {
        self.obey(Instruction::new(Opcode(opcode), kind, 0, value))
    }

    /// An axis parameter.
    pub fn get(&mut self, number: u8, axis: u8) -> i32 {
        let (status, value) = self.obey(Instruction::new(Opcode::GAP, number, axis, 0));
        assert_eq!(status, 100, "GAP {number}, {axis}");
        value
    }

    /// An axis parameter, read without a datagram.
    pub fn peek(&mut self, axis: usize, id: Ap) -> i32 {
        self.module.get_axis(axis, id).expect("no such parameter")
    }

    /// A parameter of all axes, read without datagrams.
    pub fn all_axes(&mut self, id: Ap) -> [i32; 3] {
        [0, 1, 2].map(|axis| self.peek(axis, id))
    }

    pub fn positions(&mut self) -> [i32; 3] {
        self.all_axes(Ap::ActualPosition)
    }

    /// A global parameter.
    pub fn global(&mut self, number: u8, bank: u8) -> i32 {
        let (status, value) = self.obey(Instruction::new(Opcode::GGP, number, bank, 0));
        assert_eq!(status, 100, "GGP {number}, {bank}");
        value
    }

    pub fn variable(&mut self, number: u8) -> i32 {
        self.global(number, 2)
    }

    // Programs.

    /// Stores a program from an address on.
    pub fn download_at(&mut self, address: i32, program: &str) {
        assert_eq!(self.control(132, 0, address), (100, address));
        for line in lines(program) {
            let instruction = instruction(line);
            assert_eq!(self.obey(instruction), (101, instruction.value), "{line}");
        }
        assert_eq!(self.control(133, 0, 0).0, 100);
    }

    pub fn download(&mut self, program: &str) {
        self.download_at(0, program);
    }

    /// Stores a program, resets and starts it.
    pub fn start(&mut self, program: &str) {
        self.download(program);
        assert_eq!(self.control(131, 0, 0).0, 100);
        assert_eq!(self.control(129, 0, 0).0, 100);
    }

    /// Runs a program until it stops; gives back how long it took, in us.
    pub fn run(&mut self, program: &str) -> u64 {
        self.start(program);
        self.until(3_600_000, |bench| !bench.is_running())
    }

    pub fn is_running(&mut self) -> bool {
        self.global(128, 0) == 1
    }

    pub fn accumulator(&mut self) -> i32 {
        self.control(135, 2, 0).1
    }

    pub fn x(&mut self) -> i32 {
        self.control(135, 3, 0).1
    }

    pub fn program_counter(&mut self) -> i32 {
        self.global(130, 0)
    }

    /// Status and address of the latest failure of the program.
    pub fn last_error(&mut self) -> (i32, i32) {
        let error = self.global(131, 0);
        (error >> 16, error & 0xffff)
    }
}

/// A bench on which a program has run to its end.
pub fn run(program: &str) -> Bench {
    let mut bench = Bench::new();
    bench.run(program);
    bench
}

/// A line of a program, or a command of direct mode.
pub fn instruction(line: &str) -> Instruction {
    Instruction::parse(line, &TMCM_3351).unwrap_or_else(|error| panic!("{line}: {error}"))
}

/// Commands between semicolons.
pub fn lines(text: &str) -> impl Iterator<Item = &str> {
    text.split(';').map(str::trim).filter(|line| !line.is_empty())
}

pub fn request(instruction: Instruction) -> Request {
    Request { address: 1, instruction }
}

pub fn frame(id: u32, extended: bool, instruction: Instruction, len: usize) -> can::Frame {
    let mut bytes = instruction.to_bytes().to_vec();
    bytes.resize(len, 0xee);
    can::Frame::new(id, extended, &bytes).unwrap()
}

/// Feeds bytes to a module as a script: commands on three kinds of line, in text too, damaged datagrams, changes of the
/// surroundings, power cycles and steps of time, at most some seconds of them. Nothing may panic, and every poll must come to its
/// end. The first byte chooses the module.
pub fn fuzz_datagrams(data: &[u8]) {
    let catalogue = if data.first().is_some_and(|byte| byte % 2 == 1) { &TMCM_351 } else { &TMCM_3351 };
    let mut bench = Bench::of(catalogue, Machine::default(), Memory::blank(0));
    bench.link = Link::new(OWN_LINK, LinkKind::Usb, 5_000);
    let mut rs485 = Link::new(2, LinkKind::Rs485, 0);
    let mut bus = Link::new(3, LinkKind::Can, 0);
    let mut left_us = 3_000_000;
    let mut script = data.iter().copied().skip(1);
    while let Some(action) = script.next() {
        let mut next = || script.next().unwrap_or(0);
        match action % 16 {
            0..=6 => _ = bench.raw(&request(any_instruction(&mut next)).emit()),
            7 => {
                let datagram = request(any_instruction(&mut next)).emit();
                bench.module.receive(&mut rs485, &datagram);
                while bench.module.transmit(&mut rs485).is_some() {}
            }
            8 => {
                let len = 7 + usize::from(action / 16 % 2);
                bench.module.receive_frame(&mut bus, &frame(1, action >= 128, any_instruction(&mut next), len));
                while bench.module.transmit_frame(&mut bus).is_some() {}
            }
            9 => {
                let bytes: Vec<u8> = (0..action / 16).map(|_| next()).collect();
                bench.raw(&bytes);
            }
            10 => bench.board().inputs = next(),
            11 => {
                let levels = next();
                let stage = bench.stage(usize::from(levels % 3));
                stage.switches = Switches { left: levels & 4 != 0, right: levels & 8 != 0, home: levels & 16 != 0 };
                stage.driver.flags = levels >> 5;
                stage.null = (levels & 32 != 0).then_some(i32::from(levels));
                stage.coupled = levels & 128 != 0;
            }
            12 if action > 200 => bench.board().enable = next() & 1 != 0,
            13 if action > 240 => bench = bench.power_cycle(),
            14 => _ = bench.raw(format!("A{}\r", any_instruction(&mut next).display(catalogue)).as_bytes()),
            15 if action > 128 => _ = bench.raw(&request(Instruction::new(Opcode::ASCII_MODE, 0, 0, 0)).emit()),
            _ => {
                let step_us = (u64::from(next()) << (action / 16)).min(left_us);
                left_us -= step_us;
                bench.advance_us(step_us);
            }
        }
    }
    bench.advance_us(left_us.min(100_000));
    let due = bench.module.poll_at();
    assert!(due.is_none_or(|at| at > bench.now), "due at {due:?}, polled up to {}", bench.now);
}

/// An instruction whose fields are mostly small.
fn any_instruction(next: &mut impl FnMut() -> u8) -> Instruction {
    let (opcode, kind, motor, value) = (next(), next(), next(), next());
    let value = match value {
        250 => i32::from_be_bytes([next(), next(), next(), next()]),
        251 => 1234,
        252 => i32::MIN,
        253 => i32::MAX,
        254 => -1,
        255 => 100_000,
        small => i32::from(small),
    };
    Instruction::new(Opcode(opcode), kind, motor, value)
}
