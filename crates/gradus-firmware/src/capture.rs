//! Capture: up to four values, sampled at a fixed rate into memory (command 142).
//!
//! The manuals do not name the command; the maker's tools know it as RAMDEBUG, and what is here is what PyTrinamic's
//! `RAMDebug` and `DataLogger` ask for. What is decided:
//! - Samples of all channels stand in one row: that of channel 0, that of channel 1, ..., the next of channel 0. Numbers of
//!   samples count them all; more of them before the trigger than there are at all is an invalid value. Those before the
//!   trigger are whole rows: the rest of a row is dropped at the start.
//! - A sample is taken at multiples of its period, after the control ticks and timers of that time, and reads as GAP and GGP
//!   do, also where reading clears a value. It shows whatever a host could have read then.
//! - The trigger is looked at in every sample, and needs one to compare with: the first sample never triggers. The sample in
//!   which it comes is the first one after it.
//! - While samples are taken only questions and INIT are accepted, else the command is not available; so is a start without a
//!   channel. A source that the module lacks is a wrong type, an axis that it lacks or a channel too many an invalid value.
//! - A bulk download answers how many samples follow the reply as raw bytes ([`Bulk`]): at most 64, at least one; from an index
//!   that cannot be read it is an invalid value. It works on USB-like lines; elsewhere the command is not available: on a segment
//!   another module could take samples for a command, a CAN bus carries commands only, a line in ASCII mode text, and the owner
//!   of a link may [refuse](Link::refuse_bulk) it.
//!   A suppressed reply suppresses the samples.
//!
//! Without a capture under way nothing here costs time.

use gradus_tmcl::catalogue::Ap;
use gradus_tmcl::{Bulk, CaptureAction, CaptureInfo, CaptureSource, CaptureState, CaptureTrigger, Instruction, Status};
use heapless::Vec;

use crate::drive::axes::Axes;
use crate::links::link::{Answer, Link};
use crate::module::Module;
use crate::ports::{Io, Ports, Store};
use crate::program::program::NEVER;

const CHANNELS: usize = 4;

/// Samples of all channels together; a power of two, so that their numbers may wrap.
const SAMPLES: usize = 8192;

/// Rate without a prescaler, in Hz.
const BASE_RATE: u32 = 2000;

const BASE_PERIOD_US: u64 = 1_000_000 / BASE_RATE as u64;

/// What is sampled.
#[derive(Clone, Copy, Debug)]
enum Source {
    Axis(usize, Ap),
    /// Number and bank.
    Global(u8, u8),
    Analog(u8),
    Time,
}

/// A channel: its source, and how the host has named it.
#[derive(Clone, Copy, Debug)]
struct Channel {
    source: Source,
    kind: CaptureSource,
    select: i32,
}

/// The values and the memory of a capture.
#[derive(Clone, Debug)]
pub(crate) struct Capture {
    channels: Vec<Channel, CHANNELS>,
    length: u32,
    pretrigger: u32,
    period_us: u64,
    trigger: Trigger,
    state: CaptureState,
    /// When the next sample is due.
    at_us: u64,
    /// Samples that have been written so far, wrapping.
    written: u32,
    /// The number of the first one that counts.
    first: u32,
    samples: [i32; SAMPLES],
}

impl Capture {
    pub(crate) fn new() -> Self {
        Self {
            channels: Vec::new(),
            length: SAMPLES as u32,
            pretrigger: 0,
            period_us: BASE_PERIOD_US,
            trigger: Trigger::default(),
            state: CaptureState::IDLE,
            at_us: NEVER,
            written: 0,
            first: 0,
            samples: [0; SAMPLES],
        }
    }

    /// Forgets everything; the samples stay in memory, unreadable.
    pub(crate) fn reset(&mut self) {
        self.channels.clear();
        self.length = SAMPLES as u32;
        self.pretrigger = 0;
        self.period_us = BASE_PERIOD_US;
        self.trigger = Trigger::default();
        self.state = CaptureState::IDLE;
        self.at_us = NEVER;
        (self.written, self.first) = (0, 0);
    }

