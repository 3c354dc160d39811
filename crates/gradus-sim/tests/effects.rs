//! The table of effects against the firmware: random instructions in random states change nothing but what the table says, and
//! what they do depends on nothing but what it says.

use gradus_asm::{Effects, Places};
use gradus_firmware::Register;
use gradus_sim::{Bench, Link, LinkKind};
use gradus_tmcl::catalogue::{Ap, TMCM_3351};
use gradus_tmcl::{Instruction, Opcode, Reply, Request};
use proptest::prelude::*;

struct Host {
    bench: Bench,
    link: Link,
}

/// What can be seen of a module, place by place.
#[derive(PartialEq, Debug)]
struct Seen {
    accumulator: i32,
    x: i32,
    flags: (bool, bool, bool),
    errors: (bool, bool, bool, bool, bool),
    variables: Vec<i32>,
    globals: Vec<i32>,
    axes: Vec<Option<i32>>,
    outputs: i32,
    coordinates: Vec<i32>,
    eeprom: u64,
    stack: Vec<u16>,
    interrupts: (u64, bool),
}

impl Host {
    fn new() -> Self {
        let mut bench = Bench::rigid(&TMCM_3351);
        let link = bench.attach(LinkKind::Usb, 0);
        Self { bench, link }
    }

    fn send(&mut self, opcode: Opcode, kind: u8, motor: u8, value: i32) -> i32 {
        let instruction = Instruction::new(opcode, kind, motor, value);
        self.bench.send(&mut self.link, &Request { address: 1, instruction }.emit());
        self.bench.take(&mut self.link).map_or(0, |reply| Reply::parse(&reply).unwrap().value)
    }

    /// Stores a program.
    fn load(&mut self, program: &[Instruction]) {
        self.send(Opcode::ENTER_DOWNLOAD, 0, 0, 0);
        for Instruction { opcode, kind, motor, value } in program {
            self.send(*opcode, *kind, *motor, *value);
        }
        self.send(Opcode::EXIT_DOWNLOAD, 0, 0, 0);
        self.send(Opcode::RESET_APPLICATION, 0, 0, 0);
    }

    /// Executes the next instruction, and waits a little for what it starts.
    fn step(&mut self) {
        self.send(Opcode::STEP_APPLICATION, 0, 0, 0);
        self.bench.run_for(100);
    }

    fn set(&mut self, register: Register, value: i32) {
        assert!(self.bench.set_program(register, value));
    }

    fn seen(&mut self) -> Seen {
        let global = |host: &mut Self, number| host.send(Opcode::GGP, number, 0, 0);
        let globals = [65, 77, 84, 132].map(|number| global(self, number) * i32::from(number != 132)).to_vec();
        let coordinates = (1..21).map(|number| self.send(Opcode::GCO, number, 0, 0)).collect();
        let outputs = self.send(Opcode::GIO, 255, 2, 0);
        let shown = [Ap::TargetPosition, Ap::TargetSpeed, Ap::MaxSpeed, Ap::MaxAcceleration, Ap::MaxCurrent];
        let axes = (0..3).flat_map(|axis| shown.map(|id| (axis, id)));
        let axes = axes.map(|(axis, id)| self.bench.axis_parameter(axis, id)).collect();
        let eeprom = self.bench.eeprom().total_writes();
        let view = self.bench.program().unwrap();
        let registers = view.registers();
        let flags = registers.flags;
        Seen {
            accumulator: registers.accumulator,
            x: registers.x,
            flags: (flags.equal, flags.greater, flags.less),
            errors: (flags.eto, flags.eal, flags.edv, flags.epo, flags.esd),
            variables: view.variables().to_vec(),
            globals,
            axes,
            outputs,
            coordinates,
            eeprom,
            stack: view.stack().to_vec(),
            interrupts: view.enabled_interrupts(),
        }
    }
}

impl Seen {
    /// The places in which two differ.
    fn differs(&self, other: &Self) -> Places {
        let differs = [
            (self.accumulator != other.accumulator, Places::ACCUMULATOR),
            (self.x != other.x, Places::X),
            (self.flags != other.flags, Places::FLAGS),
            (self.errors != other.errors, Places::ERRORS),
            (self.variables != other.variables, Places::VARIABLES),
            (self.globals != other.globals, Places::GLOBALS),
            (self.axes != other.axes, Places::AXES),
            (self.outputs != other.outputs, Places::PORTS),
            (self.coordinates != other.coordinates, Places::COORDINATES),
            (self.eeprom != other.eeprom, Places::EEPROM),
            (self.stack != other.stack, Places::STACK),
            (self.interrupts != other.interrupts, Places::INTERRUPTS),
        ];
        differs.into_iter().filter(|(differs, _)| *differs).map(|(_, place)| place).fold(Places::empty(), |a, b| a | b)
    }
}

