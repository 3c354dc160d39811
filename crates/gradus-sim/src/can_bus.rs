//! A CAN bus: frames that win or wait.
//!
//! With timing a frame takes its bits, stuff bits included. When the bus is free the waiting frame with the smallest identifier
//! goes first, each node's own frames in their order. Two nodes that send different frames of one identifier at the same time
//! destroy them: on a real bus they would try until they are off, here both frames are lost. A module takes no frame of another
//! module for a command, even if its reply identifier (global parameter 70) is the own one; the manuals are silent.
//!
//! A node neither hears nor is heard by one of another bit rate; a module has chosen its own at its latest start (global parameter
//! 69). On a real bus it would disturb the others as well, until it switches itself off.

use std::collections::VecDeque;

use gradus_firmware::{Link, LinkKind};
use gradus_tmcl::can::Frame;

use crate::Bench;
use crate::faults::{Faulty, Profile};
use crate::passed::{Content, Log};
use crate::rig::BusChange;
use crate::segment::first_after;
use crate::slots::put;

/// Time between two frames of a babbling node on a bus without timing.
const BABBLE_US: u64 = 1000;

/// With so many frames waiting for the bus a host had better wait.
const BUSY: usize = 1000;

/// So many nodes that send one identifier at the same time are looked at together.
const MAX_RIVALS: usize = 16;

/// How a CAN bus works.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Can {
    /// Bits a second of hosts that are set to no other rate, 1 or more.
    pub bit_rate: u32,
    /// False: nothing takes time.
    pub timing: bool,
}

impl Can {
    /// The bit rate that the modules have when they come from the factory, 1 Mbit/s.
    pub const DEFAULT: Self = Self { bit_rate: 1_000_000, timing: true };
}

#[derive(Debug)]
pub(crate) struct CanBus {
    can: Can,
    modules: Vec<usize>,
    links: Vec<Link>,
    hosts: Vec<Option<Host>>,
    waiting: Vec<Waiting>,
    /// The frame on the bus and when it ends.
    sending: Option<(Waiting, u64)>,
    free_ns: u64,
    babbles: bool,
    cut: bool,
    pub(crate) log: Log,
}

#[derive(Debug)]
struct Host {
    /// Bits a second that it sends and listens for.
    bit_rate: u32,
    /// Frames with the time at which they arrive.
    inbox: VecDeque<(u64, Frame)>,
    up: Faulty,
    down: Faulty,
}

#[derive(Clone, Copy, Debug)]
struct Waiting {
    from: Node,
    since_us: u64,
    bit_rate: u32,
    frame: Frame,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Node {
    Host(usize),
    Module(usize),
    Babbler,
}

// Building.
impl CanBus {
    pub(crate) fn new(can: Can) -> Self {
        Self {
            can,
            modules: Vec::new(),
            links: Vec::new(),
            hosts: Vec::new(),
            waiting: Vec::new(),
            sending: None,
            free_ns: 0,
            babbles: false,
            cut: false,
            log: Log::default(),
        }
    }

    pub(crate) fn bit_rate(&self) -> u32 {
        self.can.bit_rate
    }

    pub(crate) fn modules(&self) -> &[usize] {
        &self.modules
    }

    pub(crate) fn connect(&mut self, module: usize, bench: &mut Bench) {
        self.modules.push(module);
        self.links.push(bench.attach(LinkKind::Can, 0));
    }

    pub(crate) fn attach(&mut self, profile: Profile, seed: u64) -> usize {
        let [up, down] = Faulty::both_ways(profile, seed);
        put(&mut self.hosts, Host { bit_rate: self.can.bit_rate, inbox: VecDeque::new(), up, down })
    }

    pub(crate) fn detach(&mut self, host: usize) {
        self.hosts[host] = None;
        self.waiting.retain(|waiting| waiting.from != Node::Host(host));
    }

