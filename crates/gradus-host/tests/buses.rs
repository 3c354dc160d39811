//! Sessions, the search for modules and the broker on simulated buses, over real sockets and terminals.
#![cfg(unix)]

mod support;

use std::net::TcpListener;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use gradus_host::scan::scan;
use gradus_host::trace::{Decoder, Sniffer};
use gradus_host::{Address, Broker, Line, News, Rights, Session};
use gradus_sim::{BusKind, Serial};
use gradus_tmcl::catalogue::{Ap, Gp, TMCM_3351};
use gradus_tmcl::{Instruction, Opcode, Status};
use support::Served;

#[test]
fn three_modules_of_a_segment_are_found_and_left_alone() {
    let served = Served::segment(&[1, 2, 5], "");
    let mut asked = 0;
    let found = scan(&served.url("?timeout=50"), 1..=6, |_| {
        asked += 1;
        true
    });
    let found: Vec<String> =
        found.unwrap().iter().map(|found| format!("{} {:?} {}", found.module, found.firmware, found.axes)).collect();
    assert_eq!(found, vec!["TMCM-3351 (1, 11) 3"; 3]);
    assert_eq!(asked, 6);
}

#[test]
fn a_module_that_answers_any_address_is_found_at_once() {
    let served = Served::new(BusKind::Serial(Serial::USB), &[7], "");
    let mut asked = Vec::new();
    let found = scan(&served.url(""), 1..=255, |address| {
        asked.push(address);
        true
    })
    .unwrap();
    assert_eq!(found.len(), 1);
    assert_eq!((found[0].address, asked.len()), (7, 1));
    assert!(found[0].port.ends_with("?address=7"), "{}", found[0].port);
}

#[test]
fn modules_on_can_are_found_with_their_reply_identifiers() {
    let served = Served::can(&[3, 5]);
    let found = scan(&served.url(""), 1..=6, |_| true).unwrap();
    let addresses: Vec<u16> = found.iter().map(|found| found.address).collect();
    assert_eq!(addresses, [3, 5]);
    let mut session = Session::open(&found[1].port.parse().unwrap()).unwrap();
    assert_eq!(session.get_global(Gp::CanId, 0).unwrap(), 5);
}

#[test]
fn a_search_can_be_ended() {
    let served = Served::segment(&[1, 2, 5], "");
    let found = scan(&served.url("?timeout=50"), 1..=255, |address| address < 3).unwrap();
    assert_eq!(found.len(), 2);
}

#[test]
fn an_adapter_that_hears_itself_is_no_trouble() {
    let serial = Serial { echo: true, ..Serial::rs485(1_000_000).without_timing() };
    let served = Served::new(BusKind::Serial(serial), &[1], "");
    let mut session = Session::open(&served.url("?echo=1")).unwrap();
    for value in 0..100 {
        session.set_axis(Ap::MaxCurrent, 0, value).unwrap();
        assert_eq!(session.get_axis(Ap::MaxCurrent, 0).unwrap(), value);
    }
    assert_eq!(session.statistics().drained, 0);
    assert_eq!(session.statistics().probes, 1);
}

/// Writes and reads user variables; every value must come back from its own module.
fn exchange(session: &mut Session, module: i32, rounds: i32) {
    for round in 0..rounds {
        let value = module * 1_000_000 + round;
        session.set_global(Gp::UserVariable, module as u8, value).unwrap();
        assert_eq!(session.get_global(Gp::UserVariable, module as u8).unwrap(), value);
        assert_eq!(session.get_global(Gp::SerialAddress, 0).unwrap(), module);
    }
}

#[test]
fn threads_share_a_noisy_segment() {
    let served = Served::segment(&[1, 2, 5], "noisy-line");
    let line = Line::open(&served.url("")).unwrap();
    thread::scope(|scope| {
        for module in [1, 2, 5] {
            let mut session = Session::new(&line, Address::serial(module));
            session.set_timeout(Duration::from_millis(100));
            scope.spawn(move || exchange(&mut session, i32::from(module), 300));
        }
    });
}

/// A broker for a line, until its owner ends it.
struct Shared {
    url: String,
    stop: std::sync::Arc<AtomicBool>,
    thread: Option<JoinHandle<Vec<String>>>,
}

impl Shared {
    fn new(broker: Broker) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let url = format!("tcp:{}", listener.local_addr().unwrap());
        let stop = std::sync::Arc::new(AtomicBool::new(false));
        let flag = std::sync::Arc::clone(&stop);
        let thread = thread::spawn(move || {
            let gone = Mutex::new(Vec::new());
            let keep = |news: News| {
                if let News::Gone(..) = news {
                    gone.lock().unwrap().push(news.to_string());
                }
            };
            broker.serve(&listener, &flag, keep).unwrap();
            gone.into_inner().unwrap()
        });
        Self { url, stop, thread: Some(thread) }
    }

    fn session(&self, options: &str) -> Session {
        Session::open(&format!("{}{options}", self.url).parse().unwrap()).unwrap()
    }

    /// Ends the broker; what it told of its clients.
    fn end(mut self) -> Vec<String> {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.take().unwrap().join().unwrap()
    }
}

