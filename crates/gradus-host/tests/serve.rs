//! The broker's sockets: many clients, too many, rude ones, and a line that breaks.

#![cfg(unix)]

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use gradus_host::{Address, Broker, Error, LatchRequest, Line, News, Rights, Session, Url};
use gradus_tmcl::catalogue::TMCM_3351;
use gradus_tmcl::{CaptureAction, Instruction, Opcode, Reply, Request, Status};

/// A module behind a TCP port, until its owner pulls the plug. It answers a GAP with the parameter's number.
struct Module {
    listener: TcpListener,
    address: SocketAddr,
}

impl Module {
    fn new() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        Self { listener, address }
    }

    /// Answers the next host; pulling the plug is closing the stream that comes back.
    fn plug_in(&self) -> JoinHandle<TcpStream> {
        let listener = self.listener.try_clone().unwrap();
        thread::spawn(move || {
            let stream = listener.accept().unwrap().0;
            let mut line = stream.try_clone().unwrap();
            thread::spawn(move || serve(&mut line));
            stream
        })
    }

    fn url(&self) -> Url {
        format!("tcp:{}?timeout=200", self.address).parse().unwrap()
    }
}

fn serve(line: &mut TcpStream) {
    let mut bytes = [0; 9];
    while line.read_exact(&mut bytes).is_ok() {
        let Ok(Request { instruction, .. }) = Request::parse(&bytes) else { return };
        let Instruction { opcode, kind, value, .. } = instruction;
        let status = if opcode == Opcode::GET_INFO { Status::WRONG_TYPE } else { Status::OK };
        let value = if opcode == Opcode::GAP { i32::from(kind) } else { value };
        let reply = Reply { host: 2, module: 1, status, command: opcode, value };
        if line.write_all(&reply.emit()).is_err() {
            return;
        }
    }
}

/// A running broker; what it has told so far.
struct Served {
    address: SocketAddr,
    told: Arc<Mutex<Vec<String>>>,
    stop: Arc<AtomicBool>,
    thread: JoinHandle<()>,
}

impl Served {
    fn new(module: &Module, most_clients: usize) -> Self {
        let mut broker = Broker::new(
            Line::open(&module.url()).unwrap(),
            Address::serial(1),
            Duration::from_millis(200),
            Rights::default(),
        );
        broker.set_most_clients(most_clients);
        broker.reopen_at(module.url());
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let (told, stop) = (Arc::<Mutex<Vec<String>>>::default(), Arc::new(AtomicBool::new(false)));
        let (news, flag) = (Arc::clone(&told), Arc::clone(&stop));
        let keep = move |item: News| news.lock().unwrap().push(item.to_string());
        let thread = thread::spawn(move || broker.serve(&listener, &flag, keep).unwrap());
        Self { address, told, stop, thread }
    }

    fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(self.address).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
        stream
    }

    fn session(&self) -> Session {
        Session::open(&format!("tcp:{}", self.address).parse().unwrap()).unwrap()
    }

    fn wait_for(&self, words: &str) {
        let deadline = Instant::now() + Duration::from_secs(10);
        while !self.told.lock().unwrap().iter().any(|told| told.contains(words)) {
            assert!(Instant::now() < deadline, "{words}: {:?}", self.told.lock().unwrap());
            thread::sleep(Duration::from_millis(5));
        }
    }

    fn end(self) -> Vec<String> {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.join().unwrap();
        self.told.lock().unwrap().clone()
    }
}

fn gap(kind: u8) -> Instruction {
    Instruction::new(Opcode::GAP, kind, 0, 0)
}

fn ask(stream: &mut TcpStream, instruction: Instruction) -> std::io::Result<Reply> {
    stream.write_all(&Request { address: 1, instruction }.emit())?;
    let mut bytes = [0; 9];
    stream.read_exact(&mut bytes)?;
    Ok(Reply::parse(&bytes).unwrap())
}

fn threads() -> usize {
    std::fs::read_dir("/proc/self/task").map_or(0, Iterator::count)
}

/// Connects and asks at once, so that the clients' requests wait for each other.
#[test]
fn a_hundred_clients_need_no_thread_each() {
    let module = Module::new();
    let plug = module.plug_in();
    let served = Served::new(&module, 200);
    let _line = plug.join().unwrap();
    ask(&mut served.connect(), gap(1)).unwrap();
    let before = threads();
    let mut clients: Vec<TcpStream> = (0..100).map(|_| served.connect()).collect();
    for round in 0..5 {
        for (client, number) in clients.iter_mut().zip(0..) {
            let request = Request { address: 1, instruction: gap(number + round) };
            client.write_all(&request.emit()).unwrap();
        }
        for (client, number) in clients.iter_mut().zip(0..) {
            let mut bytes = [0; 9];
            client.read_exact(&mut bytes).unwrap();
            assert_eq!(Reply::parse(&bytes).unwrap().value, i32::from(number + round));
        }
    }
    // Other tests of this process come and go; a thread each would be a hundred.
    assert!(threads() < before + 50, "{before} threads before, {} now", threads());
    drop(clients);
    served.end();
}

