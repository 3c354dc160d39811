//! The stored program and its interpreter, to look at: for debuggers, tests and coverage.

use gradus_tmcl::{Instruction, WaitFor};

use crate::module::Module;
use crate::ports::{Ports, Store};
use crate::program::cpu::{Flags, Registers, Variables};
use crate::program::interpreter::Wait;
use crate::program::interrupts::Interrupts;
use crate::program::program::{NEVER, Program, State};

/// The program of a module at one moment. Looking changes nothing.
#[derive(Clone, Copy, Debug)]
pub struct ProgramView<'a> {
    program: &'a Program,
    interrupts: &'a Interrupts,
    variables: &'a Variables,
    now_us: u64,
}

/// Register values of a program.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct RegisterView {
    /// The accumulator.
    pub accumulator: i32,
    /// The X register.
    pub x: i32,
    /// Address of the next instruction.
    pub counter: u16,
    /// The comparison flags and error flags.
    pub flags: FlagView,
}

/// Comparison flags and error flags, as JC and CALL see them.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[allow(missing_docs)] // the language's words
pub struct FlagView {
    pub equal: bool,
    pub greater: bool,
    pub less: bool,
    pub eto: bool,
    pub eal: bool,
    pub edv: bool,
    pub epo: bool,
    pub esd: bool,
}

/// A WAIT that has not ended.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct WaitView {
    /// What it waits for.
    pub condition: WaitFor,
    /// The axis that it looks at; 0 where it waits for time alone.
    pub axis: usize,
    /// When its time is up, in microseconds since power-on; `None` without a time-out.
    pub deadline_us: Option<u64>,
}

/// What an interrupt handler has interrupted.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct InterruptedView {
    /// The registers that RETI restores.
    pub registers: RegisterView,
    /// The WAIT that goes on after RETI.
    pub wait: Option<WaitView>,
}

impl<'a> ProgramView<'a> {
    /// Returns what the program does (global parameter 128).
    pub fn state(&self) -> State {
        self.program.state
    }

    /// Returns accumulator, X register, program counter and flags.
    pub fn registers(&self) -> RegisterView {
        RegisterView::of(&self.program.cpu.registers)
    }

    /// Returns the return addresses of CSUB and CALL, the innermost last; 8 at most.
    pub fn stack(&self) -> &'a [u16] {
        &self.program.cpu.stack.addresses
    }

    /// Returns the WAIT that the program stands at.
    pub fn wait(&self) -> Option<WaitView> {
        self.program.wait.as_ref().map(WaitView::of)
    }

    /// Returns when the next instruction is due, in microseconds since power-on; `None` while the program stands or waits.
    pub fn due_us(&self) -> Option<u64> {
        Some(self.program.at_us).filter(|at_us| *at_us != NEVER)
    }

    /// Returns what the present interrupt handler has interrupted; `None` outside of one.
    pub fn interrupted(&self) -> Option<InterruptedView> {
        let context = self.interrupts.saved.as_ref()?;
        let registers = RegisterView::of(&context.registers);
        Some(InterruptedView { registers, wait: context.wait.as_ref().map(WaitView::of) })
    }

    /// Returns the interrupts that wait for their handler, bit n for number n.
    pub fn pending_interrupts(&self) -> u64 {
        self.interrupts.pending()
    }

    /// Returns the interrupts that are enabled, bit n for number n, and whether they are at all (EI 255).
    pub fn enabled_interrupts(&self) -> (u64, bool) {
        self.interrupts.enabled()
    }

    /// Returns the handler of an interrupt.
    pub fn vector(&self, number: u8) -> Option<u16> {
        self.interrupts.vector(number)
    }

    /// Returns status and address of the latest failed instruction since the start (global parameter 131).
    pub fn last_error(&self) -> Option<(u8, u16)> {
        let error = self.program.last_error;
        (error != 0).then_some(((error >> 16) as u8, error as u16))
    }

    /// Returns the address of the latest call with a full stack, or return with an empty one, since the start. The module ignores
    /// both.
    pub fn stack_fault(&self) -> Option<u16> {
        self.program.cpu.stack.fault
    }

    /// Returns program memory, whatever global parameter 81 hides from hosts.
    pub fn memory(&self) -> &'a [Instruction] {
        self.program.memory()
    }

    /// Returns the 256 user variables.
    pub fn variables(&self) -> &'a [i32; 256] {
        self.variables
    }

    /// Returns the module's time in microseconds since power-on.
    pub fn now_us(&self) -> u64 {
        self.now_us
    }

    /// True while commands of hosts are stored and not executed.
    pub fn is_downloading(&self) -> bool {
        self.program.downloading
    }
}

impl RegisterView {
    fn of(registers: &Registers) -> Self {
        Self {
            accumulator: registers.accumulator,
            x: registers.x,
            counter: registers.pc,
            flags: FlagView::of(registers.flags),
        }
    }
}

impl FlagView {
    fn of(flags: Flags) -> Self {
        let has = |flag| flags.contains(flag);
        Self {
            equal: has(Flags::EQUAL),
            greater: has(Flags::GREATER),
            less: has(Flags::LESS),
            eto: has(Flags::TIMEOUT),
            eal: has(Flags::ALARM),
            edv: has(Flags::DEVIATION),
            epo: has(Flags::POSITION),
            esd: has(Flags::SHUTDOWN),
        }
    }
}

impl WaitView {
    fn of(wait: &Wait) -> Self {
        let deadline_us = Some(wait.deadline_us).filter(|at_us| *at_us != NEVER);
        Self { condition: wait.condition, axis: wait.axis, deadline_us }
    }
}

/// A register that a debugger sets.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Register {
    /// The accumulator.
    Accumulator,
    /// The X register.
    X,
    /// The program counter. A WAIT that the program stands at is given up.
    Counter,
}

impl<P: Ports, S: Store> Module<P, S> {
    /// Returns the program, to look at.
    pub fn program_view(&self) -> ProgramView<'_> {
        ProgramView {
            program: &self.program,
            interrupts: &self.interrupts,
            variables: &self.variables,
            now_us: self.now,
        }
    }

    /// Sets a register of the program; a program counter past the end of memory is not taken.
    pub fn set_register(&mut self, register: Register, value: i32) -> bool {
        match register {
            Register::Accumulator => self.program.cpu.registers.accumulator = value,
            Register::X => self.program.cpu.registers.x = value,
            Register::Counter => return self.program.go_to(value, self.now),
        }
        true
    }
}
