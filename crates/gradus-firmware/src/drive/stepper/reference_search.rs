//! Reference search, modes 1 to 8 (TMCM-3351 manual §6.1, axis parameters 193 to 197).
//!
//! One state machine an axis, ticked with the ramp. A mode is a list of legs: direction, speed, and what ends the leg. A rough
//! leg looks for a switch; the exact legs after it leave the switch backwards, then either enter it again (modes 1 and 2) or
//! cross it to its far side (the others). Zero is the middle between the ends of the last two legs: the edge of the switch
//! where modes 1 and 2 leave and enter it, its centre in the others. The two ends are approached in opposite directions, so
//! that the delay of the switch cancels. At last the axis moves to zero as to any target.
//!
//! Where the manual is silent:
//! - An exact leg begins on a settled shaft: neither its switch nor the encoder (if it has counted since power-on) has changed for
//!   100 ms. A hard stop lets a motor ring over the edge, and an edge that the ringing makes is not one of the leg. A shaft that
//!   does not settle within 5 s makes the search fail.
//! - If it has settled outside of the switch within a full step of where the rough leg ended, it first goes slowly back in.
//! - Stop functions (axis parameters 12 and 13) rest during a search, but their polarity counts, whether they are enabled or not: a
//!   switch is active at the level that was set last, high if none was. The home switch is active high unless 128 is added.
//! - A rough leg that reaches an end switch stops as that stop switch would stop it (axis parameters 34 and 21); all other
//!   legs brake with the ramp.
//! - Modes 1 to 4 look at one end switch at a time; 7 and 8 at none. Modes 5 and 6 turn round once, at the end switch ahead
//!   in the rough leg; at an end switch ahead in any later leg the search fails.
//! - A search also fails when its motor does not move: a speed of 0, a stall (181) or deviation (212, 213) that stops it,
//!   ENABLE low, or a blocked shaft, whose encoder goes less than an eighth of a turn while the motor is to make a whole one
//!   (if the encoder has counted since power-on). And it fails when a leg gets longer than 1000 turns of the motor, or 2^30
//!   microsteps. A failure zeroes nothing and sets a flag of its own (4) in axis parameter 207.
//! - RFS STOP, every motion command and a new value of axis parameter 1 end a search without a flag.
//!
//! Not here: the ramp and the parameters, which are the axis's.

use crate::drive::stepper::search_failure::SearchFailure;
use crate::drive::stepper::search_modes::{Course, End, Leg, Pace, Switch, Way};
use crate::ports::Switches;

/// Ticks for which contacts may bounce: 5 ms at 10 kHz. The motor stands that long before a rough leg and the way to zero, and
/// an exact leg goes on that long after its edge.
const BOUNCE_TICKS: u16 = 50;

/// Ticks of rest in which a shaft has settled: 100 ms at 10 kHz, some twenty periods of a stepper motor's resonance.
const SETTLING_TICKS: u16 = 1_000;

/// Longest rest: 5 s at 10 kHz.
const MOST_RESTING_TICKS: u16 = 50_000;

/// A settled shaft goes less than this part of a turn by its encoder.
const SETTLED_PART: u32 = 1_024;

/// Full steps in a turn of a usual motor. A shaft that rings goes no further than one beyond where its field stands.
const FULL_STEPS: u32 = 200;

/// Longest leg in turns of the motor, and in microsteps.
const MOST_TURNS: i64 = 1_000;
const MOST_MICROSTEPS: i64 = 1 << 30;

/// A shaft is blocked when it makes less than this part of a turn in place of a whole one.
const BLOCKED_PART: u32 = 8;

/// What the search sees in a tick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sight {
    /// Position in microsteps.
    pub(crate) position: i32,
    /// The same by the encoder, if there is one.
    pub(crate) encoder: Option<i32>,
    /// The motor stands.
    pub(crate) standing: bool,
    /// True when active.
    pub(crate) switches: Switches,
}

/// What the axis is to do.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Step {
    /// As before.
    Continue,
    /// Turn.
    Turn(Way, Pace),
    /// Brake with the ramp.
    Brake,
    /// Stop as at a stop switch.
    Stop,
    /// Move to a position.
    Move(i32),
    /// The motor stands: zero is found.
    Found(Reference),
    /// Stop; there is nothing to be found.
    Fail(SearchFailure),
}

/// What a search has measured, in microsteps.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Reference {
    /// The zero point in the old coordinates.
    pub(crate) zero: i32,
    /// Between the end switches, if the mode looks for both.
    pub(crate) distance: Option<i32>,
}

#[derive(Clone, Copy, Debug)]
enum State {
    /// The motor stands, or will; the next leg begins when the shaft has settled.
    Resting(Rest),
    /// On a leg.
    Running(Run),
    /// Going to zero.
    Returning,
}

