//! What is known before each command: the registers, where the flags come from, and which axes move.
//!
//! One forward pass over each part of a program. At the start of a routine nothing is known of the registers; behind a call
//! nothing is known of what the called routine changes. Where ways meet, only what they agree in is known, so that no
//! command is looked at more than [`VISITS`] times.

use std::collections::{BTreeSet, HashMap};

use gradus_tmcl::catalogue::{Ap, Module};
use gradus_tmcl::{Instruction, MoveKind, Opcode, Operation, Search, WaitFor};

use crate::assembler::Assembly;
use crate::effects::{
    EEPROM, Effects, FIRST_ERROR, Places, VARIABLES, Variable, meaning, variable_set, variables_read,
};
use crate::flow::{Flow, Kind, Step};

/// Axes that are followed.
pub(crate) const AXES: usize = 6;

/// How often a command is looked at before everything is taken to be unknown there.
const VISITS: u8 = 8;

/// Where a value was read.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Origin {
    Axis { number: u8, axis: u8 },
    Global { number: u8, bank: u8 },
    Port { number: u8, bank: u8 },
}

/// What is known of a register.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Value {
    Unknown,
    /// `compared` is the condition that tells, where no command has loaded it.
    Constant {
        value: i32,
        compared: Option<usize>,
    },
    Read(Origin),
}

/// What the result of the last comparison is that of.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Flags {
    Unknown,
    /// Nothing has set them since the start.
    Start,
    /// A comparison of the accumulator, or, with 0, a load of it.
    Compared {
        value: Value,
        with: i32,
        at: usize,
    },
    /// A calculation, compared with 0. `lost` is a comparison that it has replaced.
    Computed {
        at: usize,
        lost: Option<usize>,
    },
    /// A routine that changes them.
    Call {
        at: usize,
    },
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Certainty {
    No,
    Unknown,
    May,
    Must,
}

/// What made an axis move.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum How {
    Nothing,
    Position,
    Velocity,
    Search,
    Mixed,
}

/// Whether an axis moves.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Motion {
    pub certainty: Certainty,
    pub how: How,
    /// The command that started it.
    pub at: usize,
    /// No time has passed since.
    pub is_fresh: bool,
}

const STILL: Motion = Motion { certainty: Certainty::No, how: How::Nothing, at: 0, is_fresh: false };
const UNKNOWN: Motion = Motion { certainty: Certainty::Unknown, how: How::Mixed, ..STILL };

/// Everything that is known in one place.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct State {
    pub accumulator: Value,
    x: Value,
    pub flags: Flags,
    /// The last comparison with another number than 0 that no condition has looked at.
    pending: Option<usize>,
    pub motion: [Motion; AXES],
}

impl State {
    const NOTHING: Self = Self {
        accumulator: Value::Unknown,
        x: Value::Unknown,
        flags: Flags::Unknown,
        pending: None,
        motion: [UNKNOWN; AXES],
    };

    fn at_start(kind: Kind) -> Self {
        match kind {
            Kind::Main => Self { flags: Flags::Start, motion: [STILL; AXES], ..Self::NOTHING },
            Kind::Handler(_) => Self { flags: Flags::Start, ..Self::NOTHING },
            Kind::Routine => Self::NOTHING,
        }
    }

    fn join(self, other: Self) -> Self {
        let same = |a: Value, b: Value| if a == b { a } else { Value::Unknown };
        Self {
            accumulator: same(self.accumulator, other.accumulator),
            x: same(self.x, other.x),
            flags: if self.flags == other.flags { self.flags } else { Flags::Unknown },
            pending: self.pending.filter(|pending| other.pending == Some(*pending)),
            motion: std::array::from_fn(|axis| self.motion[axis].join(other.motion[axis])),
        }
    }
}

