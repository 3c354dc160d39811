//! A CAN interface of the Linux kernel.

use std::io;
use std::time::Duration;

use gradus_tmcl::can::Frame;
use socketcan::{CanFrame, CanSocket, EmbeddedFrame, ExtendedId, Frame as _, Id, Socket as _, StandardId};

use super::FramePort;

/// An open interface.
pub struct Socket {
    socket: CanSocket,
}

impl Socket {
    /// Opens an interface; `Err` holds the reason in words.
    pub fn open(name: &str) -> Result<Self, String> {
        let socket = CanSocket::open(name).map_err(|error| match error.kind() {
            io::ErrorKind::NotFound => format!("there is no interface `{name}`; `ip link` lists them"),
            _ => match error.raw_os_error() {
                Some(NO_SUCH_DEVICE) => format!("there is no interface `{name}`; `ip link` lists them"),
                Some(NO_FAMILY) => "this computer's kernel has no SocketCAN".into(),
                _ => error.to_string(),
            },
        })?;
        Ok(Self { socket })
    }
}

/// ENODEV and EAFNOSUPPORT, as Linux numbers them.
const NO_SUCH_DEVICE: i32 = 19;
const NO_FAMILY: i32 = 97;

impl FramePort for Socket {
    fn send(&mut self, frame: &Frame) -> io::Result<()> {
        let id = if frame.extended {
            ExtendedId::new(frame.id).map(Id::Extended)
        } else {
            u16::try_from(frame.id).ok().and_then(StandardId::new).map(Id::Standard)
        };
        let frame = id.and_then(|id| CanFrame::new(id, frame.data()));
        frame.map_or(Ok(()), |frame| self.socket.write_frame_insist(&frame))
    }

    fn receive(&mut self, wait: Duration) -> io::Result<Option<Frame>> {
        // The kernel counts whole milliseconds; rounding down would turn the last one into a busy loop.
        let wait = u64::try_from(wait.as_micros().div_ceil(1000)).unwrap_or(u64::MAX);
        match self.socket.read_frame_timeout(Duration::from_millis(wait)) {
            Ok(CanFrame::Data(frame)) => Ok(Frame::new(frame.raw_id(), frame.is_extended(), frame.data())),
            Ok(_) => Ok(None),
            Err(error) if matches!(error.kind(), io::ErrorKind::TimedOut | io::ErrorKind::WouldBlock) => Ok(None),
            Err(error) => Err(error),
        }
    }
}
