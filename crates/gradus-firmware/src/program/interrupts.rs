//! Interrupts of a running program: vectors, priorities, timers and edges (TMCM-3351 manual §3.5.6).
//!
//! A lower number goes first, nothing nests. An event whose interrupt is disabled is lost; one that comes while a handler runs
//! waits, one deep.
//!
//! Where the manual is silent:
//! - A new period (bank 3) starts an enabled timer again, also one that had none.
//! - An event without a vector is lost.
//! - RETI restores accumulator, X register, comparison flags and program counter. The error flags stay as the handler leaves them: one that
//!   came meanwhile is not lost, one that CLE has cleared does not come back.

use gradus_tmcl::catalogue::{Interrupt, InterruptKind, Module};

use crate::program::cpu::Registers;
use crate::program::interpreter::Wait;
use crate::program::program::NEVER;

/// Interrupt numbers lie below this.
const COUNT: usize = 64;
const TIMERS: usize = 3;

/// What a handler interrupted.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Context {
    pub(crate) registers: Registers,
    pub(crate) wait: Option<Wait>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Timer {
    period_ms: u32,
    /// When it raises its interrupt next, while it is enabled.
    next_us: Option<u64>,
}

/// The interrupt controller of a module.
#[derive(Clone, Debug)]
pub(crate) struct Interrupts {
    global: bool,
    enabled: u64,
    pending: u64,
    vectors: [Option<u16>; COUNT],
    timers: [Timer; TIMERS],
    /// Trigger transitions of bank 3 by interrupt number: bit 0 rising, bit 1 falling.
    edges: [u8; COUNT],
    pub(crate) saved: Option<Context>,
}

impl Default for Interrupts {
    fn default() -> Self {
        Self {
            global: false,
            enabled: 0,
            pending: 0,
            vectors: [None; COUNT],
            timers: [Timer::default(); TIMERS],
            edges: [0; COUNT],
            saved: None,
        }
    }
}

/// Number of the interrupt of a kind and index, `None` if the module has none.
pub(crate) fn number(catalogue: &Module, kind: InterruptKind, index: usize) -> Option<u8> {
    catalogue.interrupts.iter().find(|row| row.kind == kind && usize::from(row.index) == index).map(|row| row.number)
}

fn bit(number: u8) -> u64 {
    1_u64.checked_shl(u32::from(number)).unwrap_or(0)
}

impl Interrupts {
    /// EI and DI.
    pub(crate) fn enable(&mut self, interrupt: &Interrupt, on: bool, now: u64) {
        if interrupt.kind == InterruptKind::Global {
            self.global = on;
            return;
        }
        if on {
            self.enabled |= bit(interrupt.number);
        } else {
            self.enabled &= !bit(interrupt.number);
            self.pending &= !bit(interrupt.number);
        }
        if interrupt.kind == InterruptKind::Timer
            && let Some(timer) = self.timers.get_mut(usize::from(interrupt.index))
        {
            timer.next_us = if on { timer.following(now) } else { None };
        }
    }

    /// VECT.
    pub(crate) fn set_vector(&mut self, number: u8, address: u16) {
        // EI 255 and DI 255 have no handler; the vector is kept nowhere.
        if let Some(vector) = self.vectors.get_mut(usize::from(number)) {
            *vector = Some(address);
        }
    }

    /// A period of bank 3 in ms; an enabled timer starts again.
    pub(crate) fn set_period(&mut self, number: u8, period_ms: u32, now: u64) {
        let enabled = self.enabled & bit(number) != 0;
        if let Some(timer) = self.timers.get_mut(usize::from(number)) {
            timer.period_ms = period_ms;
            timer.next_us = if enabled { timer.following(now) } else { None };
        }
    }

    pub(crate) fn period(&self, timer: u8) -> u32 {
        self.timers.get(usize::from(timer)).map_or(0, |timer| timer.period_ms)
    }

    /// A trigger transition of bank 3, which numbers them as the interrupts: 0 off, 1 rising, 2 falling, 3 both.
    pub(crate) fn set_edge(&mut self, number: u8, transition: u8) {
        if let Some(edge) = self.edges.get_mut(usize::from(number)) {
            *edge = transition;
        }
    }

    pub(crate) fn edge(&self, number: u8) -> u8 {
        self.edges.get(usize::from(number)).copied().unwrap_or(0)
    }

    /// An input has changed to `level`: raises its interrupt if that transition triggers it.
    pub(crate) fn raise_edge(&mut self, number: u8, level: bool) {
        if self.edge(number) & if level { 1 } else { 2 } != 0 {
            self.raise(number);
        }
    }

    /// An event has come. It is lost unless its interrupt is enabled and has a vector.
    pub(crate) fn raise(&mut self, number: u8) {
        let has_vector = self.vectors.get(usize::from(number)).is_some_and(Option::is_some);
        if self.global && has_vector {
            self.pending |= self.enabled & bit(number);
        }
    }

    /// Starts the next period of the timers that are due, and raises their interrupts if the program runs.
    pub(crate) fn run_timers(&mut self, now: u64, running: bool) {
        for number in 0..TIMERS {
            if let Some(due) = self.timers[number].next_us.filter(|due| *due <= now) {
                self.timers[number].next_us = self.timers[number].following(due);
                if running {
                    self.raise(number as u8);
                }
            }
        }
    }

    /// When the next timer is due.
    #[inline]
    pub(crate) fn due_at(&self) -> u64 {
        self.timers.iter().fold(NEVER, |earliest, timer| earliest.min(timer.next_us.unwrap_or(NEVER)))
    }

    /// The interrupts that wait for their handler, one bit each.
    pub(crate) fn pending(&self) -> u64 {
        self.pending
    }

    /// The enabled interrupts, one bit each, and whether they are at all.
    pub(crate) fn enabled(&self) -> (u64, bool) {
        (self.enabled, self.global)
    }

    /// The handler of an interrupt.
    pub(crate) fn vector(&self, number: u8) -> Option<u16> {
        self.vectors.get(usize::from(number)).copied().flatten()
    }

    /// The handler to enter now, if one is waiting and none runs.
    pub(crate) fn next(&mut self) -> Option<u16> {
        if self.pending == 0 || self.saved.is_some() || !self.global {
            return None;
        }
        let number = self.pending.trailing_zeros();
        self.pending &= !(1 << number);
        self.vectors.get(number as usize).copied().flatten()
    }
}

impl Timer {
    fn following(&self, from: u64) -> Option<u64> {
        (self.period_ms != 0).then(|| from.saturating_add(u64::from(self.period_ms) * 1000))
    }
}