impl Motion {
    fn join(self, other: Self) -> Self {
        use Certainty::{May, Must, No, Unknown};
        let moving = |motion: &Self| matches!(motion.certainty, May | Must);
        let certainty = match (self.certainty, other.certainty) {
            (a, b) if a == b => a,
            (May | Must, _) | (_, May | Must) => May,
            (No | Unknown, No | Unknown) => Unknown,
        };
        let at = [self, other].iter().filter(|motion| moving(motion)).map(|motion| motion.at).min().unwrap_or(0);
        let how = if self.how == other.how { self.how } else { How::Mixed };
        Self { certainty, how, at, is_fresh: self.is_fresh && other.is_fresh }
    }

    /// As if it might have ended.
    fn loosened(self) -> Self {
        let certainty = if self.certainty == Certainty::Must { Certainty::May } else { self.certainty };
        Self { certainty, ..self }
    }
}

/// What a routine does, with the routines that it calls.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct Summary {
    pub effects: Effects,
    /// Axes that it moves, waits for or looks at.
    axes: u8,
    /// Time passes in it.
    waits: bool,
    /// The user variables that it reads, restores or overwrites, as bits.
    variables: [u64; 4],
}

/// The states before all commands, part by part, and the summaries of the parts.
pub(crate) struct Values {
    /// By part and address.
    states: Vec<HashMap<usize, State>>,
    pub summaries: Vec<Summary>,
}

impl Values {
    /// Looks at the first `parts` parts.
    pub fn new(assembly: &Assembly, flow: &Flow, parts: usize) -> Self {
        let summaries = summaries(assembly, flow);
        let pass = |part| Pass { assembly, flow, summaries: &summaries }.run(part);
        Self { states: (0..parts).map(pass).collect(), summaries }
    }

    /// What is known before a command, once for each part that it belongs to.
    pub fn before(&self, flow: &Flow, address: usize) -> impl Iterator<Item = &State> {
        flow.within[address].iter().filter_map(move |part| self.states[*part].get(&address))
    }
}

/// Collects what routines do, until nothing is added any more.
fn summaries(assembly: &Assembly, flow: &Flow) -> Vec<Summary> {
    let own = |part: &crate::flow::Part| {
        let instructions = part.nodes.iter().map(|node| (*node, &assembly.program[*node]));
        instructions.fold(Summary::default(), |sum, (node, instruction)| {
            let valid = assembly.commands.get(node).is_none_or(|command| command.is_valid);
            sum.and(if valid { Summary::of(instruction, assembly.module) } else { Summary::UNKNOWN })
        })
    };
    let mut sums: Vec<_> = flow.parts.iter().map(own).collect();
    let mut callers = vec![Vec::new(); flow.parts.len()];
    for (caller, part) in flow.parts.iter().enumerate() {
        part.calls.iter().for_each(|(_, callee)| callers[*callee].push(caller));
    }
    let mut open: Vec<_> = (0..flow.parts.len()).collect();
    while let Some(callee) = open.pop() {
        for caller in &callers[callee] {
            let sum = sums[*caller].and(sums[callee]);
            if sum != sums[*caller] {
                sums[*caller] = sum;
                open.push(*caller);
            }
        }
    }
    sums
}

impl Summary {
    const UNKNOWN: Self = Self {
        effects: Effects { reads: Places::all(), writes: Places::all() },
        axes: u8::MAX,
        waits: true,
        variables: [u64::MAX; 4],
    };

    /// True if it reads, restores or overwrites a user variable.
    pub fn touches(&self, variable: u8) -> bool {
        self.variables[usize::from(variable / 64)] >> (variable % 64) & 1 != 0
    }

    fn and(self, other: Self) -> Self {
        Self {
            effects: self.effects.union(other.effects),
            axes: self.axes | other.axes,
            waits: self.waits || other.waits,
            variables: std::array::from_fn(|word| self.variables[word] | other.variables[word]),
        }
    }

