//! The ways through a program: what follows what, which commands belong to which routine.
//!
//! A program starts at address 0, at the labels that the pragma `entry` names, at the run of labelled jumps that may stand at
//! its start (TMCM-3351 manual 7.6: a host starts routines by their address), and where RST leads. Routines are what CSUB and
//! CALL lead to, handlers what VECT names. Behind a call the program goes on only if the routine can return.

use std::collections::{HashMap, HashSet, VecDeque};

use gradus_tmcl::{Instruction, Opcode};

use crate::assembler::Assembly;

/// How a program goes on behind a command.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Step {
    Next,
    Jump(usize),
    /// On or to another address.
    Branch(usize),
    Call(usize),
    /// On, perhaps after a call.
    CallIf(usize),
    Return,
    ReturnFromInterrupt,
    Restart(usize),
    Stop,
}

/// What kind of part of a program it is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Kind {
    Main,
    Routine,
    /// With the number of its interrupt.
    Handler(u8),
}

/// A part of a program that is entered as a whole. Parts may share commands.
pub(crate) struct Part {
    pub kind: Kind,
    /// Where it begins; main may begin at several addresses.
    pub entries: Vec<usize>,
    /// Its commands without those of the routines it calls, ascending.
    pub nodes: Vec<usize>,
    /// It reaches an RSUB.
    pub returns: bool,
    /// The calls in it: address and called part.
    pub calls: Vec<(usize, usize)>,
    /// Return sites, part and address, that wait for it to return.
    waiting: Vec<(usize, usize)>,
}

/// The main part of every program.
pub(crate) const MAIN: usize = 0;

/// Visits for each command before the analysis gives up: parts that share all their commands.
const VISITS: usize = 16;

pub(crate) struct Flow {
    pub steps: Vec<Step>,
    pub parts: Vec<Part>,
    /// The parts that each command belongs to, ascending.
    pub within: Vec<Vec<usize>>,
    /// The routines by address.
    pub routines: HashMap<usize, usize>,
    /// The handlers: VECT, its interrupt, the part.
    pub vectors: Vec<(usize, u8, usize)>,
    /// False where the analysis has given up, and for a program that does not fit into the module; then nothing here says
    /// anything.
    pub is_complete: bool,
}

impl Flow {
    /// `marked` are the addresses that pragmas name as entries.
    pub fn new(assembly: &Assembly, marked: &[usize]) -> Self {
        let valid = |address: usize| assembly.commands.get(address).is_none_or(|command| command.is_valid);
        let step = |(address, instruction)| if valid(address) { step(instruction) } else { Step::Next };
        let steps: Vec<_> = assembly.program.iter().enumerate().map(step).collect();
        let entries: Vec<_> = entries(assembly, &steps).chain(marked.iter().copied()).collect();
        Walk::new(steps).run(&assembly.program, entries, assembly.module.memory())
    }

    /// The commands that can follow one in its own part.
    pub fn next(&self, address: usize) -> impl Iterator<Item = usize> {
        let beyond = self.steps.len();
        let on = Some(address + 1);
        let (first, second) = match self.steps[address] {
            Step::Next | Step::CallIf(_) => (on, None),
            Step::Jump(target) => (Some(target), None),
            Step::Branch(target) => (on, Some(target)),
            Step::Call(target) => (on.filter(|_| self.returns(target)), None),
            Step::Return | Step::ReturnFromInterrupt | Step::Restart(_) | Step::Stop => (None, None),
        };
        [first, second].into_iter().flatten().filter(move |next| *next < beyond)
    }

    /// A routine of another program is taken to return.
    fn returns(&self, target: usize) -> bool {
        self.routines.get(&target).is_none_or(|part| self.parts[*part].returns)
    }

    /// True if some way leads to the command.
    pub fn is_reached(&self, address: usize) -> bool {
        !self.within[address].is_empty()
    }

    /// True if the command belongs to the part.
    pub fn contains(&self, part: usize, address: usize) -> bool {
        self.within.get(address).is_some_and(|parts| parts.binary_search(&part).is_ok())
    }

    /// The parts that a part calls, itself first, and those that they call.
    pub fn called_from(&self, part: usize) -> Vec<usize> {
        let (mut found, mut seen) = (vec![part], HashSet::from([part]));
        let mut at = 0;
        while let Some(&part) = found.get(at) {
            found
                .extend(self.parts[part].calls.iter().map(|(_, callee)| *callee).filter(|callee| seen.insert(*callee)));
            at += 1;
        }
        found
    }
}

fn step(instruction: &Instruction) -> Step {
    let target = usize::try_from(instruction.value).unwrap_or(usize::MAX);
    match instruction.opcode {
        Opcode::JA => Step::Jump(target),
        Opcode::JC | Opcode::DJNZ => Step::Branch(target),
        Opcode::CSUB => Step::Call(target),
        Opcode::CALL => Step::CallIf(target),
        Opcode::RSUB => Step::Return,
        Opcode::RETI => Step::ReturnFromInterrupt,
        Opcode::RST => Step::Restart(target),
        Opcode::STOP => Step::Stop,
        _ => Step::Next,
    }
}

