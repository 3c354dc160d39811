//! A command over TCP and over a pseudo-terminal, beside a bare echo of nine bytes on the same transport.

use std::fs::OpenOptions;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::os::fd::{AsFd, OwnedFd};
use std::path::{Path, PathBuf};
use std::thread::spawn;

use criterion::{Criterion, criterion_group, criterion_main};
use gradus_sim::{Bench, Endpoint, Options, Server};
use gradus_tmcl::catalogue::TMCM_3351;
use gradus_tmcl::{Instruction, Opcode, Request};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

/// Serves a module on an endpoint for as long as the benchmark runs, and says where.
fn serve(endpoint: Endpoint) -> Endpoint {
    let mut server = Server::open(Bench::with_defaults(&TMCM_3351), &[endpoint], Options::default()).expect("it opens");
    let opened = server.endpoints()[0].clone();
    spawn(move || server.run(None));
    opened
}

fn echo(mut port: impl Read, mut back: impl Write) {
    let mut bytes = [0; 9];
    while port.read_exact(&mut bytes).is_ok() && back.write_all(&bytes).is_ok() {}
}

fn exchange(port: &mut (impl Read + Write), datagram: &[u8; 9]) -> [u8; 9] {
    let mut reply = [0; 9];
    port.write_all(datagram).expect("the other end listens");
    port.read_exact(&mut reply).expect("the other end answers");
    reply
}

fn connect(address: SocketAddr) -> TcpStream {
    let stream = TcpStream::connect(address).expect("it listens");
    stream.set_nodelay(true).expect("TCP has it");
    stream
}

fn echo_over_tcp() -> TcpStream {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port is free");
    let address = listener.local_addr().expect("it is bound");
    spawn(move || {
        let (stream, _) = listener.accept().expect("a client comes");
        stream.set_nodelay(true).expect("TCP has it");
        echo(&stream, &stream);
    });
    connect(address)
}

fn raw(terminal: impl AsFd) {
    let mut settings = tcgetattr(&terminal).expect("it is a terminal");
    settings.make_raw();
    tcsetattr(terminal, OptionalActions::Now, &settings).expect("it is ours");
}

fn open(path: &Path) -> std::fs::File {
    let file = OpenOptions::new().read(true).write(true).open(path).expect("the terminal exists");
    raw(&file);
    file
}

fn echo_over_pty() -> std::fs::File {
    let master: OwnedFd = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).expect("a terminal is free");
    grantpt(&master).and_then(|()| unlockpt(&master)).expect("it is ours");
    let path = ptsname(&master, Vec::new()).expect("it has a name").into_string().expect("in ASCII");
    let client = open(&PathBuf::from(path));
    let master = std::fs::File::from(master);
    spawn(move || echo(&master, &master));
    client
}

fn transport(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("transport");
    group.sample_size(30);
    let datagram = Request { address: 1, instruction: Instruction::new(Opcode::GAP, 1, 0, 0) }.emit();

    let Endpoint::Tcp(address) = serve(Endpoint::Tcp("127.0.0.1:0".parse().expect("an address"))) else { return };
    let (mut command, mut bare) = (connect(address), echo_over_tcp());
    group.bench_function("TCP, bare echo", |bencher| bencher.iter(|| exchange(&mut bare, &datagram)));
    group.bench_function("TCP, GAP", |bencher| bencher.iter(|| exchange(&mut command, &datagram)));

    let Endpoint::Pty(Some(path)) = serve(Endpoint::Pty(None)) else { return };
    let (mut command, mut bare) = (open(&path), echo_over_pty());
    group.bench_function("pty, bare echo", |bencher| bencher.iter(|| exchange(&mut bare, &datagram)));
    group.bench_function("pty, GAP", |bencher| bencher.iter(|| exchange(&mut command, &datagram)));
    group.finish();
}

criterion_group!(benches, transport);
criterion_main!(benches);