    pub(crate) fn change(&mut self, now_us: u64, change: BusChange) {
        match change {
            BusChange::Cut(cut) => self.cut = cut,
            BusChange::Babble(on) => self.babble(now_us, on),
            BusChange::Faults(profile, seed) => self.set_faults(profile, seed),
            BusChange::Rate(bit_rate) => self.set_bit_rate(bit_rate),
        }
    }

    /// Sets all hosts to a rate, those to come too.
    fn set_bit_rate(&mut self, bit_rate: u32) {
        self.can.bit_rate = bit_rate;
        self.hosts.iter_mut().flatten().for_each(|host| host.bit_rate = bit_rate);
    }

    /// Sets a host to a rate.
    pub(crate) fn set_host_bit_rate(&mut self, host: usize, bit_rate: u32) {
        if let Some(host) = &mut self.hosts[host] {
            host.bit_rate = bit_rate;
        }
    }

    fn set_faults(&mut self, profile: Profile, seed: u64) {
        for (seed, host) in (seed..).zip(self.hosts.iter_mut().flatten()) {
            [host.up, host.down] = Faulty::both_ways(profile, seed);
        }
    }

    /// Lets a node send the identifier 0 all the time, which wins against everybody, or no more.
    fn babble(&mut self, now_us: u64, on: bool) {
        self.babbles = on;
        self.waiting.retain(|waiting| waiting.from != Node::Babbler);
        self.babble_on(now_us);
    }
}

// From and to the hosts.
impl CanBus {
    pub(crate) fn send(&mut self, now_us: u64, host: usize, frame: Frame) {
        let (waiting, from) = (&mut self.waiting, Node::Host(host));
        if let Some(sender) = &mut self.hosts[host] {
            let bit_rate = sender.bit_rate;
            let wait = |since_us, frame| waiting.push(Waiting { from, since_us, bit_rate, frame });
            sender.up.frame(now_us, frame, wait);
        }
    }

    /// The next frame that has arrived.
    pub(crate) fn take(&mut self, now_us: u64, host: usize) -> Option<Frame> {
        let inbox = &mut self.hosts[host].as_mut()?.inbox;
        inbox.pop_front_if(|(at_us, _)| *at_us <= now_us).map(|(_, frame)| frame)
    }

    pub(crate) fn is_busy(&self) -> bool {
        self.waiting.len() >= BUSY
    }

    /// True when something has arrived that nobody has taken.
    pub(crate) fn has_mail(&self, now_us: u64) -> bool {
        self.hosts.iter().flatten().any(|host| host.inbox.front().is_some_and(|(at_us, _)| *at_us <= now_us))
    }

    /// When something happens next, after `now_us`; what waits to be taken is no event.
    pub(crate) fn next_event(&self, now_us: u64) -> Option<u64> {
        let inboxes = self.hosts.iter().flatten().filter_map(|host| first_after(&host.inbox, now_us));
        inboxes.chain(self.next_of_bus()).min()
    }

    /// When the frame on the bus ends, or else the next one starts.
    fn next_of_bus(&self) -> Option<u64> {
        let end_ns = self.sending.as_ref().map(|(_, end_ns)| *end_ns);
        end_ns.or_else(|| self.start_ns()).map(|at_ns| at_ns.div_ceil(1000))
    }

    /// Does what is due at `now_us`.
    pub(crate) fn step(&mut self, now_us: u64, benches: &mut [Bench]) {
        while self.next_of_bus().is_some_and(|at_us| at_us <= now_us) {
            match self.sending.take() {
                Some((sent, end_ns)) => self.deliver(end_ns.div_ceil(1000), &sent, benches),
                None => self.start(now_us),
            }
        }
    }

    /// What the module of a place has to say at `now_us`.
    pub(crate) fn collect(&mut self, now_us: u64, place: usize, benches: &mut [Bench]) {
        let bench = &mut benches[self.modules[place]];
        let bit_rate = bench.line_rates().map_or(0, |rates| rates.can);
        while let Some(frame) = bench.take_frame(&mut self.links[place]) {
            self.waiting.push(Waiting { from: Node::Module(place), since_us: now_us, bit_rate, frame });
        }
    }
}

// On the bus.
impl CanBus {
    /// When the next frame can start.
    fn start_ns(&self) -> Option<u64> {
        let since_us = self.waiting.iter().map(|waiting| waiting.since_us).min()?;
        Some((since_us * 1000).max(self.free_ns))
    }

