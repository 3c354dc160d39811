//! Heartbeats: the motors stop when a host falls silent (global parameters 68 and 82).

use gradus_tmcl::catalogue::Gp;

use crate::links::link::LinkKind;
use crate::program::program::NEVER;
use crate::storage::globals::Globals;

/// When a valid command came last on each kind of interface; `None` before the first one.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Heartbeats {
    serial_us: Option<u64>,
    can_us: Option<u64>,
}

impl Heartbeats {
    /// A valid command has come.
    pub(crate) fn beat(&mut self, kind: LinkKind, now: u64) {
        let last = if kind == LinkKind::Can { &mut self.can_us } else { &mut self.serial_us };
        *last = Some(now);
    }

    /// When the motors must stop if no command comes.
    pub(crate) fn due_at(&self, globals: &Globals) -> u64 {
        let serial = deadline(self.serial_us, globals.get(Gp::SerialHeartbeat));
        serial.min(deadline(self.can_us, globals.get(Gp::CanHeartbeat)))
    }

    /// True once when a deadline has passed; then silent until the next command.
    pub(crate) fn expired(&mut self, now: u64, globals: &Globals) -> bool {
        let mut expired = false;
        for (last, limit) in [(&mut self.serial_us, Gp::SerialHeartbeat), (&mut self.can_us, Gp::CanHeartbeat)] {
            if deadline(*last, globals.get(limit)) <= now {
                *last = None;
                expired = true;
            }
        }
        expired
    }
}

fn deadline(last: Option<u64>, limit_ms: i32) -> u64 {
    match (last, u64::try_from(limit_ms)) {
        (Some(last), Ok(limit)) if limit > 0 => last.saturating_add(limit * 1000),
        _ => NEVER,
    }
}
