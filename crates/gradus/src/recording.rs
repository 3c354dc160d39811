//! What the axes did while a program ran.

use std::time::Duration;

use gradus_host::{Error, Session};
use gradus_tmcl::catalogue::Ap;

/// Where an axis is and how fast.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Motion {
    /// AP 1.
    pub position: i32,
    /// AP 3.
    pub speed: i32,
}

/// All axes at one time.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Sample {
    /// Since the start of the program.
    pub time: Duration,
    /// One an axis.
    pub axes: Vec<Motion>,
}

impl Sample {
    /// Reads the axes.
    ///
    /// # Errors
    /// When the session fails.
    pub fn take(session: &mut Session, start: Duration) -> Result<Self, Error> {
        let time = session.now().saturating_sub(start);
        let mut axes = Vec::new();
        for axis in 0..session.module()?.axes {
            let position = session.get_axis(Ap::ActualPosition, axis)?;
            axes.push(Motion { position, speed: session.get_axis(Ap::ActualSpeed, axis)? });
        }
        Ok(Self { time, axes })
    }
}
