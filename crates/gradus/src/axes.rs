//! Which axes of a module move, and where to.

use std::fmt;

use gradus_host::{Error, Session};
use gradus_tmcl::catalogue::Ap;

/// Slower than this a servo stands, in rpm: it holds its place by small movements.
const SERVO_RESTS_RPM: i32 = 5;

/// An axis that moves.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Moving {
    /// Its number.
    pub axis: u8,
    /// Where it moves to; `None` if it turns without a target.
    pub target: Option<i32>,
    /// Its speed.
    pub speed: i32,
    unit: &'static str,
}

/// `motor 0 still moves to 51200`, or how fast it turns.
impl fmt::Display for Moving {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self.target {
            Some(target) => write!(f, "motor {} still moves to {target}", self.axis),
            None => write!(f, "motor {} still turns at {} {}", self.axis, self.speed, self.unit),
        }
    }
}

/// Looks at the axes until they rest.
#[derive(Default)]
pub struct Axes {
    /// Position and speed of each axis at the last look.
    before: Vec<(i32, i32)>,
    /// Those that move.
    pub moving: Vec<Moving>,
    /// True when none has changed its speed since the last look, nor is on its way to a target.
    pub is_steady: bool,
}

impl Axes {
    /// Looks again. An axis stands if its speed is 0 and it is at its target, or where it was at the last look.
    ///
    /// # Errors
    /// When the session fails.
    pub fn look(&mut self, session: &mut Session) -> Result<(), Error> {
        let module = session.module()?;
        let row = module.axis_parameters.iter().find(|row| row.id == Ap::ActualSpeed);
        let (unit, slow) = (row.map_or("", |row| row.unit.text()), if module.is_servo() { SERVO_RESTS_RPM } else { 0 });
        let mut now = Vec::new();
        self.moving.clear();
        for axis in 0..module.axes {
            let position = session.get_axis(Ap::ActualPosition, axis)?;
            let speed = session.get_axis(Ap::ActualSpeed, axis)?;
            let way = session.get_axis(Ap::TargetPosition, axis)?.wrapping_sub(position);
            let before = self.before.get(usize::from(axis));
            let rests = way == 0 || module.is_servo() || before.is_some_and(|(before, _)| *before == position);
            now.push((position, speed));
            if speed.saturating_abs() > slow || !rests {
                let target = (way.signum() == speed.signum() && way != 0).then(|| position.wrapping_add(way));
                self.moving.push(Moving { axis, target, speed, unit });
            }
        }
        let speeds = |looks: &[(i32, i32)]| looks.iter().map(|(_, speed)| *speed).collect::<Vec<_>>();
        let turns_on = self.moving.iter().all(|moving| moving.target.is_none());
        let same = module.is_servo() || speeds(&now) == speeds(&self.before);
        self.is_steady = self.moving.is_empty() || turns_on && same && !self.before.is_empty();
        self.before = now;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use gradus_sim::Bench;
    use gradus_tmcl::catalogue::TMCM_3351;

    use super::*;

    #[test]
    fn axes_move_to_targets_or_turn_or_rest() {
        let mut session = Session::on_bench(Bench::rigid(&TMCM_3351)).unwrap();
        let mut axes = Axes::default();
        let mut look = |session: &mut Session| {
            session.sleep(Duration::from_millis(10));
            axes.look(session).unwrap();
            (axes.is_steady, axes.moving.iter().map(ToString::to_string).collect::<Vec<_>>())
        };
        session.set_axis(Ap::TargetPosition, 0, 51_200).unwrap();
        session.set_axis(Ap::TargetSpeed, 2, -1000).unwrap();
        look(&mut session);
        session.sleep(Duration::from_millis(500));
        assert_eq!(look(&mut session).1, ["motor 0 still moves to 51200", "motor 2 still turns at -1000 pps"]);
        session.sleep(Duration::from_secs(5));
        look(&mut session);
        assert_eq!(look(&mut session), (true, vec!["motor 2 still turns at -1000 pps".into()]));
        session.stop_motors().unwrap();
        session.sleep(Duration::from_secs(1));
        look(&mut session);
        assert_eq!(look(&mut session), (true, vec![]));
    }
}