/// Accumulator, X, the number that 0 has been compared with, and the user variables 0 to 3.
#[derive(Clone, Copy, Debug)]
struct Start {
    accumulator: i32,
    x: i32,
    compared: i32,
    variables: [i32; 4],
}

impl Start {
    /// A module whose program stands before the instruction.
    fn host(&self, instruction: Instruction) -> Host {
        let mut host = Host::new();
        for (number, value) in (0..).zip(self.variables) {
            host.send(Opcode::SGP, number, 2, value);
        }
        host.load(&[Instruction::new(Opcode::COMP, 0, 0, self.compared), instruction]);
        host.step(); // the accumulator is 0 here
        host.set(Register::Accumulator, self.accumulator);
        host.set(Register::X, self.x);
        host
    }
}

fn start() -> impl Strategy<Value = Start> {
    let number = || prop_oneof![-3..4i32, Just(1000)];
    (number(), number(), number(), prop::array::uniform4(number()))
        .prop_map(|(accumulator, x, compared, variables)| Start { accumulator, x, compared, variables })
}

/// Mostly instructions that the module takes.
fn instruction() -> impl Strategy<Value = Instruction> {
    let opcode =
        prop_oneof![0..58u8, 64..72u8, Just(80), prop_oneof![Just(9u8), Just(35), Just(19), Just(33), 40..46u8]];
    let kind = prop_oneof![0..13u8, Just(65), Just(77), Just(84), Just(255)];
    let motor = prop_oneof![0..4u8, Just(255)];
    let value = prop_oneof![-2..4i32, Just(1000)];
    (opcode, kind, motor, value)
        .prop_map(|(opcode, kind, motor, value)| Instruction::new(Opcode(opcode), kind, motor, value))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    #[test]
    fn an_instruction_changes_nothing_else(instruction in instruction(), start in start()) {
        let mut host = start.host(instruction);
        let before = host.seen();
        host.step();
        let changed = host.seen().differs(&before);
        let said = Effects::of(&instruction).writes;
        prop_assert!(said.contains(changed), "{:?} changes {:?}, the table says {:?}", instruction, changed, said);
    }

    #[test]
    fn an_instruction_depends_on_nothing_else(instruction in instruction(), start in start(), other in start()) {
        let effects = Effects::of(&instruction);
        let kept = |place, mine, other| if effects.reads.contains(place) { mine } else { other };
        let second = Start {
            accumulator: kept(Places::ACCUMULATOR, start.accumulator, other.accumulator),
            x: kept(Places::X, start.x, other.x),
            compared: kept(Places::FLAGS, start.compared, other.compared),
            variables: if effects.reads.contains(Places::VARIABLES) { start.variables } else { other.variables },
        };
        let run = |start: &Start| {
            let mut host = start.host(instruction);
            let before = host.seen();
            host.step();
            let counter = host.bench.program().unwrap().registers().counter;
            (counter, before, host.seen())
        };
        let (first, second) = (run(&start), run(&second));
        prop_assert_eq!(first.0, second.0, "{:?} goes on elsewhere", instruction);
        // What both started with in common, and what both have written, is the same behind it.
        // Writes of the EEPROM are counted from elsewhere on: values that are there already are not written again.
        let excused = (first.1.differs(&second.1) - written(&first, &second)) | Places::EEPROM;
        let differs = first.2.differs(&second.2);
        prop_assert!(excused.contains(differs), "{:?}: {:?} differ", instruction, differs);
    }
}

/// The places that both runs have changed.
fn written(first: &(u16, Seen, Seen), second: &(u16, Seen, Seen)) -> Places {
    first.1.differs(&first.2) & (second.1.differs(&second.2) - Places::VARIABLES)
}

#[test]
fn the_hidden_readers_of_the_accumulator_are_known() {
    for (opcode, kind, motor, value) in [
        (Opcode::SIO, 255, 2, -1),
        (Opcode::WAIT, 0, 0, -1),
        (Opcode::WAIT, 1, 0, -1),
        (Opcode::SAC, 128, 0, 0),
        (Opcode::AAPX, 4, 0, 0),
        (Opcode::MVPA, 0, 0, 0),
        (Opcode::MVPXA, 0, 0, 0),
        (Opcode::ROLA, 0, 0, 0),
        (Opcode::RORXA, 0, 0, 0),
        (Opcode::AIV, 0, 0, 0),
        (Opcode::ACO, 1, 0, 0),
    ] {
        let instruction = Instruction::new(opcode, kind, motor, value);
        assert!(Effects::of(&instruction).reads.contains(Places::ACCUMULATOR), "{instruction:?}");
    }
    let output = Instruction::new(Opcode::SIO, 0, 2, 1);
    assert!(!Effects::of(&output).reads.contains(Places::ACCUMULATOR));
}
