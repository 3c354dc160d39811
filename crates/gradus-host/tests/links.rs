//! Sessions over real sockets and pseudo-terminals, with a small module of the test's own at the other end.

#![cfg(unix)]

use std::fs::File;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::os::unix::ffi::OsStringExt;
use std::path::PathBuf;
use std::thread;

use gradus_host::scan::{addresses, plan, scan};
use gradus_host::{Error, Line, Session, Url};
use gradus_tmcl::can::Frame;
use gradus_tmcl::slcan::{Command, LineReader, Text};
use gradus_tmcl::{Instruction, Opcode, Reply, Request, Status};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};

/// Answers `count` requests or until the line breaks: a GAP with its parameter number, anything else with its own value.
fn answer(Instruction { opcode, kind, value, .. }: Instruction) -> Reply {
    let value = if opcode == Opcode::GAP { i32::from(kind) } else { value };
    Reply { host: 2, module: 1, status: Status::OK, command: opcode, value }
}

fn serve(line: &mut (impl Read + Write), count: usize) {
    let mut bytes = [0; 9];
    for _ in 0..count {
        if line.read_exact(&mut bytes).is_err() {
            return;
        }
        let Ok(Request { instruction, .. }) = Request::parse(&bytes) else { return };
        if line.write_all(&answer(instruction).emit()).is_err() {
            return;
        }
    }
}

/// The answer of a module with CAN ID 1 that replies under 2.
fn answer_frame(request: &Frame) -> Option<Frame> {
    let instruction = request.instruction().filter(|_| request.id == 1)?;
    Some(request.answer(2, &answer(instruction)))
}

/// A serial CAN adapter, which knows no bit rate but 1 Mbit/s, with a module on its bus.
fn serve_slcan(line: &mut (impl Read + Write)) {
    let mut reader = LineReader::new();
    let mut byte = [0];
    while line.read_exact(&mut byte).is_ok() {
        let answer = match reader.push(byte[0]) {
            None => continue,
            Some(Ok(Command::Frame(frame))) => {
                let reply = answer_frame(&frame).map(|frame| Text::frame(&frame, None).bytes().to_vec());
                [b"z\r".to_vec(), reply.unwrap_or_default()].concat()
            }
            Some(Ok(Command::BitRate(1_000_000) | Command::Open | Command::Empty)) => b"\r".to_vec(),
            Some(_) => vec![7],
        };
        if line.write_all(&answer).is_err() {
            return;
        }
    }
}

/// A socketcand with one bus, `can0`.
fn serve_socketcand(stream: TcpStream) {
    let mut line = stream.try_clone().unwrap();
    line.write_all(b"< hi >").unwrap();
    for message in BufReader::new(stream).split(b'>').map_while(Result::ok) {
        let text = String::from_utf8(message).unwrap();
        let words: Vec<&str> = text.trim_start_matches(['<', ' ']).split_ascii_whitespace().collect();
        let answer = match words.as_slice() {
            ["open", "can0"] | ["rawmode"] => "< ok >".into(),
            ["send", id, _, bytes @ ..] => {
                let bytes: Vec<u8> = bytes.iter().map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect();
                let frame = Frame::new(u32::from_str_radix(id, 16).unwrap(), false, &bytes).unwrap();
                let Some(reply) = answer_frame(&frame) else { continue };
                let digits: String = reply.data().iter().map(|byte| format!("{byte:02X}")).collect();
                format!("< frame {:X} 1700000000.123456 {digits} >", reply.id)
            }
            _ => "< error unknown bus >".into(),
        };
        if line.write_all(answer.as_bytes()).is_err() {
            return;
        }
    }
}

/// A TCP server for one client, which answers through `serve`; gives back its port.
fn server(serve: impl FnOnce(TcpStream) + Send + 'static) -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    thread::spawn(move || serve(listener.accept().unwrap().0));
    port
}

fn tcp_module(serve: impl FnOnce(TcpStream) + Send + 'static) -> Url {
    format!("tcp:127.0.0.1:{}", server(serve)).parse().unwrap()
}

/// A pseudo-terminal: the module's end, and the path of the other one.
fn pty() -> (File, PathBuf) {
    let module = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
    grantpt(&module).unwrap();
    unlockpt(&module).unwrap();
    let path = ptsname(&module, Vec::new()).unwrap();
    (File::from(module), std::ffi::OsString::from_vec(path.into_bytes()).into())
}

fn ask_a_hundred(session: &mut Session) {
    for number in 0..100 {
        let value = session.command(Instruction::new(Opcode::GAP, number, 0, 0)).unwrap();
        assert_eq!(value, i32::from(number));
    }
}

fn failure(url: &str) -> String {
    Session::open(&url.parse().unwrap()).err().unwrap().to_string()
}

#[test]
fn tcp_carries_a_session() {
    let url = tcp_module(|mut stream| serve(&mut stream, usize::MAX));
    ask_a_hundred(&mut Session::open(&url).unwrap());
}

#[test]
fn a_pty_carries_a_session_at_any_rate() {
    for baud in [9600, 115_200, 1_000_000] {
        let (mut module, path) = pty();
        thread::spawn(move || serve(&mut module, usize::MAX));
        let url = format!("serial:{}?baud={baud}", path.display()).parse().unwrap();
        ask_a_hundred(&mut Session::open(&url).unwrap());
    }
}

