//! The console's lines as they come from a file descriptor.

use std::io::{self, Write};
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};

use rustix::io::Errno;

use crate::{Rig, rig_console};

/// Whoever sends a longer line is no operator: `sim < /dev/zero`.
const MAX_LINE: usize = 4096;

/// So many wrong lines one after another come from no operator either: `sim < /dev/urandom`.
const MAX_WRONG: u32 = 100;

/// Bytes of a message about a wrong line, which may quote it.
const MAX_MESSAGE: usize = 200;

/// Where console lines come from and where the answers go.
pub struct Console {
    input: OwnedFd,
    /// The beginning of a line.
    pending: Vec<u8>,
    /// Lines since the last right one.
    wrong: u32,
    answers: Box<dyn Write + Send>,
    messages: Box<dyn Write + Send>,
}

impl Console {
    /// Lines from the standard input, answers on the standard output, messages about wrong lines on standard error.
    ///
    /// # Errors
    /// When there is no standard input.
    pub fn standard() -> io::Result<Self> {
        let input = io::stdin().as_fd().try_clone_to_owned()?;
        Ok(Self::new(input, Box::new(io::stdout()), Box::new(io::stderr())))
    }

    /// Lines from any descriptor that can be waited for.
    pub fn new(input: OwnedFd, answers: Box<dyn Write + Send>, messages: Box<dyn Write + Send>) -> Self {
        Self { input, pending: Vec::new(), wrong: 0, answers, messages }
    }

    /// Executes what has come; false at the end of the input, when it cannot be an operator's, and when the terminal has gone to
    /// another program.
    pub(crate) fn receive(&mut self, rig: &mut Rig) -> bool {
        if in_background(&self.input) {
            return false;
        }
        let mut buffer = [0; MAX_LINE];
        match rustix::io::read(&self.input, &mut buffer) {
            Ok(0) => {
                self.execute_pending(rig);
                false
            }
            Ok(len) => {
                self.split(&buffer[..len], rig);
                self.is_worked()
            }
            Err(error) => matches!(error, Errno::AGAIN | Errno::INTR),
        }
    }

    /// Says something unasked. What cannot be printed cannot be helped.
    pub(crate) fn say(&mut self, text: &str) {
        let _ = self.messages.write_all(text.as_bytes()).and_then(|()| self.messages.flush());
    }

    fn split(&mut self, bytes: &[u8], rig: &mut Rig) {
        for part in bytes.split_inclusive(|byte| *byte == b'\n') {
            self.pending.extend_from_slice(part);
            if part.ends_with(b"\n") && self.pending.len() <= MAX_LINE && self.wrong < MAX_WRONG {
                self.execute_pending(rig);
            }
        }
    }

    /// Whether an operator sends this; says why not.
    fn is_worked(&mut self) -> bool {
        let why = match () {
            () if self.pending.len() > MAX_LINE => format!("a line of more than {MAX_LINE} bytes"),
            () if self.wrong >= MAX_WRONG => format!("{MAX_WRONG} wrong lines one after another"),
            () => return true,
        };
        self.complain(&format!("the console is closed: {why}"));
        false
    }

    fn execute_pending(&mut self, rig: &mut Rig) {
        let line = std::mem::take(&mut self.pending);
        match rig_console::execute(&String::from_utf8_lossy(&line), rig) {
            Ok(answer) => {
                self.wrong = 0;
                print(&mut self.answers, &answer);
            }
            Err(message) => {
                self.wrong += 1;
                self.complain(&message.to_string());
            }
        }
    }

    /// Tells the operator what is wrong.
    pub(crate) fn complain(&mut self, message: &str) {
        let end = message.floor_char_boundary(MAX_MESSAGE);
        print(&mut self.messages, &format!("{}\n", &message[..end]));
    }
}

/// What cannot be printed cannot be helped.
fn print(writer: &mut dyn Write, text: &str) {
    let _ = writer.write_all(text.as_bytes()).and_then(|()| writer.flush());
}

/// True when the keys belong to another program: after `gradus sim &`, say. Reading all the same would make the system stop
/// this one, and with it the module (SIGTTIN).
fn in_background(input: &OwnedFd) -> bool {
    // Fails on what is not our terminal, such as a pipe; that can be read.
    rustix::termios::tcgetpgrp(input).is_ok_and(|foreground| foreground != rustix::process::getpgrp())
}

impl AsFd for Console {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.input.as_fd()
    }
}
