//! Real hosts at a served bench: sockets, terminals, the console, the clock.
#![cfg(unix)]

use std::fs::File;
use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use gradus_sim::{Bench, Console, Eeprom, Endpoint, Machine, Options, ServeError, Server, Speed, Stopper};
use gradus_tmcl::catalogue::{TMCM_351, TMCM_3351};
use gradus_tmcl::{
    Bulk, CaptureAction, CaptureSource, CaptureState, CaptureTrigger, Instruction, Opcode, Reply, Request, Status,
};
use rustix::event::{PollFd, PollFlags, Timespec, poll};

/// Long enough for the slowest computer, short enough to notice.
const PATIENCE: Duration = Duration::from_secs(10);

/// A server in a thread of its own; it ends with its owner.
struct Served {
    endpoints: Vec<Endpoint>,
    stopper: Stopper,
    thread: Option<JoinHandle<Result<(), ServeError>>>,
}

impl Served {
    fn new(speed: Speed, console: Option<Console>) -> Self {
        Self::bench(Bench::with_defaults(&TMCM_3351), speed, console)
    }

    fn bench(bench: Bench, speed: Speed, console: Option<Console>) -> Self {
        let endpoints = [Endpoint::Pty(None), Endpoint::Tcp("127.0.0.1:0".parse().unwrap())];
        let mut server = Server::open(bench, &endpoints, Options { speed, allow_remote: false }).unwrap();
        let (endpoints, stopper) = (server.endpoints().to_vec(), server.stopper().unwrap());
        let thread = Some(thread::spawn(move || server.run(console)));
        Self { endpoints, stopper, thread }
    }

    fn real_time() -> Self {
        Self::new(Speed::default(), None)
    }

    fn address(&self) -> SocketAddr {
        let address = |endpoint: &Endpoint| match endpoint {
            Endpoint::Tcp(address) => Some(*address),
            _ => None,
        };
        self.endpoints.iter().find_map(address).unwrap()
    }

    fn terminal(&self) -> PathBuf {
        let path = |endpoint: &Endpoint| match endpoint {
            Endpoint::Pty(path) => path.clone(),
            _ => None,
        };
        self.endpoints.iter().find_map(path).unwrap()
    }

    fn tcp(&self) -> TcpStream {
        let stream = TcpStream::connect(self.address()).unwrap();
        stream.set_nodelay(true).unwrap();
        stream
    }

    fn pty(&self) -> File {
        File::options().read(true).write(true).open(self.terminal()).unwrap()
    }

    fn stop(mut self) -> Result<(), ServeError> {
        self.stopper.stop();
        self.thread.take().unwrap().join().unwrap()
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        self.stopper.stop();
    }
}

/// Any stream to a module.
trait Host: Read + Write + std::os::fd::AsFd {}
impl<T: Read + Write + std::os::fd::AsFd> Host for T {}

fn datagram(opcode: Opcode, kind: u8, motor: u8, value: i32) -> [u8; 9] {
    Request { address: 1, instruction: Instruction { opcode, kind, motor, value } }.emit()
}

fn is_readable(host: &impl Host, within: Duration) -> bool {
    let mut descriptors = [PollFd::new(host, PollFlags::IN)];
    poll(&mut descriptors, Some(&Timespec::try_from(within).unwrap())).unwrap() > 0
}

fn reply(host: &mut impl Host) -> Reply {
    let mut bytes = [0; 9];
    for byte in &mut bytes {
        assert!(is_readable(host, PATIENCE), "no reply");
        host.read_exact(std::slice::from_mut(byte)).unwrap();
    }
    Reply::parse(&bytes).unwrap()
}

fn ask(host: &mut impl Host, opcode: Opcode, kind: u8, motor: u8, value: i32) -> i32 {
    host.write_all(&datagram(opcode, kind, motor, value)).unwrap();
    let reply = reply(host);
    assert_eq!((reply.status, reply.command), (Status::OK, opcode));
    reply.value
}

