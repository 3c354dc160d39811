//! Several modules on several buses, in one virtual time.
//!
//! Modules meet only on their buses, so between two telegrams each runs for itself, as far as the next one; what rests is not
//! looked at. A module that moves is looked at once a millisecond for events that it wants to send.

use std::collections::VecDeque;

use gradus_tmcl::can::Frame;

use crate::can_bus::{Can, CanBus};
use crate::faults::Profile;
use crate::passed::{Log, Passed};
use crate::segment::{Segment, Serial};
use crate::wakes::Wakes;
use crate::{Bench, EepromError};

/// Time between two looks at a module that is busy, in microseconds.
const LOOK_US: u64 = 1000;

/// What kind of bus it is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum BusKind {
    /// USB or RS-485.
    Serial(Serial),
    /// CAN.
    Can(Can),
}

/// What can happen to a bus.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum BusChange {
    /// Its cable is broken, or whole again: nothing arrives meanwhile.
    Cut(bool),
    /// A node talks all the time, or no more.
    Babble(bool),
    /// The line has these faults from now on, with dice of this seed.
    Faults(Profile, u64),
    /// Its hosts send and listen at so many bits a second from now on, 1 or more; the modules stay as they are.
    Rate(u32),
}

/// A host on a bus.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct HostId {
    bus: usize,
    host: usize,
}

impl HostId {
    /// The bus that the host is on.
    pub fn bus(self) -> usize {
        self.bus
    }
}

/// Modules and buses, in one virtual time: microseconds since the rig was built.
///
/// Nothing happens unless time is moved with [`run_until`](Self::run_until). Two rigs that get the same calls are equal to the bit.
///
/// ```
/// use gradus_sim::{Bench, BusKind, Rig, Serial};
/// use gradus_tmcl::catalogue::{Gp, TMCM_3351};
///
/// let mut rig = Rig::default();
/// let segment = rig.add_bus("segment", BusKind::Serial(Serial::rs485(9600)));
/// for address in 1..=3 {
///     let mut bench = Bench::with_defaults(&TMCM_3351);
///     bench.set_global(Gp::SerialAddress, address);
///     let module = rig.add_module("module", bench);
///     rig.connect(module, segment);
/// }
/// let host = rig.attach(segment);
/// rig.send(host, &[3, 136, 1, 0, 0, 0, 0, 0, 140]);
/// rig.run_for(19_792); // nine bytes, turn-around, nine bytes of the reply
/// let mut reply = Vec::new();
/// rig.take(host, &mut reply);
/// assert_eq!(reply[..4], [2, 3, 100, 136]);
/// ```
#[derive(Debug, Default)]
pub struct Rig {
    now_us: u64,
    benches: Vec<Bench>,
    module_names: Vec<String>,
    /// The buses of each module, with its place there.
    places: Vec<Vec<(usize, usize)>>,
    wakes: Wakes,
    buses: Vec<Bus>,
    bus_wakes: Wakes,
    /// Changes of buses to come, in the order of time.
    schedule: VecDeque<(u64, usize, BusChange)>,
    /// Buses that hosts should look at: something has arrived, or there is room again.
    mail: Vec<usize>,
}

#[derive(Debug)]
struct Bus {
    name: String,
    wires: Wires,
    profile: Profile,
    seed: u64,
    /// Noted in [`Rig::mail`].
    has_mail: bool,
    was_busy: bool,
}

#[derive(Debug)]
enum Wires {
    Serial(Segment),
    Can(CanBus),
}

impl From<Bench> for Rig {
    /// The module alone on its USB port.
    fn from(bench: Bench) -> Self {
        let mut rig = Self { now_us: bench.now(), ..Self::default() };
        let bus = rig.add_bus("usb", BusKind::Serial(Serial::USB));
        let module = rig.add_module("module", bench);
        rig.connect(module, bus);
        rig
    }
}

// Building.
impl Rig {
    /// Adds a bus and gives back its number.
    pub fn add_bus(&mut self, name: &str, kind: BusKind) -> usize {
        let wires = match kind {
            BusKind::Serial(serial) => Wires::Serial(Segment::new(serial)),
            BusKind::Can(can) => Wires::Can(CanBus::new(can)),
        };
        let (name, profile) = (name.to_owned(), Profile::default());
        self.buses.push(Bus { name, wires, profile, seed: 0, has_mail: false, was_busy: false });
        self.bus_wakes.push();
        self.buses.len() - 1
    }

