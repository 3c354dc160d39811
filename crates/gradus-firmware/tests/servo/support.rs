//! A TMCM-1617 on fake hardware: the test says what sensors and shunts read, and sees what the firmware makes of it.

use gradus_firmware::{
    Bridge, InputCircuit, Io, Link, LinkKind, Module, NullEvent, Ports, RotorInputs, Servo, Store, Supply, store_size,
};
use gradus_tmcl::catalogue::{Ap, TMCM_1617};
use gradus_tmcl::{Instruction, Opcode, Reply, Request};

/// A power stage with a motor that turns as the test wants.
#[derive(Clone, Debug)]
pub struct Drive {
    pub shunts: [u16; 2],
    pub hall: u8,
    pub encoder: i32,
    /// Counts that the encoder goes on in each PWM period.
    pub counts_per_tick: i32,
    pub encoder_levels: u8,
    pub null_event: Option<NullEvent>,
    pub null: Option<i32>,
    pub voltage_dv: i32,
    pub temperature_c: i32,
    pub gate_fault: bool,
    pub chopper: bool,
    pub frequency_hz: u32,
    /// The latest duties, `None` while all switches are open.
    pub duties: Option<[u16; 3]>,
    /// Periods so far.
    pub periods: u32,
    /// No period is to come.
    pub rests: bool,
}

impl Default for Drive {
    fn default() -> Self {
        Self {
            shunts: [32767; 2],
            hall: 1,
            encoder: 0,
            counts_per_tick: 0,
            encoder_levels: 0,
            null_event: None,
            null: None,
            voltage_dv: 240,
            temperature_c: 25,
            gate_fault: false,
            chopper: true,
            frequency_hz: 0,
            duties: None,
            periods: 0,
            rests: false,
        }
    }
}

impl Bridge for Drive {
    fn shunts(&mut self) -> [u16; 2] {
        self.shunts
    }

    fn set_duties(&mut self, duties: Option<[u16; 3]>) {
        self.duties = duties;
        self.periods += 1;
        self.rests = false;
        self.encoder = self.encoder.wrapping_add(self.counts_per_tick);
    }

    fn rest(&mut self) {
        (self.duties, self.rests) = (None, true);
    }

    fn set_frequency(&mut self, hz: u32) {
        self.frequency_hz = hz;
    }

    fn is_faulty(&mut self) -> bool {
        self.gate_fault
    }
}

impl RotorInputs for Drive {
    fn hall(&mut self) -> u8 {
        self.hall
    }

    fn encoder(&mut self) -> i32 {
        self.encoder
    }

    fn encoder_levels(&mut self) -> u8 {
        self.encoder_levels
    }

    fn watch_null(&mut self, event: Option<NullEvent>) {
        (self.null_event, self.null) = (event, None);
    }

    fn take_null(&mut self) -> Option<i32> {
        self.null.take()
    }
}

impl Supply for Drive {
    fn voltage_dv(&mut self) -> i32 {
        self.voltage_dv
    }

    fn temperature_c(&mut self) -> i32 {
        self.temperature_c
    }

    fn set_brake_chopper(&mut self, on: bool) {
        self.chopper = on;
    }
}

/// Ports of the module; the analogue inputs read the number of the port times 1000.
#[derive(Clone, Debug, Default)]
pub struct Board {
    pub inputs: u8,
    pub outputs: u8,
}

impl Io for Board {
    fn inputs(&mut self) -> u8 {
        self.inputs
    }

    fn set_outputs(&mut self, levels: u8) {
        self.outputs = levels;
    }

    fn analog(&mut self, port: u8) -> i32 {
        i32::from(port) * 1000
    }

    fn set_circuit(&mut self, _circuit: InputCircuit) {}

    fn enable(&mut self) -> bool {
        true
    }
}

#[derive(Clone, Debug, Default)]
pub struct Machine {
    pub drive: Drive,
    pub board: Board,
}

impl Ports for Machine {
    type Axes = Servo;
    type Axis = Drive;
    type Io = Board;

    fn axis(&mut self, _axis: usize) -> &mut Drive {
        &mut self.drive
    }

    fn io(&mut self) -> &mut Board {
        &mut self.board
    }
}

#[derive(Clone, Debug)]
pub struct Memory(Vec<u8>);

impl Memory {
    fn erased() -> Self {
        Self(vec![0xff; store_size(&TMCM_1617) as usize])
    }
}

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

/// A module with a host that speaks in commands.
pub struct Bench {
    pub module: Module<Machine, Memory>,
    link: Link,
    pub now: u64,
}

impl Bench {
    pub fn new() -> Self {
        Self::with(Machine::default(), Memory::erased())
    }

    fn with(machine: Machine, memory: Memory) -> Self {
        let mut bench =
            Self { module: Module::new(&TMCM_1617, machine, memory), link: Link::new(1, LinkKind::Usb, 0), now: 0 };
        bench.advance_us(0);
        bench
    }

    /// A new module on which these commands have been executed without an error.
    pub fn set_up(commands: &str) -> Self {
        let mut bench = Self::new();
        bench.all(commands);
        bench
    }

    pub fn power_cycle(self) -> Self {
        let (machine, memory) = self.module.into_parts();
        Self::with(machine, memory)
    }

    pub fn drive(&mut self) -> &mut Drive {
        &mut self.module.ports().drive
    }

    pub fn board(&mut self) -> &mut Board {
        &mut self.module.ports().board
    }

    pub fn advance_us(&mut self, us: u64) {
        self.now += us;
        self.module.poll(self.now);
    }

    pub fn advance_ms(&mut self, ms: u64) {
        self.advance_us(ms * 1000);
    }

    /// PWM periods in so many milliseconds.
    pub fn periods_in_ms(&mut self, ms: u64) -> u32 {
        let before = self.drive().periods;
        self.advance_ms(ms);
        self.drive().periods - before
    }

    pub fn obey(&mut self, instruction: Instruction) -> (u8, i32) {
        self.module.poll(self.now);
        self.module.receive(&mut self.link, &Request { address: 1, instruction }.emit());
        let reply = self.module.transmit(&mut self.link).expect("no reply");
        let reply = Reply::parse(&reply).expect("wrong checksum");
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

    /// Executes commands between semicolons, none of which may fail.
    pub fn all(&mut self, commands: &str) {
        for command in commands.split(';').map(str::trim).filter(|command| !command.is_empty()) {
            self.ask(command);
        }
    }

    pub fn get(&mut self, number: u8) -> i32 {
        self.ask(&format!("GAP {number}, 0"))
    }

    pub fn set(&mut self, number: u8, value: i32) {
        self.ask(&format!("SAP {number}, 0, {value}"));
    }

    /// An axis parameter, read without a datagram.
    pub fn peek(&mut self, id: Ap) -> i32 {
        self.module.get_axis(0, id).expect("no such parameter")
    }

    /// True if all these flags of axis parameter 156 are set.
    pub fn has_flags(&mut self, flags: u32) -> bool {
        self.get(156) as u32 & flags == flags
    }

    pub fn control(&mut self, opcode: Opcode, value: i32) -> (u8, i32) {
        self.obey(Instruction::new(opcode, 0, 0, value))
    }
}

pub fn instruction(command: &str) -> Instruction {
    Instruction::parse(command, &TMCM_1617).unwrap_or_else(|error| panic!("{command}: {error}"))
}
