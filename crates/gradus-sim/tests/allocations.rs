//! Once a module runs, nothing it does takes memory from the heap.

use allocation_counter::measure;
use gradus_sim::console::Change;
use gradus_sim::{Bench, BenchFile, Eeprom, Link, LinkKind};
use gradus_tmcl::catalogue::{TMCM_351, TMCM_1617, TMCM_3351};
use gradus_tmcl::{Instruction, Reply, Request, Status};

const SECOND_US: u64 = 1_000_000;

/// A module with a host that allocates nothing itself.
struct Host {
    bench: Bench,
    link: Link,
}

impl Host {
    fn new() -> Self {
        Self::at(Bench::rigid(&TMCM_3351))
    }

    fn at(mut bench: Bench) -> Self {
        let link = bench.attach(LinkKind::Usb, 0);
        Self { bench, link }
    }

    /// With a program that runs.
    fn running(program: &[&str]) -> Self {
        let mut host = Self::new();
        host.all(&["DATA 132, 0, 0, 0"]);
        host.all(program);
        host.all(&["DATA 133, 0, 0, 0", "DATA 129, 1, 0, 0"]);
        host
    }

    fn all(&mut self, commands: &[&str]) {
        for command in commands {
            self.send(&datagram(command));
            assert!(self.answer().is_some_and(Status::is_ok), "{command}");
        }
    }

    fn send(&mut self, datagram: &[u8; 9]) {
        self.bench.send(&mut self.link, datagram);
    }

    fn answer(&mut self) -> Option<Status> {
        self.bench.take(&mut self.link).map(|reply| Status(reply[2]))
    }
}

fn datagram(command: &str) -> [u8; 9] {
    let instruction = Instruction::parse(command, &TMCM_3351).unwrap();
    Request { address: 1, instruction }.emit()
}

/// How often the heap is asked for memory.
fn allocations(work: impl FnOnce()) -> u64 {
    measure(work).count_total
}

#[test]
fn commands_allocate_nothing() {
    let commands = [
        "GAP 1, 0",
        "SAP 4, 0, 20000",
        "MVP ABS, 0, 51200",
        "MVP REL, 1, -100",
        "SCO 1, 0, 1000",
        "SCO 1, 1, 1000",
        "MVP COORD, $43, 1",
        "ROR 2, 5000",
        "MST 2",
        "RFS START, 2",
        "RFS STOP, 2",
        "SIO 0, 2, 1",
        "GIO 0, 1",
        "GIO 255, 0",
        "SGP 7, 2, 42",
        "STGP 7, 2",
        "RSGP 7, 2",
        "SGP 77, 0, 1",
        "SCO 2, 255, 0",
        "CALC ADD, 1",
        "VECT 0, 5",
        "EI 0",
        "DI 0",
        "DATA 132, 0, 0, 0",
        "MVP ABS, 0, 51200",
        "DATA 133, 0, 0, 0",
        "DATA 134, 0, 0, 0",
        "DATA 135, 1, 0, 0",
        "DATA 136, 0, 0, 0",
        "DATA 138, 0, 0, 7",
        "DATA 141, 0, 0, 3",
        "GAP 1, 9",
        "DATA 99, 0, 0, 0",
    ];
    let mut host = Host::new();
    for command in commands {
        let bytes = datagram(command);
        let count = allocations(|| {
            host.send(&bytes);
            assert!(host.answer().is_some());
            host.bench.run_for(1000);
        });
        assert_eq!(count, 0, "{command}");
    }
}

#[test]
fn values_that_are_stored_allocate_nothing() {
    let mut host = Host::new();
    let written = host.bench.eeprom().total_writes();
    let values = ["SGP 76, 0, 2", "SGP 76, 0, 3"].map(datagram);
    let count = allocations(|| {
        for value in values.iter().cycle().take(1000) {
            host.send(value);
            assert_eq!(host.answer(), Some(Status::OK));
        }
    });
    assert_eq!(count, 0);
    assert!(host.bench.eeprom().total_writes() >= written + 1000);
}

