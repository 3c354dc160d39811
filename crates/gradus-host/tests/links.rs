//! Sessions over real sockets and pseudo-terminals, with a small module of the test's own at the other end.

#![cfg(unix)]

use std::fs::File;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::os::unix::ffi::OsStringExt;
use std::path::PathBuf;
use std::thread;

use gradus_host::{Error, Session, Url};
use gradus_tmcl::{Instruction, Opcode, Reply, Request, Status};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};

/// Answers `count` requests or until the line breaks: a GAP with its parameter number, anything else with its own value.
fn serve(line: &mut (impl Read + Write), count: usize) {
    let mut bytes = [0; 9];
    for _ in 0..count {
        if line.read_exact(&mut bytes).is_err() {
            return;
        }
        let Ok(Request { instruction, .. }) = Request::parse(&bytes) else { return };
        let Instruction { opcode, kind, value, .. } = instruction;
        let value = if opcode == Opcode::GAP { i32::from(kind) } else { value };
        let reply = Reply { host: 2, module: 1, status: Status::OK, command: opcode, value };
        if line.write_all(&reply.emit()).is_err() {
            return;
        }
    }
}

/// A TCP server for one client, which answers through `serve`.
fn tcp_module(serve: impl FnOnce(TcpStream) + Send + 'static) -> Url {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    thread::spawn(move || serve(listener.accept().unwrap().0));
    format!("tcp:127.0.0.1:{port}").parse().unwrap()
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
