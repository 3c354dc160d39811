//! A CAN interface of this computer.

use std::io;
use std::os::fd::{AsFd, BorrowedFd};

use gradus_tmcl::can::Frame;
use socketcan::{CanDataFrame, CanFrame, CanSocket, EmbeddedFrame, ExtendedId, Frame as _, Id, Socket, StandardId};

#[derive(Debug)]
pub(crate) struct CanInterface(CanSocket);

impl CanInterface {
    pub(crate) fn open(name: &str) -> io::Result<Self> {
        let socket = CanSocket::open(name)?;
        socket.set_nonblocking(true)?;
        Ok(Self(socket))
    }

    /// The next data frame that waits; remote and error frames are passed over, TMCL has none.
    pub(crate) fn read(&self) -> io::Result<Frame> {
        loop {
            if let CanFrame::Data(frame) = self.0.read_frame()?
                && let Some(frame) = Frame::new(frame.raw_id(), frame.is_extended(), frame.data())
            {
                return Ok(frame);
            }
        }
    }

    pub(crate) fn write(&self, frame: &Frame) -> io::Result<()> {
        let id = if frame.extended {
            ExtendedId::new(frame.id).map(Id::Extended)
        } else {
            StandardId::new(frame.id as u16).map(Id::Standard)
        };
        match id.and_then(|id| CanDataFrame::new(id, frame.data())) {
            Some(frame) => self.0.write_frame(&CanFrame::Data(frame)),
            None => Ok(()),
        }
    }
}

impl AsFd for CanInterface {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.0.as_fd()
    }
}
