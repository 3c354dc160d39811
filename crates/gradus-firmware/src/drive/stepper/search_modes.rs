//! The modes of a reference search: what their legs look for, and in which direction (TMCM-3351 manual §6.1).

use crate::ports::Switches;

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
    pub(crate) fn opposite(self) -> Self {
        if self == Self::Left { Self::Right } else { Self::Left }
    }

    pub(crate) fn end_switch(self) -> Switch {
        if self == Self::Left { Switch::Left } else { Switch::Right }
    }
}

/// Which speed: axis parameter 194 or 195.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Pace {
    Rough,
    Exact,
}

/// A switch that a leg looks at.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Switch {
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

    pub(crate) fn is_active(self, active: Switches) -> bool {
        match self {
            Self::Left => active.left,
            Self::Right => active.right,
            Self::Home => active.home,
        }
    }
}

/// What ends a leg.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum End {
    /// The switch is active, be it from the start.
    Active,
    /// The switch becomes active.
    Enters,
    /// The switch becomes inactive.
    Leaves,
}

/// One straight part of a search.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Leg {
    pub(crate) way: Way,
    pub(crate) pace: Pace,
    pub(crate) end: End,
    pub(crate) switch: Switch,
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

    /// Slowly back into the switch that this leg is to leave.
    pub(crate) fn entry(self) -> Self {
        Self { way: self.way.opposite(), end: End::Active, ..self }
    }

    pub(crate) fn is_entry(self) -> bool {
        self.pace == Pace::Exact && self.end == End::Active
    }

    /// The same with left and right exchanged.
    pub(crate) fn mirrored(self) -> Self {
        Self { way: self.way.opposite(), switch: self.switch.mirrored(), ..self }
    }
}

/// One mode without its flags.
#[derive(Debug)]
struct Mode {
    legs: &'static [Leg],
    mirrored: bool,
    reverses: bool,
}

/// The legs of a mode with its flags.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Course {
    pub(crate) legs: &'static [Leg],
    /// Left and right change places in `legs`.
    pub(crate) mirrored: bool,
    /// The rough leg turns round at an end switch.
    pub(crate) reverses: bool,
}

/// Level of the home switch when it is active, in the mode of axis parameter 193.
pub(crate) fn home_level(mode: i32) -> bool {
    mode & INVERTED == 0
}

impl Course {
    /// The course of a value of axis parameter 193, `None` if there is no such mode.
    pub(crate) fn of(mode: i32) -> Option<Self> {
        let number = mode & !(EXCHANGED | INVERTED);
        let row = MODES.get(usize::try_from(number.checked_sub(1)?).ok()?)?;
        Some(Self { legs: row.legs, mirrored: row.mirrored != (mode & EXCHANGED != 0), reverses: row.reverses })
    }
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
