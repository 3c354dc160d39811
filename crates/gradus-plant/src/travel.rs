//! Travel: where the switches and end stops of an axis stand.

/// A switch along the travel.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Switch {
    /// End of the travel in negative direction.
    Left,
    /// End of the travel in positive direction.
    Right,
    /// Somewhere between.
    Home,
}

impl Switch {
    /// All switches, in the order of their numbers.
    pub const ALL: [Self; 3] = [Self::Left, Self::Right, Self::Home];
}

/// The vane of a switch: the positions in which the carriage works it, in microsteps.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Vane {
    /// The lowest of them.
    pub from: i64,
    /// The highest of them.
    pub to: i64,
    /// The contact is a normally closed one: it opens here and is closed everywhere else.
    pub opens: bool,
}

impl Vane {
    /// From a place to another one, with a contact that closes.
    pub const fn between(from: i64, to: i64) -> Self {
        Self { from, to, opens: false }
    }

    /// Here and in all positions below.
    pub const fn below(to: i64) -> Self {
        Self::between(i64::MIN, to)
    }

    /// Here and in all positions above.
    pub const fn above(from: i64) -> Self {
        Self::between(from, i64::MAX)
    }

    /// True when the carriage closes the contact at `position`.
    pub fn closes(&self, position: i64) -> bool {
        (self.from..=self.to).contains(&position) != self.opens
    }
}

/// Where the switches and end stops are, in microsteps; `None`: there is no such thing.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Travel {
    /// Vane of the left switch.
    pub left: Option<Vane>,
    /// Vane of the right switch.
    pub right: Option<Vane>,
    /// Vane of the home switch.
    pub home: Option<Vane>,
    /// End stops: the carriage goes no further left, and no further right.
    pub ends: [Option<i64>; 2],
    /// How long the contact of each switch bounces, in microseconds, in steps of 100.
    pub bounce_us: [u32; Switch::ALL.len()],
}

impl Travel {
    /// True if a contact bounces.
    pub fn bounces(&self) -> bool {
        self.bounce_us != [0; Switch::ALL.len()]
    }

    /// The vane of a switch.
    pub fn vane(&self, switch: Switch) -> Option<Vane> {
        match switch {
            Switch::Left => self.left,
            Switch::Right => self.right,
            Switch::Home => self.home,
        }
    }

    /// True for each switch that the carriage closes at `position`, in the order of [`Switch::ALL`].
    #[inline]
    pub fn closed(&self, position: i64) -> [bool; Switch::ALL.len()] {
        [self.left, self.right, self.home].map(|vane| vane.is_some_and(|vane| vane.closes(position)))
    }

    /// True when the carriage closes the switch at `position`.
    pub fn closes(&self, switch: Switch, position: i64) -> bool {
        self.vane(switch).is_some_and(|vane| vane.closes(position))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn carriage_closes_switches_along_its_travel() {
        let travel = Travel {
            left: Some(Vane::below(-1000)),
            right: Some(Vane::above(2000)),
            home: Some(Vane::between(490, 510)),
            ..Travel::default()
        };
        let cases = [
            (-1001, [true, false, false]),
            (-1000, [true, false, false]),
            (-999, [false, false, false]),
            (489, [false, false, false]),
            (490, [false, false, true]),
            (510, [false, false, true]),
            (511, [false, false, false]),
            (1999, [false, false, false]),
            (2000, [false, true, false]),
        ];
        for (position, closed) in cases {
            assert_eq!(Switch::ALL.map(|switch| travel.closes(switch, position)), closed, "at {position}");
        }
    }

    #[test]
    fn normally_closed_contact_opens_where_the_vane_is() {
        let travel = Travel { home: Some(Vane { opens: true, ..Vane::between(490, 510) }), ..Travel::default() };
        assert_eq!([489, 490, 510, 511].map(|at| travel.closes(Switch::Home, at)), [true, false, false, true]);
    }

    #[test]
    fn travel_without_switches_closes_nothing() {
        for position in [i64::MIN / 2, 0, i64::MAX / 2] {
            assert_eq!(Switch::ALL.map(|switch| Travel::default().closes(switch, position)), [false; 3]);
        }
    }
}