#[test]
fn moving_axes_and_their_events_allocate_nothing() {
    for bench in [Bench::rigid(&TMCM_3351), Bench::with_defaults(&TMCM_3351)] {
        let mut host = Host::at(bench);
        let moves = [[51_200, -25_600, 7], [0, 0, 0]]
            .map(|targets| [0, 1, 2].map(|axis| datagram(&format!("MVP ABS, {axis}, {}", targets[axis]))));
        host.all(&["DATA 138, 1, 0, 7", "SAP 12, 0, 3", "SAP 200, 1, 255", "SAP 212, 2, 1000"]);
        let mut events = 0;
        let count = allocations(|| {
            for targets in moves.iter().cycle().take(10) {
                for command in targets {
                    host.send(command);
                    assert_eq!(host.answer(), Some(Status::OK));
                }
                host.bench.run_for(5 * SECOND_US);
                while host.answer() == Some(Status::POSITION_REACHED) {
                    events += 1;
                }
            }
        });
        assert_eq!((count, events), (0, 10));
    }
}

/// StallGuard2, CoolStep, StealthChop, currents with inductance, contacts that bounce, a load that changes, warmth.
#[test]
fn motors_with_all_that_belongs_to_them_allocate_nothing() {
    let file = BenchFile::parse(
        "module = 'tmcm-3351'\n[axis.0]\ncurrents = 'electrical'\n[axis.1.travel.home]\nat = 1\nwidth = 1\nbounce = 0.01",
    );
    let mut host = Host::at(file.unwrap().build(Eeprom::of(&TMCM_3351)));
    host.all(&["SAP 172, 0, 2", "SAP 182, 0, 100", "SAP 173, 0, 1", "SAP 187, 2, 4", "SAP 181, 1, 100000"]);
    host.all(&["ROR 0, 51200", "ROR 1, 25600", "ROR 2, 51200"]);
    for (at_us, line) in [(SECOND_US, "load 0 0.3"), (2 * SECOND_US, "block 1"), (3 * SECOND_US, "push 2 90")] {
        host.bench.schedule(at_us, Change::parse(line, &TMCM_3351).unwrap());
    }
    assert_eq!(allocations(|| host.bench.run_for(10 * SECOND_US)), 0);
}

#[test]
fn programs_with_interrupts_allocate_nothing() {
    let mut host = Host::running(&[
        "VECT 0, 13",
        "SGP 0, 3, 7",
        "EI 0",
        "EI 255",
        "CALC ADD, 1",
        "AGP 1, 2",
        "MVP REL, 0, 1000",
        "WAIT POS, 0, 0",
        "GAP 1, 0",
        "COMP 5000",
        "JC LT, 4",
        "CSUB 16",
        "JA 4",
        "CALCV ADD, 0, 1",
        "SIO 0, 2, 1",
        "RETI",
        "SGP 75, 0, 1",
        "RSUB",
    ]);
    let count = allocations(|| host.bench.run_for(10 * SECOND_US));
    assert_eq!(count, 0);
    host.send(&datagram("GGP 0, 2"));
    let handled = Reply::parse(&host.bench.take(&mut host.link).unwrap()).unwrap().value;
    assert!(handled > 1000, "{handled} interrupts in 10 s, one every 7 ms");
}

#[test]
fn older_module_allocates_nothing() {
    let mut host = Host::at(Bench::with_defaults(&TMCM_351));
    host.all(&["SAP 205, 0, 5", "SAP 212, 1, 1000", "SAP 204, 2, 10", "DATA 132, 0, 0, 0"]);
    host.all(&[
        "MVP REL, 0, 20000",
        "MVP REL, 1, -9000",
        "ROR 2, 500",
        "WAIT POS, 0, 0",
        "MST 2",
        "DATA 29, 0, 4, 7",
        "JA 0",
    ]);
    host.all(&["DATA 133, 0, 0, 0", "DATA 129, 1, 0, 0"]);
    assert_eq!(allocations(|| host.bench.run_for(10 * SECOND_US)), 0);
}

