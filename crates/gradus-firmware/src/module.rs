//! A module: links at one side, hardware at the other, time as an argument.

use gradus_tmcl::catalogue::{self, Ap, Gp};
use gradus_tmcl::{Instruction, Opcode, Reply, Request, Status, can};

use crate::capture::Capture;
use crate::commands::outputs::Outputs;
use crate::drive::axes::Axes;
use crate::drive::stepper::search_failure::SearchFailure;
use crate::drive::ticks::Ticks;
use crate::links::heartbeats::Heartbeats;
use crate::links::line_rates::LineRates;
use crate::links::link::{Addresses, Answer, Link, LinkKind, Telegram, can_answer, serial_answer};
use crate::links::position_events::PositionEvents;
use crate::ports::{InputCircuit, Io, Ports, Store, Switches};
use crate::program::cpu::Variables;
use crate::program::interrupts::Interrupts;
use crate::program::program::{NEVER, Program, State};
use crate::storage::globals::Globals;
use crate::storage::records::Eeprom;

/// Axes of the largest module.
pub(crate) const MAX_AXES: usize = 3;

/// What the module has seen of its surroundings.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Inputs {
    pub(crate) enabled: bool,
    pub(crate) levels: u8,
    pub(crate) switches: [Switches; MAX_AXES],
    /// The axes whose drivers have switched themselves off.
    pub(crate) shut_down: u8,
}

/// The firmware of one module on its hardware.
///
/// The caller hands in time as microseconds since power-on: [`poll`](Self::poll) first, then
/// [`receive`](Self::receive) and [`transmit`](Self::transmit). Nothing in here reads a clock, allocates or panics.
#[derive(Clone, Debug)]
pub struct Module<P: Ports, S> {
    pub(crate) catalogue: &'static catalogue::Module,
    pub(crate) ports: P,
    pub(crate) eeprom: Eeprom<S>,
    pub(crate) now: u64,
    pub(crate) ticks: Ticks,
    pub(crate) axes: P::Axes,
    pub(crate) globals: Globals,
    pub(crate) variables: Variables,
    pub(crate) program: Program,
    pub(crate) interrupts: Interrupts,
    pub(crate) events: PositionEvents,
    pub(crate) heartbeats: Heartbeats,
    pub(crate) capture: Capture,
    pub(crate) inputs: Inputs,
    pub(crate) outputs: Outputs,
    /// Those of the latest start.
    rates: LineRates,
    pub(crate) tick_timer_zero_ms: u64,
    pub(crate) random: u64,
    /// Serial lines carry text, see [`speaks_ascii`](Self::speaks_ascii).
    pub(crate) ascii: bool,
    /// Command 255 has been answered.
    pub(crate) restart_due: bool,
}

// Life.
impl<P: Ports, S: Store> Module<P, S> {
    /// Switches a module on: reads what the store holds, and starts the program if global parameter 77 says so.
    pub fn new(catalogue: &'static catalogue::Module, ports: P, store: S) -> Self {
        let mut module = Self {
            catalogue,
            ports,
            eeprom: Eeprom::new(catalogue, store),
            now: 0,
            ticks: Ticks::NONE,
            axes: P::Axes::new(catalogue),
            globals: Globals::factory(catalogue),
            variables: [0; 256],
            program: Program::new(catalogue.program_len),
            interrupts: Interrupts::default(),
            events: PositionEvents::default(),
            heartbeats: Heartbeats::default(),
            capture: Capture::new(),
            inputs: Inputs::default(),
            outputs: Outputs::default(),
            rates: LineRates::FACTORY,
            tick_timer_zero_ms: 0,
            random: 0,
            ascii: false,
            restart_due: false,
        };
        module.power_on();
        module
    }

    fn power_on(&mut self) {
        self.restore_globals();
        self.restore_program();
        self.check_magic();
        self.rates = LineRates::of(self.globals.get(Gp::SerialBaudRate), self.globals.get(Gp::CanBitRate));
        self.ascii = self.starts_in_ascii();
        self.restore_coordinates();
        self.ports.io().set_outputs(0);
        self.ports.io().set_circuit(InputCircuit::default());
        let enabled = self.is_enabled();
        self.inputs = Inputs { enabled, levels: self.ports.io().inputs(), ..Inputs::default() };
        for index in 0..self.axis_count() {
            self.axes.start(index, self.now, enabled, &mut self.ports);
            let switches = self.axes.switches(index, &mut self.ports);
            if let Some(seen) = self.inputs.switches.get_mut(index) {
                *seen = switches;
            }
        }
        self.restore_axis_parameters();
        self.wake_axes();
        if self.globals.get(Gp::AutoStart) != 0 {
            self.start_program(State::Run);
        }
    }

    /// Everything in RAM as after switching on; time goes on.
    fn restart(&mut self) {
        let catalogue = self.catalogue;
        self.ticks = Ticks::NONE;
        self.axes.restart();
        self.globals = Globals::factory(catalogue);
        self.variables = [0; 256];
        self.program.restart();
        self.interrupts = Interrupts::default();
        self.events = PositionEvents::default();
        self.heartbeats = Heartbeats::default();
        self.capture.reset();
        self.outputs = Outputs::default();
        self.tick_timer_zero_ms = self.now / 1000;
        self.random = 0;
        self.restart_due = false;
        self.power_on();
    }