    /// Adds a module that hangs on no bus yet, and gives back its number.
    pub fn add_module(&mut self, name: &str, bench: Bench) -> usize {
        self.benches.push(bench);
        self.module_names.push(name.to_owned());
        self.places.push(Vec::new());
        self.wakes.push();
        let module = self.benches.len() - 1;
        self.wakes.set(module, self.benches[module].next_event());
        module
    }

    /// Hangs a module on a bus; it can hang on several. It has the rate that it has chosen at its latest start, see
    /// [`Bench::set_rate`].
    pub fn connect(&mut self, module: usize, bus: usize) {
        let wires = &mut self.buses[bus].wires;
        self.places[module].push((bus, wires.modules().len()));
        match wires {
            Wires::Serial(segment) => segment.connect(module, &mut self.benches[module]),
            Wires::Can(can) => can.connect(module, &mut self.benches[module]),
        }
    }

    /// Lets something happen to a bus at a time in microseconds.
    pub fn schedule(&mut self, at_us: u64, bus: usize, change: BusChange) {
        let at_us = at_us.max(self.now_us);
        let index = self.schedule.partition_point(|(other_us, ..)| *other_us <= at_us);
        self.schedule.insert(index, (at_us, bus, change));
    }

    /// Lets something happen to a bus now.
    pub fn change(&mut self, bus: usize, change: BusChange) {
        let (now_us, Bus { wires, profile, seed, .. }) = (self.now_us, &mut self.buses[bus]);
        if let BusChange::Faults(new_profile, new_seed) = change {
            (*profile, *seed) = (new_profile, new_seed);
        }
        match wires {
            Wires::Serial(segment) => segment.change(now_us, change),
            Wires::Can(can) => can.change(now_us, change),
        }
        self.touched(bus);
    }
}

// Names.
impl Rig {
    /// The names of all modules.
    pub fn module_names(&self) -> &[String] {
        &self.module_names
    }

    /// The names of all buses.
    pub fn bus_names(&self) -> impl Iterator<Item = &str> + Clone {
        self.buses.iter().map(|bus| bus.name.as_str())
    }

    /// Bits a second of a CAN bus; `None` for a serial line.
    pub fn can_bit_rate(&self, bus: usize) -> Option<u32> {
        match &self.buses[bus].wires {
            Wires::Serial(_) => None,
            Wires::Can(can) => Some(can.bit_rate()),
        }
    }

    /// Name of a bus.
    pub fn bus_name(&self, bus: usize) -> &str {
        &self.buses[bus].name
    }
}

// Modules.
impl Rig {
    /// Looks at a module and its machine, or changes them, at this moment.
    pub fn with_bench<T>(&mut self, module: usize, work: impl FnOnce(&mut Bench) -> T) -> T {
        let bench = &mut self.benches[module];
        bench.run_until(self.now_us);
        let result = work(bench);
        self.collect(module);
        result
    }

    /// The modules, as far as each has come.
    pub fn benches(&mut self) -> &mut [Bench] {
        &mut self.benches
    }
}

// Hosts.
impl Rig {
    /// Puts a new host on a bus. Each has dice of its own, in the order in which they come.
    pub fn attach(&mut self, bus: usize) -> HostId {
        let Bus { wires, profile, seed, .. } = &mut self.buses[bus];
        let host = match wires {
            Wires::Serial(segment) => segment.attach(*profile, *seed, &mut self.benches),
            Wires::Can(can) => can.attach(*profile, *seed),
        };
        *seed = seed.wrapping_add(1);
        HostId { bus, host }
    }

    /// Refuses a host bulk downloads: it takes nothing but datagrams.
    pub(crate) fn refuse_bulk(&mut self, host: HostId) {
        if let Wires::Serial(segment) = &mut self.buses[host.bus].wires {
            segment.refuse_bulk(host.host);
        }
    }

    /// Sets the rate of a host in bits a second, 1 or more. One that has not been set has that of its bus. A serial line without timing has
    /// no rate.
    pub fn set_host_rate(&mut self, host: HostId, rate: u32) {
        match &mut self.buses[host.bus].wires {
            Wires::Serial(segment) => segment.set_host_baud(host.host, rate),
            Wires::Can(can) => can.set_host_bit_rate(host.host, rate),
        }
    }