    /// When a sample is due; never unless a capture is under way.
    #[inline]
    pub(crate) fn due_at(&self) -> u64 {
        self.at_us
    }

    fn is_running(&self) -> bool {
        self.at_us != NEVER
    }

    /// Samples that can be read: all that count, or before the trigger as many as will count.
    fn readable(&self) -> u32 {
        match self.state {
            CaptureState::PRETRIGGER | CaptureState::TRIGGER => self.written.min(self.pretrigger),
            _ => self.written.wrapping_sub(self.first),
        }
    }

    fn sample(&self, index: i32) -> Result<i32, Status> {
        let index = u32::try_from(index).map_err(|_| Status::INVALID_VALUE)?;
        let readable = self.readable();
        if index >= readable {
            return Err(Status::INVALID_VALUE);
        }
        let first = if self.is_triggered() { self.first } else { self.written.wrapping_sub(readable) };
        Ok(self.samples[first.wrapping_add(index) as usize % SAMPLES])
    }

    /// How many samples a block from an index on has.
    fn block_len(&self, index: i32) -> Result<i32, Status> {
        self.sample(index)?;
        let left = self.readable().saturating_sub(index as u32);
        Ok(left.min(Bulk::MAX_SAMPLES as u32) as i32)
    }

    fn is_triggered(&self) -> bool {
        self.state == CaptureState::CAPTURE || self.state == CaptureState::COMPLETE
    }

    fn start(&mut self, kind: u8, threshold: i32, now: u64) -> Result<(), Status> {
        if self.channels.is_empty() {
            return Err(Status::NOT_AVAILABLE);
        }
        let edge = Edge::new(CaptureTrigger(kind), threshold)?;
        if edge.is_some() && self.trigger.source.is_none() {
            return Err(Status::NOT_AVAILABLE);
        }
        self.trigger.edge = edge;
        self.trigger.last = None;
        self.pretrigger -= self.pretrigger.checked_rem(self.channels.len() as u32).unwrap_or(0);
        (self.written, self.first) = (0, 0);
        self.state = match edge {
            None => CaptureState::CAPTURE,
            Some(_) if self.pretrigger > 0 => CaptureState::PRETRIGGER,
            Some(_) => CaptureState::TRIGGER,
        };
        self.at_us = (now / self.period_us.max(1)).saturating_add(1).saturating_mul(self.period_us);
        Ok(())
    }

    /// What the trigger has to look at now.
    fn watched(&self) -> Option<Source> {
        self.trigger.source.filter(|_| !self.is_triggered())
    }

    /// Begins the samples of one moment: looks at the trigger.
    fn begin(&mut self, watched: Option<i32>) {
        self.at_us = self.at_us.saturating_add(self.period_us);
        let triggered = watched.is_some_and(|value| self.trigger.comes(value));
        if self.state == CaptureState::TRIGGER && triggered {
            self.state = CaptureState::CAPTURE;
            self.first = self.written.wrapping_sub(self.pretrigger);
        }
    }

    fn push(&mut self, value: i32) {
        if self.state == CaptureState::COMPLETE {
            return;
        }
        self.samples[self.written as usize % SAMPLES] = value;
        self.written = self.written.wrapping_add(1);
        if self.state == CaptureState::CAPTURE && self.written.wrapping_sub(self.first) >= self.length {
            self.state = CaptureState::COMPLETE;
            self.at_us = NEVER;
        }
    }

    /// Ends the samples of one moment.
    fn end(&mut self) {
        if self.state == CaptureState::PRETRIGGER && self.written >= self.pretrigger {
            self.state = CaptureState::TRIGGER;
        }
    }
}

/// What starts a capture.
#[derive(Clone, Copy, Debug)]
struct Trigger {
    source: Option<Source>,
    shift: u32,
    mask: u32,
    /// `None`: at once.
    edge: Option<Edge>,
    last: Option<i64>,
}

/// A crossing of a threshold.
#[derive(Clone, Copy, Debug)]
struct Edge {
    rising: bool,
    falling: bool,
    signed: bool,
    threshold: i64,
}

impl Default for Trigger {
    fn default() -> Self {
        Self { source: None, shift: 0, mask: u32::MAX, edge: None, last: None }
    }
}