    /// Arbitration: the winner goes on the bus, together with those that send the same frame.
    fn start(&mut self, now_us: u64) {
        let Some(start_ns) = self.start_ns().filter(|start_ns| start_ns.div_ceil(1000) <= now_us) else { return };
        let contends = |index: &usize| self.contends(*index, start_ns);
        let contenders = (0..self.waiting.len()).filter(contends);
        let Some(winner) = contenders.clone().min_by_key(|index| rank(&self.waiting[*index].frame)) else { return };
        let winner = self.waiting[winner];
        let rivals = contenders.filter(|index| rank(&self.waiting[*index].frame) == rank(&winner.frame));
        let rivals: heapless::Vec<usize, MAX_RIVALS> = rivals.take(MAX_RIVALS).collect();
        let is_same = |index: &usize| self.waiting[*index].frame == winner.frame;
        let destroyed = self.can.timing && !rivals.iter().all(is_same);
        for index in rivals.iter().rev() {
            if destroyed || self.waiting[*index].frame == winner.frame {
                self.waiting.remove(*index);
            }
        }
        self.occupy(start_ns, winner, destroyed);
    }

    /// Whether a waiting frame takes part: it has been there in time, and no earlier one of its node is there.
    fn contends(&self, index: usize, start_ns: u64) -> bool {
        let Waiting { from, since_us, .. } = self.waiting[index];
        since_us * 1000 <= start_ns && self.waiting[..index].iter().all(|earlier| earlier.from != from)
    }

    fn occupy(&mut self, start_ns: u64, winner: Waiting, destroyed: bool) {
        let bits = if self.can.timing { u64::from(frame_bits(&winner.frame)) } else { 0 };
        self.free_ns = start_ns + bits * 1_000_000_000 / u64::from(winner.bit_rate.max(1));
        self.sending = Some((winner, self.free_ns)).filter(|_| !destroyed);
        if winner.from == Node::Babbler {
            let pause_us = if self.can.timing { 0 } else { BABBLE_US };
            self.babble_on(start_ns.div_ceil(1000) + pause_us);
        }
    }

    fn babble_on(&mut self, since_us: u64) {
        if let Some(frame) = Frame::new(0, false, &[0; 8]).filter(|_| self.babbles) {
            let bit_rate = self.can.bit_rate;
            self.waiting.push(Waiting { from: Node::Babbler, since_us, bit_rate, frame });
        }
    }

    fn deliver(&mut self, at_us: u64, sent: &Waiting, benches: &mut [Bench]) {
        if self.cut {
            return;
        }
        self.log.add(at_us, 0, matches!(sent.from, Node::Module(_)), || Content::Frame(sent.frame));
        for (_, host) in self.hosts.iter_mut().enumerate().filter(|(index, _)| sent.from != Node::Host(*index)) {
            if let Some(Host { inbox, down, .. }) = host.as_mut().filter(|host| host.bit_rate == sent.bit_rate) {
                let arrive = |at_us, frame| inbox.push_back((at_us, frame));
                match sent.from {
                    Node::Module(_) => down.reply_frame(at_us, sent.frame, arrive),
                    _ => down.frame(at_us, sent.frame, arrive),
                }
            }
        }
        if matches!(sent.from, Node::Module(_)) {
            return;
        }
        for place in 0..self.modules.len() {
            let bench = &mut benches[self.modules[place]];
            if bench.line_rates().is_none_or(|rates| rates.can != sent.bit_rate) {
                continue;
            }
            bench.run_until(at_us);
            bench.send_frame(&mut self.links[place], &sent.frame);
            self.collect(at_us, place, benches);
        }
    }
}

/// What counts in arbitration: the first eleven bits, then short before long, then the rest.
fn rank(frame: &Frame) -> u32 {
    let (base, rest) = if frame.extended { (frame.id >> 18, frame.id & 0x3_ffff) } else { (frame.id, 0) };
    base << 19 | u32::from(frame.extended) << 18 | rest
}

/// The bits of a frame up to its checksum, before stuffing.
struct Bits {
    bits: u128,
    len: u32,
}

impl Bits {
    fn push(&mut self, value: u32, len: u32) {
        self.bits = self.bits << len | u128::from(value);
        self.len += len;
    }