    /// The reset to factory settings by the hardware, as with bridged pads at power-on (TMCM-3351 §5.1): what command 137 does, and
    /// then a start. The way back when no interface reaches the module any more.
    pub fn reset_to_factory(&mut self) {
        self.restore_factory_settings();
        self.restart();
    }

    /// The hardware and the store, when the module is switched off.
    pub fn into_parts(self) -> (P, S) {
        (self.ports, self.eeprom.store)
    }

    /// The hardware.
    pub fn ports(&mut self) -> &mut P {
        &mut self.ports
    }

    /// The hardware, to look at.
    pub fn ports_ref(&self) -> &P {
        &self.ports
    }

    /// The memory that survives a loss of power.
    pub fn store(&mut self) -> &mut S {
        &mut self.eeprom.store
    }

    /// What the module is.
    pub fn catalogue(&self) -> &'static catalogue::Module {
        self.catalogue
    }

    /// An axis parameter as GAP reads it (and clears it, if it is 207), for tools and tests; `None` if there is no such axis
    /// or the module has no such parameter.
    pub fn get_axis(&mut self, axis: usize, id: Ap) -> Option<i32> {
        self.row_of(id)?;
        self.get_id(u8::try_from(axis).ok()?, id).ok()
    }

    /// A reference search that has failed since the last call, for tools and tests: its axis and why.
    #[inline]
    pub fn take_search_failure(&mut self) -> Option<(usize, SearchFailure)> {
        self.axes.take_search_failure()
    }

    /// Returns the bits a second of the lines, as global parameters 65 and 69 were at the latest start.
    pub fn line_rates(&self) -> LineRates {
        self.rates
    }

    /// Levels of the digital outputs, bit 0 is output 0.
    pub fn outputs(&self) -> u8 {
        self.outputs.levels
    }
}

// Time.
impl<P: Ports, S: Store> Module<P, S> {
    /// Does everything that is due up to `now`, in order of time: control ticks, timers, the program. The work is bounded by
    /// the time that has passed since the last call. Inputs are looked at once, at the start, as they are since the last
    /// call: to change one at a certain time, poll up to that time, change it, poll on.
    pub fn poll(&mut self, now: u64) {
        let now = now.min(NEVER - 1);
        if self.restart_due {
            self.restart();
        }
        self.sample_inputs();
        self.check_wait();
        self.enter_handler();
        loop {
            let due = self.due_at();
            if due > now {
                break;
            }
            self.now = due.max(self.now);
            self.step(now);
        }
        self.now = now.max(self.now);
    }

    /// When [`poll`](Self::poll) has work next; `None` if only a datagram or a change of an input can wake the module.
    /// Replies that are held back are not counted, see [`Link::ready_at`].
    pub fn poll_at(&self) -> Option<u64> {
        if self.restart_due {
            return Some(self.now);
        }
        Some(self.due_at()).filter(|due| *due != NEVER)
    }

    fn due_at(&self) -> u64 {
        self.ticks.at_us.min(self.program.at_us).min(self.timers_at())
    }

    /// When something besides control ticks and the program is due.
    fn timers_at(&self) -> u64 {
        let wait = self.program.wait.map_or(NEVER, |wait| wait.deadline_us);
        wait.min(self.axes.due_at())
            .min(self.capture.due_at())
            .min(self.interrupts.due_at())
            .min(self.heartbeats.due_at(&self.globals))
    }

    /// What is due at the present time, in a fixed order; then the program up to whatever else is due next.
    fn step(&mut self, now: u64) {
        if self.ticks.at_us <= self.now {
            self.control_tick();
            self.check_wait();
            self.enter_handler();
        }
        let timers_at = self.timers_at();
        if timers_at <= self.now {
            self.run_timers();
        } else if self.program.at_us != NEVER {
            self.run_program(self.ticks.at_us.min(timers_at).min(now.saturating_add(1)));
            self.enter_handler();
        }
    }

    fn run_timers(&mut self) {
        for index in 0..self.axis_count() {
            self.axes.run_timer(index, self.now, &mut self.ports);
        }
        self.interrupts.run_timers(self.now, self.program.is_running());
        if self.heartbeats.expired(self.now, &self.globals) {
            self.stop_all();
        }
        self.run_capture();
        self.check_wait();
        self.enter_handler();
    }

    /// Schedules control ticks when an axis needs them: at multiples of the tick's length.
    pub(crate) fn wake_axes(&mut self) {
        if self.ticks.at_us == NEVER && (0..self.axis_count()).any(|index| self.axes.is_active(index)) {
            self.ticks = Ticks::start(self.now, self.axes.period());
        }
    }
}

