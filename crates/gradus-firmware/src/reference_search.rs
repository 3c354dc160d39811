//! Reference search, modes 1 to 8 (TMCM-3351 manual §6.1, axis parameters 193 to 197).
//!
//! One state machine an axis, ticked with the ramp. A mode is a list of legs: direction, speed, and what ends the leg. A rough
//! leg looks for a switch; the exact legs after it leave the switch backwards, then either enter it again (modes 1 and 2) or
//! cross it to its far side (the others). Zero is the middle between the ends of the last two legs: the edge of the switch
//! where modes 1 and 2 leave and enter it, its centre in the others. The two ends are approached in opposite directions, so
//! that the delay of the switch cancels. At last the axis moves to zero as to any target.
//!
//! Where the manual is silent:
//! - Stop functions (axis parameters 12 and 13) rest during a search, but their polarity counts. A switch that they do not
//!   enable is active high, as is the home switch unless 128 is added.
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

use crate::ports::Switches;

/// Ticks for which contacts may bounce: 5 ms at 10 kHz. The motor stands that long between two legs, and after a change of a
/// switch the next one counts that much later.
const BOUNCE_TICKS: u8 = 50;

/// Longest leg in turns of the motor, and in microsteps.
const MOST_TURNS: i64 = 1_000;
const MOST_MICROSTEPS: i64 = 1 << 30;

/// A shaft is blocked when it makes less than this part of a turn in place of a whole one.
const BLOCKED_PART: u32 = 8;

/// Flags in the mode number.
const EXCHANGED: i32 = 64;
const INVERTED: i32 = 128;

/// Direction of travel; left is negative.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Way {
    Left,
    Right,
}

impl Way {
    fn opposite(self) -> Self {
        if self == Self::Left { Self::Right } else { Self::Left }
    }

    fn end_switch(self) -> Switch {
        if self == Self::Left { Switch::Left } else { Switch::Right }
    }
}

/// Which speed: axis parameter 194 or 195.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Pace {
    Rough,
    Exact,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Switch {
    Left,
    Right,
    Home,
}

impl Switch {
    fn mirrored(self) -> Self {
        match self {
            Self::Left => Self::Right,
            Self::Right => Self::Left,
            Self::Home => Self::Home,
        }
    }

    fn is_active(self, active: Switches) -> bool {
        match self {
            Self::Left => active.left,
            Self::Right => active.right,
            Self::Home => active.home,
        }
    }
}

/// What ends a leg.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum End {
    /// The switch is active, be it from the start.
    Active,
    /// The switch becomes active.
    Enters,
    /// The switch becomes inactive.
    Leaves,
}

/// One straight part of a search.
#[derive(Clone, Copy, Debug)]
struct Leg {
    way: Way,
    pace: Pace,
    end: End,
    switch: Switch,
}

impl Leg {
    const fn find(way: Way, switch: Switch) -> Self {
        Self { way, pace: Pace::Rough, end: End::Active, switch }
    }

    const fn enter(way: Way, switch: Switch) -> Self {
        Self { way, pace: Pace::Exact, end: End::Enters, switch }
    }

    const fn leave(way: Way, switch: Switch) -> Self {
        Self { way, pace: Pace::Exact, end: End::Leaves, switch }
    }

    fn mirrored(self) -> Self {
        Self { way: self.way.opposite(), switch: self.switch.mirrored(), ..self }
    }
}

/// One mode without its flags.
#[derive(Clone, Debug)]
struct Mode {
    legs: &'static [Leg],
    /// Left and right change places in `legs`.
    mirrored: bool,
    /// The rough leg turns round at an end switch.
    reverses: bool,
}

impl Mode {
    const fn new(legs: &'static [Leg], mirrored: bool, reverses: bool) -> Self {
        Self { legs, mirrored, reverses }
    }
}

