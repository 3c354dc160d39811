//! Labels and constants. Case does not matter; both kinds share one set of names, over all files of a program.

use std::cell::Cell;
use std::collections::HashMap;

use gradus_tmcl::catalogue::Module;

use crate::builtin;
use crate::code::Code;
use crate::expression::{Expression, Fault, Meaning, functions};
use crate::nearest;
use crate::parser::Name;
use crate::problem::Problem;

/// What a name stands for.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Hash)]
pub enum Defined {
    /// Index into [`Assembly::labels`](crate::Assembly::labels).
    Label(usize),
    /// Index into [`Assembly::constants`](crate::Assembly::constants).
    Constant(usize),
}

/// Constants of a cycle that a problem names.
const CYCLE_SHOWN: usize = 10;
/// Comparisons of an unknown name with a defined one, for hints: when they are used up, there are no more hints.
const COMPARISONS: usize = 100_000;

/// Where the evaluation of a constant stands.
#[derive(Clone, Copy, PartialEq)]
enum State {
    Open,
    /// Constants that it needs are looked at first; it has this place among those that wait.
    Waiting(usize),
    Known(f64),
    Failed,
}

struct Definition {
    name: Name,
    /// `None` for a label.
    expression: Option<Expression>,
    state: State,
}

impl Definition {
    fn what(&self) -> &'static str {
        if self.expression.is_some() { "constant" } else { "label" }
    }
}

/// The labels and constants of a program.
pub(crate) struct Names {
    module: &'static Module,
    definitions: Vec<Definition>,
    index: HashMap<String, usize>,
    /// Definitions of a name that was defined before: the later and the first one.
    again: Vec<(usize, usize)>,
    comparisons_left: Cell<usize>,
}

impl Names {
    pub fn new(module: &'static Module) -> Self {
        Self {
            module,
            definitions: Vec::new(),
            index: HashMap::new(),
            again: Vec::new(),
            comparisons_left: Cell::new(COMPARISONS),
        }
    }

    pub fn add_label(&mut self, name: Name, address: usize) {
        self.add(Definition { name, expression: None, state: State::Known(address as f64) });
    }

    pub fn add_constant(&mut self, name: Name, expression: Expression) {
        self.add(Definition { name, expression: Some(expression), state: State::Open });
    }

    fn add(&mut self, definition: Definition) {
        let new = self.definitions.len();
        let first = *self.index.entry(definition.name.text.to_lowercase()).or_insert(new);
        if first != new {
            self.again.push((new, first));
        }
        self.definitions.push(definition);
    }

    /// Gives every constant its value.
    pub fn resolve(&mut self, problems: &mut Vec<Problem>) {
        for definition in 0..self.definitions.len() {
            if self.definitions[definition].state == State::Open {
                self.settle(definition, problems);
            }
        }
        problems.extend(self.again.iter().filter_map(|(new, first)| self.duplicate(*new, *first)));
    }

    /// Evaluates a constant and, before it, those that it needs.
    fn settle(&mut self, wanted: usize, problems: &mut Vec<Problem>) {
        let mut path = vec![wanted];
        while let Some(&current) = path.last() {
            self.definitions[current].state = State::Waiting(path.len() - 1);
            let state = match self.unsettled(current) {
                Some((next, State::Waiting(place))) => {
                    problems.push(self.cycle(&path[place..], next));
                    State::Failed
                }
                Some((next, _)) => {
                    path.push(next);
                    continue;
                }
                None => self.calculate(current, problems),
            };
            self.definitions[current].state = state;
            path.pop();
        }
    }

    /// A constant in this one's expression that has not been evaluated.
    fn unsettled(&self, definition: usize) -> Option<(usize, State)> {
        let mut names = self.definitions[definition].expression.iter().flat_map(Expression::names);
        names.find_map(|(name, _)| {
            let index = *self.index.get(&name.to_lowercase())?;
            let state = self.definitions[index].state;
            matches!(state, State::Open | State::Waiting(_)).then_some((index, state))
        })
    }

    fn calculate(&self, definition: usize, problems: &mut Vec<Problem>) -> State {
        let value = self.definitions[definition].expression.as_ref().and_then(|e| self.value(e, problems));
        value.map_or(State::Failed, State::Known)
    }

