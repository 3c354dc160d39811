//! A serial line: USB or RS-232 with one module, or an RS-485 segment with several.
//!
//! With timing every byte takes its ten bits, at the rate of who sends it: a host's own, or that which a module has chosen at its latest
//! start (global parameter 65). Who listens at another rate hears noise or nothing. A module begins its reply after its telegram pause (global parameter 75) and the
//! turn-around of the line. Two that talk at once collide: a driver of either pulls the line to 0, so what is received is the AND
//! of the bytes that overlap, and a byte that begins inside another one is not received as a byte of its own. Two modules with one
//! address that send the same bytes at the same time are therefore heard well, as on a real segment.
//!
//! All hosts of a segment send through one adapter, one after the other; a reply goes to the host that asked. They do not wait for
//! each other's replies: two that talk at once collide as two masters do. A module takes no reply of another module for a
//! command, even if the host address (global parameter 76) is its own address. The manuals are silent on both.

use std::collections::VecDeque;
use std::iter::from_fn;

use gradus_firmware::{Link, LinkKind};

use crate::Bench;
use crate::faults::{Dice, Faulty, Profile};
use crate::passed::{Content, Log};
use crate::rig::BusChange;
use crate::slots::put;
use crate::uart;

/// Time between two bytes of a babbling node on a line without timing.
const BABBLE_US: u64 = 1000;

/// With so many bytes waiting for the line a host had better wait.
const BUSY: usize = 4096;

/// How a serial line works.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Serial {
    /// Whether addresses count, and the telegram pause.
    pub kind: LinkKind,
    /// Bits a second of hosts that are set to no other rate; 0: nothing takes time, and nobody has a rate.
    pub baud: u32,
    /// A host on a pseudo-terminal has the rate that it sets there.
    pub strict: bool,
    /// A line for each direction, on which host and module do not collide.
    pub full_duplex: bool,
    /// Least time between the end of a command and the beginning of its reply, in microseconds; `None`: that of a byte. None
    /// without timing.
    pub turn_around_us: Option<u32>,
    /// A longer pause inside a datagram throws its beginning away; microseconds, 0: never.
    pub gap_us: u32,
    /// Hosts receive their own bytes, as on a two-wire adapter that does not switch its receiver off.
    pub echo: bool,
}

impl Serial {
    /// A point-to-point line without timing.
    pub const USB: Self = Self {
        kind: LinkKind::Usb,
        baud: 0,
        strict: false,
        full_duplex: true,
        turn_around_us: None,
        gap_us: 0,
        echo: false,
    };

    /// An RS-485 segment whose hosts send so many bits a second, 1 or more; the turn-around is the time of one byte.
    pub const fn rs485(baud: u32) -> Self {
        Self { kind: LinkKind::Rs485, baud, full_duplex: false, ..Self::USB }
    }

    /// An RS-232 line whose hosts send so many bits a second, 1 or more. The driver is always on: there is no turn-around.
    pub const fn rs232(baud: u32) -> Self {
        Self { full_duplex: true, turn_around_us: Some(0), ..Self::rs485(baud) }
    }

    /// The same line on which nothing takes time.
    pub const fn without_timing(self) -> Self {
        Self { baud: 0, ..self }
    }

    fn has_timing(&self) -> bool {
        self.baud > 0
    }
}

/// Length of a byte with start and stop bit.
const fn byte_ns(baud: u32) -> u64 {
    if baud == 0 { 0 } else { 10_000_000_000 / baud as u64 }
}

#[derive(Debug)]
pub(crate) struct Segment {
    serial: Serial,
    modules: Vec<usize>,
    /// When each module has finished its latest telegram.
    module_free_ns: Vec<u64>,
    hosts: Vec<Option<Host>>,
    /// What hosts have sent and the line has not carried yet: when, which host, the byte.
    queue: VecDeque<(u64, usize, u8)>,
    host_free_ns: u64,
    /// What is on the line, and what was there just before.
    talks: Vec<Talk>,
    babbler: Option<(Dice, u64)>,
    cut: bool,
    pub(crate) log: Log,
}