/// A rest between two legs.
#[derive(Clone, Copy, Default, Debug)]
struct Rest {
    /// Ticks that the motor has stood.
    ticks: u16,
    /// Ticks since the switch or the shaft moved last, and how they were then.
    quiet: u16,
    active: bool,
    encoder: Option<i32>,
}

impl Rest {
    /// A tick of a standing motor.
    fn look(&mut self, active: bool, encoder: Option<i32>, tolerance: u32) {
        self.ticks = self.ticks.saturating_add(1);
        let way = self.encoder.zip(encoder).map_or(0, |(from, to)| to.wrapping_sub(from).unsigned_abs());
        if active == self.active && way <= tolerance && encoder.is_some() == self.encoder.is_some() {
            self.quiet += 1;
        } else {
            *self = Self { ticks: self.ticks, quiet: 0, active, encoder };
        }
    }
}

/// A leg under way.
#[derive(Clone, Copy, Debug)]
struct Run {
    leg: Leg,
    /// Position at its beginning.
    start: i32,
    /// Position and encoder at the beginning of its latest turn.
    turn_start: (i32, Option<i32>),
    contact: Contact,
}

/// A switch during a leg. A change counts once the switch has kept to it for the time for which contacts may bounce; it has
/// happened where it was first seen.
#[derive(Clone, Copy, Debug)]
struct Contact {
    /// The switch is active, as it was read last, and as it is steadily.
    active: bool,
    steady: bool,
    /// Ticks since it was last read otherwise.
    kept: u16,
    /// Where it was first read otherwise than it is steadily.
    changed_at: Option<i32>,
}

impl Contact {
    fn new(active: bool) -> Self {
        Self { active, steady: active, kept: 0, changed_at: None }
    }

    /// Where the switch has changed for good, in the tick in which that is certain.
    fn see(&mut self, active: bool, position: i32) -> Option<i32> {
        if active != self.active {
            self.active = active;
            self.kept = 0;
            self.changed_at.get_or_insert(position);
            return None;
        }
        self.kept = self.kept.saturating_add(1);
        if self.kept < BOUNCE_TICKS {
            return None;
        }
        let at = self.changed_at.take();
        let changed = self.active != self.steady;
        self.steady = self.active;
        at.filter(|_| changed)
    }
}

impl Run {
    /// Whether the shaft has not followed the motor in a whole turn.
    fn is_blocked(&mut self, sight: Sight, turn: u32) -> bool {
        let (position, encoder) = self.turn_start;
        if sight.position.wrapping_sub(position).unsigned_abs() < turn {
            return false;
        }
        self.turn_start = (sight.position, sight.encoder);
        let way = encoder.zip(sight.encoder).map(|(from, to)| to.wrapping_sub(from).unsigned_abs());
        way.is_some_and(|way| way < turn / BLOCKED_PART)
    }
}

/// A search under way.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ReferenceSearch {
    course: Course,
    /// Microsteps in a turn of the motor, and in the longest leg.
    turn: u32,
    longest_leg: u32,
    /// It has turned round at an end switch.
    reversed: bool,
    leg: u8,
    /// Where the rough leg has ended, until the leg after it begins.
    hit: Option<i32>,
    state: State,
    /// Where the last three exact legs ended.
    ends: [i32; 3],
}

impl ReferenceSearch {
    /// A search of the mode of axis parameter 193, `None` if there is no such mode. `turn` is a turn of the motor in microsteps.
    pub(crate) fn new(mode: i32, turn: i64) -> Option<Self> {
        Some(Self {
            course: Course::of(mode)?,
            turn: turn.clamp(0, MOST_MICROSTEPS) as u32,
            longest_leg: if turn == 0 { MOST_MICROSTEPS } else { (turn * MOST_TURNS).min(MOST_MICROSTEPS) } as u32,
            reversed: false,
            leg: 0,
            hit: None,
            state: State::Resting(Rest::default()),
            ends: [0; 3],
        })
    }

    /// How far the search is: the number of its leg, counted from 1.
    pub(crate) fn stage(&self) -> i32 {
        i32::from(self.leg) + 1
    }

    /// One control tick.
    pub(crate) fn tick(&mut self, sight: Sight) -> Step {
        match self.state {
            State::Resting(_) if !sight.standing => Step::Continue,
            State::Resting(rest) => self.rest(rest, sight),
            State::Running(run) => self.go_on(run, sight),
            State::Returning if sight.standing => Step::Found(self.reference()),
            State::Returning => Step::Continue,
        }
    }

