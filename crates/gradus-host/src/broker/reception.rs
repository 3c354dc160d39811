//! The thread that lets clients in and reads what they send.

use std::collections::HashMap;
use std::io::{self, Read};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use gradus_tmcl::Framer;

use super::desk::Desk;
use super::news::{News, Visit};
use super::own_answer::OwnAnswer;
use super::queue::Task;
use super::worker::{Client, Shared, Worker};

/// A pause inside a datagram that ends it, as on a module's own TCP port.
const GAP: Duration = Duration::from_millis(50);
/// How often it looks for the end.
const GLANCE: Duration = Duration::from_millis(10);
/// How long nobody is let in after the system could not.
const DEAF: Duration = Duration::from_millis(200);
/// How many requests of a client may wait; more stay with the system.
const MOST_WAITING: usize = 32;

/// How many bytes of answers the system keeps for a client that does not read; more, and it is let go.
#[cfg(unix)]
const UNREAD: usize = 64 * 1024;

/// Lets clients in and takes what they send.
pub struct Reception<'a, N> {
    listener: &'a TcpListener,
    own: OwnAnswer,
    most_clients: usize,
    shared: Arc<Shared>,
    guests: HashMap<u64, Guest>,
    /// The number of the next client.
    next: u64,
    start: Instant,
    /// Until when nobody is let in.
    deaf_until: Option<Instant>,
    from_worker: Receiver<News>,
    news: N,
}

struct Guest {
    client: Arc<Client>,
    framer: Framer,
}

impl<'a, N: FnMut(News)> Reception<'a, N> {
    /// Opens the doors; the line gets a thread of its own.
    pub fn open(desk: Desk, most_clients: usize, listener: &'a TcpListener, news: N) -> io::Result<Self> {
        listener.set_nonblocking(true)?;
        let (own, shared, (sender, from_worker)) = (desk.own_answer(), Arc::<Shared>::default(), channel());
        let worker = Worker { desk, shared: Arc::clone(&shared), news: sender, retry: None };
        std::thread::Builder::new().name("line".into()).spawn(|| worker.run())?;
        let (guests, start) = (HashMap::new(), Instant::now());
        Ok(Self { listener, own, most_clients, shared, guests, next: 0, start, deaf_until: None, from_worker, news })
    }

    /// Serves until `stop` is set, whatever the line and the clients do.
    pub fn run(mut self, stop: &AtomicBool) -> io::Result<()> {
        while !stop.load(Ordering::Relaxed) {
            for number in self.wait()? {
                self.read(number);
            }
            self.let_in();
            self.from_worker.try_iter().for_each(&mut self.news);
        }
        let everybody: Vec<u64> = self.guests.keys().copied().collect();
        everybody.into_iter().for_each(|number| self.let_out(number));
        Ok(())
    }

    /// Waits for something to do; the clients who have sent something.
    fn wait(&self) -> io::Result<Vec<u64>> {
        let heard = |(number, _): &(&u64, &Guest)| self.shared.queue.len(**number) < MOST_WAITING;
        let (numbers, streams): (Vec<u64>, Vec<&TcpStream>) =
            self.guests.iter().filter(heard).map(|(number, guest)| (*number, &guest.client.stream)).unzip();
        let listener = self.deaf_until.is_none_or(|until| Instant::now() >= until).then_some(self.listener);
        let ready = readable(listener, &streams)?;
        Ok(numbers.into_iter().zip(ready).filter_map(|(number, ready)| ready.then_some(number)).collect())
    }

    fn let_in(&mut self) {
        while self.deaf_until.is_none_or(|until| Instant::now() >= until) {
            match self.listener.accept() {
                Ok((stream, address)) => self.welcome(stream, address),
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => return,
                // The client has gone before it was let in.
                Err(error) if error.kind() == io::ErrorKind::ConnectionAborted => {}
                Err(error) => {
                    if self.deaf_until.replace(Instant::now() + DEAF).is_none() {
                        (self.news)(News::Deaf(error));
                    }
                    return;
                }
            }
        }
    }

    fn welcome(&mut self, stream: TcpStream, address: SocketAddr) {
        self.deaf_until = None;
        if self.guests.len() >= self.most_clients {
            return (self.news)(News::Full(address, self.most_clients));
        }
        if set_up(&stream).is_err() {
            return; // gone already
        }
        (self.news)(News::Came(address));
        let client = Arc::new(Client { address, stream, visit: Mutex::default(), gone: AtomicBool::new(false) });
        self.shared.clients().insert(self.next, Arc::clone(&client));
        self.guests.insert(self.next, Guest { client, framer: Framer::new(GAP.as_micros() as u32) });
        self.next += 1;
    }

    /// Takes what a client has sent.
    fn read(&mut self, number: u64) {
        let Some(guest) = self.guests.get_mut(&number) else { return };
        if guest.client.gone.load(Ordering::Relaxed) {
            return self.let_out(number);
        }
        let mut buffer = [0; 9 * MOST_WAITING];
        match (&guest.client.stream).read(&mut buffer) {
            Err(error) if error.kind() == io::ErrorKind::WouldBlock || error.kind() == io::ErrorKind::Interrupted => {}
            Ok(0) | Err(_) => self.let_out(number),
            Ok(count) => {
                let now_us = u64::try_from(self.start.elapsed().as_micros()).unwrap_or(u64::MAX);
                for datagram in buffer[..count].iter().filter_map(|byte| guest.framer.push(*byte, now_us)) {
                    let looked_at = self.own.look_at(&datagram, &mut guest.client.visit());
                    match looked_at {
                        Ok(request) => self.shared.queue.push(number, Task::Ask(request, self.own.line.job())),
                        Err(answer) => guest.client.send(&answer),
                    }
                }
            }
        }
    }

    fn let_out(&mut self, number: u64) {
        let Some(guest) = self.guests.remove(&number) else { return };
        self.shared.clients().remove(&number);
        self.shared.queue.push(number, Task::Leave);
        let visit: Visit = *guest.client.visit();
        (self.news)(News::Gone(guest.client.address, visit));
    }
}

fn set_up(stream: &TcpStream) -> io::Result<()> {
    stream.set_nonblocking(true)?;
    #[cfg(unix)]
    rustix::net::sockopt::set_socket_send_buffer_size(stream, UNREAD)?;
    stream.set_nodelay(true)
}

/// Waits until somebody knocks, or a client has sent something or has gone; which clients have.
#[cfg(unix)]
fn readable(listener: Option<&TcpListener>, streams: &[&TcpStream]) -> io::Result<Vec<bool>> {
    use rustix::event::{PollFd, PollFlags, Timespec, poll};
    let mut descriptors: Vec<PollFd> = streams.iter().map(|stream| PollFd::new(*stream, PollFlags::IN)).collect();
    descriptors.extend(listener.map(|listener| PollFd::new(listener, PollFlags::IN)));
    let glance = Timespec::try_from(GLANCE).unwrap_or_default();
    match poll(&mut descriptors, Some(&glance)) {
        Err(rustix::io::Errno::INTR) | Ok(_) => {}
        Err(error) => return Err(error.into()),
    }
    Ok(descriptors[..streams.len()].iter().map(|descriptor| !descriptor.revents().is_empty()).collect())
}

/// Looks at all of them now and then.
#[cfg(not(unix))]
fn readable(_: Option<&TcpListener>, streams: &[&TcpStream]) -> io::Result<Vec<bool>> {
    std::thread::sleep(Duration::from_millis(1));
    Ok(vec![true; streams.len()])
}
