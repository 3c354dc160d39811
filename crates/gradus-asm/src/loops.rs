//! Loops of a program, and the commands that every way passes.

use std::collections::{HashMap, HashSet, VecDeque};

use crate::flow::Flow;

/// Commands that lead to each other: a loop with all that is in it.
pub(crate) struct Loop {
    /// Ascending addresses.
    pub nodes: Vec<usize>,
    /// Where it is entered.
    pub header: usize,
}

impl Loop {
    pub fn contains(&self, address: usize) -> bool {
        self.nodes.binary_search(&address).is_ok()
    }
}

/// The loops of a part that lie in no other loop.
pub(crate) fn loops(flow: &Flow, part: usize) -> Vec<Loop> {
    let part = &flow.parts[part];
    let mut loops: Vec<_> = components(flow, &part.nodes)
        .into_iter()
        .filter(|nodes| nodes.len() > 1 || flow.next(nodes[0]).any(|next| next == nodes[0]))
        .map(|mut nodes| {
            nodes.sort_unstable();
            Loop { header: nodes[0], nodes }
        })
        .collect();
    let of: HashMap<usize, usize> = loops
        .iter()
        .enumerate()
        .flat_map(|(index, found)| found.nodes.iter().map(move |node| (*node, index)))
        .collect();
    let mut entered: Vec<Option<usize>> = vec![None; loops.len()];
    let jumps = part.nodes.iter().flat_map(|node| flow.next(*node).map(|next| (Some(*node), next)));
    for (from, to) in jumps.chain(part.entries.iter().map(|entry| (None, *entry))) {
        if let Some(index) = of.get(&to).filter(|index| from.and_then(|from| of.get(&from)) != Some(*index)) {
            entered[*index] = Some(entered[*index].map_or(to, |header: usize| header.min(to)));
        }
    }
    for (found, header) in loops.iter_mut().zip(entered) {
        found.header = header.unwrap_or(found.header);
    }
    loops
}

/// Strongly connected components (Tarjan), the last ones of the program first.
fn components(flow: &Flow, nodes: &[usize]) -> Vec<Vec<usize>> {
    let mut search = Search::default();
    for node in nodes {
        search.from(*node, flow);
    }
    search.found
}

#[derive(Default)]
struct Search {
    index: HashMap<usize, usize>,
    low: HashMap<usize, usize>,
    stack: Vec<usize>,
    on_stack: HashSet<usize>,
    found: Vec<Vec<usize>>,
}

impl Search {
    fn from(&mut self, root: usize, flow: &Flow) {
        if self.index.contains_key(&root) {
            return;
        }
        let mut path = vec![self.enter(root, flow)];
        while let Some((node, successors)) = path.last_mut() {
            let node = *node;
            match successors.pop() {
                Some(next) if !self.index.contains_key(&next) => path.push(self.enter(next, flow)),
                Some(next) if self.on_stack.contains(&next) => self.lower(node, self.index[&next]),
                Some(_) => {}
                None => {
                    path.pop();
                    self.leave(node);
                    if let Some((parent, _)) = path.last() {
                        self.lower(*parent, self.low[&node]);
                    }
                }
            }
        }
    }

    fn enter(&mut self, node: usize, flow: &Flow) -> (usize, Vec<usize>) {
        let number = self.index.len();
        self.index.insert(node, number);
        self.low.insert(node, number);
        self.stack.push(node);
        self.on_stack.insert(node);
        (node, flow.next(node).collect())
    }

    fn lower(&mut self, node: usize, low: usize) {
        self.low.entry(node).and_modify(|old| *old = low.min(*old));
    }

    fn leave(&mut self, node: usize) {
        if self.low[&node] != self.index[&node] {
            return;
        }
        let start = self.stack.iter().rposition(|other| *other == node).unwrap_or(0);
        let component = self.stack.split_off(start);
        component.iter().for_each(|node| {
            self.on_stack.remove(node);
        });
        self.found.push(component);
    }
}

/// The commands that every pass of a loop meets.
pub(crate) fn on_every_pass(flow: &Flow, found: &Loop) -> Vec<usize> {
    on_every_way(found.header, |node| {
        let inside = flow.next(node).filter(|next| found.contains(*next));
        inside.map(|next| (next != found.header).then_some(next)).collect()
    })
}

/// The nodes on every way from `start` to the end, which is where `next` says `None`. None if no way ends.
pub(crate) fn on_every_way(start: usize, next: impl Fn(usize) -> Vec<Option<usize>>) -> Vec<usize> {
    let Some(path) = way(start, &next) else { return Vec::new() };
    let place: HashMap<usize, usize> = path.iter().enumerate().map(|(place, node)| (*node, place)).collect();
    let (mut always, mut seen, mut furthest) = (Vec::new(), HashSet::new(), 0);
    for (at, node) in path.iter().enumerate() {
        if furthest == at {
            always.push(*node);
        }
        // Everything that can be reached from here without a node of the path.
        let mut open = vec![*node];
        while let Some(node) = open.pop() {
            for next in next(node) {
                match next.map(|next| (next, place.get(&next))) {
                    None => furthest = path.len(),
                    Some((_, Some(place))) => furthest = furthest.max(*place),
                    Some((next, None)) if seen.insert(next) => open.push(next),
                    Some(_) => {}
                }
            }
        }
    }
    always
}

/// A shortest way to the end.
fn way(start: usize, next: &impl Fn(usize) -> Vec<Option<usize>>) -> Option<Vec<usize>> {
    let mut before = HashMap::from([(start, start)]);
    let mut open = VecDeque::from([start]);
    while let Some(node) = open.pop_front() {
        for next in next(node) {
            match next {
                None => return Some(path_to(node, &before)),
                Some(next) if !before.contains_key(&next) => {
                    before.insert(next, node);
                    open.push_back(next);
                }
                Some(_) => {}
            }
        }
    }
    None
}

fn path_to(end: usize, before: &HashMap<usize, usize>) -> Vec<usize> {
    let mut path = vec![end];
    while let Some(last) = path.last().filter(|last| before[*last] != **last) {
        path.push(before[last]);
    }
    path.reverse();
    path
}

#[cfg(test)]
mod tests {
    use super::on_every_way;

    /// The graph of `1>2 1>3 2>4`; 0 is the end.
    fn always(edges: &str) -> Vec<usize> {
        let edges: Vec<(usize, usize)> = edges
            .split(' ')
            .map(|edge| edge.split_once('>').unwrap())
            .map(|(from, to)| (from.parse().unwrap(), to.parse().unwrap()))
            .collect();
        on_every_way(1, |node| {
            let out = edges.iter().filter(|(from, _)| *from == node);
            out.map(|(_, to)| Some(*to).filter(|to| *to != 0)).collect()
        })
    }

    #[test]
    fn nodes_on_every_way_are_those_that_cannot_be_passed_by() {
        for (edges, expected) in [
            ("1>0", vec![1]),
            ("1>2 2>3 3>0", vec![1, 2, 3]),
            ("1>2 2>3 1>3 3>0", vec![1, 3]),
            ("1>2 2>4 1>3 3>4 4>0", vec![1, 4]),
            ("1>2 2>2 2>3 3>0", vec![1, 2, 3]),
            ("1>2 2>3 3>0 1>0", vec![1]),
            ("1>2 2>3 3>4 4>0 1>5 5>6 6>3", vec![1, 3, 4]),
            ("1>2 2>1", vec![]),
        ] {
            assert_eq!(always(edges), expected, "{edges}");
        }
    }
}