#[derive(Debug)]
struct Host {
    /// One for each module.
    links: Vec<Link>,
    /// Bits a second that it sends and listens for.
    baud: u32,
    /// Bytes with the time at which they arrive.
    inbox: VecDeque<(u64, u8)>,
    up: Faulty,
    down: Faulty,
}

/// Bytes on the line, one right after the other.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Talk {
    start_ns: u64,
    end_ns: u64,
    from: Talker,
    /// Bits a second.
    baud: u32,
    bytes: [u8; 9],
    len: usize,
    heard: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
enum Talker {
    Host(usize),
    Module { place: usize, host: usize },
    Babbler,
}

/// When the first of what is on its way arrives after `now_us`.
pub(crate) fn first_after<T>(inbox: &VecDeque<(u64, T)>, now_us: u64) -> Option<u64> {
    inbox.get(inbox.partition_point(|(at_us, _)| *at_us <= now_us)).map(|(at_us, _)| *at_us)
}

impl Talk {
    /// A byte of a host that is on its way.
    fn is_coming(&self) -> bool {
        matches!(self.from, Talker::Host(_)) && !self.heard
    }

    fn begin_ns(&self, index: usize) -> u64 {
        self.start_ns + index as u64 * byte_ns(self.baud)
    }
}

// Building.
impl Segment {
    pub(crate) fn new(serial: Serial) -> Self {
        Self {
            serial,
            modules: Vec::new(),
            module_free_ns: Vec::new(),
            hosts: Vec::new(),
            queue: VecDeque::new(),
            host_free_ns: 0,
            talks: Vec::new(),
            babbler: None,
            cut: false,
            log: Log::default(),
        }
    }

    pub(crate) fn modules(&self) -> &[usize] {
        &self.modules
    }

    /// Whether a pause inside a datagram is nobody's business here, so that the server watches the wall clock.
    pub(crate) fn is_gapless(&self) -> bool {
        self.serial.gap_us == 0
    }

    pub(crate) fn connect(&mut self, module: usize, bench: &mut Bench) {
        self.modules.push(module);
        self.module_free_ns.push(0);
        for host in self.hosts.iter_mut().flatten() {
            host.links.push(bench.attach(self.serial.kind, self.serial.gap_us));
        }
    }

    pub(crate) fn attach(&mut self, profile: Profile, seed: u64, benches: &mut [Bench]) -> usize {
        let attach = |module: &usize| benches[*module].attach(self.serial.kind, self.serial.gap_us);
        let links = self.modules.iter().map(attach).collect();
        let [up, down] = Faulty::both_ways(profile, seed);
        put(&mut self.hosts, Host { links, baud: self.serial.baud, inbox: VecDeque::new(), up, down })
    }

    /// What the host has said, and what is said to it, is gone with it.
    pub(crate) fn detach(&mut self, host: usize) {
        self.hosts[host] = None;
        self.queue.retain(|(_, from, _)| *from != host);
        self.talks.retain(|talk| match talk.from {
            Talker::Host(gone) | Talker::Module { host: gone, .. } => gone != host,
            Talker::Babbler => true,
        });
        self.start_next();
    }

    /// Forgets the beginning of a datagram that the host has sent.
    pub(crate) fn resynchronise(&mut self, host: usize) {
        for link in self.hosts[host].iter_mut().flat_map(|host| &mut host.links) {
            link.forget_beginning();
        }
    }

    /// The host takes nothing but datagrams.
    pub(crate) fn refuse_bulk(&mut self, host: usize) {
        self.hosts[host].iter_mut().flat_map(|host| &mut host.links).for_each(Link::refuse_bulk);
    }

    pub(crate) fn change(&mut self, now_us: u64, change: BusChange) {
        match change {
            BusChange::Cut(cut) => self.cut = cut,
            BusChange::Babble(on) => self.babble(now_us, on),
            BusChange::Faults(profile, seed) => self.set_faults(profile, seed),
            BusChange::Rate(baud) => self.set_baud(baud),
        }
    }