// Links.
impl<P: Ports, S: Store> Module<P, S> {
    /// Takes bytes from a serial line, in any portions; gives back how many it has taken. It takes fewer while replies wait:
    /// call [`transmit`](Self::transmit) and [`transmit_byte`](Self::transmit_byte), then give it the rest.
    pub fn receive(&mut self, link: &mut Link, bytes: &[u8]) -> usize {
        for (taken, byte) in bytes.iter().enumerate() {
            let ascii = self.speaks_ascii();
            if link.is_full(ascii) {
                return taken;
            }
            if ascii {
                self.receive_character(link, *byte);
            } else if let Some(datagram) = link.framer.push(*byte, self.now) {
                self.receive_datagram(link, &datagram);
            }
        }
        bytes.len()
    }

    fn receive_datagram(&mut self, link: &mut Link, datagram: &[u8; 9]) {
        if link.kind == LinkKind::Rs485 && !self.is_addressed(datagram[0]) {
            return;
        }
        let addresses = Addresses { host: self.globals.get(Gp::HostAddress) as u8, module: self.own_address() };
        let at_us = self.now.saturating_add(self.pause_us(link.kind));
        let (answer, instruction) = match Request::parse(datagram) {
            Ok(request) => (self.obey(link, &request.instruction), request.instruction),
            Err(_) => (self.plain(Opcode::NOP, Status::WRONG_CHECKSUM, 0), Instruction::default()),
        };
        if let Some(reply) = serial_answer(answer, &instruction, addresses) {
            link.send(Telegram::Serial(reply), at_us);
            if let Some(block) = self.bulk(&instruction, answer) {
                link.say(block.bytes(), at_us);
            }
        }
    }

    /// Takes a CAN frame; one that is not for this module, or no command, is left alone. A link holds four replies:
    /// [`transmit_frame`](Self::transmit_frame) them before the next frames, what finds no room is lost.
    pub fn receive_frame(&mut self, link: &mut Link, frame: &can::Frame) {
        let secondary = self.globals.get(Gp::CanSecondaryId) as u32;
        let own = self.globals.get(Gp::CanId) as u32;
        let addressed = frame.id == own || (secondary != 0 && frame.id == secondary);
        let Some(instruction) = frame.instruction().filter(|_| addressed) else { return };
        let reply_id = self.globals.get(Gp::CanReplyId) as u32;
        if instruction.opcode == Opcode::POSITION_EVENT {
            link.event_request = Some(*frame);
        }
        let answer = self.obey(link, &instruction);
        if let Some(reply) = can_answer(answer, &instruction, frame, reply_id, own as u8) {
            link.send(Telegram::Can(reply), self.now);
        }
    }

    pub(crate) fn obey(&mut self, link: &Link, instruction: &Instruction) -> Answer {
        self.heartbeats.beat(link.kind, self.now);
        self.answer(link, instruction)
    }

    /// The next reply or event of a serial line that may go out now.
    pub fn transmit(&mut self, link: &mut Link) -> Option<[u8; 9]> {
        if let Some(telegram) = link.take(self.now) {
            return telegram.serial();
        }
        let event = self.event(link)?;
        Some(event.emit())
    }

    /// The next byte besides datagrams that may go out now: echo and replies of the ASCII interface, and samples of a bulk
    /// download, once the reply that announces them has gone.
    pub fn transmit_byte(&mut self, link: &mut Link) -> Option<u8> {
        link.take_byte(self.now)
    }

    /// The next reply or event of a CAN bus that may go out now.
    pub fn transmit_frame(&mut self, link: &mut Link) -> Option<can::Frame> {
        if let Some(telegram) = link.take(self.now) {
            return telegram.frame();
        }
        let event = self.event(link)?;
        Some(link.event_request?.answer(self.globals.get(Gp::CanReplyId) as u32, &event))
    }

    /// An event that is due for the link; it does not overtake a reply that is held back.
    fn event(&mut self, link: &Link) -> Option<Reply> {
        if link.ready_at().is_some() || (link.kind != LinkKind::Can && self.speaks_ascii()) {
            return None;
        }
        let mask = self.events.take(link.id)?;
        let module = if link.kind == LinkKind::Can { self.globals.get(Gp::CanId) as u8 } else { self.own_address() };
        Some(Reply {
            host: self.globals.get(Gp::HostAddress) as u8,
            module,
            status: Status::POSITION_REACHED,
            command: Opcode::POSITION_EVENT,
            value: i32::from(mask),
        })
    }

    /// How long a reply is held back.
    pub(crate) fn pause_us(&self, kind: LinkKind) -> u64 {
        match kind {
            LinkKind::Rs485 => u64::from(self.globals.get(Gp::TelegramPause).unsigned_abs()) * 1000,
            LinkKind::Usb | LinkKind::Can => 0,
        }
    }

    pub(crate) fn own_address(&self) -> u8 {
        self.globals.get(Gp::SerialAddress) as u8
    }

    pub(crate) fn is_addressed(&self, address: u8) -> bool {
        let secondary = self.globals.get(Gp::SerialSecondaryAddress) as u8;
        address == self.own_address() || (secondary != 0 && address == secondary)
    }
}