#[cfg(unix)]
mod served {
    use std::fs::File;
    use std::io::{Read, Write};
    use std::net::TcpStream;
    use std::thread;

    use gradus_sim::{Endpoint, Options, Server};

    use super::*;

    /// A stream to a module.
    trait Port: Read + Write {}
    impl<T: Read + Write> Port for T {}

    fn connect(endpoint: &Endpoint) -> Box<dyn Port> {
        match endpoint {
            Endpoint::Tcp(address) => Box::new(TcpStream::connect(address).unwrap()),
            Endpoint::Pty(path) => {
                Box::new(File::options().read(true).write(true).open(path.as_ref().unwrap()).unwrap())
            }
            _ => panic!("{endpoint} carries frames"),
        }
    }

    /// How often the thread of a server asks for memory while a client comes and sends so many commands, three axes moving.
    fn while_serving(endpoint: Endpoint, commands: usize) -> u64 {
        let bench = Bench::rigid(&TMCM_3351);
        let mut server = Server::open(bench, &[endpoint], Options::default()).unwrap();
        let (opened, stopper) = (server.endpoints()[0].clone(), server.stopper().unwrap());
        let thread = thread::spawn(move || allocations(|| server.run(None).unwrap()));

        let mut port = connect(&opened);
        let turn = ["ROR 0, 10000", "ROR 1, 20000", "ROR 2, 30000"].map(datagram);
        let ask = datagram("GAP 1, 0");
        for datagram in turn.iter().chain(std::iter::repeat_n(&ask, commands)) {
            let mut reply = [0; 9];
            port.write_all(datagram).unwrap();
            port.read_exact(&mut reply).unwrap();
            assert_eq!(Status(reply[2]), Status::OK);
        }
        stopper.stop();
        thread.join().unwrap()
    }

    #[test]
    fn served_commands_allocate_nothing() {
        for endpoint in [Endpoint::Pty(None), Endpoint::Tcp("127.0.0.1:0".parse().unwrap())] {
            let [few, many] = [10, 3000].map(|commands| while_serving(endpoint.clone(), commands));
            assert_eq!(few, many, "{endpoint}");
        }
    }
}

#[test]
fn closed_loop_allocates_nothing() {
    let mut bench = Bench::with_defaults(&TMCM_3351);
    let link = bench.attach(LinkKind::Usb, 0);
    let mut host = Host { bench, link };
    host.all(&["SAP 129, 0, 1", "SAP 129, 1, 2"]);
    host.bench.run_for(3 * SECOND_US);
    host.all(&["MVP ABS, 0, 100000", "MVP ABS, 1, 100000"]);
    assert_eq!(allocations(|| host.bench.run_for(SECOND_US)), 0, "position");
    host.all(&["SAP 50, 0, 100"]);
    assert_eq!(allocations(|| host.bench.run_for(SECOND_US)), 0, "torque");
}

#[test]
fn servo_with_its_motor_and_a_capture_allocates_nothing() {
    let mut bench = Bench::with_defaults(&TMCM_1617);
    let mut link = bench.attach(LinkKind::Usb, 0);
    let commands = ["SAP 15, 0, 2", "DATA 142, 4, 1, 42", "DATA 142, 7, 0, 0", "ROR 0, 1000"].map(|command| {
        let instruction = Instruction::parse(command, &TMCM_1617).unwrap();
        Request { address: 1, instruction }.emit()
    });
    let work = || {
        for command in &commands {
            bench.send(&mut link, command);
            assert_eq!(bench.take(&mut link).map(|reply| reply[2]), Some(100));
        }
        bench.run_for(SECOND_US);
    };
    assert_eq!(allocations(work), 0);
}