    /// Sets all hosts to a rate, those to come too. A line without timing has none.
    fn set_baud(&mut self, baud: u32) {
        if self.serial.has_timing() {
            self.serial.baud = baud;
            self.hosts.iter_mut().flatten().for_each(|host| host.baud = baud);
        }
    }

    /// Sets a host to a rate.
    pub(crate) fn set_host_baud(&mut self, host: usize, baud: u32) {
        if let Some(host) = self.hosts[host].as_mut().filter(|_| self.serial.has_timing()) {
            host.baud = baud;
        }
    }

    pub(crate) fn is_strict(&self) -> bool {
        self.serial.strict && self.serial.has_timing()
    }

    fn set_faults(&mut self, profile: Profile, seed: u64) {
        for (seed, host) in (seed..).zip(self.hosts.iter_mut().flatten()) {
            [host.up, host.down] = Faulty::both_ways(profile, seed);
        }
    }

    /// Lets a node talk all the time, or no more.
    fn babble(&mut self, now_us: u64, on: bool) {
        self.babbler = on.then(|| (Dice::new(now_us), now_us * 1000));
        if on {
            self.babble_on();
        } else {
            self.talks.retain(|talk| talk.from != Talker::Babbler);
        }
    }
}

// From and to the hosts.
impl Segment {
    pub(crate) fn send(&mut self, now_us: u64, host: usize, bytes: &[u8], benches: &mut [Bench]) {
        let was_idle = self.queue.is_empty() && !self.talks.iter().any(Talk::is_coming);
        let queue = &mut self.queue;
        if let Some(sender) = &mut self.hosts[host] {
            sender.up.bytes(now_us, bytes, |at_us, byte| queue.push_back((at_us, host, byte)));
        }
        let is_due = self.queue.back().is_none_or(|(at_us, ..)| *at_us <= now_us);
        if !self.serial.has_timing() && was_idle && is_due {
            self.send_at_once(now_us, host, benches);
        } else {
            self.start_next();
        }
    }

    /// All that waits, which is one host's, on a line where nothing takes time.
    fn send_at_once(&mut self, now_us: u64, host: usize, benches: &mut [Bench]) {
        let mut bytes = [0; 64];
        while !self.queue.is_empty() {
            let len = self.queue.len().min(bytes.len());
            for (byte, (_, _, queued)) in bytes.iter_mut().zip(self.queue.drain(..len)) {
                *byte = queued;
            }
            self.hear(now_us, host, &bytes[..len], 0, benches);
        }
    }

    /// Takes what has arrived.
    pub(crate) fn take(&mut self, now_us: u64, host: usize, into: &mut Vec<u8>) {
        let Some(host) = &mut self.hosts[host] else { return };
        let arrived = host.inbox.iter().take_while(|(at_us, _)| *at_us <= now_us).count();
        into.extend(host.inbox.drain(..arrived).map(|(_, byte)| byte));
    }

    pub(crate) fn is_busy(&self) -> bool {
        self.queue.len() >= BUSY
    }

    /// True when something has arrived that nobody has taken.
    pub(crate) fn has_mail(&self, now_us: u64) -> bool {
        self.hosts.iter().flatten().any(|host| host.inbox.front().is_some_and(|(at_us, _)| *at_us <= now_us))
    }

    /// When something happens next, after `now_us`; what waits to be taken is no event.
    pub(crate) fn next_event(&self, now_us: u64, benches: &[Bench]) -> Option<u64> {
        let talk = self.talks.iter().filter(|talk| !talk.heard).map(|talk| talk.end_ns.div_ceil(1000)).min();
        let held = (0..self.modules.len()).filter_map(|place| self.held(benches, place)).min();
        let inbox = self.hosts.iter().flatten().filter_map(|host| first_after(&host.inbox, now_us)).min();
        [talk, held, inbox].into_iter().flatten().min()
    }

