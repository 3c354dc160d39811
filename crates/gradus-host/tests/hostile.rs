//! Peers that never stop sending, or never end what they began: every command ends within its time-out, and says why.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::thread;
use std::time::{Duration, Instant};

use gradus_host::{Error, Session, Terminal, Url};
use gradus_tmcl::{Instruction, Opcode, Reply, Status};

/// Time-out of an answer, in milliseconds.
const TIMEOUT: u64 = 200;
/// What a command may take: a time-out for the probe and its answer, the wait for silence, the last look at the line.
const LONGEST: Duration = Duration::from_millis(3000);

/// A TCP server for one client; gives back its port.
fn server(serve: impl FnOnce(TcpStream) + Send + 'static) -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    thread::spawn(move || serve(listener.accept().unwrap().0));
    port
}

/// Sends `bytes` again and again, until the client has gone.
fn flood(mut stream: TcpStream, bytes: &[u8]) {
    let many = bytes.repeat(4096 / bytes.len() + 1);
    while stream.write_all(&many).is_ok() {}
}

/// Waits for a request, and floods then.
fn flood_when_asked(mut stream: TcpStream, bytes: &[u8]) {
    stream.read_exact(&mut [0; 9]).unwrap();
    flood(stream, bytes);
}

fn reply(module: u8, status: Status, command: Opcode) -> Vec<u8> {
    Reply { host: 2, module, status, command, value: 1 }.emit().to_vec()
}

/// Answers a probe, and floods when it is asked for anything else.
fn flood_when_in_step(mut stream: TcpStream, bytes: &[u8]) {
    let mut request = [0; 9];
    stream.read_exact(&mut request).unwrap();
    let value = i32::from_be_bytes(request[4..8].try_into().unwrap());
    let probe = Reply { host: 2, module: 1, status: Status::WRONG_TYPE, command: Opcode::GET_INFO, value };
    stream.write_all(&probe.emit()).unwrap();
    flood_when_asked(stream, bytes);
}

/// A byte now and then, never nine of them without a pause between.
fn dribble(mut stream: TcpStream) {
    while stream.write_all(&[1]).is_ok() {
        thread::sleep(Duration::from_millis(40));
    }
}

fn url(scheme: &str, port: u16, rest: &str) -> Url {
    format!("{scheme}:127.0.0.1:{port}{rest}?timeout={TIMEOUT}").parse().unwrap()
}

/// Opens a session and asks for a parameter.
fn ask(url: &Url) -> Error {
    let asked = Session::open(url).and_then(|mut session| session.command(Instruction::new(Opcode::GAP, 1, 0, 0)));
    asked.unwrap_err()
}

fn in_time(url: &Url, ask: impl FnOnce(&Url) -> Error) -> String {
    let start = Instant::now();
    let error = ask(url).to_string();
    assert!(start.elapsed() < LONGEST, "{url}: {:?}, {error}", start.elapsed());
    error
}

#[test]
fn a_peer_that_never_stops_sending_is_told_apart_from_an_absent_module() {
    let foreign = reply(9, Status::OK, Opcode::GAP);
    for bytes in [vec![0], foreign, reply(1, Status::POSITION_REACHED, Opcode::POSITION_EVENT)] {
        for serve in [flood, flood_when_asked] {
            let bytes = bytes.clone();
            let error = in_time(&url("tcp", server(move |stream| serve(stream, &bytes)), ""), ask);
            assert!(error.contains("200 ms without a pause and answers nothing"), "{error}");
        }
    }
}

#[test]
fn a_module_that_begins_to_babble_is_no_answer() {
    for (bytes, expected) in [
        (vec![1, 2], "came damaged"),
        (reply(9, Status::OK, Opcode::GAP), "no answer to `GAP 1, 0` within 200 ms"),
        (reply(1, Status::POSITION_REACHED, Opcode::POSITION_EVENT), "no answer to `GAP 1, 0` within 200 ms"),
    ] {
        let port = server(move |stream| flood_when_in_step(stream, &bytes));
        let error = in_time(&url("tcp", port, ""), |url| {
            let mut session = Session::open(url).unwrap();
            session.set_retries(0);
            session.command(Instruction::new(Opcode::GAP, 1, 0, 0)).unwrap_err()
        });
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn a_peer_that_dribbles_is_no_module() {
    let error = in_time(&url("tcp", server(dribble), ""), ask);
    assert!(error.contains("no module answers at address 1") || error.contains("without a pause"), "{error}");
}

#[test]
fn an_slcan_adapter_that_never_ends_a_line_or_never_stops_is_left() {
    for bytes in [&b"t"[..], b"\r", b"z\r", b"\x07", b"t00a0\r", b"t00276402000000000000\r"] {
        in_time(&url("slcan", server(move |stream| flood(stream, bytes)), ""), ask);
    }
}

#[test]
fn a_socketcand_that_never_ends_its_text_or_never_stops_is_left() {
    let hello = |bytes: &'static [u8]| {
        move |mut stream: TcpStream| {
            stream.write_all(b"< hi >< ok >< ok >").unwrap();
            flood(stream, bytes);
        }
    };
    for bytes in [&b"<"[..], b"< frame 9 1.0 00 >", b"< ok >"] {
        in_time(&url("socketcand", server(hello(bytes)), "/can0"), ask);
    }
    let error = in_time(&url("socketcand", server(|stream| flood(stream, b"x")), "/can0"), ask);
    assert!(error.contains("does not speak socketcand"), "{error}");
}

#[test]
fn a_terminal_whose_module_never_ends_a_line_is_left() {
    for bytes in [&b"x"[..], b"\r", b"hello\r"] {
        let port = server(move |stream| flood_when_asked(stream, bytes));
        in_time(&url("tcp", port, ""), |url| Terminal::open(url).unwrap().ask("GAP 1, 0").unwrap_err());
    }
}