    pub fn of(instruction: &Instruction, module: &Module) -> Self {
        let effects = Effects::of(instruction);
        let waits = instruction.opcode == Opcode::WAIT;
        let looks = instruction.opcode == Opcode::GAP
            && matches!(meaning(module, instruction.kind), Some(Ap::ActualSpeed | Ap::PositionReached));
        let axes = if effects.writes.contains(Places::MOTION) || waits || looks { axes(instruction) } else { 0 };
        Self { effects, axes, waits, variables: variables(instruction) }
    }
}

/// The user variables that a command reads, restores or overwrites, as bits.
fn variables(instruction: &Instruction) -> [u64; 4] {
    let restored = (instruction.opcode == Opcode::RSGP && instruction.motor == VARIABLES).then_some(instruction.kind);
    let overwritten = variable_set(instruction).into_iter().chain(restored).map(Variable::One);
    let mut bits = [0; 4];
    for variable in variables_read(instruction).into_iter().flatten().chain(overwritten) {
        match variable {
            Variable::Any => bits = [u64::MAX; 4],
            Variable::One(number) => bits[usize::from(number / 64)] |= 1 << (number % 64),
        }
    }
    bits
}

/// The axes of a command as bits: all of them where a register chooses, and for coordinates.
fn axes(instruction: &Instruction) -> u8 {
    let by_register = [Opcode::ROLXA, Opcode::RORXA, Opcode::MSTX, Opcode::SAPX, Opcode::AAPX, Opcode::MVPXA];
    let coordinated = matches!(instruction.opcode, Opcode::MVP | Opcode::MVPA) && instruction.kind == MoveKind::COORD.0;
    if by_register.contains(&instruction.opcode) || coordinated {
        return u8::MAX;
    }
    1u8.checked_shl(instruction.motor.into()).unwrap_or(0)
}

struct Pass<'a> {
    assembly: &'a Assembly,
    flow: &'a Flow,
    summaries: &'a [Summary],
}

impl Pass<'_> {
    fn run(&self, part: usize) -> HashMap<usize, State> {
        let part = &self.flow.parts[part];
        let mut states: HashMap<usize, (State, u8)> = HashMap::with_capacity(part.nodes.len());
        let mut open = BTreeSet::new();
        for entry in part.entries.iter().filter(|entry| **entry < self.flow.steps.len()) {
            states.insert(*entry, (State::at_start(part.kind), 1));
            open.insert(*entry);
        }
        while let Some(address) = open.pop_first() {
            let state = self.after(address, states[&address].0);
            for next in self.flow.next(address) {
                let state = self.along(address, next, state);
                if reach(&mut states, next, state) {
                    open.insert(next);
                }
            }
        }
        states.into_iter().map(|(address, (state, _))| (address, state)).collect()
    }

    /// What is known behind a command.
    fn after(&self, address: usize, state: State) -> State {
        if self.assembly.commands.get(address).is_some_and(|command| !command.is_valid) {
            return State::NOTHING;
        }
        let instruction = &self.assembly.program[address];
        if let Step::Call(target) | Step::CallIf(target) = self.flow.steps[address] {
            return self.called(address, target, state);
        }
        let state = registers(address, instruction, state);
        Moves { address, instruction, module: self.assembly.module }.after(state)
    }

    fn called(&self, address: usize, target: usize, state: State) -> State {
        let callee = self.flow.routines.get(&target);
        let summary = callee.map_or(Summary::UNKNOWN, |part| self.summaries[*part]);
        let writes = summary.effects.writes;
        let kept = |place, value| if writes.contains(place) { Value::Unknown } else { value };
        let flags = if writes.contains(Places::FLAGS) { Flags::Call { at: address } } else { state.flags };
        let motion = |axis: usize| match state.motion[axis] {
            _ if summary.axes >> axis & 1 != 0 => UNKNOWN,
            motion => Motion { is_fresh: motion.is_fresh && !summary.waits, ..motion },
        };
        State {
            accumulator: kept(Places::ACCUMULATOR, state.accumulator),
            x: kept(Places::X, state.x),
            flags,
            pending: None,
            motion: std::array::from_fn(motion),
        }
    }

    /// What a condition tells on one of its two ways.
    fn along(&self, address: usize, next: usize, mut state: State) -> State {
        let instruction = &self.assembly.program[address];
        let Step::Branch(target) = self.flow.steps[address] else { return state };
        let (Flags::Compared { value, with, .. }, true) = (state.flags, instruction.opcode == Opcode::JC) else {
            return state;
        };
        if target == address + 1 {
            return state;
        }
        let equal = match (instruction.kind, next == target) {
            (0 | 2, taken) => taken,
            (1 | 3, taken) => !taken,
            _ => return state,
        };
        if equal && !matches!(state.accumulator, Value::Constant { compared: None, .. }) && state.accumulator == value {
            state.accumulator = Value::Constant { value: with, compared: Some(address) };
            state.flags = Flags::Compared { value: state.accumulator, with, at: address };
        }
        self.stands(value, with, equal, &mut state.motion);
        state
    }

    /// Speed 0 and position reached end a motion.
    fn stands(&self, value: Value, with: i32, equal: bool, motion: &mut [Motion; AXES]) {
        let Value::Read(Origin::Axis { number, axis }) = value else { return };
        let stands = match meaning(self.assembly.module, number) {
            Some(Ap::ActualSpeed) => equal && with == 0,
            Some(Ap::PositionReached) => equal == (with == 1),
            _ => false,
        };
        if let (true, Some(motion)) = (stands, motion.get_mut(usize::from(axis))) {
            *motion = STILL;
        }
    }
}