/// Address 0 and the jumps and STOPs with labels that follow it.
fn entries(assembly: &Assembly, steps: &[Step]) -> impl Iterator<Item = usize> {
    let labelled: HashSet<_> = assembly.labels.iter().map(|label| label.address).collect();
    let ends = steps.iter().map(|step| matches!(step, Step::Jump(_) | Step::Stop));
    let run = ends.enumerate().take_while(|(address, ends)| *ends && labelled.contains(address)).count();
    0..run.max(1)
}

struct Walk {
    flow: Flow,
    seen: HashSet<(usize, usize)>,
    open: VecDeque<(usize, usize)>,
    /// The handlers by address.
    handlers: HashMap<usize, usize>,
}

impl Walk {
    fn new(steps: Vec<Step>) -> Self {
        let flow = Flow {
            within: vec![Vec::new(); steps.len()],
            steps,
            parts: Vec::new(),
            routines: HashMap::new(),
            vectors: Vec::new(),
            is_complete: true,
        };
        Self { flow, seen: HashSet::new(), open: VecDeque::new(), handlers: HashMap::new() }
    }

    fn run(mut self, program: &[Instruction], entries: Vec<usize>, room: usize) -> Flow {
        self.part(Kind::Main, entries);
        self.flow.is_complete = self.flow.steps.len() <= room;
        while let Some((part, address)) = self.open.pop_front().filter(|_| self.flow.is_complete) {
            if address >= program.len() || !self.seen.insert((part, address)) {
                continue;
            }
            if self.seen.len() > VISITS * program.len() + 1000 {
                self.flow.is_complete = false;
            }
            self.visit(part, address, &program[address]);
        }
        self.finish()
    }

    fn visit(&mut self, part: usize, address: usize, instruction: &Instruction) {
        self.flow.parts[part].nodes.push(address);
        match self.flow.steps[address] {
            Step::Next => self.open.push_back((part, address + 1)),
            Step::Jump(target) => self.open.push_back((part, target)),
            Step::Branch(target) => self.open.extend([(part, address + 1), (part, target)]),
            Step::Call(target) => self.call(part, address, target),
            Step::CallIf(target) => {
                self.open.push_back((part, address + 1));
                if let Some(callee) = self.routine(target) {
                    self.flow.parts[part].calls.push((address, callee));
                }
            }
            Step::Return => self.leave(part),
            Step::Restart(target) => self.restart(target),
            Step::ReturnFromInterrupt | Step::Stop => {}
        }
        let target = usize::try_from(instruction.value).ok().filter(|target| *target < self.flow.steps.len());
        if let (Opcode::VECT, Some(target)) = (instruction.opcode, target) {
            self.vector(address, instruction.kind, target);
        }
    }

    fn call(&mut self, part: usize, address: usize, target: usize) {
        let after = (part, address + 1);
        let Some(callee) = self.routine(target) else { return self.open.push_back(after) };
        self.flow.parts[part].calls.push((address, callee));
        if self.flow.parts[callee].returns {
            self.open.push_back(after);
        } else {
            self.flow.parts[callee].waiting.push(after);
        }
    }

    fn leave(&mut self, part: usize) {
        let part = &mut self.flow.parts[part];
        part.returns = true;
        self.open.extend(part.waiting.drain(..));
    }

    fn restart(&mut self, target: usize) {
        self.flow.parts[MAIN].entries.push(target);
        self.open.push_back((MAIN, target));
    }

    fn vector(&mut self, address: usize, interrupt: u8, target: usize) {
        let part = match self.handlers.get(&target) {
            Some(part) => *part,
            None => self.part(Kind::Handler(interrupt), vec![target]),
        };
        self.handlers.insert(target, part);
        self.flow.vectors.push((address, interrupt, part));
    }

    /// The routine at an address; `None` if the address is behind the program.
    fn routine(&mut self, target: usize) -> Option<usize> {
        if target >= self.flow.steps.len() {
            return None;
        }
        if let Some(part) = self.flow.routines.get(&target) {
            return Some(*part);
        }
        let part = self.part(Kind::Routine, vec![target]);
        self.flow.routines.insert(target, part);
        Some(part)
    }

    fn part(&mut self, kind: Kind, entries: Vec<usize>) -> usize {
        let number = self.flow.parts.len();
        self.open.extend(entries.iter().map(|entry| (number, *entry)));
        let (nodes, calls, waiting) = (Vec::new(), Vec::new(), Vec::new());
        self.flow.parts.push(Part { kind, entries, nodes, returns: false, calls, waiting });
        number
    }

    fn finish(mut self) -> Flow {
        for (number, part) in self.flow.parts.iter_mut().enumerate() {
            part.nodes.sort_unstable();
            part.entries.sort_unstable();
            part.entries.dedup();
            part.nodes.iter().for_each(|node| self.flow.within[*node].push(number));
        }
        self.flow
    }
}