fn broker(served: &Served, address: u8, rights: Rights) -> Broker {
    let line = Line::open(&served.url("")).unwrap();
    Broker::new(line, Address::serial(address), Duration::from_millis(200), rights)
}

#[test]
fn clients_of_a_broker_share_a_module_and_each_gets_its_own_answers() {
    let served = Served::segment(&[1, 2], "");
    let shared = Shared::new(broker(&served, 2, Rights::default()));
    thread::scope(|scope| {
        for client in 0..4 {
            let mut session = shared.session("");
            scope.spawn(move || {
                for round in 0..100 {
                    session.set_global(Gp::UserVariable, client, i32::from(client) * 1000 + round).unwrap();
                    let value = session.get_global(Gp::UserVariable, client).unwrap();
                    assert_eq!(value, i32::from(client) * 1000 + round);
                }
                assert_eq!(session.answering_address(), 2, "the module looks as if it were alone");
            });
        }
    });
    let told = shared.end();
    assert_eq!(told.len(), 4);
    assert!(told.iter().all(|visit| visit.contains("requests") && visit.contains(" 0 drained")), "{told:?}");
}

#[test]
fn clients_of_a_bus_broker_reach_every_module() {
    let served = Served::segment(&[1, 2, 5], "");
    let shared = Shared::new(broker(&served, 1, Rights { whole_bus: true, read_only: false }));
    thread::scope(|scope| {
        for module in [1, 2, 5] {
            let mut session = shared.session(&format!("?address={module}"));
            scope.spawn(move || exchange(&mut session, module, 50));
        }
    });
    let url = format!("{}?address=9&timeout=100", shared.url).parse().unwrap();
    assert!(Session::open(&url).err().unwrap().to_string().contains("no module answers at address 9"));
}

#[test]
fn readers_may_read_and_nothing_else() {
    let served = Served::segment(&[1], "");
    let shared = Shared::new(broker(&served, 1, Rights { whole_bus: false, read_only: true }));
    let mut session = shared.session("");
    assert_eq!(session.get_axis(Ap::MaxCurrent, 0).unwrap(), 128);
    for text in ["SAP 6, 0, 1", "MVP ABS, 0, 100", "MST 0", "SIO 0, 2, 1", "RFS START, 0", "DATA 128, 0, 0, 0"] {
        let instruction = Instruction::parse(text, &TMCM_3351).unwrap();
        assert_eq!(session.execute(instruction).unwrap().status, Status::NOT_AVAILABLE, "{text}");
    }
    assert_eq!(session.get_axis(Ap::MaxCurrent, 0).unwrap(), 128);
    assert_eq!(session.version_text().unwrap(), "3351V111");
    drop(session);
    let told = shared.end();
    assert!(told[0].contains("6 refused"), "{told:?}");
}

#[test]
fn an_event_goes_to_the_client_that_asked_for_it() {
    let served = Served::segment(&[1], "");
    let shared = Shared::new(broker(&served, 1, Rights::default()));
    let (mut one, mut other) = (shared.session(""), shared.session(""));
    other.get_axis(Ap::MaxCurrent, 0).unwrap();
    one.command(Instruction::new(Opcode::POSITION_EVENT, 0, 0, 1)).unwrap();
    one.command(Instruction::parse("MVP ABS, 0, 1000", &TMCM_3351).unwrap()).unwrap();
    assert_eq!(one.wait_event(Duration::from_secs(10)).unwrap().map(|event| event.motors), Some(1));
    assert_eq!(other.wait_event(Duration::from_millis(50)).unwrap(), None);
}

#[test]
fn who_listens_to_a_can_bus_hears_others_talk() {
    let served = Served::can(&[3]);
    let mut sniffer = Sniffer::open(&served.url("")).unwrap();
    let mut session = Session::open(&served.url("?id=3")).unwrap();
    session.get_axis(Ap::MaxSpeed, 1).unwrap();
    let mut decoder = Decoder::new(&TMCM_3351);
    let mut heard = Vec::new();
    while let Some(record) = sniffer.listen(Duration::from_millis(200)).unwrap() {
        heard.push(decoder.line(&record).split_off(12));
    }
    let last = &heard[heard.len() - 2..];
    assert!(last[0].contains("> 3   GAP 4, 1") && last[0].contains("maximum_positioning_speed of axis 1"), "{heard:?}");
    assert!(last[1].contains("< 3   100 (ok) 51200"), "{heard:?}");
}
