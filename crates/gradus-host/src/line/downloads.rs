//! Who stores a program in which module.
//!
//! A module in download mode stores what it is sent instead of executing it, and executes it when somebody has ended that
//! mode. So download mode belongs to the session that entered it. What others send meanwhile would end up in the program: it is
//! refused, but for control commands (128 and up), which the module executes, and MST, before which the download is ended. When another session ends the download, what the owner
//! still sends would be executed: it is refused until the owner begins anew (132) or ends it himself (133).
//! After a 133 that the module has not acknowledged the download is still one, of who sent it, until he or another sends 133 again.
//! So it is after a 132 that the module has not acknowledged, not having got it on a stopped line for example: who sends a program
//! without a look at the answers must not have it executed.

use gradus_tmcl::{Opcode, Status};

/// True for the commands that a module executes even while it stores all others (BEHAVIOUR 3).
pub(crate) fn is_control(opcode: Opcode) -> bool {
    opcode.0 >= Opcode::STOP_APPLICATION.0
}

/// The number of a session.
pub(crate) type Owner = u64;

/// The downloads of a line.
#[derive(Default)]
pub(crate) struct Downloads {
    under_way: Vec<Download>,
    /// Modules and the sessions whose download another one has ended.
    broken: Vec<(u8, Owner)>,
}

struct Download {
    module: u8,
    owner: Owner,
    /// The module has said that it stores.
    confirmed: bool,
}

impl Download {
    fn is(&self, module: u8, owner: Owner) -> bool {
        self.module == module && self.owner == owner
    }
}

