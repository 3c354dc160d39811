//! A command over TCP and over a pseudo-terminal, beside a bare echo of nine bytes on the same transport.

use std::fs::OpenOptions;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::os::fd::{AsFd, OwnedFd};
use std::path::{Path, PathBuf};
use std::thread::spawn;
use std::time::{Duration, Instant};

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

/// Batches of exchanges on each of the two ports.
const BATCHES: usize = 200;
const BATCH: u32 = 200;

/// Time of one exchange in a batch.
fn batch(port: &mut (impl Read + Write), datagram: &[u8; 9]) -> Duration {
    let start = Instant::now();
    for _ in 0..BATCH {
        exchange(port, datagram);
    }
    start.elapsed() / BATCH
}

/// Echo and command in turn, batch by batch, so that both see the same moods of the machine.
fn compare<P: Read + Write>(transport: &str, mut bare: P, mut command: P) {
    let datagram = Request { address: 1, instruction: Instruction::new(Opcode::GAP, 1, 0, 0) }.emit();
    let (mut echoes, mut commands): (Vec<_>, Vec<_>) =
        (0..BATCHES).map(|_| (batch(&mut bare, &datagram), batch(&mut command, &datagram))).unzip();
    let mut ratios: Vec<_> =
        echoes.iter().zip(&commands).map(|(echo, command)| echo.as_secs_f64() / command.as_secs_f64()).collect();
    echoes.sort();
    commands.sort();
    ratios.sort_by(f64::total_cmp);
    let (echo, command, ratio) = (echoes[BATCHES / 2], commands[BATCHES / 2], ratios[BATCHES / 2]);
    println!(
        "{transport:4} echo of nine bytes {echo:>10.2?}   GAP {command:>10.2?}   rate of GAP / rate of echo {ratio:.2}"
    );
}

/// Keeps this process on one processor: where the scheduler puts the two ends decides more than what they do.
#[cfg(target_os = "linux")]
fn stay_on_one_processor() {
    use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};
    let allowed = sched_getaffinity(None).expect("a process may ask that");
    let mut one = CpuSet::new();
    if let Some(first) = (0..CpuSet::MAX_CPU).find(|processor| allowed.is_set(*processor)) {
        one.set(first);
        sched_setaffinity(None, &one).expect("it is one of ours");
    }
}

#[cfg(not(target_os = "linux"))]
fn stay_on_one_processor() {}

fn main() {
    // `cargo test` starts benchmarks too, to see that they run; it does not pass `--bench`.
    if !std::env::args().any(|argument| argument == "--bench") {
        return;
    }
    stay_on_one_processor();
    if let Endpoint::Tcp(address) = serve(Endpoint::Tcp("127.0.0.1:0".parse().expect("an address"))) {
        compare("TCP", echo_over_tcp(), connect(address));
    }
    if let Endpoint::Pty(Some(path)) = serve(Endpoint::Pty(None)) {
        compare("pty", echo_over_pty(), open(&path));
    }
}
