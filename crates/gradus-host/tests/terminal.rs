//! Conversations in command lines.

use std::io::{Read, Write};
use std::net::TcpListener;
use std::thread::{self, JoinHandle};

use gradus_host::{Error, Terminal, Url};
use gradus_sim::Bench;
use gradus_tmcl::catalogue::{Gp, TMCM_351};
use gradus_tmcl::{Instruction, Opcode, Reply, Request, Status};

/// A module that expects these bytes, one after the other, and answers each with the bytes beside it.
fn module(script: Vec<(Vec<u8>, Vec<u8>)>) -> (Url, JoinHandle<()>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("tcp:{}?timeout=300", listener.local_addr().unwrap()).parse().unwrap();
    let thread = thread::spawn(move || {
        let (mut host, _) = listener.accept().unwrap();
        for (expected, answer) in script {
            let mut bytes = vec![0; expected.len()];
            host.read_exact(&mut bytes).unwrap();
            assert_eq!(bytes, expected);
            host.write_all(&answer).unwrap();
        }
        assert_eq!(host.read(&mut [0]).unwrap_or(0), 0, "the host says more");
    });
    (url, thread)
}

fn enter() -> Vec<u8> {
    Request { address: 1, instruction: Instruction::new(Opcode::ASCII_MODE, 0, 0, 0) }.emit().into()
}

fn entered(status: Status) -> Vec<u8> {
    Reply { host: 2, module: 1, status, command: Opcode::ASCII_MODE, value: 0 }.emit().into()
}

fn text(line: &str, answer: &str) -> (Vec<u8>, Vec<u8>) {
    (line.into(), answer.into())
}

#[test]
fn a_module_is_switched_over_and_back_and_echo_is_no_reply() {
    let (url, module) = module(vec![
        (enter(), entered(Status::OK)),
        text("AGAP 1, 0\r", "AGAP 1, 0\rBA 100 -7\r"),
        text("AGAP 99, 0\r", "BA 3 0\r"),
        text("ABIN\r", "BA 100 0\r"),
    ]);
    let mut terminal = Terminal::open(&url).unwrap();
    assert_eq!(terminal.ask("GAP 1, 0").unwrap().value, -7);
    assert_eq!(terminal.ask("GAP 99, 0").unwrap().status, Status::WRONG_TYPE);
    terminal.close().unwrap();
    module.join().unwrap();
}

#[test]
fn a_module_that_is_in_ascii_mode_stays_there() {
    let (url, module) = module(vec![
        (enter(), vec![]),
        text("\r", ""),
        text("AGAP 1, 0\r", "BA 100 5\r"),
        text("AMST 0\r", "BA 100 0\r"),
    ]);
    let mut terminal = Terminal::open(&url).unwrap();
    assert_eq!(terminal.ask("GAP 1, 0").unwrap().value, 5);
    terminal.ask("MST 0").unwrap();
    terminal.close().unwrap();
    module.join().unwrap();

    let mut bench = Bench::with_defaults(&TMCM_351);
    assert!(bench.set_global(Gp::AsciiMode, 1));
    bench.power_off();
    bench.power_on();
    assert_eq!(Terminal::on_bench(bench).ask("GAP 6, 0").unwrap().value, 255);
}

#[test]
fn after_bin_the_next_line_switches_over_again() {
    let (url, module) = module(vec![
        (enter(), entered(Status::OK)),
        text("ABIN\r", "BA 100 0\r"),
        (enter(), entered(Status::OK)),
        text("AMST 0\r", "BA 100 0\r"),
        text("ABIN\r", "BA 100 0\r"),
    ]);
    let mut terminal = Terminal::open(&url).unwrap();
    terminal.ask("BIN").unwrap();
    terminal.ask("MST 0").unwrap();
    terminal.close().unwrap();
    module.join().unwrap();
}

#[test]
fn what_goes_wrong_has_a_name() {
    let (url, _module) = module(vec![(enter(), entered(Status::NOT_AVAILABLE))]);
    let error = Terminal::open(&url).unwrap().ask("GAP 1, 0").unwrap_err();
    assert!(matches!(error, Error::Refused { status: Status::NOT_AVAILABLE, .. }), "{error}");

    let (url, _module) = module(vec![(enter(), vec![]), text("\r", ""), text("AGAP 1, 0\r", "noise\r")]);
    let error = Terminal::open(&url).unwrap().ask("GAP 1, 0").unwrap_err();
    assert!(matches!(error, Error::NoModule { .. }), "{error}");

    let (url, _module) = module(vec![(enter(), entered(Status::OK)), text("AGAP 1, 0\r", "BA 100")]);
    let error = Terminal::open(&url).unwrap().ask("GAP 1, 0").unwrap_err();
    assert!(matches!(error, Error::Silent { .. }), "{error}");
}