impl Trigger {
    /// True if the value crosses the threshold.
    fn comes(&mut self, value: i32) -> bool {
        let Some(edge) = self.edge else { return false };
        let field = (value as u32 & self.mask) >> self.shift;
        let value = if edge.signed { i64::from(self.extend(field)) } else { i64::from(field) };
        let Some(last) = self.last.replace(value) else { return false };
        (edge.rising && last < edge.threshold && value >= edge.threshold)
            || (edge.falling && last > edge.threshold && value <= edge.threshold)
    }

    /// The sign of a field of the mask's width.
    fn extend(&self, field: u32) -> i32 {
        let unused = (self.mask >> self.shift).leading_zeros().min(31);
        (field << unused) as i32 >> unused
    }
}

impl Edge {
    fn new(trigger: CaptureTrigger, threshold: i32) -> Result<Option<Self>, Status> {
        let (rising, falling, signed) = match trigger {
            CaptureTrigger::UNCONDITIONAL => return Ok(None),
            CaptureTrigger::RISING_SIGNED => (true, false, true),
            CaptureTrigger::FALLING_SIGNED => (false, true, true),
            CaptureTrigger::BOTH_SIGNED => (true, true, true),
            CaptureTrigger::RISING_UNSIGNED => (true, false, false),
            CaptureTrigger::FALLING_UNSIGNED => (false, true, false),
            CaptureTrigger::BOTH_UNSIGNED => (true, true, false),
            _ => return Err(Status::WRONG_TYPE),
        };
        let threshold = if signed { i64::from(threshold) } else { i64::from(threshold as u32) };
        Ok(Some(Self { rising, falling, signed, threshold }))
    }
}

// Command 142.
impl<P: Ports, S: Store> Module<P, S> {
    /// # Errors
    /// As the module's documentation says.
    pub(crate) fn capture(&mut self, link: &Link, instruction: &Instruction) -> Result<i32, Status> {
        let Instruction { kind, motor, value, .. } = *instruction;
        match CaptureAction(kind) {
            CaptureAction::INIT => self.capture.reset(),
            CaptureAction::GET_STATE => return Ok(self.capture.state.0.into()),
            CaptureAction::GET_SAMPLE => return self.capture.sample(value),
            CaptureAction::BULK_DOWNLOAD if link.carries_bulk && !self.speaks_ascii() => {
                return self.capture.block_len(value);
            }
            CaptureAction::BULK_DOWNLOAD => return Err(Status::NOT_AVAILABLE),
            CaptureAction::GET_INFO => return self.capture_info(value),
            CaptureAction::GET_CHANNEL_TYPE => return Ok(self.channel(motor)?.kind.0.into()),
            CaptureAction::GET_CHANNEL_ADDRESS => return Ok(self.channel(motor)?.select),
            CaptureAction::GET_PRETRIGGER => return Ok(self.capture.pretrigger as i32),
            _ if self.capture.is_running() => return Err(Status::NOT_AVAILABLE),
            action => self.configure_capture(action, motor, value)?,
        }
        Ok(value)
    }

    /// The samples that follow the answer to a command.
    pub(crate) fn bulk(&self, instruction: &Instruction, answer: Answer) -> Option<Bulk> {
        match answer {
            Answer::Plain(Status::OK, count) if Bulk::is_asked_by(instruction) => {
                let indices = instruction.value..instruction.value.saturating_add(count);
                Some(Bulk::new(indices.map_while(|index| self.capture.sample(index).ok())))
            }
            _ => None,
        }
    }

