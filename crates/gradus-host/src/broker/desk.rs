//! The broker without its sockets: who asks what, and what the answer is. Nothing here waits for a client.

use std::collections::HashMap;
use std::time::Duration;

use gradus_tmcl::{Instruction, Opcode, Reply, Request, Status};

use super::news::Visit;
use super::own_answer::{HOST, OwnAnswer};
use super::rights::Rights;
use crate::line::Job;
use crate::{Address, Error, Line, Session, Url};

/// Answers the requests of clients, who have numbers.
pub struct Desk {
    own: OwnAnswer,
    /// How long an answer of the line may take.
    timeout: Duration,
    /// The port, to open it again.
    url: Option<Url>,
    /// The broker's own session, which hears of a line that breaks while nobody asks.
    watch: Session,
    clients: HashMap<u64, Sessions>,
    /// The client that gets the events of a module.
    listeners: HashMap<u8, u64>,
}

/// A client's sessions, one a module, by the address in the request.
type Sessions = HashMap<u8, Session>;

impl Desk {
    /// A desk for the module at `address`; an answer of the line may take `timeout`.
    pub fn new(line: Line, address: Address, timeout: Duration, rights: Rights) -> Self {
        let mut watch = Session::new(&line, address);
        watch.set_timeout(timeout);
        let own = OwnAnswer { line, address, rights };
        Self { own, timeout, url: None, watch, clients: HashMap::new(), listeners: HashMap::new() }
    }

    /// Opens the line at that port again when it breaks.
    pub fn reopen_at(&mut self, url: Url) {
        self.url = Some(url);
    }

    pub(super) fn own_answer(&self) -> OwnAnswer {
        self.own.clone()
    }

    /// Answers a datagram; `None`: it has no answer.
    ///
    /// # Errors
    /// [`Error::Broken`] when the line is broken.
    pub fn answer(&mut self, client: u64, datagram: &[u8; 9], visit: &mut Visit) -> Result<Option<[u8; 9]>, Error> {
        match self.own.look_at(datagram, visit) {
            Ok(request) => self.ask(client, request, self.own.line.job(), visit),
            Err(answer) => Ok(Some(answer)),
        }
    }

    /// Lets the module answer; `None`: it does not.
    pub(super) fn ask(
        &mut self,
        client: u64,
        request: Request,
        job: Job,
        visit: &mut Visit,
    ) -> Result<Option<[u8; 9]>, Error> {
        if self.own.line.go_on_with(job, request.instruction).is_err() {
            return Ok(Some(self.own.refuse(request, visit)));
        }
        let session = self.session(client, request.address);
        let before = (session.statistics().retries, session.statistics().drained);
        let answer = session.relay(request.instruction);
        visit.retries += session.statistics().retries - before.0;
        visit.drained += session.statistics().drained - before.1;
        match answer {
            Ok(bytes) => {
                self.listen_for(client, request);
                visit.answers += 1;
                Ok(Some(bytes))
            }
            Err(Error::Stopped { .. } | Error::Refused { .. }) => Ok(Some(self.own.refuse(request, visit))),
            Err(error @ Error::Broken { .. }) => Err(error),
            Err(_) => Ok(None),
        }
    }

    fn session(&mut self, client: u64, address: u8) -> &mut Session {
        let OwnAnswer { line, rights, address: own } = &self.own;
        let timeout = self.timeout;
        let key = if rights.whole_bus { address } else { 0 };
        self.clients.entry(client).or_default().entry(key).or_insert_with(|| {
            let module = if rights.whole_bus { u16::from(address) } else { own.module };
            let mut session = Session::new(line, Address { module, ..*own });
            session.set_timeout(timeout);
            session
        })
    }

    /// From now on the events of a module are this client's, if it has asked for them.
    fn listen_for(&mut self, client: u64, Request { address, instruction }: Request) {
        if instruction.opcode == Opcode::POSITION_EVENT {
            let module = self.session(client, address).answering_address() as u8;
            self.listeners.insert(module, client);
        }
    }

    /// The events that have come, with the clients they are for.
    ///
    /// # Errors
    /// [`Error::Broken`] when the line is broken.
    pub fn events(&mut self) -> Result<Vec<(u64, [u8; 9])>, Error> {
        self.watch.listen_in()?;
        let mut events = Vec::new();
        for (&module, &client) in &self.listeners {
            while let Some(event) = self.watch.take_event_of(module) {
                let (status, command) = (Status::POSITION_REACHED, Opcode::POSITION_EVENT);
                events.push((client, Reply { host: HOST, module, status, command, value: event.motors }.emit()));
            }
        }
        Ok(events)
    }

    /// A client has gone. A download of its own is ended, lest the module stores what others send.
    ///
    /// # Errors
    /// [`Error::Broken`] when the line is broken.
    pub fn leave(&mut self, client: u64) -> Result<(), Error> {
        self.listeners.retain(|_, listener| *listener != client);
        let sessions = self.clients.remove(&client).unwrap_or_default();
        for mut session in sessions.into_values().filter(Session::downloads) {
            let ended = session.insist(Instruction::new(Opcode::EXIT_DOWNLOAD, 0, 0, 0));
            // While the module does not answer, what others send it is refused until one of them sends 133.
            if let Err(error @ Error::Broken { .. }) = ended {
                return Err(error);
            }
        }
        Ok(())
    }

    /// Tries to open the broken line again.
    pub(super) fn reopen(&self) -> bool {
        self.url.as_ref().is_some_and(|url| self.own.line.reopen(url).is_ok())
    }
}
