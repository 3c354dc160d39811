//! What ends a command before its time: Ctrl-C, SIGTERM, and a reader of the output that has gone.
//!
//! A command ends at once, with the status that a shell gives to an end by that signal (130 for Ctrl-C), unless it has asked
//! for an [`interruption`]: then the first signal sets a flag, and the second one ends it at once.

use std::io;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, LazyLock};

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

use crate::exit::{Exit, SIGNAL};

/// True when the next signal ends this program at once.
static AT_ONCE: LazyLock<Arc<AtomicBool>> = LazyLock::new(|| Arc::new(AtomicBool::new(true)));
/// True when somebody or something has asked for the end.
static ASKED: LazyLock<Arc<AtomicBool>> = LazyLock::new(Arc::default);
/// Number of the signal that came, 0 for none.
static SIGNAL_NUMBER: LazyLock<Arc<AtomicUsize>> = LazyLock::new(Arc::default);

/// Lets signals end this program, with the status of the signal. To be called once, at the start.
///
/// # Errors
/// When the system does not let itself be asked.
pub fn end_on_signals() -> io::Result<()> {
    for signal in [SIGINT, SIGTERM] {
        flag::register_conditional_shutdown(signal, i32::from(SIGNAL) + signal, Arc::clone(&AT_ONCE))?;
        flag::register_usize(signal, Arc::clone(&SIGNAL_NUMBER), signal as usize)?;
        flag::register(signal, Arc::clone(&ASKED))?;
        flag::register(signal, Arc::clone(&AT_ONCE))?;
    }
    Ok(())
}

/// A flag that the first signal sets; a second signal ends this program at once. For servers, whose output nobody need read.
pub fn end_of_service() -> Arc<AtomicBool> {
    AT_ONCE.store(false, Ordering::Relaxed);
    Arc::clone(&ASKED)
}

/// The same; the flag is set as well when nobody reads the output any more.
pub fn interruption() -> Arc<AtomicBool> {
    #[cfg(unix)]
    std::thread::spawn(|| {
        wait_until_nobody_reads();
        ASKED.store(true, Ordering::Relaxed);
    });
    end_of_service()
}

/// The end of a command whose [`interruption`] has come. What it did about it is the message.
pub fn interrupted(message: &str) -> anyhow::Error {
    match SIGNAL_NUMBER.load(Ordering::Relaxed) {
        0 => Exit::with(0, ""), // nobody reads any more
        signal => Exit::with(SIGNAL + signal as u8, message),
    }
}

/// Waits for the hang-up of the standard output; for ever if it is no pipe and no terminal.
#[cfg(unix)]
fn wait_until_nobody_reads() {
    use rustix::event::{PollFd, PollFlags, poll};

    let output = io::stdout();
    // Without an event asked for, only a hang-up or an error ends the wait.
    while poll(&mut [PollFd::new(&output, PollFlags::empty())], None) == Err(rustix::io::Errno::INTR) {}
}
