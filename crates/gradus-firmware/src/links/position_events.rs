//! Position-reached events: the second reply of command 138.

/// How many clients can ask for events; one more takes the place of the oldest.
const CLIENTS: usize = 4;

#[derive(Clone, Copy, Debug)]
struct Registration {
    link: u32,
    mask: u8,
    every: bool,
    /// Motors of the mask that an MVP has started and that have not been reported yet.
    moving: u8,
    fired: bool,
}

/// Who wants to know which motors have arrived.
#[derive(Clone, Debug, Default)]
pub(crate) struct PositionEvents {
    clients: heapless::Vec<Registration, CLIENTS>,
}

impl PositionEvents {
    /// Command 138: the link wants an event for the motors of the mask, for every MVP or only for the next one.
    pub(crate) fn request(&mut self, link: u32, mask: u8, every: bool) {
        self.clients.retain(|client| client.link != link);
        if self.clients.is_full() {
            self.clients.remove(0);
        }
        if mask != 0 {
            let _ = self.clients.push(Registration { link, mask, every, moving: 0, fired: false });
        }
    }

    /// An MVP has started these motors.
    pub(crate) fn moved(&mut self, motors: u8) {
        for client in &mut self.clients {
            client.moving |= client.mask & motors;
        }
    }

    /// True while an event may be due.
    pub(crate) fn is_waiting(&self) -> bool {
        self.clients.iter().any(|client| client.moving != 0)
    }

    /// Fires the events whose motors are all among `reached`.
    pub(crate) fn update(&mut self, reached: u8) {
        for client in &mut self.clients {
            if client.moving != 0 && client.moving & !reached == 0 {
                client.moving = 0;
                client.fired = true;
            }
        }
    }

    /// The mask of an event that is due for the link.
    pub(crate) fn take(&mut self, link: u32) -> Option<u8> {
        let index = self.clients.iter().position(|client| client.link == link && client.fired)?;
        let client = self.clients.get_mut(index)?;
        client.fired = false;
        let mask = client.mask;
        if !client.every {
            self.clients.remove(index);
        }
        Some(mask)
    }
}
