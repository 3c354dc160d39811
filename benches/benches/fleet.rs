//! What a fleet costs: virtual TMCM-3351 in real time, a tenth of their axes moving, every axis asked for its position ten times a
//! second over TCP; and a fleet that rests, with a silent host at each module. The load is in percent of one processor, of the
//! server and of the host that asks.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::thread;
use std::time::{Duration, Instant};

use gradus_sim::{Bench, BusKind, Endpoint, Options, Rig, Serial, Server, allow_many_endpoints};
use gradus_tmcl::catalogue::TMCM_3351;
use gradus_tmcl::{Instruction, Request};
use rustix::time::{ClockId, clock_gettime};

const PERIOD: Duration = Duration::from_millis(100);
const MEASURED: Duration = Duration::from_secs(10);
const AXES: usize = 3;

fn main() {
    println!(
        "{:>8} {:>7} {:>8} {:>10} {:>9} {:>11} {:>10}",
        "modules", "moving", "polls/s", "server %", "host %", "worst ms", "MB"
    );
    for modules in [1, 10, 100, 300, 1000] {
        measure(modules, true);
    }
    measure(1000, false);
}

/// Seconds that this thread has had a processor.
fn thread_seconds() -> f64 {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

/// Memory of this process in MB, where the system tells it.
fn memory_mb() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap_or_default();
    line.trim().trim_end_matches(" kB").parse().map_or(f64::NAN, |kilobytes: f64| kilobytes / 1024.0)
}

fn server(modules: usize) -> Server {
    let mut rig = Rig::default();
    for index in 0..modules {
        let module = rig.add_module(&index.to_string(), Bench::rigid(&TMCM_3351));
        let bus = rig.add_bus(&index.to_string(), BusKind::Serial(Serial::USB));
        rig.connect(module, bus);
    }
    allow_many_endpoints(3 * modules);
    let mut server = Server::open(rig, &[], Options::default()).expect("a server opens");
    for bus in 0..modules {
        server.open_endpoint(bus, &Endpoint::Tcp(SocketAddr::from(([127, 0, 0, 1], 0)))).expect("there are ports");
    }
    server
}

fn datagram(command: &str) -> [u8; 9] {
    let instruction = Instruction::parse(command, &TMCM_3351).expect(command);
    Request { address: 1, instruction }.emit()
}

fn measure(modules: usize, busy: bool) {
    let before_mb = memory_mb();
    let mut server = server(modules);
    let addresses: Vec<SocketAddr> = server
        .endpoints()
        .iter()
        .filter_map(|endpoint| match endpoint {
            Endpoint::Tcp(address) => Some(*address),
            _ => None,
        })
        .collect();
    let stopper = server.stopper().expect("there are descriptors");
    let served = thread::spawn(move || {
        server.run(None).expect("the server runs");
        (thread_seconds(), server)
    });
    let mut hosts: Vec<TcpStream> = addresses.iter().map(|address| connect(*address)).collect();
    let moving = if busy { start_axes(&mut hosts) } else { 0 };
    let (host_seconds, start) = (thread_seconds(), Instant::now());
    let (polls, worst) = poll_all(if busy { &mut hosts } else { &mut [] }, start);
    let (host_seconds, seconds) = (thread_seconds() - host_seconds, start.elapsed().as_secs_f64());
    let used_mb = memory_mb() - before_mb;
    stopper.stop();
    let (server_seconds, _) = served.join().expect("the server ends");
    println!(
        "{modules:>8} {moving:>7} {:>8.0} {:>10.1} {:>9.1} {:>11.1} {used_mb:>10.0}",
        polls as f64 / seconds,
        server_seconds / seconds * 100.0,
        host_seconds / seconds * 100.0,
        worst.as_secs_f64() * 1e3,
    );
}

fn connect(address: SocketAddr) -> TcpStream {
    let stream = TcpStream::connect(address).expect("the server listens");
    stream.set_nodelay(true).expect("a TCP stream");
    stream
}

/// A tenth of all axes turn, each on another module as far as that goes.
fn start_axes(hosts: &mut [TcpStream]) -> usize {
    let moving = (hosts.len() * AXES).div_ceil(10);
    let count = hosts.len();
    for index in 0..moving {
        let host = &mut hosts[index % count];
        host.write_all(&datagram(&format!("ROR {}, 100000", index / count))).expect("the server lives");
        host.read_exact(&mut [0; 9]).expect("the module answers");
    }
    moving
}

/// Asks every axis once a period; how many answers came, and the longest time that one took.
fn poll_all(hosts: &mut [TcpStream], start: Instant) -> (usize, Duration) {
    let questions: Vec<u8> = (0..AXES).flat_map(|axis| datagram(&format!("GAP 1, {axis}"))).collect();
    let (mut answers, mut worst) = (0, Duration::ZERO);
    for round in 0.. {
        let due = start + round * PERIOD;
        thread::sleep(due.saturating_duration_since(Instant::now()));
        if start.elapsed() >= MEASURED {
            break;
        }
        let asked = Instant::now();
        for host in hosts.iter_mut() {
            host.write_all(&questions).expect("the server lives");
        }
        for host in hosts.iter_mut() {
            host.read_exact(&mut [0; 9 * AXES]).expect("the module answers");
            answers += AXES;
        }
        worst = worst.max(asked.elapsed());
    }
    (answers, worst)
}