const LEFT_EDGE: &[Leg] =
    &[Leg::find(Way::Left, Switch::Left), Leg::leave(Way::Right, Switch::Left), Leg::enter(Way::Left, Switch::Left)];
const RIGHT_THEN_LEFT_EDGE: &[Leg] = &[
    Leg::find(Way::Right, Switch::Right),
    Leg::leave(Way::Left, Switch::Right),
    LEFT_EDGE[0],
    LEFT_EDGE[1],
    LEFT_EDGE[2],
];
const LEFT_CENTRE: &[Leg] =
    &[Leg::find(Way::Left, Switch::Left), Leg::leave(Way::Right, Switch::Left), Leg::leave(Way::Left, Switch::Left)];
const RIGHT_THEN_LEFT_CENTRE: &[Leg] = &[
    Leg::find(Way::Right, Switch::Right),
    Leg::leave(Way::Left, Switch::Right),
    LEFT_CENTRE[0],
    LEFT_CENTRE[1],
    LEFT_CENTRE[2],
];
const HOME_CENTRE: &[Leg] =
    &[Leg::find(Way::Left, Switch::Home), Leg::leave(Way::Right, Switch::Home), Leg::leave(Way::Left, Switch::Home)];

/// Modes 1 to 8.
static MODES: [Mode; 8] = [
    Mode::new(LEFT_EDGE, false, false),
    Mode::new(RIGHT_THEN_LEFT_EDGE, false, false),
    Mode::new(RIGHT_THEN_LEFT_CENTRE, false, false),
    Mode::new(LEFT_CENTRE, false, false),
    Mode::new(HOME_CENTRE, false, true),
    Mode::new(HOME_CENTRE, true, true),
    Mode::new(HOME_CENTRE, true, false),
    Mode::new(HOME_CENTRE, false, false),
];

/// What the search sees in a tick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sight {
    /// Position in microsteps.
    pub(crate) position: i32,
    /// The same by the encoder, if there is one.
    pub(crate) encoder: Option<i32>,
    /// The motor stands.
    pub(crate) standing: bool,
    /// The end switches are true when active; `home` is the level.
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
    Fail,
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
    /// The motor stands, or will; the next leg begins after some ticks.
    Resting(u8),
    /// On a leg.
    Running(Run),
    /// Going to zero.
    Returning,
}

/// A leg under way.
#[derive(Clone, Copy, Debug)]
struct Run {
    leg: Leg,
    /// Position at its beginning.
    start: i32,
    /// Position and encoder at the beginning of its latest turn.
    turn_start: (i32, Option<i32>),
    /// The leg's switch is active.
    active: bool,
    /// Ticks until its next change counts.
    blind: u8,
}

impl Run {
    /// Whether the switch has changed.
    fn see(&mut self, active: bool) -> bool {
        if self.blind > 0 {
            self.blind -= 1;
            return false;
        }
        let changed = active != self.active;
        if changed {
            self.active = active;
            self.blind = BOUNCE_TICKS;
        }
        changed
    }

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
    mode: &'static Mode,
    mirrored: bool,
    /// Level of the home switch when it is active.
    home_level: bool,
    /// Microsteps in a turn of the motor, and in the longest leg.
    turn: u32,
    longest_leg: u32,
    /// It has turned round at an end switch.
    reversed: bool,
    leg: u8,
    state: State,
    /// Where the last three exact legs ended.
    ends: [i32; 3],
}

impl ReferenceSearch {
    /// A search of the mode of axis parameter 193, `None` if there is no such mode. `turn` is a turn of the motor in microsteps.
    pub(crate) fn new(mode: i32, turn: i64) -> Option<Self> {
        let number = mode & !(EXCHANGED | INVERTED);
        let row = MODES.get(usize::try_from(number.checked_sub(1)?).ok()?)?;
        Some(Self {
            mode: row,
            mirrored: row.mirrored != (mode & EXCHANGED != 0),
            home_level: mode & INVERTED == 0,
            turn: turn.clamp(0, MOST_MICROSTEPS) as u32,
            longest_leg: if turn == 0 { MOST_MICROSTEPS } else { (turn * MOST_TURNS).min(MOST_MICROSTEPS) } as u32,
            reversed: false,
            leg: 0,
            state: State::Resting(0),
            ends: [0; 3],
        })
    }

