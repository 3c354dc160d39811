//! Links over CAN: adapters that speak the slcan text protocol, socketcand servers, and interfaces of the Linux kernel.
//!
//! A request is a frame of seven bytes to the module's identifier; the answer comes under the host's, with the low byte of the
//! module's identifier in front. The link makes the nine bytes of a serial reply of it, so that a session sees no difference.
//! The version text (command 136 type 0) is asked with eight bytes, because the answer has as many bytes as the request.

mod slcan;
#[cfg(all(target_os = "linux", feature = "socketcan"))]
mod socket;
mod socketcand;

use std::io;
use std::time::{Duration, Instant};

use gradus_tmcl::can::Frame;
use gradus_tmcl::{Instruction, checksum};

use crate::link::GRACE;
use crate::url::Bus;
use crate::verdict::{Form, form};
use crate::{Address, Heard, Link, Nature};

/// A line of CAN frames.
pub trait FramePort: Send {
    /// Sends a frame.
    ///
    /// # Errors
    /// When the line is broken.
    fn send(&mut self, frame: &Frame) -> io::Result<()>;

    /// Waits for a frame, at most for `wait`. One that is there already is taken even if `wait` is zero.
    ///
    /// # Errors
    /// When the line is broken.
    fn receive(&mut self, wait: Duration) -> io::Result<Option<Frame>>;
}

/// TMCL on a CAN bus.
pub struct CanLink {
    port: Box<dyn FramePort>,
    opened: Instant,
    /// Identifier of answers; `None`: any.
    reply: Option<u16>,
    /// What the answer that is waited for looks like.
    form: Form,
    check: &'static str,
}

impl CanLink {
    /// Opens a bus; `Err` holds the reason in words.
    pub fn open(bus: &Bus, bit_rate: u32) -> Result<Self, String> {
        let (port, check) = open(bus, bit_rate)?;
        Ok(Self { port, opened: Instant::now(), reply: None, form: Form::Reply, check })
    }

    fn datagram(&self, frame: &Frame) -> Option<[u8; 9]> {
        let from_module = !frame.extended && self.reply.is_none_or(|reply| u32::from(reply) == frame.id);
        let mut bytes = [frame.id as u8, 0, 0, 0, 0, 0, 0, 0, 0];
        let body = frame.data().get(..if self.form == Form::Text { 8 } else { 7 })?;
        bytes.get_mut(1..=body.len())?.copy_from_slice(body);
        if self.form != Form::Text {
            bytes[8] = checksum(&bytes[..8]);
        }
        from_module.then_some(bytes)
    }
}

/// An open port, and what to check when no module answers.
pub(crate) fn open(bus: &Bus, bit_rate: u32) -> Result<(Box<dyn FramePort>, &'static str), String> {
    Ok(match bus {
        Bus::Slcan(place) => {
            (slcan::open(place, bit_rate)?, "power, bus, bit rate (?bitrate=1000000) and CAN IDs (?id=1&reply=2)")
        }
        Bus::Socketcand { host, port, bus } => {
            (socketcand::open(host, *port, bus)?, "power, bus and CAN IDs (?id=1&reply=2)")
        }
        Bus::Interface(name) => (socket(name)?, "power, the interface's bit rate and CAN IDs (?id=1&reply=2)"),
    })
}

#[cfg(all(target_os = "linux", feature = "socketcan"))]
fn socket(name: &str) -> Result<Box<dyn FramePort>, String> {
    Ok(Box::new(socket::Socket::open(name)?))
}

#[cfg(not(all(target_os = "linux", feature = "socketcan")))]
fn socket(_: &str) -> Result<Box<dyn FramePort>, String> {
    Err("this program was built without SocketCAN (Linux only, feature `socketcan`)".into())
}

/// For [`fuzz_session`](crate::fuzz_session): opens a bus behind a hostile adapter or server, and listens.
pub(crate) fn fuzz_port(slcan: bool, peer: impl crate::Stream + 'static) {
    let port: Result<Box<dyn FramePort>, String> = match slcan {
        true => slcan::Slcan::new(peer, 1_000_000).map(|port| Box::new(port) as _),
        false => socketcand::Socketcand::new(peer, "can0").map(|port| Box::new(port) as _),
    };
    let Ok(mut port) = port else { return };
    for _ in 0..10 {
        let _ = port.receive(Duration::from_millis(20));
    }
}

impl Link for CanLink {
    fn send(&mut self, to: Address, instruction: Instruction) -> io::Result<()> {
        self.reply = to.reply;
        self.form = form(instruction);
        let request = Frame::request(u32::from(to.module), &instruction);
        if self.form != Form::Text {
            return self.port.send(&request);
        }
        let bytes: Vec<u8> = request.data().iter().copied().chain([0]).collect();
        let longer = Frame::new(request.id, false, &bytes);
        longer.map_or(Ok(()), |frame| self.port.send(&frame))
    }

    fn receive(&mut self, deadline: Duration) -> io::Result<Heard> {
        loop {
            let frame = self.port.receive(deadline.saturating_sub(self.now()))?;
            match frame {
                None if self.now() < deadline => {}
                None => return Ok(Heard::Nothing),
                Some(frame) => {
                    if let Some(bytes) = self.datagram(&frame) {
                        return Ok(Heard::Datagram(bytes));
                    }
                    if self.now() > deadline + GRACE {
                        return Ok(Heard::Nothing);
                    }
                }
            }
        }
    }

    fn now(&self) -> Duration {
        self.opened.elapsed()
    }

    fn nature(&self) -> Nature {
        Nature { can: true, check: self.check }
    }
}

#[cfg(test)]
mod tests;
