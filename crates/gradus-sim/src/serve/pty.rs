//! Pseudo-terminals that survive their clients.

use std::fs;
use std::io;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::os::unix::ffi::OsStringExt;
use std::path::{Path, PathBuf};

use rustix::fs::{Mode, OFlags};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, QueueSelector, tcflush, tcgetattr, tcsetattr};

use super::endpoint::EndpointError;
use super::visitors::Visitors;

/// Bits a second until a client sets others: those of a module as it is delivered.
const FACTORY_BAUD: u32 = 9600;

/// A pseudo-terminal in raw mode, with a symbolic link to it if one was asked for.
///
/// The slave stays open here: clients come and go without the master noticing, and the raw mode lasts.
#[derive(Debug)]
pub(crate) struct Pty {
    master: OwnedFd,
    slave: OwnedFd,
    slave_path: PathBuf,
    link: Option<PathBuf>,
    visitors: Option<Visitors>,
}

impl Pty {
    pub(crate) fn open(link: Option<&Path>) -> Result<Self, EndpointError> {
        let mut pty = Self::open_pair().map_err(|source| EndpointError::Pty { source })?;
        if let Some(path) = link {
            make_link(&pty.slave_path, path)?;
            pty.link = Some(path.to_owned());
        }
        Ok(pty)
    }

    fn open_pair() -> io::Result<Self> {
        let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY)?;
        rustix::io::fcntl_setfd(&master, rustix::io::FdFlags::CLOEXEC)?;
        rustix::io::ioctl_fionbio(&master, true)?;
        grantpt(&master)?;
        unlockpt(&master)?;
        let slave_path = PathBuf::from(std::ffi::OsString::from_vec(ptsname(&master, Vec::new())?.into_bytes()));
        let slave = rustix::fs::open(&slave_path, OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC, Mode::empty())?;
        let mut settings = tcgetattr(&slave)?;
        settings.make_raw();
        settings.set_speed(FACTORY_BAUD)?;
        tcsetattr(&slave, OptionalActions::Now, &settings)?;
        let visitors = Visitors::watch(&slave_path).ok();
        Ok(Self { master, slave, slave_path, link: None, visitors })
    }

    /// Bits a second that a client has set.
    pub(crate) fn baud(&self) -> Option<u32> {
        tcgetattr(&self.slave).ok().map(|settings| settings.output_speed()).filter(|baud| *baud > 0)
    }

    /// The path that clients open.
    pub(crate) fn path(&self) -> &Path {
        self.link.as_deref().unwrap_or(&self.slave_path)
    }

    /// What becomes readable when a client comes or goes, where the system can tell.
    pub(crate) fn visitors(&self) -> Option<BorrowedFd<'_>> {
        self.visitors.as_ref().map(AsFd::as_fd)
    }

    /// True when the last client has gone or a first one has come. What the one before has not read is thrown away, so
    /// that it does not greet the next one.
    pub(crate) fn changes_hands(&mut self) -> bool {
        let changed = self.visitors.as_mut().is_some_and(Visitors::have_changed);
        if changed {
            let _ = tcflush(&self.slave, QueueSelector::IFlush);
        }
        changed
    }
}

impl AsFd for Pty {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.master.as_fd()
    }
}

impl Drop for Pty {
    /// Removes the link, unless it leads elsewhere by now.
    fn drop(&mut self) {
        if let Some(link) = &self.link
            && fs::read_link(link).is_ok_and(|target| target == self.slave_path)
        {
            let _ = fs::remove_file(link);
        }
    }
}

/// Links `path` to the terminal. A link that leads nowhere, or to this very terminal, is left from an earlier run and goes.
fn make_link(terminal: &Path, path: &Path) -> Result<(), EndpointError> {
    let fail = |source| EndpointError::Link { path: path.to_owned(), source };
    if let Ok(found) = fs::symlink_metadata(path) {
        let is_left_over =
            found.is_symlink() && (!path.exists() || fs::read_link(path).is_ok_and(|target| target == terminal));
        if !is_left_over {
            return Err(EndpointError::Occupied { path: path.to_owned() });
        }
        fs::remove_file(path).map_err(fail)?;
    }
    std::os::unix::fs::symlink(terminal, path).map_err(fail)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn link_in(folder: &tempfile::TempDir) -> PathBuf {
        folder.path().join("module")
    }

    #[test]
    fn link_leads_to_the_terminal_and_goes_with_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = link_in(&folder);
        let pty = Pty::open(Some(&path)).unwrap();
        assert_eq!(pty.path(), path);
        assert_eq!(fs::read_link(&path).unwrap(), pty.slave_path);
        drop(pty);
        assert!(fs::symlink_metadata(&path).is_err());
    }

    #[test]
    fn dead_link_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let path = link_in(&folder);
        std::os::unix::fs::symlink("/dev/pts/no-such-terminal", &path).unwrap();
        let pty = Pty::open(Some(&path)).unwrap();
        assert_eq!(fs::read_link(&path).unwrap(), pty.slave_path);
    }

    #[test]
    fn anything_else_is_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let (file, living) = (folder.path().join("file"), folder.path().join("living"));
        fs::write(&file, "precious").unwrap();
        std::os::unix::fs::symlink(&file, &living).unwrap();
        for path in [&file, &living, &folder.path().to_owned()] {
            let error = Pty::open(Some(path)).unwrap_err();
            assert!(matches!(error, EndpointError::Occupied { .. }), "{error}");
        }
        assert_eq!(fs::read_to_string(&living).unwrap(), "precious");
    }

    #[test]
    fn link_that_leads_elsewhere_by_now_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = link_in(&folder);
        let pty = Pty::open(Some(&path)).unwrap();
        fs::remove_file(&path).unwrap();
        std::os::unix::fs::symlink("/dev/null", &path).unwrap();
        drop(pty);
        assert_eq!(fs::read_link(&path).unwrap(), Path::new("/dev/null"));
    }
}