    /// Waits until contacts no longer bounce and, before an exact leg, the shaft no longer rings.
    fn rest(&mut self, mut rest: Rest, sight: Sight) -> Step {
        let leg = self.next_leg();
        let enough = if leg.is_some_and(|leg| leg.pace == Pace::Exact) { SETTLING_TICKS } else { BOUNCE_TICKS };
        if rest.quiet >= enough {
            return self.begin_leg(leg, sight);
        }
        if rest.ticks >= MOST_RESTING_TICKS {
            return Step::Fail(SearchFailure::Restless);
        }
        let active = leg.is_some_and(|leg| leg.switch.is_active(sight.switches));
        rest.look(active, sight.encoder, self.turn / SETTLED_PART);
        self.state = State::Resting(rest);
        Step::Continue
    }

    fn begin_leg(&mut self, leg: Option<Leg>, sight: Sight) -> Step {
        let Some(leg) = leg else {
            self.state = State::Returning;
            return Step::Move(self.zero());
        };
        let leg = self.entering(leg, sight);
        let run = Run {
            leg,
            start: sight.position,
            turn_start: (sight.position, sight.encoder),
            contact: Contact::new(leg.switch.is_active(sight.switches)),
        };
        self.watch(run, sight).unwrap_or(Step::Turn(leg.way, leg.pace))
    }

    /// The leg, or before it one that slowly goes a full step back into the switch: after a hard stop a shaft may come to rest
    /// just outside. If it has lost steps and slid through the switch, that changes nothing, and the leg crosses the switch.
    fn entering(&mut self, leg: Leg, sight: Sight) -> Leg {
        let hit = self.hit.take();
        let near = |hit: i32| sight.position.wrapping_sub(hit).unsigned_abs() <= self.turn / FULL_STEPS;
        if leg.switch.is_active(sight.switches) || !hit.is_some_and(near) {
            return leg;
        }
        self.leg -= 1;
        leg.entry()
    }

    fn go_on(&mut self, mut run: Run, sight: Sight) -> Step {
        let travel = sight.position.wrapping_sub(run.start).unsigned_abs();
        let blocked = run.is_blocked(sight, self.turn);
        if let Some(step) = self.watch(run, sight) {
            step
        } else if sight.standing {
            Step::Fail(SearchFailure::Still)
        } else if blocked {
            Step::Fail(SearchFailure::Blocked)
        } else if travel > self.longest_leg {
            Step::Fail(SearchFailure::NoSwitch)
        } else if run.leg.is_entry() && travel > self.turn / FULL_STEPS {
            self.end_leg(run.leg, sight.position)
        } else {
            Step::Continue
        }
    }

    /// Looks at the switches: what they make the axis do, if anything.
    fn watch(&mut self, mut run: Run, sight: Sight) -> Option<Step> {
        let leg = run.leg;
        let edge = run.contact.see(leg.switch.is_active(sight.switches), sight.position);
        self.state = State::Running(run);
        let end = match leg.end {
            End::Active => run.contact.active.then_some(sight.position),
            End::Enters => edge.filter(|_| run.contact.active),
            End::Leaves => edge.filter(|_| !run.contact.active),
        };
        if let Some(position) = end {
            return Some(self.end_leg(leg, position));
        }
        let at_end = self.course.reverses && leg.way.end_switch().is_active(sight.switches);
        at_end.then(|| self.reverse())
    }

    fn end_leg(&mut self, leg: Leg, position: i32) -> Step {
        self.leg += 1;
        self.state = State::Resting(Rest::default());
        if leg.end == End::Active {
            self.hit = (leg.pace == Pace::Rough).then_some(position);
        } else {
            let [_, before, last] = self.ends;
            self.ends = [before, last, position];
        }
        if leg.pace == Pace::Rough && leg.switch != Switch::Home { Step::Stop } else { Step::Brake }
    }

    /// An end switch is ahead: the same in the other direction, once.
    fn reverse(&mut self) -> Step {
        if self.reversed || self.leg > 0 {
            return Step::Fail(SearchFailure::BothEnds);
        }
        self.reversed = true;
        self.course.mirrored = !self.course.mirrored;
        self.state = State::Resting(Rest::default());
        Step::Stop
    }

    fn next_leg(&self) -> Option<Leg> {
        let leg = *self.course.legs.get(usize::from(self.leg))?;
        Some(if self.course.mirrored { leg.mirrored() } else { leg })
    }

    fn zero(&self) -> i32 {
        let [_, one, other] = self.ends;
        one.wrapping_add(other.wrapping_sub(one) / 2)
    }

    fn reference(&self) -> Reference {
        let zero = self.zero();
        let both = self.course.legs.len() > self.ends.len();
        Reference { zero, distance: both.then(|| self.ends[0].wrapping_sub(zero).wrapping_abs()) }
    }
}