    /// How far the search is: the number of its leg, counted from 1.
    pub(crate) fn stage(&self) -> i32 {
        i32::from(self.leg) + 1
    }

    /// One control tick.
    pub(crate) fn tick(&mut self, mut sight: Sight) -> Step {
        sight.switches.home = sight.switches.home == self.home_level;
        match self.state {
            State::Resting(_) if !sight.standing => Step::Continue,
            State::Resting(ticks) if ticks < BOUNCE_TICKS => {
                self.state = State::Resting(ticks + 1);
                Step::Continue
            }
            State::Resting(_) => self.begin_leg(sight),
            State::Running(run) => self.go_on(run, sight),
            State::Returning if sight.standing => Step::Found(self.reference()),
            State::Returning => Step::Continue,
        }
    }

    fn begin_leg(&mut self, sight: Sight) -> Step {
        let Some(leg) = self.next_leg() else {
            self.state = State::Returning;
            return Step::Move(self.zero());
        };
        let run = Run {
            leg,
            start: sight.position,
            turn_start: (sight.position, sight.encoder),
            active: leg.switch.is_active(sight.switches),
            blind: 0,
        };
        self.watch(run, sight).unwrap_or(Step::Turn(leg.way, leg.pace))
    }

    fn go_on(&mut self, mut run: Run, sight: Sight) -> Step {
        let travel = sight.position.wrapping_sub(run.start).unsigned_abs();
        let lost = sight.standing || run.is_blocked(sight, self.turn) || travel > self.longest_leg;
        self.watch(run, sight).unwrap_or(if lost { Step::Fail } else { Step::Continue })
    }

    /// Looks at the switches: what they make the axis do, if anything.
    fn watch(&mut self, mut run: Run, sight: Sight) -> Option<Step> {
        let leg = run.leg;
        let changed = run.see(leg.switch.is_active(sight.switches));
        self.state = State::Running(run);
        let ended = match leg.end {
            End::Active => run.active,
            End::Enters => changed && run.active,
            End::Leaves => changed && !run.active,
        };
        if ended {
            return Some(self.end_leg(leg, sight.position));
        }
        let at_end = self.mode.reverses && leg.way.end_switch().is_active(sight.switches);
        at_end.then(|| self.reverse())
    }

    fn end_leg(&mut self, leg: Leg, position: i32) -> Step {
        self.leg += 1;
        self.state = State::Resting(0);
        if leg.pace == Pace::Exact {
            let [_, before, last] = self.ends;
            self.ends = [before, last, position];
        }
        if leg.pace == Pace::Rough && leg.switch != Switch::Home { Step::Stop } else { Step::Brake }
    }

    /// An end switch is ahead: the same in the other direction, once.
    fn reverse(&mut self) -> Step {
        if self.reversed || self.leg > 0 {
            return Step::Fail;
        }
        self.reversed = true;
        self.mirrored = !self.mirrored;
        self.state = State::Resting(0);
        Step::Stop
    }

    fn next_leg(&self) -> Option<Leg> {
        let leg = *self.mode.legs.get(usize::from(self.leg))?;
        Some(if self.mirrored { leg.mirrored() } else { leg })
    }

    fn zero(&self) -> i32 {
        let [_, one, other] = self.ends;
        one.wrapping_add(other.wrapping_sub(one) / 2)
    }

    fn reference(&self) -> Reference {
        let zero = self.zero();
        let both = self.mode.legs.len() > self.ends.len();
        Reference { zero, distance: both.then(|| self.ends[0].wrapping_sub(zero).wrapping_abs()) }
    }
}
