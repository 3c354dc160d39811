//! What clients want of the line, in the order in which it is done.

use std::collections::{HashMap, VecDeque};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use gradus_tmcl::Request;
use gradus_tmcl::catalogue::Impact;

use crate::line::Job;

/// What is to be done for a client.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Task {
    /// Ask the module; what acts and is older than a stop is refused.
    Ask(Request, Job),
    /// The client has gone.
    Leave,
}

/// Tasks of all clients. Each client's are done in their order; clients take turns; who wants to stop something goes first.
#[derive(Default)]
pub struct Queue {
    state: Mutex<State>,
    filled: Condvar,
}

#[derive(Default)]
struct State {
    /// Clients with tasks, in the order of their turns.
    turns: VecDeque<u64>,
    tasks: HashMap<u64, VecDeque<Task>>,
}

impl Queue {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// How many tasks a client has.
    pub fn len(&self, client: u64) -> usize {
        self.lock().tasks.get(&client).map_or(0, VecDeque::len)
    }

    /// Adds a task behind all others of its client.
    pub fn push(&self, client: u64, task: Task) {
        let mut state = self.lock();
        let tasks = state.tasks.entry(client).or_default();
        tasks.push_back(task);
        if tasks.len() == 1 {
            state.turns.push_back(client);
        }
        self.filled.notify_one();
    }

    /// The next task; waits for one, at most for `patience`.
    pub fn pop(&self, patience: Duration) -> Option<(u64, Task)> {
        let state = self.lock();
        let waited = self.filled.wait_timeout_while(state, patience, |state| state.turns.is_empty());
        waited.unwrap_or_else(PoisonError::into_inner).0.pop()
    }
}

impl State {
    fn pop(&mut self) -> Option<(u64, Task)> {
        let urgent = self.turns.iter().position(|client| self.tasks[client].front().is_some_and(stops));
        let client = self.turns.remove(urgent.unwrap_or(0))?;
        let tasks = self.tasks.get_mut(&client)?;
        let task = tasks.pop_front()?;
        if tasks.is_empty() {
            self.tasks.remove(&client);
        } else {
            self.turns.push_back(client);
        }
        Some((client, task))
    }
}

fn stops(task: &Task) -> bool {
    matches!(task, Task::Ask(request, _) if request.instruction.impact() == Impact::Stops)
}

#[cfg(test)]
mod tests {
    use gradus_tmcl::{Instruction, Opcode};

    use super::*;

    fn ask(opcode: Opcode, value: i32) -> Task {
        Task::Ask(Request { address: 1, instruction: Instruction::new(opcode, 0, 0, value) }, Job::default())
    }

    fn order(queue: &Queue) -> Vec<(u64, Task)> {
        std::iter::from_fn(|| queue.pop(Duration::ZERO)).collect()
    }

    #[test]
    fn clients_take_turns_and_keep_their_own_order() {
        let queue = Queue::default();
        for value in 0..3 {
            queue.push(1, ask(Opcode::GAP, value));
        }
        queue.push(2, ask(Opcode::GAP, 7));
        queue.push(2, Task::Leave);
        let [first, second, third] = [0, 1, 2].map(|value| (1, ask(Opcode::GAP, value)));
        assert_eq!(order(&queue), [first, (2, ask(Opcode::GAP, 7)), second, (2, Task::Leave), third]);
        assert_eq!((queue.len(1), queue.len(2)), (0, 0));
    }

    #[test]
    fn who_wants_to_stop_something_goes_first() {
        let queue = Queue::default();
        queue.push(1, ask(Opcode::GAP, 0));
        queue.push(2, ask(Opcode::GAP, 0));
        queue.push(3, ask(Opcode::MST, 0));
        assert_eq!(order(&queue).iter().map(|(client, _)| *client).collect::<Vec<_>>(), [3, 1, 2]);
    }
}