    /// Whether a host on a pseudo-terminal has the rate that it sets there.
    pub(crate) fn is_strict(&self, bus: usize) -> bool {
        matches!(&self.buses[bus].wires, Wires::Serial(segment) if segment.is_strict())
    }

    /// Takes a host away.
    pub fn detach(&mut self, host: HostId) {
        match &mut self.buses[host.bus].wires {
            Wires::Serial(segment) => segment.detach(host.host),
            Wires::Can(can) => can.detach(host.host),
        }
        self.touched(host.bus);
    }

    /// Sends bytes on a serial line, from now on; a CAN bus has no use for them.
    pub fn send(&mut self, host: HostId, bytes: &[u8]) {
        if let Wires::Serial(segment) = &mut self.buses[host.bus].wires {
            segment.send(self.now_us, host.host, bytes, &mut self.benches);
        }
        self.touched(host.bus);
    }

    /// Sends a frame on a CAN bus, when it is free; a serial line has no use for it.
    pub fn send_frame(&mut self, host: HostId, frame: Frame) {
        let (now_us, bus) = (self.now_us, &mut self.buses[host.bus]);
        if let Wires::Can(can) = &mut bus.wires {
            can.send(now_us, host.host, frame);
            can.step(now_us, &mut self.benches);
        }
        self.touched(host.bus);
    }

    /// Takes what has arrived over a serial line.
    pub fn take(&mut self, host: HostId, into: &mut Vec<u8>) {
        if let Wires::Serial(segment) = &mut self.buses[host.bus].wires {
            segment.take(self.now_us, host.host, into);
        }
    }

    /// The next frame that has arrived over a CAN bus.
    pub fn take_frame(&mut self, host: HostId) -> Option<Frame> {
        let Wires::Can(can) = &mut self.buses[host.bus].wires else { return None };
        can.take(self.now_us, host.host)
    }

    /// Keeps from now on what passes on the buses, for [`take_passed`](Self::take_passed).
    pub fn record(&mut self) {
        self.buses.iter_mut().for_each(|bus| bus.wires.log().begin());
    }

    /// What has passed since it was asked for last, in the order of time.
    pub fn take_passed(&mut self) -> Vec<Passed> {
        let buses = self.buses.iter_mut().enumerate();
        let mut passed: Vec<Passed> = buses
            .flat_map(|(index, bus)| {
                bus.wires.log().take().into_iter().map(move |passed| Passed { bus: index, ..passed })
            })
            .collect();
        passed.sort_by_key(|passed| passed.at_us);
        passed
    }

    /// A bus on which something has arrived for a host, each once.
    pub(crate) fn next_mail(&mut self) -> Option<usize> {
        let bus = self.mail.pop()?;
        self.buses[bus].has_mail = false;
        Some(bus)
    }

    /// Fails if an EEPROM file of a module on the bus did not take a byte.
    pub(crate) fn check_memories(&mut self, bus: usize) -> Result<(), EepromError> {
        let mut modules = self.buses[bus].wires.modules().iter();
        modules.try_for_each(|module| self.benches[*module].eeprom().check())
    }

    /// True while the bus has much to carry: better send no more.
    pub fn is_busy(&self, host: HostId) -> bool {
        self.buses[host.bus].wires.is_busy()
    }

    /// Forgets the beginning of a datagram of a host, unless the line itself watches for pauses.
    pub(crate) fn resynchronise(&mut self, host: HostId) {
        if let Wires::Serial(segment) = &mut self.buses[host.bus].wires
            && segment.is_gapless()
        {
            segment.resynchronise(host.host);
        }
    }
}

// Time.
impl Rig {
    /// Virtual time in microseconds.
    pub fn now(&self) -> u64 {
        self.now_us
    }

    /// When something happens next if nobody does anything; `None`: never.
    pub fn next_event(&self) -> Option<u64> {
        let change = self.schedule.front().map(|(at_us, ..)| *at_us);
        let first = |wakes: &Wakes| wakes.first().map(|(at_us, _)| at_us);
        [change, first(&self.wakes), first(&self.bus_wakes)].into_iter().flatten().min()
    }