impl Downloads {
    /// Why a session may not send a command to a module now; `None`: it may.
    pub fn refusal(&self, module: u8, who: Owner, opcode: Opcode) -> Option<&'static str> {
        let is_stored = !is_control(opcode) && opcode != Opcode::MST;
        if self.is_broken(module, who) && !is_control(opcode) {
            Some(
                "this download was refused, or ended by another program or a reset; begin it again (command 132) or end it (133)",
            )
        } else if self.is_others(module, who) && (opcode == Opcode::ENTER_DOWNLOAD || is_stored) {
            Some("another program is storing its program in this module; command 133 ends that")
        } else {
            None
        }
    }

    fn is_broken(&self, module: u8, who: Owner) -> bool {
        let unconfirmed = |download: &Download| download.is(module, who) && !download.confirmed;
        self.broken.contains(&(module, who)) || self.under_way.iter().any(unconfirmed)
    }

    /// True while another session stores a program in the module.
    pub fn is_others(&self, module: u8, who: Owner) -> bool {
        self.owner(module).is_some_and(|owner| owner != who)
    }

    /// True if the module stores what this session sends.
    pub fn is_own(&self, module: u8, who: Owner) -> bool {
        self.owner(module) == Some(who)
    }

    fn owner(&self, module: u8) -> Option<Owner> {
        self.under_way.iter().find(|download| download.module == module).map(|download| download.owner)
    }

    /// A command has gone out. It counts though its answer may get lost.
    pub fn sent(&mut self, module: u8, who: Owner, opcode: Opcode) {
        match opcode {
            Opcode::ENTER_DOWNLOAD => {
                self.broken.retain(|entry| *entry != (module, who));
                if !self.is_own(module, who) {
                    self.under_way.push(Download { module, owner: who, confirmed: false });
                }
            }
            Opcode::EXIT_DOWNLOAD => self.leave(module, who),
            Opcode::FACTORY_SETTINGS | Opcode::SOFTWARE_RESET => self.end(module, who),
            _ => {}
        }
    }

    /// A command got no answer, and may not even have gone out.
    pub fn failed(&mut self, module: u8, who: Owner, opcode: Opcode) {
        if opcode == Opcode::ENTER_DOWNLOAD && !self.is_own(module, who) {
            self.broken.push((module, who));
        }
    }

    /// A module has answered a command.
    pub fn answered(&mut self, module: u8, who: Owner, opcode: Opcode, status: Status) {
        if opcode == Opcode::ENTER_DOWNLOAD {
            let own = self.under_way.iter_mut().filter(|download| download.is(module, who));
            own.for_each(|download| download.confirmed |= status.is_ok());
            self.drop_unconfirmed(module, who);
        } else if opcode == Opcode::EXIT_DOWNLOAD && status.is_ok() {
            self.under_way.retain(|download| download.module != module);
        } else if !is_control(opcode) && status == Status::OK && self.is_own(module, who) {
            // It was executed: the module has been reset, or somebody else reaches it another way.
            self.under_way.retain(|download| !download.is(module, who));
            self.broken.push((module, who));
        }
    }

    fn drop_unconfirmed(&mut self, module: u8, who: Owner) {
        let mut refused = self.under_way.extract_if(.., |download| download.is(module, who) && !download.confirmed);
        self.broken.extend(refused.next().map(|_| (module, who)));
    }

    /// A module has been told to leave download mode. Until it has acknowledged that, it may be in it or not: nobody sends it anything that
    /// would be stored, or executed.
    fn leave(&mut self, module: u8, who: Owner) {
        let was_storing = self.owner(module).is_some();
        self.end(module, who);
        self.broken.retain(|entry| *entry != (module, who));
        if was_storing {
            self.under_way.push(Download { module, owner: who, confirmed: false });
        }
    }

    /// A module leaves download mode at the word of a session.
    fn end(&mut self, module: u8, who: Owner) {
        let ended = self.under_way.extract_if(.., |download| download.module == module);
        self.broken.extend(ended.filter(|download| download.owner != who).map(|download| (module, download.owner)));
    }

    /// Nobody knows what the modules do: the line was broken.
    pub fn end_all(&mut self) {
        self.broken.extend(self.under_way.drain(..).map(|download| (download.module, download.owner)));
    }

    /// A session has gone, or given up what came of its download. A module that still stores goes on storing until somebody ends
    /// that.
    pub fn forget(&mut self, who: Owner) {
        self.broken.retain(|(_, owner)| *owner != who);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MODULE: u8 = 1;
    const OWNER: Owner = 7;
    const OTHER: Owner = 8;

    fn under_way() -> Downloads {
        let mut downloads = Downloads::default();
        downloads.sent(MODULE, OWNER, Opcode::ENTER_DOWNLOAD);
        downloads.answered(MODULE, OWNER, Opcode::ENTER_DOWNLOAD, Status::OK);
        downloads
    }

    fn end(downloads: &mut Downloads, who: Owner) {
        downloads.sent(MODULE, who, Opcode::EXIT_DOWNLOAD);
        downloads.answered(MODULE, who, Opcode::EXIT_DOWNLOAD, Status::OK);
    }

    fn may(downloads: &Downloads, who: Owner, opcode: Opcode) -> bool {
        downloads.refusal(MODULE, who, opcode).is_none()
    }

    #[test]
    fn others_may_send_control_commands_and_stop_motors() {
        let downloads = under_way();
        for opcode in (0..=255).map(Opcode) {
            let control = opcode.0 >= 128 && opcode != Opcode::ENTER_DOWNLOAD;
            assert_eq!(may(&downloads, OTHER, opcode), control || opcode == Opcode::MST, "{opcode:?}");
            assert!(may(&downloads, OWNER, opcode), "{opcode:?}");
            assert!(downloads.refusal(2, OTHER, opcode).is_none(), "another module: {opcode:?}");
        }
    }

    #[test]
    fn an_owner_whose_download_another_one_has_ended_begins_anew_or_ends_it() {
        for way_out in [Opcode::ENTER_DOWNLOAD, Opcode::EXIT_DOWNLOAD] {
            let mut downloads = under_way();
            end(&mut downloads, OTHER);
            assert!(!may(&downloads, OWNER, Opcode::MVP) && !may(&downloads, OWNER, Opcode::GAP));
            assert!(may(&downloads, OWNER, way_out) && may(&downloads, OTHER, Opcode::MVP));
            downloads.sent(MODULE, OWNER, way_out);
            downloads.answered(MODULE, OWNER, way_out, Status::OK);
            assert!(may(&downloads, OWNER, Opcode::MVP));
        }
    }

    #[test]
    fn an_end_that_the_module_has_not_acknowledged_is_none() {
        for who in [OWNER, OTHER] {
            let mut downloads = under_way();
            downloads.sent(MODULE, who, Opcode::EXIT_DOWNLOAD);
            downloads.failed(MODULE, who, Opcode::EXIT_DOWNLOAD);
            for other in [OWNER, OTHER, 9] {
                assert!(!may(&downloads, other, Opcode::MVP), "{other}: it would be stored, or executed");
                assert!(may(&downloads, other, Opcode::EXIT_DOWNLOAD));
            }
            end(&mut downloads, 9);
            assert!(may(&downloads, 9, Opcode::MVP) && !may(&downloads, who, Opcode::MVP));
        }
        let mut downloads = Downloads::default();
        downloads.sent(MODULE, OWNER, Opcode::EXIT_DOWNLOAD);
        assert!(may(&downloads, OWNER, Opcode::MVP), "there was none to end");
    }

    #[test]
    fn a_reset_by_another_one_breaks_it_and_an_own_one_ends_it() {
        for opcode in [Opcode::SOFTWARE_RESET, Opcode::FACTORY_SETTINGS] {
            let mut downloads = under_way();
            downloads.sent(MODULE, OTHER, opcode);
            assert!(!may(&downloads, OWNER, Opcode::MVP));
            let mut downloads = under_way();
            downloads.sent(MODULE, OWNER, opcode);
            assert!(may(&downloads, OWNER, Opcode::MVP) && may(&downloads, OTHER, Opcode::MVP));
        }
    }

    #[test]
    fn a_download_that_the_module_refuses_is_none() {
        let mut downloads = Downloads::default();
        downloads.sent(MODULE, OWNER, Opcode::ENTER_DOWNLOAD);
        assert!(!may(&downloads, OTHER, Opcode::MVP), "until the answer nobody knows");
        downloads.answered(MODULE, OWNER, Opcode::ENTER_DOWNLOAD, Status::EEPROM_LOCKED);
        assert!(may(&downloads, OTHER, Opcode::MVP));
        assert!(!may(&downloads, OWNER, Opcode::MVP), "it would be executed");
    }

    #[test]
    fn what_follows_a_download_that_did_not_begin_is_refused() {
        let mut downloads = under_way();
        downloads.failed(MODULE, OTHER, Opcode::ENTER_DOWNLOAD);
        end(&mut downloads, OWNER);
        assert!(!may(&downloads, OTHER, Opcode::MVP));
        downloads.sent(MODULE, OTHER, Opcode::ENTER_DOWNLOAD);
        assert!(!may(&downloads, OTHER, Opcode::MVP), "until the module has acknowledged it");
        downloads.answered(MODULE, OTHER, Opcode::ENTER_DOWNLOAD, Status::OK);
        assert!(may(&downloads, OTHER, Opcode::MVP));
    }

    #[test]
    fn a_wrong_address_on_the_way_does_not_end_it() {
        let mut downloads = under_way();
        downloads.sent(MODULE, OWNER, Opcode::ENTER_DOWNLOAD);
        downloads.answered(MODULE, OWNER, Opcode::ENTER_DOWNLOAD, Status::INVALID_VALUE);
        assert!(!may(&downloads, OTHER, Opcode::MVP));
    }

    #[test]
    fn a_command_that_was_executed_instead_of_stored_is_the_last_one() {
        let mut downloads = under_way();
        downloads.answered(MODULE, OWNER, Opcode::SAP, Status::LOADED);
        assert!(may(&downloads, OWNER, Opcode::SAP));
        downloads.answered(MODULE, OWNER, Opcode::SAP, Status::OK);
        assert!(!may(&downloads, OWNER, Opcode::SAP));
    }

    #[test]
    fn a_broken_line_breaks_all_and_a_session_that_has_gone_leaves_a_module_that_stores() {
        let mut downloads = under_way();
        downloads.end_all();
        assert!(!may(&downloads, OWNER, Opcode::MVP) && may(&downloads, OTHER, Opcode::MVP));
        let mut downloads = under_way();
        downloads.forget(OWNER);
        assert!(!may(&downloads, OTHER, Opcode::MVP));
        end(&mut downloads, OTHER);
        assert!(may(&downloads, OTHER, Opcode::MVP));
    }
}