    fn iter(&self) -> impl Iterator<Item = u32> + '_ {
        (0..self.len).rev().map(|place| (self.bits >> place & 1) as u32)
    }

    fn crc(&self) -> u32 {
        self.iter().fold(0, |crc, bit| {
            let shifted = crc << 1 & 0x7fff;
            if crc >> 14 & 1 == bit { shifted } else { shifted ^ 0x4599 }
        })
    }

    /// After five equal bits the sender puts in one of the other kind.
    fn stuffed_len(&self) -> u32 {
        let (mut last, mut run, mut len) = (2, 0, 0);
        for bit in self.iter() {
            run = if bit == last { run + 1 } else { 1 };
            (last, len) = (bit, len + 1);
            if run == 5 {
                (last, run, len) = (1 - bit, 1, len + 1);
            }
        }
        len
    }
}

/// Bits of a frame on the bus: stuffed up to the checksum, then delimiters, acknowledge, end, and the pause after it.
fn frame_bits(frame: &Frame) -> u32 {
    let mut bits = Bits { bits: 0, len: 1 };
    if frame.extended {
        bits.push(frame.id >> 18, 11);
        bits.push(0b11, 2);
        bits.push(frame.id & 0x3_ffff, 18);
        bits.push(0, 3);
    } else {
        bits.push(frame.id, 11);
        bits.push(0, 3);
    }
    bits.push(frame.data().len() as u32, 4);
    for byte in frame.data() {
        bits.push(u32::from(*byte), 8);
    }
    bits.push(bits.crc(), 15);
    bits.stuffed_len() + 1 + 2 + 7 + 3
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(id: u32, extended: bool, bytes: &[u8]) -> Frame {
        Frame::new(id, extended, bytes).unwrap()
    }

    #[test]
    fn frames_have_the_bits_of_the_standard() {
        // Without stuff bits 47 and 67 bits and eight for each byte; stuffing adds one for four at most.
        for len in 0..=8_u32 {
            for byte in [0, 0x55, 0xff] {
                for (extended, bare, stuffed) in [(false, 47, 34), (true, 67, 54)] {
                    let bits = frame_bits(&frame(0x2aa, extended, &vec![byte; len as usize]));
                    let (least, most) = (bare + 8 * len, bare + 8 * len + (stuffed + 8 * len - 1) / 4);
                    assert!((least..=most).contains(&bits), "{bits} of {least} to {most}");
                }
            }
        }
    }

    #[test]
    fn checksum_is_the_remainder_of_the_division() {
        // The remainder of the long division by x^15 + x^14 + x^10 + x^8 + x^7 + x^4 + x^3 + 1.
        let mut bits = Bits { bits: 0, len: 1 };
        for (value, len) in [(0x14, 11), (0, 3), (1, 4), (1, 8)] {
            bits.push(value, len);
        }
        let mut rest = bits.bits << 15;
        for place in (15..bits.len + 15).rev() {
            if rest >> place & 1 == 1 {
                rest ^= 0xc599 << (place - 15);
            }
        }
        assert_eq!(u128::from(bits.crc()), rest);
    }

    #[test]
    fn smaller_identifiers_and_short_ones_win() {
        let order = [(0, false), (0, true), (1, true), (1, false), (0x7ff, false), (0x1fff_ffff, true)];
        let ranks = order.map(|(id, extended)| rank(&frame(id, extended, &[])));
        assert!(ranks.is_sorted(), "{ranks:?}");
    }
}
