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

/// The vane of a home switch.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Home {
    /// Its middle, in microsteps.
    pub middle: i64,
    /// Its width in microsteps; 0 closes the switch in one position only.
    pub width: u64,
}

/// Where the switches and end stops are, in microsteps; `None`: there is no such thing.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Travel {
    /// The left switch is closed here and in all positions below.
    pub left: Option<i64>,
    /// The right switch is closed here and in all positions above.
    pub right: Option<i64>,
    /// The home switch is closed over the width of its vane.
    pub home: Option<Home>,
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

    /// True when the carriage closes the switch at `position`.
    pub fn closes(&self, switch: Switch, position: i64) -> bool {
        match switch {
            Switch::Left => self.left.is_some_and(|end| position <= end),
            Switch::Right => self.right.is_some_and(|end| position >= end),
            Switch::Home => self.home.is_some_and(|home| position.abs_diff(home.middle) <= home.width / 2),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn carriage_closes_switches_along_its_travel() {
        let travel = Travel {
            left: Some(-1000),
            right: Some(2000),
            home: Some(Home { middle: 500, width: 20 }),
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
    fn travel_without_switches_closes_nothing() {
        for position in [i64::MIN / 2, 0, i64::MAX / 2] {
            assert_eq!(Switch::ALL.map(|switch| Travel::default().closes(switch, position)), [false; 3]);
        }
    }
}
