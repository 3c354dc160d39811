//! Bytes over a serial port: RS232, RS485 adapter, USB, pseudo-terminal.

#[cfg(unix)]
mod claim;

use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serial2::SerialPort;
#[cfg(target_os = "linux")]
use serial2::rs4xx::Rs485Config;

#[cfg(unix)]
use self::claim::{Claim, Refusal};
use crate::Stream;
use crate::link::received;

/// An open serial port: 8 data bits, no parity, one stop bit, no flow control.
pub struct SerialStream {
    port: SerialPort,
    opened: Instant,
    /// The port is this program's alone. Windows does so by itself.
    #[cfg(unix)]
    _claim: Claim,
}

impl SerialStream {
    /// Opens the port, for this program alone; `Err` holds the reason in words. With `rs485` the port's driver switches an RS-485 transceiver to sending
    /// and back; most adapters do that by themselves.
    pub fn open(path: &Path, baud: u32, rs485: bool) -> Result<Self, String> {
        #[cfg(unix)]
        let claim = Claim::take(path).map_err(|refusal| in_words(refusal, baud))?;
        let port = SerialPort::open(path, baud).map_err(|error| reason(&error, baud))?;
        #[cfg(unix)]
        claim.keep_others_out();
        if rs485 {
            switch_direction(&port)?;
        }
        // What came before belongs to whoever had the port open before.
        port.discard_input_buffer().map_err(|error| error.to_string())?;
        Ok(Self {
            port,
            opened: Instant::now(),
            #[cfg(unix)]
            _claim: claim,
        })
    }

    /// The serial ports of this computer.
    pub fn ports() -> Vec<PathBuf> {
        SerialPort::available_ports().unwrap_or_default()
    }
}

#[cfg(target_os = "linux")]
fn switch_direction(port: &SerialPort) -> Result<(), String> {
    port.set_rs4xx_mode(Rs485Config::new()).map_err(|error| {
        format!("its driver cannot switch an RS-485 transceiver ({error}); most adapters do so by themselves: leave rs485=1 out")
    })
}

#[cfg(not(target_os = "linux"))]
fn switch_direction(_: &SerialPort) -> Result<(), String> {
    Err("an RS-485 transceiver is switched on Linux only; most adapters do so by themselves: leave rs485=1 out".into())
}

#[cfg(unix)]
fn in_words(refusal: Refusal, baud: u32) -> String {
    match refusal {
        Refusal::Words(words) => words,
        Refusal::System(error) => reason(&error, baud),
    }
}

fn reason(error: &io::Error, baud: u32) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "there is no such file; is the module plugged in?".into(),
        io::ErrorKind::PermissionDenied | io::ErrorKind::ResourceBusy => {
            "in use by another program; see `gradus serve`, which shares a port between programs".into()
        }
        io::ErrorKind::InvalidInput => format!("the port does not work at {baud} baud"),
        _ if error.raw_os_error() == Some(NOT_A_TERMINAL) => "this is not a serial port".into(),
        _ => error.to_string(),
    }
}

/// ENOTTY, as Linux and the BSDs number it.
const NOT_A_TERMINAL: i32 = 25;

impl Stream for SerialStream {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.port.write_all(bytes)
    }

    fn receive(&mut self, buffer: &mut [u8], deadline: Duration) -> io::Result<usize> {
        // The port counts whole milliseconds; rounding down would turn the last one into a busy loop.
        let wait = deadline.saturating_sub(self.now()).as_micros().div_ceil(1000);
        self.port.set_read_timeout(Duration::from_millis(u64::try_from(wait).unwrap_or(u64::MAX)))?;
        received(self.port.read(buffer))
    }

    fn now(&self) -> Duration {
        self.opened.elapsed()
    }

    fn what_to_check(&self) -> &'static str {
        "power, cable, baud rate and address (?address=N)"
    }
}
