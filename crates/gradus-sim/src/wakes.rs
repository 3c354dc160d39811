//! When each of many things is due.

/// A tournament: every node holds the earlier of the two times below it, so the winner stands at the top and a change costs
/// one walk up. What rests costs nothing.
#[derive(Clone, Debug, Default)]
pub(crate) struct Wakes {
    /// The top is 1; the children of `n` are `2 n` and `2 n + 1`; the second half are the things.
    times: Vec<u64>,
    len: usize,
}

const NEVER: u64 = u64::MAX;

impl Wakes {
    /// One more thing, which is never due so far.
    pub(crate) fn push(&mut self) {
        self.len += 1;
        if 2 * self.len > self.times.len() {
            let things = self.times.split_off(self.times.len() / 2);
            self.times = vec![NEVER; 2 * self.len.next_power_of_two()];
            for (index, at_us) in things.into_iter().enumerate() {
                self.set(index, Some(at_us));
            }
        }
    }

    /// Says when a thing is due.
    pub(crate) fn set(&mut self, index: usize, at_us: Option<u64>) {
        let mut node = self.times.len() / 2 + index;
        self.times[node] = at_us.unwrap_or(NEVER);
        while node > 1 {
            node /= 2;
            self.times[node] = self.times[2 * node].min(self.times[2 * node + 1]);
        }
    }

    /// When a thing is due.
    pub(crate) fn at(&self, index: usize) -> u64 {
        self.times[self.times.len() / 2 + index]
    }

    /// What is due first and when; of several the one that was pushed first.
    pub(crate) fn first(&self) -> Option<(u64, usize)> {
        let half = self.times.len() / 2;
        let at_us = *self.times.get(1).filter(|at_us| **at_us != NEVER)?;
        let mut node = 1;
        while node < half {
            node = if self.times[2 * node] == at_us { 2 * node } else { 2 * node + 1 };
        }
        Some((at_us, node - half))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_is_the_earliest_whatever_changes() {
        let mut wakes = Wakes::default();
        assert_eq!(wakes.first(), None);
        let mut times = Vec::new();
        for round in 0..500_u64 {
            if round % 10 == 0 {
                wakes.push();
                times.push(None);
            }
            let (index, at_us) = ((round * 7919) as usize % times.len(), round * 104_729 % 64);
            times[index] = Some(at_us).filter(|at_us| *at_us > 8);
            wakes.set(index, times[index]);
            let due = |(index, at_us): (usize, &Option<u64>)| at_us.map(|at_us| (at_us, index));
            assert_eq!(wakes.first(), times.iter().enumerate().filter_map(due).min(), "round {round}");
        }
    }
}
