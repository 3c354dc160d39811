//! A module with its encoder on the simulated machine.

use gradus_plant::Encoder;
use gradus_sim::{Bench, Link, LinkKind};
use gradus_tmcl::catalogue::{Ap, TMCM_3351};
use gradus_tmcl::{Instruction, Reply, Request, Status};

const SECOND_US: u64 = 1_000_000;

/// A bench with a host.
struct Host {
    bench: Bench,
    link: Link,
}

impl Host {
    /// A bench with this encoder on axis 0, on which the commands have been executed.
    fn with(encoder: Encoder, commands: &[&str]) -> Self {
        let mut bench = Bench::with_defaults(&TMCM_3351);
        bench.machine().axes[0].plant.encoder = Some(encoder);
        let link = bench.attach(LinkKind::Usb, 0);
        let mut host = Self { bench, link };
        commands.iter().for_each(|command| host.tell(command));
        host
    }

    fn tell(&mut self, command: &str) {
        let instruction = Instruction::parse(command, &TMCM_3351).unwrap();
        self.bench.send(&mut self.link, &Request { address: 1, instruction }.emit());
        let reply = Reply::parse(&self.bench.take(&mut self.link).unwrap()).unwrap();
        assert_eq!(reply.status, Status::OK, "{command}");
    }

    fn get(&mut self, id: Ap) -> i32 {
        self.bench.axis_parameter(0, id).unwrap()
    }
}

const FAST: [&str; 3] = ["SAP 4, 0, 500000", "SAP 5, 0, 2000000", "SAP 17, 0, 2000000"];

#[test]
fn index_is_found_at_any_speed() {
    // Count 1000 of 4096 begins at 12 500 microsteps; at 500 000 pps a tick goes over four counts.
    let encoder = Encoder { index: Some(1_000), ..Encoder::default() };
    for speed in ["SAP 4, 0, 10000", "SAP 4, 0, 500000"] {
        let mut host = Host::with(encoder, &FAST);
        host.tell(speed);
        host.tell("SAP 201, 0, 28");
        host.tell("MVP ABS, 0, 50000");
        host.bench.run_for(10 * SECOND_US);
        let (motor, latch) = (host.get(Ap::LatchedPosition), host.get(Ap::LatchedEncoderPosition));
        assert_eq!(latch, 12_500, "{speed}");
        assert!((motor - latch).abs() <= 25, "{speed}: motor at {motor}");
    }
}

#[test]
fn encoder_that_is_cleared_at_the_index_shows_the_place_in_the_turn() {
    let mut host = Host::with(Encoder::default(), &FAST);
    host.tell("SAP 201, 0, 284");
    host.tell("MVP ABS, 0, 512500");
    host.bench.run_for(10 * SECOND_US);
    let (position, encoder) = (host.get(Ap::ActualPosition), host.get(Ap::EncoderPosition));
    assert_eq!((position, encoder), (512_500, 500));
}