    /// Does what is due at `now_us`.
    pub(crate) fn step(&mut self, now_us: u64, benches: &mut [Bench]) {
        while let Some(index) = self.next_heard(now_us) {
            self.talks[index].heard = true;
            self.finish(self.talks[index], benches);
        }
        let telegram_ns = 9 * self.talks.iter().map(|talk| byte_ns(talk.baud)).max().unwrap_or(0);
        self.talks.retain(|talk| !talk.heard || talk.end_ns + telegram_ns > now_us * 1000);
        for place in 0..self.modules.len() {
            if self.held(benches, place).is_some_and(|at_us| at_us <= now_us) {
                benches[self.modules[place]].run_until(now_us);
                self.collect(now_us, place, benches);
            }
        }
    }

    /// When the module of a place may send a reply that it holds back.
    fn held(&self, benches: &[Bench], place: usize) -> Option<u64> {
        let bench = &benches[self.modules[place]];
        self.hosts.iter().flatten().filter_map(|host| bench.ready_at(&host.links[place])).min()
    }

    /// What the module of a place has to say at `now_us`.
    pub(crate) fn collect(&mut self, now_us: u64, place: usize, benches: &mut [Bench]) {
        let bench = &mut benches[self.modules[place]];
        let baud = bench.line_rates().map_or(0, |rates| rates.baud);
        for index in 0..self.hosts.len() {
            while let Some(link) = self.hosts[index].as_mut().map(|host| &mut host.links[place])
                && let Some(telegram) = bench.take(link)
            {
                self.log.add(now_us, index, true, || Content::Bytes(telegram.to_vec()));
                self.reply(now_us, place, index, baud, &telegram);
            }
            let link = self.hosts[index].as_mut().map(|host| &mut host.links[place]);
            let loose = link.map(|link| from_fn(|| bench.take_byte(link)).collect::<Vec<u8>>()).unwrap_or_default();
            if !loose.is_empty() {
                loose.iter().for_each(|byte| self.reply(now_us, place, index, baud, &[*byte]));
                self.log.add(now_us, index, true, || Content::Loose(loose));
            }
        }
    }
}

// On the line.
impl Segment {
    fn reply(&mut self, now_us: u64, place: usize, host: usize, baud: u32, said: &[u8]) {
        if !self.serial.has_timing() {
            return self.arrive(now_us, host, said, 0);
        }
        let mut bytes = [0; 9];
        let len = said.len().min(bytes.len());
        bytes[..len].copy_from_slice(&said[..len]);
        let turn_around_us = self.serial.turn_around_us.map_or(byte_ns(baud).div_ceil(1000), u64::from);
        let start_ns = ((now_us + turn_around_us) * 1000).max(self.module_free_ns[place]);
        let end_ns = start_ns + len as u64 * byte_ns(baud);
        self.module_free_ns[place] = end_ns;
        let from = Talker::Module { place, host };
        self.talks.push(Talk { start_ns, end_ns, from, baud, bytes, len, heard: false });
    }

    /// The next byte of the hosts goes on the line, unless one is there.
    fn start_next(&mut self) {
        if self.talks.iter().any(Talk::is_coming) {
            return;
        }
        if let Some((at_us, host, byte)) = self.queue.pop_front() {
            let start_ns = (at_us * 1000).max(self.host_free_ns);
            let baud = self.hosts[host].as_ref().map_or(0, |host| host.baud);
            self.host_free_ns = start_ns + byte_ns(baud);
            self.say(start_ns, Talker::Host(host), baud, byte);
        }
    }

    fn babble_on(&mut self) {
        if let Some((dice, free_ns)) = &mut self.babbler {
            let (start_ns, byte) = (*free_ns, dice.roll() as u8);
            let baud = self.serial.baud;
            *free_ns += if baud == 0 { BABBLE_US * 1000 } else { byte_ns(baud) };
            self.say(start_ns, Talker::Babbler, baud, byte);
        }
    }