    /// The value of an expression; `None` if it has none, which is reported.
    pub fn value(&self, expression: &Expression, problems: &mut Vec<Problem>) -> Option<f64> {
        match expression.evaluate(|name| self.meaning(name)) {
            Ok(value) => Some(value),
            Err(fault) => {
                problems.extend(self.report(fault));
                None
            }
        }
    }

    /// True if there is such a label or constant.
    pub fn contains(&self, name: &str) -> bool {
        self.index.contains_key(&name.to_lowercase())
    }

    fn meaning(&self, name: &str) -> Meaning {
        match self.index.get(&name.to_lowercase()).map(|index| self.definitions[*index].state) {
            Some(State::Known(value)) => Meaning::Value(value),
            Some(_) => Meaning::Failed,
            None => Meaning::Unknown,
        }
    }

    fn report(&self, fault: Fault) -> Option<Problem> {
        match fault {
            Fault::Reported => None,
            Fault::Unknown(name, span) => {
                let problem = Problem::error(Code::UnknownName, span, format!("no label or constant named `{name}`"));
                Some(problem.maybe_help(self.hint(&name)))
            }
            Fault::DivisionByZero(span) => Some(Problem::error(Code::Arithmetic, span, "division by zero")),
            Fault::Arithmetic(span) => Some(Problem::error(Code::Arithmetic, span, "this has no finite value")),
        }
    }

    fn hint(&self, name: &str) -> Option<String> {
        if let Some(function) = functions().find(|function| function.eq_ignore_ascii_case(name)) {
            return Some(format!("the function is written `{function}(...)`"));
        }
        self.comparisons_left.set(self.comparisons_left.get().checked_sub(self.definitions.len())?);
        let defined = self.definitions.iter().map(|definition| definition.name.text.as_str());
        nearest::hint(name, defined).or_else(|| builtin::hint(name, self.module))
    }

    /// These constants need each other, each the next one and the last `first`.
    fn cycle(&self, around: &[usize], first: usize) -> Problem {
        let name = |index: &usize| self.definitions[*index].name.text.as_str();
        let mut names: Vec<_> = around.iter().take(CYCLE_SHOWN).map(name).collect();
        if around.len() > CYCLE_SHOWN {
            names.push("...");
        }
        names.push(name(&first));
        let message = format!("constant `{}` is defined by itself", name(&first));
        Problem::error(Code::ConstantCycle, self.definitions[first].name.span, message).help(names.join(" -> "))
    }

    /// A constant may be defined again with the same value: files that include the same file can be used together.
    fn duplicate(&self, new: usize, first: usize) -> Option<Problem> {
        let (new, first) = (&self.definitions[new], &self.definitions[first]);
        if new.expression.is_some() && first.expression.is_some() && new.state == first.state {
            return None;
        }
        let message = format!("`{}` is already a {}", new.name.text, first.what());
        Some(Problem::error(Code::Duplicate, new.name.span, message).note(first.name.span, "the first one"))
    }

    /// For every definition its number among the labels or the constants; `None` for a constant without a value.
    pub fn numbered(&self) -> Vec<Option<Defined>> {
        let (mut labels, mut constants) = ((0..).map(Defined::Label), (0..).map(Defined::Constant));
        let number = |definition: &Definition| match (&definition.expression, definition.state) {
            (_, State::Open | State::Waiting(_) | State::Failed) => None,
            (None, _) => labels.next(),
            (Some(_), _) => constants.next(),
        };
        self.definitions.iter().map(number).collect()
    }

    /// The definition of a name; the first where there are several.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.index.get(&name.to_lowercase()).copied()
    }

    /// The expressions of the constants.
    pub fn expressions(&self) -> impl Iterator<Item = &Expression> {
        self.definitions.iter().filter_map(|definition| definition.expression.as_ref())
    }

    /// The labels with their addresses, in the order of the text.
    pub fn labels(&self) -> impl Iterator<Item = (&Name, f64)> {
        self.known(|definition| definition.expression.is_none())
    }

    /// The constants with their values, in the order of the text.
    pub fn constants(&self) -> impl Iterator<Item = (&Name, f64)> {
        self.known(|definition| definition.expression.is_some())
    }

    fn known(&self, wanted: fn(&Definition) -> bool) -> impl Iterator<Item = (&Name, f64)> {
        self.definitions.iter().filter(move |definition| wanted(definition)).filter_map(|definition| {
            match definition.state {
                State::Known(value) => Some((&definition.name, value)),
                _ => None,
            }
        })
    }
}