    /// Moves time on to `end_us`; a time that has passed changes nothing.
    pub fn run_until(&mut self, end_us: u64) {
        let end_us = end_us.max(self.now_us);
        while let Some((at_us, bus, change)) = self.schedule.pop_front_if(|(at_us, ..)| *at_us <= end_us) {
            self.pass(at_us);
            self.change(bus, change);
        }
        self.pass(end_us);
    }

    /// Moves time on by so many microseconds.
    pub fn run_for(&mut self, us: u64) {
        self.run_until(self.now_us.saturating_add(us));
    }

    /// Buses come before modules: what a module does at a time it does with what has arrived by then.
    fn pass(&mut self, end_us: u64) {
        loop {
            let bus = self.bus_wakes.first().filter(|(at_us, _)| *at_us <= end_us);
            let module = self.wakes.first().filter(|(at_us, _)| *at_us <= end_us);
            match (bus, module) {
                (Some((bus_us, bus)), module) if module.is_none_or(|(module_us, _)| bus_us <= module_us) => {
                    self.now_us = bus_us.max(self.now_us);
                    self.step_bus(bus);
                }
                (_, Some((at_us, module))) => self.run_module(module, at_us, end_us),
                _ => break,
            }
        }
        self.now_us = end_us;
    }

    fn step_bus(&mut self, bus: usize) {
        match &mut self.buses[bus].wires {
            Wires::Serial(segment) => segment.step(self.now_us, &mut self.benches),
            Wires::Can(can) => can.step(self.now_us, &mut self.benches),
        }
        self.touched(bus);
    }

    /// As far as the next look, or the next that happens on one of its buses.
    fn run_module(&mut self, module: usize, at_us: u64, end_us: u64) {
        let look_us = (at_us / LOOK_US + 1) * LOOK_US;
        let buses = self.places[module].iter().map(|(bus, _)| self.bus_wakes.at(*bus));
        let until_us = buses.fold(look_us.min(end_us), u64::min).max(at_us);
        self.benches[module].run_until(until_us);
        self.collect(module);
    }

    /// What a module has to say goes on its buses.
    fn collect(&mut self, module: usize) {
        let now_us = self.benches[module].now();
        for index in 0..self.places[module].len() {
            let (bus, place) = self.places[module][index];
            match &mut self.buses[bus].wires {
                Wires::Serial(segment) => segment.collect(now_us, place, &mut self.benches),
                Wires::Can(can) => can.collect(now_us, place, &mut self.benches),
            }
            self.look_at(bus);
        }
        self.wakes.set(module, self.benches[module].next_event());
    }

    /// Something has happened on a bus.
    fn touched(&mut self, bus: usize) {
        for place in 0..self.buses[bus].wires.modules().len() {
            let module = self.buses[bus].wires.modules()[place];
            if self.places[module].len() > 1 {
                self.collect(module);
            } else {
                self.wakes.set(module, self.benches[module].next_event());
            }
        }
        self.look_at(bus);
    }

    /// When it goes on there, and whether hosts should look: something has arrived, or there is room again.
    fn look_at(&mut self, bus: usize) {
        let (now_us, Bus { wires, was_busy, has_mail, .. }) = (self.now_us, &mut self.buses[bus]);
        let (next, arrived) = match wires {
            Wires::Serial(segment) => (segment.next_event(now_us, &self.benches), segment.has_mail(now_us)),
            Wires::Can(can) => (can.next_event(now_us), can.has_mail(now_us)),
        };
        self.bus_wakes.set(bus, next);
        let has_room = std::mem::replace(was_busy, wires.is_busy()) && !*was_busy;
        if (arrived || has_room) && !*has_mail {
            *has_mail = true;
            self.mail.push(bus);
        }
    }
}

impl Wires {
    fn is_busy(&self) -> bool {
        match self {
            Self::Serial(segment) => segment.is_busy(),
            Self::Can(can) => can.is_busy(),
        }
    }

    fn log(&mut self) -> &mut Log {
        match self {
            Self::Serial(segment) => &mut segment.log,
            Self::Can(can) => &mut can.log,
        }
    }

    fn modules(&self) -> &[usize] {
        match self {
            Self::Serial(segment) => segment.modules(),
            Self::Can(can) => can.modules(),
        }
    }
}
