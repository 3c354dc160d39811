//! Hosts on the endpoints of a CAN bus, and several buses at once.
#![cfg(unix)]

use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use gradus_sim::{Bench, BusKind, Can, Endpoint, Options, Rig, RigFile, ServeError, Server, Stopper};
use gradus_tmcl::catalogue::{Gp, TMCM_3351};

/// A server in a thread of its own; it ends with its owner.
struct Served {
    endpoints: Vec<Endpoint>,
    stopper: Stopper,
    thread: Option<JoinHandle<Result<(), ServeError>>>,
}

impl Served {
    fn new(rig: Rig, endpoints: &[(usize, Endpoint)]) -> Self {
        let mut server = Server::open(rig, &[], Options::default()).unwrap();
        for (bus, endpoint) in endpoints {
            server.open_endpoint(*bus, endpoint).unwrap();
        }
        let (endpoints, stopper) = (server.endpoints().to_vec(), server.stopper().unwrap());
        let thread = Some(thread::spawn(move || server.run(None)));
        Self { endpoints, stopper, thread }
    }

    /// A module on a CAN bus of 250 kbit/s.
    fn on_can(endpoint: &str) -> Self {
        let mut bench = Bench::rigid(&TMCM_3351);
        assert!(bench.set_rate(Gp::CanBitRate, 250_000));
        let mut rig = Rig::from(bench);
        let bus = rig.add_bus("can", BusKind::Can(Can { bit_rate: 250_000, timing: true }));
        rig.connect(0, bus);
        Self::new(rig, &[(bus, endpoint.parse().unwrap())])
    }

    fn host(&self, index: usize) -> Host {
        let address: SocketAddr = match &self.endpoints[index] {
            Endpoint::Tcp(address) | Endpoint::SlcanTcp(address) | Endpoint::Socketcand(address) => *address,
            other => panic!("{other} is not on TCP"),
        };
        let stream = TcpStream::connect(address).unwrap();
        stream.set_nodelay(true).unwrap();
        Host(stream)
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        self.stopper.stop();
        let ended = self.thread.take().unwrap().join().unwrap();
        assert!(thread::panicking() || ended.is_ok());
    }
}

struct Host(TcpStream);

impl Host {
    fn say(&mut self, text: &str) {
        self.0.write_all(text.as_bytes()).unwrap();
    }

    /// As many bytes as the text has must be the text.
    fn expect(&mut self, text: &str) {
        self.0.set_read_timeout(Some(Duration::from_secs(10))).unwrap();
        let mut bytes = vec![0; text.len()];
        self.0.read_exact(&mut bytes).unwrap_or_else(|error| panic!("{text:?}: {error}"));
        assert_eq!(String::from_utf8_lossy(&bytes), text);
    }

    fn expect_silence(&mut self) {
        self.0.set_read_timeout(Some(Duration::from_millis(50))).unwrap();
        let mut byte = [0];
        assert_eq!(self.0.read(&mut byte).map_err(|error| error.kind()), Err(ErrorKind::WouldBlock), "{byte:?}");
    }
}

/// GAP 4, 0 and its answer, 51200.
const ASK: &str = "t001706040000000000\r";
const ANSWER: &str = "z\rt00270164060000C800\r";

#[test]
fn adapter_carries_commands_and_answers() {
    let served = Served::on_can("slcan:127.0.0.1:0");
    let mut host = served.host(0);
    for command in ["C\r", "S5\r", "O\r", "Z0\r", "\r"] {
        host.say(command);
        host.expect("\r");
    }
    for (command, answer) in [("V\r", "V1010\r"), ("N\r", "N0001\r"), ("F\r", "F00\r"), ("r0010\r", "z\r")] {
        host.say(command);
        host.expect(answer);
    }
    for _ in 0..10 {
        host.say(ASK);
        host.expect(ANSWER);
    }
    host.say("T00000001706040000000000\r");
    host.expect("Z\rT0000000270164060000C800\r");
    host.say("C\rZ1\rO\r");
    host.expect("\r\r\r");
    host.say(ASK);
    host.expect(&ANSWER[..ANSWER.len() - 1]);
    let mut time = [0; 5];
    host.0.read_exact(&mut time).unwrap();
    assert!(time[..4].iter().all(u8::is_ascii_hexdigit) && time[4] == b'\r', "{time:?}");
}

#[test]
fn adapter_refuses_what_it_cannot_do() {
    let served = Served::on_can("slcan:127.0.0.1:0");
    let mut host = served.host(0);
    for (command, answer) in [
        (ASK, "\x07"),
        ("S9\r", "\x07"),
        ("nonsense\r", "\x07"),
        ("L\r", "\r"),
        (ASK, "\x07"),
        ("C\rO\r", "\r\r"),
        ("S5\r", "\x07"),
        (ASK, ANSWER),
    ] {
        host.say(command);
        host.expect(answer);
    }
}

