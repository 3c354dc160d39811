//! Waits for many descriptors at once.

#[cfg(target_os = "linux")]
pub(crate) use linux::Waiter;
#[cfg(not(target_os = "linux"))]
pub(crate) use other::Waiter;

/// What a descriptor is waited for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Interest {
    pub(crate) read: bool,
    pub(crate) write: bool,
}

impl Interest {
    pub(crate) const READ: Self = Self { read: true, write: false };
}

/// The kernel keeps the list, so that a thousand silent hosts cost nothing.
#[cfg(target_os = "linux")]
mod linux {
    use std::io;
    use std::mem::MaybeUninit;
    use std::os::fd::{BorrowedFd, OwnedFd};
    use std::time::Duration;

    use rustix::event::{Timespec, epoll};
    use rustix::io::Errno;

    use super::Interest;

    /// So many that are ready are served in one turn; the others wait for the next.
    const AT_ONCE: usize = 512;

    #[derive(Debug)]
    pub(crate) struct Waiter(OwnedFd);

    impl Waiter {
        pub(crate) fn new() -> io::Result<Self> {
            Ok(Self(epoll::create(epoll::CreateFlags::CLOEXEC)?))
        }

        /// Fails for a file of the disk, which cannot be waited for.
        pub(crate) fn add(&mut self, fd: BorrowedFd, token: u64, interest: Interest) -> io::Result<()> {
            Ok(epoll::add(&self.0, fd, epoll::EventData::new_u64(token), flags(interest))?)
        }

        pub(crate) fn change(&mut self, fd: BorrowedFd, token: u64, interest: Interest) -> io::Result<()> {
            Ok(epoll::modify(&self.0, fd, epoll::EventData::new_u64(token), flags(interest))?)
        }

        pub(crate) fn remove(&mut self, fd: BorrowedFd) {
            // Fails only for one that has not been added.
            let _ = epoll::delete(&self.0, fd);
        }

        /// Waits until something is ready, or for so long, and puts the tokens of what is into `ready`.
        pub(crate) fn wait(&mut self, timeout: Option<Duration>, ready: &mut Vec<u64>) -> io::Result<()> {
            ready.clear();
            let mut events = [MaybeUninit::uninit(); AT_ONCE];
            let timeout = timeout.and_then(|timeout| Timespec::try_from(timeout).ok());
            match epoll::wait(&self.0, &mut events, timeout.as_ref()) {
                Ok((events, _)) => ready.extend(events.iter().map(|event| event.data.u64())),
                Err(Errno::INTR) => {}
                Err(error) => return Err(error.into()),
            }
            Ok(())
        }
    }

    fn flags(interest: Interest) -> epoll::EventFlags {
        let mut flags = epoll::EventFlags::empty();
        flags.set(epoll::EventFlags::IN, interest.read);
        flags.set(epoll::EventFlags::OUT, interest.write);
        flags
    }
}

/// With `poll`, on descriptors of its own.
#[cfg(not(target_os = "linux"))]
mod other {
    use std::io;
    use std::os::fd::{AsRawFd, BorrowedFd, OwnedFd, RawFd};
    use std::time::Duration;

    use rustix::event::{PollFd, PollFlags, Timespec, poll};
    use rustix::io::Errno;

    use super::Interest;

    #[derive(Debug)]
    pub(crate) struct Waiter {
        waiting: Vec<Waiting>,
    }

    #[derive(Debug)]
    struct Waiting {
        /// The descriptor that was added, to find it again.
        added: RawFd,
        fd: OwnedFd,
        token: u64,
        flags: PollFlags,
    }

    impl Waiter {
        pub(crate) fn new() -> io::Result<Self> {
            Ok(Self { waiting: Vec::new() })
        }

        pub(crate) fn add(&mut self, fd: BorrowedFd, token: u64, interest: Interest) -> io::Result<()> {
            let (added, fd) = (fd.as_raw_fd(), fd.try_clone_to_owned()?);
            self.waiting.push(Waiting { added, fd, token, flags: flags(interest) });
            Ok(())
        }

        pub(crate) fn change(&mut self, fd: BorrowedFd, token: u64, interest: Interest) -> io::Result<()> {
            let found =
                self.waiting.iter_mut().find(|waiting| waiting.added == fd.as_raw_fd() && waiting.token == token);
            if let Some(found) = found {
                found.flags = flags(interest);
            }
            Ok(())
        }

        pub(crate) fn remove(&mut self, fd: BorrowedFd) {
            self.waiting.retain(|waiting| waiting.added != fd.as_raw_fd());
        }

        pub(crate) fn wait(&mut self, timeout: Option<Duration>, ready: &mut Vec<u64>) -> io::Result<()> {
            ready.clear();
            let polled = |waiting: &'_ Waiting| PollFd::new(&waiting.fd, waiting.flags);
            let mut polled: Vec<PollFd> = self.waiting.iter().map(polled).collect();
            let timeout = timeout.and_then(|timeout| Timespec::try_from(timeout).ok());
            match poll(&mut polled, timeout.as_ref()) {
                Ok(_) => {}
                Err(Errno::INTR) => return Ok(()),
                Err(error) => return Err(error.into()),
            }
            let come = self.waiting.iter().zip(&polled).filter(|(_, polled)| !polled.revents().is_empty());
            ready.extend(come.map(|(waiting, _)| waiting.token));
            Ok(())
        }
    }

    fn flags(interest: Interest) -> PollFlags {
        let mut flags = PollFlags::empty();
        flags.set(PollFlags::IN, interest.read);
        flags.set(PollFlags::OUT, interest.write);
        flags
    }
}