#[test]
fn a_port_that_is_in_use_names_who_has_it_and_is_left_as_it_is() {
    let (mut module, path) = pty();
    thread::spawn(move || serve(&mut module, usize::MAX));
    let url = |baud: u32| format!("serial:{}?baud={baud}", path.display());
    let mut session = Session::open(&url(19_200).parse().unwrap()).unwrap();
    let message = failure(&url(9600));
    assert!(message.contains(&format!("in use by {} ", std::process::id())), "{message}");
    assert!(message.contains("see `gradus serve`"), "{message}");
    let settings = rustix::termios::tcgetattr(File::open(&path).unwrap()).unwrap();
    assert_eq!(settings.output_speed(), 19_200, "the rate is still that of the first one");
    ask_a_hundred(&mut session);
}

#[test]
fn a_line_takes_its_own_port_again() {
    let (mut module, path) = pty();
    let _plugged = File::options().read(true).write(true).open(&path).unwrap();
    thread::spawn(move || serve(&mut module, usize::MAX));
    let url: Url = path.to_str().unwrap().parse().unwrap();
    let line = Line::open(&url).unwrap();
    let mut session = Session::new(&line, url.address);
    ask_a_hundred(&mut session);
    line.reopen(&url).unwrap();
    ask_a_hundred(&mut session);
    let nowhere = "/dev/no-such-port".parse().unwrap();
    assert!(line.reopen(&nowhere).is_err());
    let error = session.command(Instruction::new(Opcode::GAP, 1, 0, 0)).unwrap_err();
    assert!(error.to_string().contains("the port is not open"), "{error}");
}

#[test]
fn an_slcan_adapter_carries_a_session_on_a_pty_and_over_tcp() {
    let (mut module, path) = pty();
    thread::spawn(move || serve_slcan(&mut module));
    let port = server(|mut stream| serve_slcan(&mut stream));
    for url in [format!("slcan:{}", path.display()), format!("slcan:127.0.0.1:{port}?id=1&reply=2")] {
        ask_a_hundred(&mut Session::open(&url.parse().unwrap()).unwrap());
    }
}

#[test]
fn a_socketcand_carries_a_session() {
    let url = format!("socketcand:127.0.0.1:{}/can0", server(serve_socketcand));
    ask_a_hundred(&mut Session::open(&url.parse().unwrap()).unwrap());
}

#[test]
fn a_bus_that_does_not_open_says_why() {
    let slcan = || server(|mut stream| serve_slcan(&mut stream));
    let cases = [
        (format!("slcan:127.0.0.1:{}?bitrate=500000", slcan()), "the adapter refuses the bit rate 500000"),
        (format!("slcan:127.0.0.1:{}?bitrate=123", slcan()), "no slcan adapter knows the bit rate 123"),
        (format!("slcan:127.0.0.1:{}?id=9&timeout=20", slcan()), "no module answers at CAN ID 9; check power, bus"),
        (format!("socketcand:127.0.0.1:{}/can7", server(serve_socketcand)), "is there such a bus?"),
        ("can:no-such-bus".into(), "cannot open can:no-such-bus: "),
    ];
    for (url, expected) in cases {
        let message = failure(&url);
        assert!(message.contains(expected), "{url}: {message}");
    }
}

#[test]
fn a_closed_connection_is_reported() {
    let url = tcp_module(|mut stream| serve(&mut stream, 3));
    let mut session = Session::open(&url).unwrap();
    let errors: Vec<Error> =
        (0..4).filter_map(|number| session.command(Instruction::new(Opcode::GAP, number, 0, 0)).err()).collect();
    assert!(matches!(errors[0], Error::Broken { .. }), "{errors:?}");
    assert!(errors[0].to_string().contains("the connection broke"), "{}", errors[0]);
}

#[test]
fn a_port_that_does_not_open_says_why() {
    let closed = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let file = tempfile::NamedTempFile::new().unwrap();
    let cases = [
        (format!("tcp:127.0.0.1:{closed}"), "nothing listens there"),
        ("tcp:no-such-host.invalid:4322".into(), "cannot open tcp:no-such-host.invalid:4322: "),
        ("/dev/no-such-port".into(), "there is no such file"),
        (file.path().display().to_string(), "this is not a serial port"),
    ];
    for (url, expected) in cases {
        let message = failure(&url);
        assert!(message.contains(expected), "{url}: {message}");
    }
}

/// The first part of a search: one question at every baud rate of a port behind which nobody answers.
#[test]
fn a_module_as_delivered_would_be_found_in_about_a_second() {
    let (_module, path) = pty();
    let url: Url = path.to_str().unwrap().parse().unwrap();
    let start = std::time::Instant::now();
    let legs = plan(&url, &addresses(&url));
    for leg in legs.iter().filter(|leg| leg.addresses == [1]) {
        assert_eq!(scan(&leg.line, leg.addresses.iter().copied(), |_| true).unwrap(), []);
    }
    println!("{:?}", start.elapsed());
    assert!(start.elapsed() < std::time::Duration::from_secs(5), "{:?}", start.elapsed());
}
