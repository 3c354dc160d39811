//! The thread that asks the line and answers.

use std::collections::HashMap;
use std::io::{self, Write};
use std::net::{Shutdown, SocketAddr, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use gradus_tmcl::Request;

use super::desk::Desk;
use super::news::{News, Visit};
use super::queue::{Queue, Task};
use crate::Error;
use crate::line::Job;

/// How often it looks for events.
const GLANCE: Duration = Duration::from_millis(10);
/// Time between two attempts to open a broken line again.
const REOPEN: Duration = Duration::from_millis(500);

/// A connection, which both threads know.
pub struct Client {
    pub address: SocketAddr,
    pub stream: TcpStream,
    pub visit: Mutex<Visit>,
    /// True once it was let go; what it still sends does not count.
    pub gone: AtomicBool,
}

/// What both threads know.
#[derive(Default)]
pub struct Shared {
    pub queue: Queue,
    pub clients: Mutex<HashMap<u64, Arc<Client>>>,
}

/// Does what stands in the queue.
pub struct Worker {
    pub desk: Desk,
    pub shared: Arc<Shared>,
    pub news: Sender<News>,
    /// When the broken line is tried next; `None` while it works.
    pub retry: Option<Instant>,
}

impl Client {
    pub fn visit(&self) -> MutexGuard<'_, Visit> {
        self.visit.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sends an answer. Who has not read so many that the system takes no more is let go.
    pub fn send(&self, bytes: &[u8; 9]) {
        match (&self.stream).write(bytes) {
            Ok(9) => {}
            Err(error) if error.kind() != io::ErrorKind::WouldBlock => self.let_go(),
            _ => {
                self.visit().unread = true;
                self.let_go();
            }
        }
    }

    /// Closes the connection; whoever reads it notices.
    pub fn let_go(&self) {
        self.gone.store(true, Ordering::Relaxed);
        let _ = self.stream.shutdown(Shutdown::Both);
    }
}

impl Shared {
    pub fn clients(&self) -> MutexGuard<'_, HashMap<u64, Arc<Client>>> {
        self.clients.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn client(&self, number: u64) -> Option<Arc<Client>> {
        self.clients().get(&number).cloned()
    }
}

impl Worker {
    /// Works until nobody listens to its news any more.
    pub fn run(mut self) {
        while Arc::strong_count(&self.shared) > 1 {
            match self.shared.queue.pop(GLANCE) {
                Some((client, task)) => self.work(client, task),
                None => self.pass_events(),
            }
            self.try_line();
        }
    }

    fn work(&mut self, number: u64, task: Task) {
        match task {
            Task::Ask(request, job) => self.answer(number, request, job),
            Task::Leave => {
                let left = self.desk.leave(number);
                self.notice(left.err());
            }
        }
    }

    fn answer(&mut self, number: u64, request: Request, job: Job) {
        let Some(client) = self.shared.client(number) else { return };
        if self.retry.is_some() {
            return client.let_go();
        }
        let mut seen = Visit::default();
        let answer = self.desk.ask(number, request, job, &mut seen);
        client.visit().add(seen);
        match answer {
            Ok(Some(bytes)) => client.send(&bytes),
            Ok(None) => {}
            Err(error) => self.notice(Some(error)),
        }
    }

    fn pass_events(&mut self) {
        if self.retry.is_some() {
            return;
        }
        match self.desk.events() {
            Ok(events) => {
                for (number, bytes) in events {
                    self.shared.client(number).iter().for_each(|client| client.send(&bytes));
                }
            }
            Err(error) => self.notice(Some(error)),
        }
    }

    /// Lets all clients go if the line broke.
    fn notice(&mut self, error: Option<Error>) {
        let Some(error @ Error::Broken { .. }) = error else { return };
        if self.retry.is_none() {
            let _ = self.news.send(News::LineBroke(error.to_string()));
        }
        self.retry = Some(Instant::now() + REOPEN);
        self.shared.clients().values().for_each(|client| client.let_go());
    }

    fn try_line(&mut self) {
        if self.retry.is_some_and(|retry| Instant::now() >= retry) {
            self.retry = Some(Instant::now() + REOPEN);
            if self.desk.reopen() {
                self.retry = None;
                let _ = self.news.send(News::LineIsBack);
            }
        }
    }
}

impl Visit {
    fn add(&mut self, seen: Visit) {
        self.answers += seen.answers;
        self.refused += seen.refused;
        self.retries += seen.retries;
        self.drained += seen.drained;
    }
}