    fn say(&mut self, start_ns: u64, from: Talker, baud: u32, byte: u8) {
        let end_ns = start_ns + byte_ns(baud);
        self.talks.push(Talk { start_ns, end_ns, from, baud, bytes: [byte; 9], len: 1, heard: false });
    }

    fn next_heard(&self, now_us: u64) -> Option<usize> {
        let due = self.talks.iter().enumerate().filter(|(_, talk)| !talk.heard && talk.end_ns <= now_us * 1000);
        due.min_by_key(|(_, talk)| (talk.end_ns, talk.from)).map(|(index, _)| index)
    }

    /// The end of a talk: who listens has received it.
    fn finish(&mut self, talk: Talk, benches: &mut [Bench]) {
        let (at_us, mut received, mut len) = (talk.end_ns.div_ceil(1000), [0; 9], 0);
        for byte in (0..talk.len).filter_map(|index| self.received(&talk, index)) {
            received[len] = byte;
            len += 1;
        }
        let received = &received[..len];
        match talk.from {
            Talker::Module { host, .. } => self.arrive(at_us, host, received, talk.baud),
            Talker::Host(host) => {
                if self.serial.echo {
                    self.arrive(at_us, host, received, talk.baud);
                }
                self.hear(at_us, host, received, talk.baud, benches);
                self.start_next();
            }
            Talker::Babbler => {
                for host in 0..self.hosts.len() {
                    // Noise is noise at any rate.
                    self.arrive(at_us, host, received, 0);
                    self.hear(at_us, host, received, 0, benches);
                }
                self.babble_on();
            }
        }
    }

    /// What becomes of a byte of a talk: `None` if it begins inside a byte of somebody else.
    fn received(&self, talk: &Talk, index: usize) -> Option<u8> {
        let start_ns = talk.begin_ns(index);
        let mut byte = talk.bytes[index];
        for other in self.talks.iter().filter(|other| self.collide(talk.from, other.from)) {
            for place in 0..other.len {
                let other_ns = other.begin_ns(place);
                if other_ns + byte_ns(other.baud) <= start_ns || start_ns + byte_ns(talk.baud) <= other_ns {
                    continue;
                }
                if (other_ns, other.from) < (start_ns, talk.from) {
                    return None;
                }
                byte &= other.bytes[place];
            }
        }
        Some(byte)
    }

    /// Whether two are on the same wire.
    fn collide(&self, one: Talker, other: Talker) -> bool {
        let apart = self.serial.full_duplex && one != Talker::Babbler && other != Talker::Babbler;
        one != other && !apart
    }

    /// Modules receive bytes of a host, sent at `baud`. What finds no room, because replies are held back, is lost as in a UART.
    fn hear(&mut self, at_us: u64, host: usize, bytes: &[u8], baud: u32, benches: &mut [Bench]) {
        if self.cut {
            return;
        }
        self.log.add(at_us, host, false, || Content::Bytes(bytes.to_vec()));
        for place in 0..self.modules.len() {
            let own = benches[self.modules[place]].line_rates().map_or(0, |rates| rates.baud);
            let heard = uart::received(bytes, baud, own);
            let mut rest = &*heard;
            while !rest.is_empty() {
                let Some(link) = self.hosts[host].as_mut().map(|host| &mut host.links[place]) else { break };
                let bench = &mut benches[self.modules[place]];
                bench.run_until(at_us);
                let taken = bench.send(link, rest);
                rest = &rest[taken..];
                self.collect(at_us, place, benches);
                if taken == 0 {
                    break;
                }
            }
        }
    }

    /// A host receives bytes that are sent at `sent_baud`; 0: at its own rate.
    fn arrive(&mut self, at_us: u64, host: usize, bytes: &[u8], sent_baud: u32) {
        if let Some(Host { inbox, down, baud, .. }) = self.hosts[host].as_mut().filter(|_| !self.cut) {
            down.reply(at_us, &uart::received(bytes, sent_baud, *baud), |at_us, byte| inbox.push_back((at_us, byte)));
        }
    }
}