#[test]
fn more_clients_than_there_may_be_are_told_of_and_not_let_in() {
    let module = Module::new();
    let plug = module.plug_in();
    let served = Served::new(&module, 2);
    let _line = plug.join().unwrap();
    let (mut one, mut other) = (served.connect(), served.connect());
    ask(&mut one, gap(1)).unwrap();
    ask(&mut other, gap(1)).unwrap();
    assert_eq!(served.connect().read(&mut [0]).unwrap(), 0, "closed");
    served.wait_for("was not let in: there are 2 clients already (--clients)");
    drop(one);
    served.wait_for("went: 1 requests, 1 answers");
    assert_eq!(ask(&mut served.connect(), gap(7)).unwrap().value, 7);
    served.end();
}

/// The module would answer it: the refusal is the broker's.
#[test]
fn a_bulk_download_is_refused_on_a_shared_line() {
    let module = Module::new();
    let plug = module.plug_in();
    let served = Served::new(&module, 10);
    let _line = plug.join().unwrap();
    let bulk = Instruction::new(Opcode::CAPTURE, CaptureAction::BULK_DOWNLOAD.0, 0, 7);
    let mut client = served.connect();
    let reply = ask(&mut client, bulk).unwrap();
    assert_eq!((reply.status, reply.value), (Status::NOT_AVAILABLE, 7));
    let sample = Instruction::new(Opcode::CAPTURE, CaptureAction::GET_SAMPLE.0, 0, 7);
    assert_eq!(ask(&mut client, sample).unwrap().status, Status::OK);
    let mut session = Session::open(&"sim:tmcm-1617".parse().unwrap()).unwrap();
    let error = session.command(bulk).unwrap_err();
    assert!(error.to_string().contains("one sample after the other"), "{error}");
    served.end();
}

#[test]
fn a_client_that_does_not_read_is_let_go_and_holds_nobody_up() {
    let module = Module::new();
    let plug = module.plug_in();
    let served = Served::new(&module, 10);
    let _line = plug.join().unwrap();
    // A request that the broker answers itself, so that the answers pile up fast.
    let request = Request { address: 1, instruction: LatchRequest::State.instruction() }.emit();
    let mut rude = served.connect();
    let flood = thread::spawn(move || {
        let many = request.repeat(1000);
        while rude.write_all(&many).is_ok() {}
    });
    let mut polite = served.connect();
    for number in 0..50 {
        assert_eq!(ask(&mut polite, gap(number)).unwrap().value, i32::from(number));
    }
    served.wait_for("did not read its answers");
    flood.join().unwrap();
    served.end();
}

#[test]
fn a_broker_ends_though_a_client_does_not_read_and_its_module_is_silent() {
    let module = Module::new();
    let served = Served::new(&module, 10);
    let (_silent, _) = module.listener.accept().unwrap();
    let mut client = served.connect();
    client.write_all(&Request { address: 1, instruction: gap(1) }.emit().repeat(10)).unwrap();
    served.wait_for("came");
    let start = Instant::now();
    assert!(served.end().last().unwrap().contains("went: "));
    assert!(start.elapsed() < Duration::from_secs(1), "{:?}", start.elapsed());
}

#[test]
fn clients_learn_that_the_line_broke_and_find_it_again_with_its_stop() {
    let module = Module::new();
    let plug = module.plug_in();
    let served = Served::new(&module, 10);
    let line = plug.join().unwrap();
    let (mut one, mut idle) = (served.connect(), served.connect());
    assert_eq!(ask(&mut one, gap(3)).unwrap().value, 3);
    let stop = LatchRequest::Stop.instruction();
    assert_eq!(ask(&mut one, stop).unwrap().status, Status::OK);

    line.shutdown(std::net::Shutdown::Both).unwrap();
    assert_eq!(idle.read(&mut [0]).unwrap(), 0, "who does not ask learns it too");
    assert!(ask(&mut one, gap(3)).is_err());
    served.wait_for("the connection broke");

    let plug = module.plug_in();
    served.wait_for("the line is back");
    let _line = plug.join().unwrap();
    let mut session = served.session();
    assert_eq!(session.command(gap(5)).unwrap(), 5);
    assert_eq!(session.ask_latch(LatchRequest::State).unwrap(), Some(true), "the stop lasts");
    let refused = session.command(Instruction::parse("ROR 0, 1", &TMCM_3351).unwrap()).unwrap_err();
    assert!(matches!(refused, Error::Stopped { .. }), "{refused}");
    served.end();
}

#[test]
fn a_stop_is_answered_while_the_line_is_busy() {
    let module = Module::new();
    let served = Served::new(&module, 10);
    let (_silent, _) = module.listener.accept().unwrap();
    let (mut waits, mut stops) = (served.connect(), served.connect());
    waits.write_all(&Request { address: 1, instruction: gap(1) }.emit()).unwrap();
    thread::sleep(Duration::from_millis(50));
    let start = Instant::now();
    assert_eq!(ask(&mut stops, LatchRequest::Stop.instruction()).unwrap().status, Status::OK);
    assert!(start.elapsed() < Duration::from_millis(150), "{:?}", start.elapsed());
    served.end();
}