fn wait_until(what: &str, mut holds: impl FnMut() -> bool) {
    let start = Instant::now();
    while !holds() {
        assert!(start.elapsed() < PATIENCE, "waited in vain for {what}");
        thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn hosts_on_tcp_and_terminal_are_answered() {
    let served = Served::real_time();
    for value in [1, -1, i32::MAX] {
        assert_eq!(ask(&mut served.tcp(), Opcode::SGP, 9, 2, value), value);
        assert_eq!(ask(&mut served.pty(), Opcode::GGP, 9, 2, 0), value);
    }
    served.stop().unwrap();
}

#[test]
fn samples_of_a_bulk_download_come_behind_their_reply() {
    let served = Served::real_time();
    let mut host = served.tcp();
    let mut capture = |action: CaptureAction, motor, value| ask(&mut host, Opcode::CAPTURE, action.0, motor, value);
    capture(CaptureAction::SET_LENGTH, 0, 40);
    capture(CaptureAction::SET_CHANNEL, CaptureSource::TIME.0, 0);
    capture(CaptureAction::ENABLE_TRIGGER, CaptureTrigger::UNCONDITIONAL.0, 0);
    wait_until("the samples", || capture(CaptureAction::GET_STATE, 0, 0) == CaptureState::COMPLETE.0.into());
    let samples: Vec<i32> = (0..40).map(|index| capture(CaptureAction::GET_SAMPLE, 0, index)).collect();
    let mut host = served.pty();
    for (index, count) in [(0, 40), (30, 10)] {
        assert_eq!(ask(&mut host, Opcode::CAPTURE, CaptureAction::BULK_DOWNLOAD.0, 0, index), count);
        let expected = Bulk::new(samples[index as usize..].iter().copied());
        let mut bytes = vec![0; expected.bytes().len()];
        host.read_exact(&mut bytes).unwrap();
        assert_eq!(bytes, expected.bytes(), "from {index}");
    }
    assert_eq!(ask(&mut host, Opcode::SGP, 9, 2, 7), 7, "and the line is in step");
}

#[test]
fn a_bulk_download_is_refused_on_tcp() {
    let served = Served::real_time();
    let mut host = served.tcp();
    ask(&mut host, Opcode::CAPTURE, CaptureAction::SET_CHANNEL.0, CaptureSource::TIME.0, 0);
    ask(&mut host, Opcode::CAPTURE, CaptureAction::SET_LENGTH.0, 0, 1);
    ask(&mut host, Opcode::CAPTURE, CaptureAction::ENABLE_TRIGGER.0, 0, 0);
    host.write_all(&datagram(Opcode::CAPTURE, CaptureAction::BULK_DOWNLOAD.0, 0, 0)).unwrap();
    assert_eq!(reply(&mut host).status, Status::NOT_AVAILABLE);
}

/// What comes up to the second CR, which ends the reply after the echo.
fn echo_and_reply(host: &mut impl Host) -> String {
    let mut bytes = Vec::new();
    while bytes.iter().filter(|byte| **byte == b'\r').count() < 2 {
        assert!(is_readable(host, PATIENCE), "only {}", bytes.escape_ascii());
        let mut byte = [0];
        host.read_exact(&mut byte).unwrap();
        bytes.extend(byte);
    }
    String::from_utf8(bytes).unwrap()
}

#[test]
fn command_lines_are_answered_however_slowly_they_are_typed() {
    let served = Served::bench(Bench::with_defaults(&TMCM_351), Speed::default(), None);
    ask(&mut served.tcp(), Opcode::ASCII_MODE, 0, 0, 0);
    for mut host in [File::from(OwnedFd::from(served.tcp())), served.pty()] {
        host.write_all(b"A MVX").unwrap();
        thread::sleep(Duration::from_millis(70));
        host.write_all(b"\x08P REL, 1, -5").unwrap();
        host.write_all(b"000\r").unwrap();
        let heard = echo_and_reply(&mut host);
        let reply = heard.strip_prefix("A MVX\x08 \x08P REL, 1, -5000\rBA 100 ");
        assert!(reply.is_some_and(|value| value.trim_end().parse::<i32>().is_ok()), "{heard:?}");
    }
    let mut host = served.tcp();
    host.write_all(b"A BIN\r").unwrap();
    assert_eq!(echo_and_reply(&mut host), "A BIN\rBA 100 0\r");
    assert_eq!(ask(&mut host, Opcode::SGP, 9, 2, 5), 5);
}

#[test]
fn each_host_gets_the_replies_to_its_own_requests() {
    let served = Served::real_time();
    let hosts = (0..20).map(|host| {
        let mut stream = served.tcp();
        thread::spawn(move || {
            for round in 0..200 {
                let variable = 100 + host;
                assert_eq!(ask(&mut stream, Opcode::SGP, variable, 2, round), round);
                assert_eq!(ask(&mut stream, Opcode::GGP, variable, 2, 0), round);
            }
        })
    });
    for host in hosts.collect::<Vec<_>>() {
        host.join().unwrap();
    }
}

#[test]
fn many_requests_at_once_are_answered_in_order() {
    let served = Served::real_time();
    let requests: Vec<u8> = (0..5000).flat_map(|value| datagram(Opcode::SGP, 9, 2, value)).collect();
    for host in [OwnedFd::from(served.tcp()), OwnedFd::from(served.pty())] {
        let (mut writer, mut reader) = (File::from(host.try_clone().unwrap()), File::from(host));
        let requests = requests.clone();
        let sender = thread::spawn(move || writer.write_all(&requests).unwrap());
        for value in 0..5000 {
            assert_eq!(reply(&mut reader).value, value);
        }
        sender.join().unwrap();
    }
}

#[test]
fn event_goes_to_the_host_that_asked_for_it() {
    let served = Served::new(Speed::Max, None);
    let (mut mover, mut listener) = (served.tcp(), served.tcp());
    ask(&mut listener, Opcode::POSITION_EVENT, 0, 0, 1);
    ask(&mut mover, Opcode::MVP, 0, 0, 5000);
    assert_eq!(reply(&mut listener).status, Status::POSITION_REACHED);
    assert_eq!(ask(&mut mover, Opcode::GAP, 1, 0, 0), 5000);
    assert!(!is_readable(&mover, Duration::ZERO));
}

#[test]
fn split_datagram_is_put_together() {
    let served = Served::real_time();
    let mut host = served.tcp();
    let bytes = datagram(Opcode::GAP, 4, 0, 0);
    for part in [&bytes[..1], &bytes[1..8], &bytes[8..]] {
        host.write_all(part).unwrap();
        thread::sleep(Duration::from_millis(3));
    }
    assert_eq!(reply(&mut host).command, Opcode::GAP);
}

#[test]
fn pause_inside_a_datagram_discards_its_beginning() {
    for speed in [Speed::Factor(1.0), Speed::Factor(100.0), Speed::Max] {
        let served = Served::new(speed, None);
        let mut host = served.tcp();
        host.write_all(&[1, 2, 3]).unwrap();
        // Once another host is answered, the server has read the beginning, however busy the computer is.
        ask(&mut served.tcp(), Opcode::SGP, 8, 2, 4);
        thread::sleep(Duration::from_millis(80));
        assert_eq!(ask(&mut host, Opcode::SGP, 9, 2, 5), 5, "{speed}");
    }
}

#[test]
fn host_that_never_reads_disturbs_nobody() {
    let served = Served::real_time();
    let mut deaf = served.tcp();
    deaf.set_nonblocking(true).unwrap();
    let flood: Vec<u8> = datagram(Opcode::GAP, 4, 0, 0).repeat(10_000);
    let start = Instant::now();
    let mut stuck = false;
    while !stuck && start.elapsed() < PATIENCE {
        stuck = deaf.write(&flood).is_err_and(|error| error.kind() == ErrorKind::WouldBlock);
        assert_eq!(ask(&mut served.tcp(), Opcode::SGP, 9, 2, 5), 5);
    }
    assert!(stuck, "the server buffers without end");
    assert_eq!(ask(&mut served.pty(), Opcode::SGP, 9, 2, 6), 6);
}

#[test]
fn hosts_that_come_and_go_leave_nothing_behind() {
    let served = Served::real_time();
    for round in 0..300 {
        assert_eq!(ask(&mut served.tcp(), Opcode::SGP, 9, 2, round), round);
        drop(served.tcp());
        assert_eq!(ask(&mut served.pty(), Opcode::GGP, 9, 2, 0), round);
    }
}

#[test]
fn terminal_is_raw_for_every_host() {
    let served = Served::real_time();
    for value in [0x0a0d_0304, 0x1113_1a00, 0x7f08_1b1c, 0x0d0d_0a0a] {
        assert_eq!(ask(&mut served.pty(), Opcode::SGP, 9, 2, value), value);
    }
}

#[test]
fn terminal_takes_the_settings_of_a_serial_port() {
    use rustix::termios::{OptionalActions, QueueSelector, tcflush, tcgetattr, tcsetattr};
    let served = Served::real_time();
    for baud in [9600, 115_200] {
        let mut host = served.pty();
        let mut settings = tcgetattr(&host).unwrap();
        settings.make_raw();
        settings.set_speed(baud).unwrap();
        tcsetattr(&host, OptionalActions::Now, &settings).unwrap();
        tcflush(&host, QueueSelector::IOFlush).unwrap();
        assert_eq!(ask(&mut host, Opcode::SGP, 9, 2, baud as i32), baud as i32);
    }
}

#[cfg(target_os = "linux")]
#[test]
fn replies_that_a_gone_host_left_do_not_greet_the_next_one() {
    let served = Served::real_time();
    for round in 0..20 {
        let mut hasty = served.pty();
        hasty.write_all(&datagram(Opcode::GAP, 4, 0, 0).repeat(10)).unwrap();
        hasty.write_all(&[1, 2, 3]).unwrap();
        thread::sleep(Duration::from_millis(20));
        assert!(is_readable(&hasty, PATIENCE));
        drop(hasty);
        thread::sleep(Duration::from_millis(20));
        assert_eq!(ask(&mut served.pty(), Opcode::SGP, 9, 2, round), round);
    }
}

#[test]
fn link_to_the_terminal_goes_with_the_server() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("module");
    let endpoint = Endpoint::Pty(Some(path.clone()));
    let bench = Bench::with_defaults(&TMCM_3351);
    let mut server = Server::open(bench, std::slice::from_ref(&endpoint), Options::default()).unwrap();
    assert_eq!(server.endpoints(), [endpoint]);
    let stopper = server.stopper().unwrap();
    let thread = thread::spawn(move || server.run(None));
    let mut host = File::options().read(true).write(true).open(&path).unwrap();
    assert_eq!(ask(&mut host, Opcode::SGP, 9, 2, 8), 8);
    stopper.stop();
    thread.join().unwrap().unwrap();
    assert!(path.symlink_metadata().is_err());
}

#[test]
fn signal_ends_the_server() {
    let mut server = Server::open(Bench::with_defaults(&TMCM_3351), &[], Options::default()).unwrap();
    server.stop_on_signals().unwrap();
    let thread = thread::spawn(move || server.run(None));
    signal_hook::low_level::raise(signal_hook::consts::SIGTERM).unwrap();
    thread.join().unwrap().unwrap();
}

#[test]
fn console_works_the_machine_and_may_end() {
    let (mut operator, input) = UnixStream::pair().unwrap();
    let (mut answers, output) = UnixStream::pair().unwrap();
    let (mut messages, errors) = UnixStream::pair().unwrap();
    let console = Console::new(input.into(), Box::new(output), Box::new(errors));
    let served = Served::new(Speed::default(), Some(console));
    let mut host = served.tcp();

    operator.write_all(b"in 3 1\nin 5 1").unwrap();
    wait_until("input 3", || ask(&mut host, Opcode::GIO, 3, 0, 0) == 1);
    assert_eq!(ask(&mut host, Opcode::GIO, 5, 0, 0), 0, "the line has not ended");
    operator.write_all(b"\r\nnonsense\nswitch 0 left 1\nhelp\n").unwrap();
    wait_until("the left switch", || ask(&mut host, Opcode::GAP, 11, 0, 0) == 1);
    assert_eq!(ask(&mut host, Opcode::GIO, 5, 0, 0), 1);
    operator.write_all(b"in 3 0").unwrap();
    drop(operator);
    wait_until("the last line", || ask(&mut host, Opcode::GIO, 3, 0, 0) == 0);
    assert_eq!(ask(&mut host, Opcode::SGP, 9, 2, 7), 7, "the server outlives its console");

    served.stop().unwrap();
    let (mut said, mut complained) = (String::new(), String::new());
    answers.read_to_string(&mut said).unwrap();
    messages.read_to_string(&mut complained).unwrap();
    assert!(said.starts_with("in PORT"), "{said}");
    assert_eq!(complained, "there is no command `nonsense`; `help` lists them\n");
}

#[test]
fn virtual_time_follows_the_wall_clock() {
    for factor in [1.0, 0.2, 20.0] {
        let served = Served::new(Speed::Factor(factor), None);
        let mut host = served.tcp();
        let (wall, virtual_ms) = (Instant::now(), ask(&mut host, Opcode::GGP, 132, 0, 0));
        thread::sleep(Duration::from_millis(300));
        let passed_ms = f64::from(ask(&mut host, Opcode::GGP, 132, 0, 0) - virtual_ms);
        let expected_ms = wall.elapsed().as_secs_f64() * 1e3 * factor;
        // Both requests take some wall time on a busy computer.
        assert!((passed_ms - expected_ms).abs() < 2.0 + 100.0 * factor, "{passed_ms} ms of {expected_ms} ms");
    }
}

#[test]
fn axes_move_while_nobody_talks() {
    let served = Served::real_time();
    let mut host = served.tcp();
    ask(&mut host, Opcode::SAP, 4, 0, 100_000);
    ask(&mut host, Opcode::SAP, 5, 0, 1_000_000);
    ask(&mut host, Opcode::POSITION_EVENT, 0, 0, 1);
    let start = Instant::now();
    ask(&mut host, Opcode::MVP, 0, 0, 20_000);
    assert_eq!(reply(&mut host).status, Status::POSITION_REACHED);
    // 20000 microsteps at 100000 pps with ramps of 0.1 s: 0.3 s.
    assert!(start.elapsed() >= Duration::from_millis(295), "after {:?}", start.elapsed());
    assert_eq!(ask(&mut host, Opcode::GAP, 1, 0, 0), 20_000);
}

#[test]
fn at_full_speed_a_minute_passes_at_once() {
    let served = Served::new(Speed::Max, None);
    let mut host = served.tcp();
    ask(&mut host, Opcode::SAP, 4, 0, 1000);
    let start = Instant::now();
    ask(&mut host, Opcode::MVP, 0, 0, 60_000);
    wait_until("the target", || ask(&mut host, Opcode::GAP, 8, 0, 0) == 1);
    assert!(start.elapsed() < PATIENCE);
    assert!(ask(&mut host, Opcode::GGP, 132, 0, 0) >= 60_000);
}

#[test]
fn acknowledged_value_is_in_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("eeprom");
    let bench = Bench::new(&TMCM_3351, Machine::of(&TMCM_3351), Eeprom::open(&path, &TMCM_3351).unwrap());
    let served = Served::bench(bench, Speed::default(), None);
    let mut host = served.tcp();
    for value in 0..50 {
        ask(&mut host, Opcode::SGP, 7, 2, value);
        ask(&mut host, Opcode::STGP, 7, 2, 0);
        // What a simulator would find that is started after this one is killed now.
        let cells = std::fs::read(&path).unwrap();
        let later = Bench::new(&TMCM_3351, Machine::of(&TMCM_3351), Eeprom::with_cells(&cells));
        let later = Served::bench(later, Speed::default(), None);
        assert_eq!(ask(&mut later.tcp(), Opcode::GGP, 7, 2, 0), value);
    }
}
