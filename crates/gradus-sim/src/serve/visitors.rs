//! Notices when the clients of a terminal change. Only Linux can tell.

#[cfg(target_os = "linux")]
pub(crate) use linux::Visitors;
#[cfg(not(target_os = "linux"))]
pub(crate) use other::Visitors;

#[cfg(target_os = "linux")]
mod linux {
    use std::io;
    use std::mem::MaybeUninit;
    use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
    use std::path::Path;

    use rustix::fs::inotify::{CreateFlags, ReadFlags, Reader, WatchFlags, add_watch, init};

    /// Counts how often a file is open, from the start of the watch on.
    #[derive(Debug)]
    pub(crate) struct Visitors {
        inotify: OwnedFd,
        open: usize,
    }

    impl Visitors {
        pub(crate) fn watch(path: &Path) -> io::Result<Self> {
            let inotify = init(CreateFlags::CLOEXEC | CreateFlags::NONBLOCK)?;
            add_watch(&inotify, path, WatchFlags::OPEN | WatchFlags::CLOSE)?;
            Ok(Self { inotify, open: 0 })
        }

        /// True when the last client has gone, or a first one has come, since the last call.
        pub(crate) fn have_changed(&mut self) -> bool {
            let mut buffer = [MaybeUninit::uninit(); 1024];
            let mut events = Reader::new(&self.inotify, &mut buffer);
            let mut changed = false;
            while let Ok(event) = events.next() {
                let comes = event.events().contains(ReadFlags::OPEN);
                let others = if comes { self.open } else { self.open.saturating_sub(1) };
                self.open = others + usize::from(comes);
                changed |= others == 0;
            }
            changed
        }
    }

    impl AsFd for Visitors {
        fn as_fd(&self) -> BorrowedFd<'_> {
            self.inotify.as_fd()
        }
    }
}

#[cfg(not(target_os = "linux"))]
mod other {
    use std::convert::Infallible;
    use std::io;
    use std::os::fd::{AsFd, BorrowedFd};
    use std::path::Path;

    /// There is none.
    #[derive(Debug)]
    pub(crate) struct Visitors(Infallible);

    impl Visitors {
        pub(crate) fn watch(_: &Path) -> io::Result<Self> {
            Err(io::ErrorKind::Unsupported.into())
        }

        pub(crate) fn have_changed(&mut self) -> bool {
            match self.0 {}
        }
    }

    impl AsFd for Visitors {
        fn as_fd(&self) -> BorrowedFd<'_> {
            match self.0 {}
        }
    }
}