/// Adds a state to what is known at an address; true if that has changed.
fn reach(states: &mut HashMap<usize, (State, u8)>, address: usize, new: State) -> bool {
    let Some((known, visits)) = states.get_mut(&address) else {
        states.insert(address, (new, 1));
        return true;
    };
    let joined = if *visits < VISITS { known.join(new) } else { State::NOTHING };
    let changed = joined != *known;
    *visits = visits.saturating_add(u8::from(changed));
    *known = joined;
    changed
}

/// Accumulator, X and flags behind a command.
fn registers(at: usize, instruction: &Instruction, mut state: State) -> State {
    let Instruction { opcode, kind, motor, value } = *instruction;
    let read = match opcode {
        Opcode::GAP => Some(Value::Read(Origin::Axis { number: kind, axis: motor })),
        Opcode::GGP => Some(Value::Read(Origin::Global { number: kind, bank: motor })),
        Opcode::GIO => Some(Value::Read(Origin::Port { number: kind, bank: motor })),
        Opcode::CALCAV if kind == Operation::LOAD.0 => {
            Some(Value::Read(Origin::Global { number: motor, bank: VARIABLES }))
        }
        Opcode::CALC if kind == Operation::LOAD.0 => Some(Value::Constant { value, compared: None }),
        Opcode::GAPX | Opcode::GIV | Opcode::SAC => Some(Value::Unknown),
        Opcode::GCO if motor != EEPROM => Some(Value::Unknown),
        _ => None,
    };
    if let Some(value) = read {
        let flags = Flags::Compared { value, with: 0, at };
        return State { accumulator: value, flags, pending: None, ..state };
    }
    match opcode {
        Opcode::COMP => {
            state.flags = Flags::Compared { value: state.accumulator, with: value, at };
            state.pending = (value != 0).then_some(at);
        }
        Opcode::JC if kind < FIRST_ERROR => state.pending = None,
        Opcode::CALCX if kind == Operation::LOAD.0 => state.x = state.accumulator,
        _ => state = computed(at, instruction, state),
    }
    state
}

/// Behind a calculation; and behind every other command, which changes nothing here.
fn computed(at: usize, instruction: &Instruction, state: State) -> State {
    let writes = Effects::of(instruction).writes;
    let kept = |place, value| if writes.contains(place) { Value::Unknown } else { value };
    let compares = instruction.opcode.0 >= Opcode::CALCVV.0 && instruction.kind == Operation::COMP.0;
    let flags = match writes.contains(Places::FLAGS) {
        false => state.flags,
        true if compares => Flags::Unknown,
        true => Flags::Computed { at, lost: state.pending },
    };
    let pending = if compares && writes == Places::FLAGS { None } else { state.pending };
    State {
        accumulator: kept(Places::ACCUMULATOR, state.accumulator),
        x: kept(Places::X, state.x),
        flags,
        pending,
        ..state
    }
}