    fn configure_capture(&mut self, action: CaptureAction, motor: u8, value: i32) -> Result<(), Status> {
        match action {
            CaptureAction::SET_LENGTH => {
                self.capture.length = samples(value, self.capture.pretrigger.max(1), SAMPLES as u32)?;
            }
            CaptureAction::SET_SAMPLING_SOURCE => {}
            CaptureAction::SET_PRESCALER => self.capture.period_us = BASE_PERIOD_US * (u64::from(value as u32) + 1),
            CaptureAction::SET_CHANNEL => self.add_channel(CaptureSource(motor), value)?,
            CaptureAction::SET_TRIGGER_CHANNEL => {
                self.capture.trigger.source = self.source(CaptureSource(motor), value)?;
            }
            CaptureAction::SET_SHIFT_MASK if motor < 32 => {
                (self.capture.trigger.shift, self.capture.trigger.mask) = (motor.into(), value as u32);
            }
            CaptureAction::SET_SHIFT_MASK => return Err(Status::INVALID_VALUE),
            CaptureAction::SET_PRETRIGGER => self.capture.pretrigger = samples(value, 0, self.capture.length)?,
            CaptureAction::ENABLE_TRIGGER => self.capture.start(motor, value, self.now)?,
            _ => return Err(Status::WRONG_TYPE),
        }
        Ok(())
    }

    fn capture_info(&self, entry: i32) -> Result<i32, Status> {
        match u8::try_from(entry).map(CaptureInfo) {
            Ok(CaptureInfo::CHANNELS) => Ok(CHANNELS as i32),
            Ok(CaptureInfo::SAMPLES) => Ok(SAMPLES as i32),
            Ok(CaptureInfo::BASE_RATE) => Ok(BASE_RATE as i32),
            Ok(CaptureInfo::CAPTURED) => Ok(self.capture.readable() as i32),
            _ => Err(Status::INVALID_VALUE),
        }
    }

    fn channel(&self, index: u8) -> Result<&Channel, Status> {
        self.capture.channels.get(usize::from(index)).ok_or(Status::INVALID_VALUE)
    }

    fn add_channel(&mut self, kind: CaptureSource, select: i32) -> Result<(), Status> {
        match self.source(kind, select)? {
            Some(source) => {
                let channel = Channel { source, kind, select };
                self.capture.channels.push(channel).map_err(|_| Status::INVALID_VALUE)
            }
            None => Ok(()),
        }
    }

    fn source(&self, kind: CaptureSource, select: i32) -> Result<Option<Source>, Status> {
        let [group, _, high, number] = select.to_be_bytes();
        let unknown = high & 0x0f != 0;
        Ok(Some(match kind {
            CaptureSource::DISABLED => return Ok(None),
            CaptureSource::AXIS_PARAMETER => {
                let index = self.axis_index(group)?;
                let row = self.catalogue.axis_parameter(number).filter(|_| !unknown).ok_or(Status::WRONG_TYPE)?;
                Source::Axis(index, row.id)
            }
            CaptureSource::GLOBAL_PARAMETER => {
                self.catalogue.global_parameter(group, number).ok_or(Status::WRONG_TYPE)?;
                Source::Global(number, group)
            }
            CaptureSource::ANALOG_INPUT => {
                self.catalogue.port(1, number).ok_or(Status::WRONG_TYPE)?;
                Source::Analog(number)
            }
            CaptureSource::TIME => Source::Time,
            _ => return Err(Status::WRONG_TYPE),
        }))
    }
}

// Time.
impl<P: Ports, S: Store> Module<P, S> {
    /// Takes the samples that are due.
    pub(crate) fn run_capture(&mut self) {
        if self.capture.at_us > self.now {
            return;
        }
        let watched = self.capture.watched().map(|source| self.read(source));
        self.capture.begin(watched);
        for index in 0..self.capture.channels.len() {
            if let Some(channel) = self.capture.channels.get(index).copied() {
                let value = self.read(channel.source);
                self.capture.push(value);
            }
        }
        self.capture.end();
    }

    fn read(&mut self, source: Source) -> i32 {
        match source {
            Source::Axis(index, id) => self.axes.get(index, id, self.now, &mut self.ports),
            Source::Global(number, bank) => self.get_global(number, bank).unwrap_or(0),
            Source::Analog(port) => self.ports.io().analog(port),
            Source::Time => (self.now / 1000) as i32,
        }
    }
}

/// A number of samples in a range.
fn samples(value: i32, min: u32, max: u32) -> Result<u32, Status> {
    u32::try_from(value).ok().filter(|count| (min..=max).contains(count)).ok_or(Status::INVALID_VALUE)
}
