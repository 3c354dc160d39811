//! Whether a module restarted between two commands.

use gradus_tmcl::catalogue::Gp;
use gradus_tmcl::{Instruction, Opcode};

use crate::{Error, Session};

/// Tells a restart by the module's tick timer, which counts milliseconds since power-on: it has gone back.
///
/// Nothing else need tell: a module that is back in a tenth of a second has missed no request, and answers as ever. A restart
/// that is looked for later than the module had been on before is not seen.
pub struct RestartWatch {
    ticks: u32,
}

impl RestartWatch {
    /// Watches from now on.
    ///
    /// # Errors
    /// When the session fails.
    pub fn new(session: &mut Session) -> Result<Self, Error> {
        Ok(Self { ticks: ticks(session)? })
    }

    /// True if the module restarted since the last look.
    ///
    /// # Errors
    /// When the session fails.
    pub fn look(&mut self, session: &mut Session) -> Result<bool, Error> {
        let before = std::mem::replace(&mut self.ticks, ticks(session)?);
        // The timer passes its end every 50 days; that is a small step forwards.
        Ok(self.ticks.wrapping_sub(before) > u32::MAX / 2)
    }

    /// True for a command that sets the timer, so that it tells nothing any more.
    pub fn is_blinded_by(command: Instruction) -> bool {
        const TICK_TIMER: u8 = 132;
        const BANK: u8 = 0;
        matches!(command.opcode, Opcode::SGP | Opcode::AGP) && (command.kind, command.motor) == (TICK_TIMER, BANK)
    }
}

fn ticks(session: &mut Session) -> Result<u32, Error> {
    session.get_global(Gp::TickTimer, 0).map(|value| value as u32)
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use gradus_sim::Bench;
    use gradus_tmcl::catalogue::MODULES;

    use super::*;

    #[test]
    fn a_restart_is_seen_and_time_that_passes_is_none() {
        for module in MODULES {
            let mut session = Session::on_bench(Bench::with_defaults(module)).unwrap();
            session.sleep(Duration::from_secs(5));
            let mut watch = RestartWatch::new(&mut session).unwrap();
            session.sleep(Duration::from_secs(1));
            assert!(!watch.look(&mut session).unwrap(), "{}", module.name);
            session.bench().unwrap().reset();
            session.sleep(Duration::from_secs(1));
            assert!(watch.look(&mut session).unwrap(), "{}", module.name);
            assert!(!watch.look(&mut session).unwrap(), "{}", module.name);
        }
    }

    #[test]
    fn the_change_of_sign_is_no_restart() {
        let mut session = Session::on_bench(Bench::with_defaults(MODULES[0])).unwrap();
        session.set_global(Gp::TickTimer, 0, i32::MAX - 1000).unwrap();
        let mut watch = RestartWatch::new(&mut session).unwrap();
        session.sleep(Duration::from_secs(3));
        assert!(!watch.look(&mut session).unwrap());
    }

    #[test]
    fn the_catalogue_has_the_timer_where_it_is_looked_for() {
        for module in MODULES {
            assert_eq!(module.global_parameter(0, 132).map(|row| row.id), Some(Gp::TickTimer), "{}", module.name);
        }
    }
}