/// What a command does to the motion of axes.
struct Moves<'a> {
    address: usize,
    instruction: &'a Instruction,
    module: &'a Module,
}

impl Moves<'_> {
    fn after(&self, mut state: State) -> State {
        let Instruction { opcode, .. } = *self.instruction;
        if opcode == Opcode::WAIT {
            state.motion.iter_mut().for_each(|motion| motion.is_fresh = false);
        }
        let axes = axes(self.instruction);
        let zero = matches!(state.accumulator, Value::Constant { value: 0, .. });
        let moved = state.motion.iter_mut().enumerate().filter(|(axis, _)| axes >> axis & 1 != 0);
        for (_, motion) in moved {
            *motion = self.motion(*motion, axes == u8::MAX, zero);
        }
        state
    }

    fn motion(&self, before: Motion, chosen_elsewhere: bool, zero: bool) -> Motion {
        let Instruction { opcode, kind, value, .. } = *self.instruction;
        match opcode {
            Opcode::MVP | Opcode::MVPA | Opcode::MVPXA | Opcode::ROLXA | Opcode::RORXA | Opcode::MSTX
                if chosen_elsewhere =>
            {
                UNKNOWN
            }
            Opcode::MVP | Opcode::MVPA => self.starts(How::Position, Certainty::Must),
            Opcode::ROL | Opcode::ROR if value == 0 => stopping(before),
            Opcode::ROLA | Opcode::RORA if zero => stopping(before),
            Opcode::ROL | Opcode::ROR | Opcode::ROLA | Opcode::RORA => self.starts(How::Velocity, Certainty::Must),
            Opcode::MST => stopping(before),
            Opcode::RFS => self.search(before),
            Opcode::WAIT => self.waited(before),
            Opcode::SAP | Opcode::AAP => self.written(before),
            Opcode::SAPX | Opcode::AAPX if matches!(kind, 0 | 2) => UNKNOWN,
            _ => before,
        }
    }

    fn starts(&self, how: How, certainty: Certainty) -> Motion {
        Motion { certainty, how, at: self.address, is_fresh: true }
    }

    fn search(&self, before: Motion) -> Motion {
        if self.instruction.kind == Search::START.0 {
            return self.starts(How::Search, Certainty::Must);
        }
        let how = if before.how == How::Search { How::Mixed } else { before.how };
        Motion { how, ..before.loosened() }
    }

    fn waited(&self, before: Motion) -> Motion {
        let ends = match WaitFor(self.instruction.kind) {
            WaitFor::POS => matches!(before.how, How::Position | How::Nothing | How::Mixed),
            WaitFor::RFS => true,
            _ => return before,
        };
        match (ends, self.instruction.value) {
            (true, 0) => STILL,
            (true, _) => Motion { how: How::Mixed, ..before.loosened() },
            (false, _) => before.loosened(),
        }
    }

    fn written(&self, before: Motion) -> Motion {
        match meaning(self.module, self.instruction.kind) {
            Some(Ap::TargetPosition) => self.starts(How::Position, Certainty::May),
            Some(Ap::TargetSpeed) if self.instruction.opcode == Opcode::SAP && self.instruction.value == 0 => {
                stopping(before)
            }
            Some(Ap::TargetSpeed) => self.starts(How::Velocity, Certainty::May),
            _ => before,
        }
    }
}

/// MST, and a velocity of 0: the motor slows down if it turns.
fn stopping(before: Motion) -> Motion {
    if before.certainty == Certainty::No { before } else { Motion { how: How::Velocity, ..before.loosened() } }
}