#[test]
fn adapter_of_another_bit_rate_hears_nothing() {
    let served = Served::on_can("slcan:127.0.0.1:0");
    let (mut deaf, mut host) = (served.host(0), served.host(0));
    deaf.say("S8\rO\r");
    deaf.expect("\r\r");
    deaf.say(ASK);
    deaf.expect("z\r");
    host.say(&format!("O\r{ASK}"));
    host.expect(&format!("\r{ANSWER}"));
    deaf.expect_silence();
}

#[test]
fn every_adapter_hears_the_bus() {
    let served = Served::on_can("slcan:127.0.0.1:0");
    let (mut listener, mut host) = (served.host(0), served.host(0));
    listener.say("L\r");
    listener.expect("\r");
    host.say(&format!("O\r{ASK}"));
    listener.expect("t001706040000000000\rt00270164060000C800\r");
}

#[test]
fn socketcand_carries_commands_and_answers() {
    let served = Served::on_can("socketcand:127.0.0.1:0");
    let mut host = served.host(0);
    host.expect("< hi >");
    host.say("< send 1 0 >");
    host.expect("< error no bus is open >");
    host.say("< open can0 >< rawmode >");
    host.expect("< ok >< ok >");
    host.say("< echo >");
    host.expect("< echo >");
    host.say("< send 001 7 6 4 0 0 0 0 0 >");
    host.expect("< frame 002 ");
    let mut text = Vec::new();
    while text.last() != Some(&b'>') {
        let mut byte = [0];
        host.0.read_exact(&mut byte).unwrap();
        text.push(byte[0]);
    }
    let text = String::from_utf8(text).unwrap();
    let (seconds, rest) = text.split_once(' ').unwrap();
    assert!(seconds.parse::<f64>().is_ok(), "{seconds}");
    assert_eq!(rest, "0164060000C800 >");
    host.say("< send 001 9 6 4 0 0 0 0 0 >");
    host.expect("< error Syntax error in send command >");
    host.say("< dance >");
    host.expect("< error unknown command >");
}

#[test]
fn buses_of_a_file_are_served_at_once() {
    let text = "
        [[bus]]
        name = 'segment'
        kind = 'rs485'
        baud = 115200
        endpoints = ['tcp:127.0.0.1:0']
        [[bus]]
        name = 'field'
        kind = 'can'
        endpoints = ['slcan:127.0.0.1:0']
        [[module]]
        name = 'x'
        bus = ['segment', 'field']
        module = 'tmcm-3351'
        [[module]]
        name = 'y'
        bus = 'segment'
        address = 3
        module = 'tmcm-3351'";
    let file = RigFile::parse(text).unwrap().unwrap();
    let served = Served::new(file.build().unwrap(), &file.endpoints());
    let (mut segment, mut field) = (served.host(0), served.host(1));
    field.say("O\rt001709090200000007\r"); // SGP 9, 2, 7
    field.expect("\rz\rt002701640900000007\r");
    for (address, value) in [(1, 7), (3, 0)] {
        segment.0.write_all(&[address, 10, 9, 2, 0, 0, 0, 0, 21 + address]).unwrap(); // GGP 9, 2
        let mut reply = [0; 9];
        segment.0.set_read_timeout(Some(Duration::from_secs(10))).unwrap();
        segment.0.read_exact(&mut reply).unwrap();
        assert_eq!((reply[1], reply[7]), (address, value));
    }
}

#[test]
fn flood_for_nobody_is_carried_to_its_end() {
    let text = "
        [[bus]]
        name = 'segment'
        kind = 'rs485'
        baud = 1_000_000
        endpoints = ['tcp:127.0.0.1:0']
        [[module]]
        name = 'x'
        bus = 'segment'
        module = 'tmcm-3351'";
    let file = RigFile::parse(text).unwrap().unwrap();
    let served = Served::new(file.build().unwrap(), &file.endpoints());
    let mut host = served.host(0);
    let to_nobody = [99, 10, 9, 2, 0, 0, 0, 0, 120];
    for _ in 0..3000 {
        host.0.write_all(&to_nobody).unwrap();
    }
    host.0.write_all(&[1, 10, 9, 2, 0, 0, 0, 0, 22]).unwrap();
    host.0.set_read_timeout(Some(Duration::from_secs(10))).unwrap();
    let mut reply = [0; 9];
    host.0.read_exact(&mut reply).unwrap();
    assert_eq!(reply[..3], [2, 1, 100]);
}
