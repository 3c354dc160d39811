//! Several modules on buses, in virtual time.

use gradus_sim::{Bench, BusChange, BusKind, Can, HostId, Profile, Rig, Serial};
use gradus_tmcl::can::Frame;
use gradus_tmcl::catalogue::{Gp, TMCM_351, TMCM_3351};
use gradus_tmcl::rates::BAUD_RATES;
use gradus_tmcl::{Instruction, Opcode, Reply, Request, Status};

/// Modules on one bus with a host.
struct Field {
    rig: Rig,
    host: HostId,
}

impl Field {
    fn new(kind: BusKind, modules: &[&[(Gp, i32)]]) -> Self {
        let mut rig = Rig::default();
        let bus = rig.add_bus("field", kind);
        for settings in modules {
            let mut bench = Bench::with_defaults(&TMCM_3351);
            for (parameter, value) in *settings {
                assert!(bench.set_global(*parameter, *value));
            }
            match kind {
                BusKind::Serial(Serial { baud: 0, .. }) => {}
                BusKind::Serial(Serial { baud, .. }) => assert!(bench.set_rate(Gp::SerialBaudRate, baud)),
                BusKind::Can(Can { bit_rate, .. }) => assert!(bench.set_rate(Gp::CanBitRate, bit_rate)),
            }
            let module = rig.add_module("module", bench);
            rig.connect(module, bus);
        }
        let host = rig.attach(bus);
        Self { rig, host }
    }

    fn segment(serial: Serial, addresses: &[i32]) -> Self {
        let settings: Vec<_> = addresses.iter().map(|address| [(Gp::SerialAddress, *address)]).collect();
        Self::new(BusKind::Serial(serial), &settings.iter().map(|own| own.as_slice()).collect::<Vec<_>>())
    }

    fn can(timing: bool, ids: &[(i32, i32)]) -> Self {
        let settings: Vec<_> = ids.iter().map(|(own, reply)| [(Gp::CanId, *own), (Gp::CanReplyId, *reply)]).collect();
        let kind = BusKind::Can(Can { bit_rate: 1_000_000, timing });
        Self::new(kind, &settings.iter().map(|own| own.as_slice()).collect::<Vec<_>>())
    }

    fn send(&mut self, address: u8, command: &str) {
        self.rig.send(self.host, &datagram(address, command));
    }

    /// The bytes that have arrived.
    fn take(&mut self) -> Vec<u8> {
        let mut bytes = Vec::new();
        self.rig.take(self.host, &mut bytes);
        bytes
    }

    /// Runs until something arrives; when that was, and the replies.
    fn replies(&mut self, limit_us: u64) -> Option<(u64, Vec<Reply>)> {
        let end_us = self.rig.now() + limit_us;
        loop {
            let bytes = self.take();
            if !bytes.is_empty() {
                return Some((self.rig.now(), bytes.chunks(9).map(reply).collect()));
            }
            let next_us = self.rig.next_event().filter(|at_us| *at_us <= end_us)?;
            self.rig.run_until(next_us);
        }
    }

    /// What arrives of a question within a second.
    fn ask(&mut self, address: u8, command: &str) -> Option<Reply> {
        self.send(address, command);
        let (_, replies) = self.replies(1_000_000)?;
        assert_eq!(replies.len(), 1, "{replies:?}");
        Some(replies[0])
    }

    /// Whether a reply comes; what was sent before is forgotten first, as after a pause.
    fn understands(&mut self, command: &str) -> bool {
        self.rig.run_for(200_000);
        self.take();
        self.rig.detach(self.host);
        self.host = self.rig.attach(0);
        self.send(1, command);
        self.rig.run_for(200_000);
        let bytes = self.take();
        bytes.try_into().is_ok_and(|bytes| Reply::parse(&bytes).is_ok())
    }

    fn send_frame(&mut self, host: HostId, id: u32, command: &str) {
        self.rig.send_frame(host, Frame::request(id, &instruction(command)));
    }

    /// The frames that have come to a host after so long.
    fn frames(&mut self, host: HostId, us: u64) -> Vec<Frame> {
        self.rig.run_for(us);
        std::iter::from_fn(|| self.rig.take_frame(host)).collect()
    }
}

fn instruction(command: &str) -> Instruction {
    Instruction::parse(command, &TMCM_3351).unwrap()
}

fn datagram(address: u8, command: &str) -> [u8; 9] {
    Request { address, instruction: instruction(command) }.emit()
}

fn reply(bytes: &[u8]) -> Reply {
    Reply::parse(bytes.try_into().unwrap()).unwrap()
}

fn instant() -> Serial {
    Serial::rs485(9600).without_timing()
}

#[test]
fn each_module_of_a_segment_answers_to_its_address() {
    let mut field = Field::segment(instant(), &[1, 3, 200]);
    for address in [3, 1, 200] {
        assert_eq!(field.ask(address, "SGP 9, 2, 5").map(|reply| reply.module), Some(address));
    }
    assert!(field.ask(2, "GGP 9, 2").is_none());
    assert_eq!(field.ask(200, "GGP 9, 2").map(|reply| reply.value), Some(5));
}

#[test]
fn secondary_address_is_answered_by_all_who_have_it() {
    let one = [(Gp::SerialAddress, 1), (Gp::SerialSecondaryAddress, 9)];
    let mut field = Field::new(BusKind::Serial(instant()), &[&one, &[(Gp::SerialAddress, 3)]]);
    assert_eq!(field.ask(9, "GAP 1, 0").map(|reply| reply.module), Some(1));
}

#[test]
fn telegrams_take_their_time_on_the_line() {
    // Nine bytes of ten bits, the turn-around of one byte, the telegram pause, nine bytes.
    for (baud, pause_ms) in [(9600, 0), (9600, 5), (115_200, 0), (115_200, 30)] {
        let settings = [(Gp::SerialAddress, 1), (Gp::TelegramPause, pause_ms)];
        let mut field = Field::new(BusKind::Serial(Serial::rs485(baud)), &[&settings]);
        field.send(1, "GAP 1, 0");
        let (at_us, _) = field.replies(1_000_000).unwrap();
        let expected_us = 19.0 * 10e6 / f64::from(baud) + f64::from(pause_ms) * 1e3;
        assert!((at_us as f64 - expected_us).abs() <= 3.0, "{at_us} us, expected {expected_us}");
    }
}

#[test]
fn text_takes_ten_bits_a_character() {
    let mut rig = Rig::default();
    let bus = rig.add_bus("field", BusKind::Serial(Serial::rs485(9600)));
    let mut bench = Bench::with_defaults(&TMCM_351);
    // No echo, and text from the next start on.
    assert!(bench.set_global(Gp::AsciiMode, 33));
    bench.power_off();
    bench.power_on();
    let module = rig.add_module("module", bench);
    rig.connect(module, bus);
    let host = rig.attach(bus);
    let line = b"AGAP 6, 0\r";
    rig.send(host, line);
    let (mut heard, reply) = (Vec::new(), b"BA 100 255\r");
    while heard.len() < reply.len() {
        rig.run_until(rig.next_event().expect("the reply is cut short"));
        rig.take(host, &mut heard);
    }
    assert_eq!(heard, reply);
    // The line, the turn-around of one character, the reply.
    let characters = line.len() + 1 + reply.len();
    let expected_us = characters as f64 * 10e6 / 9600.0;
    assert!((rig.now() as f64 - expected_us).abs() <= 3.0, "{} us, expected {expected_us}", rig.now());
}

#[test]
fn commands_in_a_row_are_carried_one_after_the_other() {
    let mut field = Field::segment(Serial::rs485(9600), &[1]);
    field.send(1, "SGP 255, 0, 1"); // no more replies, which would collide with the next command
    field.rig.run_for(30_000);
    field.take();
    let start_us = field.rig.now();
    field.send(1, "SGP 9, 2, 1");
    field.send(1, "SGP 9, 2, 2");
    field.send(1, "GGP 9, 2");
    let (at_us, replies) = field.replies(1_000_000).unwrap();
    assert_eq!(replies[0].value, 2);
    let expected_us = 37.0 * 10e6 / 9600.0;
    assert!(((at_us - start_us) as f64 - expected_us).abs() < 3.0);
}

#[test]
fn baud_rate_changes_with_the_next_power_up() {
    let mut field = Field::segment(Serial::rs485(9600), &[1]);
    assert_eq!(field.ask(1, "SGP 65, 0, 7").map(|reply| reply.status), Some(Status::OK));
    assert_eq!(field.ask(1, "GGP 65, 0").map(|reply| reply.value), Some(7), "still at the old rate");
    field.rig.with_bench(0, Bench::power_off);
    field.rig.with_bench(0, Bench::power_on);
    assert!(!field.understands("GGP 65, 0"), "9600 is noise for a module at 115200");
    field.rig.detach(field.host);
    field.host = field.rig.attach(0);
    field.rig.set_host_rate(field.host, 115_200);
    let start_us = field.rig.now();
    field.send(1, "GGP 65, 0");
    let (at_us, replies) = field.replies(1_000_000).unwrap();
    assert_eq!(replies[0].value, 7);
    let expected_us = 19.0 * 10e6 / 115_200.0;
    assert!(((at_us - start_us) as f64 - expected_us).abs() <= 3.0, "{} us", at_us - start_us);
}

#[test]
fn command_that_starts_the_module_anew_changes_its_rate_too() {
    let mut field = Field::segment(Serial::rs485(9600), &[1]);
    field.ask(1, "SGP 65, 0, 2");
    field.ask(1, "DATA 255, 0, 0, 1234");
    assert!(!field.understands("GAP 4, 0"));
    field.rig.change(0, BusChange::Rate(19_200));
    assert!(field.understands("GAP 4, 0"));
}

#[test]
fn host_at_another_rate_hears_no_reply_that_is_one() {
    for (index, rate) in BAUD_RATES.into_iter().enumerate() {
        let mut field = Field::segment(Serial::rs485(rate), &[1]);
        for other in BAUD_RATES {
            field.rig.change(0, BusChange::Rate(other));
            // 250 000 is 8.5 % off 230 400: too much for the last bits, as all others are.
            assert_eq!(field.understands("GGP 65, 0"), other == rate, "value {index}: {other} at {rate}");
        }
    }
}

#[test]
fn rs232_is_for_one_module_that_looks_at_its_address_and_has_a_pause_but_no_collisions() {
    let settings = [(Gp::SerialAddress, 3), (Gp::TelegramPause, 5)];
    let mut field = Field::new(BusKind::Serial(Serial::rs232(9600)), &[&settings]);
    assert!(field.ask(1, "GAP 4, 0").is_none(), "another address");
    let start_us = field.rig.now();
    field.send(3, "GAP 4, 0");
    let (at_us, _) = field.replies(1_000_000).unwrap();
    let expected_us = 18.0 * 10e6 / 9600.0 + 5e3;
    assert!(((at_us - start_us) as f64 - expected_us).abs() <= 3.0, "{} us", at_us - start_us);
    field.send(3, "GAP 4, 0");
    field.send(3, "GAP 5, 0");
    field.rig.run_for(100_000);
    let bytes = field.take();
    let replies: Vec<i32> = bytes.chunks(9).map(|chunk| reply(chunk).value).collect();
    assert_eq!(replies, [51_200, 51_200], "the second question comes during the first reply");
}

#[test]
fn modules_that_share_an_address_collide_unless_they_say_the_same() {
    let mut field = Field::segment(Serial::rs485(9600), &[7, 7]);
    assert_eq!(field.ask(7, "GAP 1, 0").map(|reply| reply.status), Some(Status::OK), "two equal replies are one");
    field.rig.with_bench(0, |bench| bench.machine().io.set_analog(0, 0b01_0101));
    field.rig.with_bench(1, |bench| bench.machine().io.set_analog(0, 0b11_0011));
    field.send(7, "GIO 0, 1");
    field.rig.run_for(50_000);
    let bytes = field.take();
    assert_eq!(bytes.len(), 9);
    assert_eq!(bytes[7], 0b01_0001, "both drive the line: a 0 wins");
    assert!(Reply::parse(&bytes.try_into().unwrap()).is_err());
}

#[test]
fn modules_that_share_an_address_both_answer_without_timing() {
    let mut field = Field::segment(instant(), &[7, 7]);
    field.send(7, "GAP 1, 0");
    assert_eq!(field.take().len(), 18);
}

#[test]
fn host_that_does_not_wait_for_the_reply_destroys_it() {
    let mut field = Field::segment(Serial::rs485(9600), &[1, 3]);
    field.send(1, "GAP 1, 0");
    field.send(3, "GAP 1, 0");
    field.rig.run_for(100_000);
    let bytes = field.take();
    assert!(bytes.chunks(9).any(|chunk| chunk.try_into().ok().is_none_or(|chunk| Reply::parse(&chunk).is_err())));
}

#[test]
fn two_wire_adapter_hears_itself() {
    let mut field = Field::segment(Serial { echo: true, ..Serial::rs485(9600) }, &[1]);
    field.send(1, "GAP 1, 0");
    field.rig.run_for(50_000);
    let bytes = field.take();
    assert_eq!((&bytes[..9], bytes.len()), (&datagram(1, "GAP 1, 0")[..], 18));
}

#[test]
fn reply_goes_to_the_host_that_asked() {
    let mut field = Field::segment(Serial::rs485(115_200), &[1, 3]);
    let other = field.rig.attach(field.host.bus());
    field.rig.send(other, &datagram(3, "GAP 1, 0"));
    field.rig.run_for(10_000);
    let mut heard = Vec::new();
    field.rig.take(other, &mut heard);
    assert_eq!((reply(&heard).module, field.take().len()), (3, 0));
}

#[test]
fn cut_cable_is_silence_and_babble_is_noise() {
    let mut field = Field::segment(Serial { gap_us: 5000, ..Serial::rs485(9600) }, &[1]);
    field.rig.change(0, BusChange::Cut(true));
    assert!(field.ask(1, "GAP 1, 0").is_none());
    field.rig.change(0, BusChange::Cut(false));
    assert!(field.ask(1, "GAP 1, 0").is_some());
    field.rig.schedule(field.rig.now() + 10_000, 0, BusChange::Babble(true));
    field.rig.run_for(1_010_000);
    assert!((950..970).contains(&field.take().len()), "a second of bytes of 10 bits");
    field.rig.change(0, BusChange::Babble(false));
    field.rig.run_for(100_000);
    field.take();
    assert!(field.ask(1, "GAP 1, 0").is_some(), "after a pause a new datagram begins");
}

#[test]
fn faults_of_a_line_are_those_of_its_seed() {
    let heard = |seed| {
        let mut field = Field::segment(instant(), &[1]);
        let profile = Profile { flipped: 0.2, late: 0.1, delay_ms: (1, 5), ..Profile::default() };
        field.rig.change(0, BusChange::Faults(profile, seed));
        (0..100)
            .flat_map(|value| {
                field.send(1, &format!("SGP 9, 2, {value}"));
                field.rig.run_for(10_000);
                field.take()
            })
            .collect::<Vec<_>>()
    };
    assert_eq!(heard(1), heard(1));
    assert_ne!(heard(1), heard(2));
}

#[test]
fn late_reply_comes_later_and_not_never() {
    let mut field = Field::segment(instant(), &[1]);
    let profile = Profile { late: 1.0, delay_ms: (20, 20), ..Profile::default() };
    field.rig.change(0, BusChange::Faults(profile, 1));
    field.send(1, "GAP 1, 0");
    assert_eq!(field.replies(1_000_000).map(|(at_us, _)| at_us), Some(20_000));
}

#[test]
fn position_event_goes_on_the_bus_when_the_motor_has_arrived() {
    let mut field = Field::segment(Serial::rs485(115_200), &[1]);
    field.ask(1, "DATA 138, 1, 0, 1");
    field.ask(1, "MVP ABS, 0, 51200");
    let (at_us, replies) = field.replies(10_000_000).unwrap();
    assert_eq!((replies[0].status, replies[0].value), (Status::POSITION_REACHED, 1));
    // 51200 microsteps with 51200 pps and 51200 pps2: 2 s.
    assert!((2_000_000..2_010_000).contains(&at_us), "{at_us}");
}

#[test]
fn modules_of_a_can_bus_answer_to_their_identifiers() {
    for timing in [false, true] {
        let mut field = Field::can(timing, &[(1, 100), (3, 101)]);
        let host = field.host;
        for (id, reply) in [(3, 101), (1, 100)] {
            field.send_frame(host, id, "GAP 1, 0");
            let frames = field.frames(host, 1000);
            assert_eq!(frames.iter().map(|frame| frame.id).collect::<Vec<_>>(), [reply]);
            assert_eq!(frames[0].data()[..3], [id as u8, 100, 6]);
        }
        field.send_frame(host, 7, "GAP 1, 0");
        assert_eq!(field.frames(host, 1000), []);
    }
}

#[test]
fn frames_are_heard_by_all_hosts_but_their_own() {
    let mut field = Field::can(true, &[(1, 100)]);
    let (asks, listens) = (field.host, field.rig.attach(0));
    field.send_frame(asks, 1, "GAP 1, 0");
    assert_eq!(field.frames(asks, 1000).iter().map(|frame| frame.id).collect::<Vec<_>>(), [100]);
    assert_eq!(field.frames(listens, 0).iter().map(|frame| frame.id).collect::<Vec<_>>(), [1, 100]);
}

#[test]
fn frame_and_reply_take_their_bits() {
    let mut field = Field::can(true, &[(1, 100)]);
    let host = field.host;
    field.send_frame(host, 1, "GAP 1, 0");
    assert_eq!(field.frames(host, 206), [], "two frames of 7 bytes have 2 * 103 bits without stuff bits");
    assert_eq!(field.frames(host, 2 * 22 + 1).len(), 1, "and 2 * 22 stuff bits at most");
}

#[test]
fn smaller_identifier_goes_first() {
    let mut field = Field::can(true, &[]);
    let (first, second, third) = (field.host, field.rig.attach(0), field.rig.attach(0));
    for (host, id) in [(first, 0x300), (second, 0x200), (first, 0x100), (second, 0x400)] {
        field.send_frame(host, id, "GAP 1, 0");
    }
    let order: Vec<u32> = field.frames(third, 2000).iter().map(|frame| frame.id).collect();
    assert_eq!(order, [0x300, 0x100, 0x200, 0x400], "300 found the bus free; a host's own frames keep their order");
}

#[test]
fn same_identifier_at_the_same_time_destroys_both_frames() {
    let mut field = Field::can(true, &[]);
    let (first, second, third) = (field.host, field.rig.attach(0), field.rig.attach(0));
    field.send_frame(third, 0x10, "GAP 1, 0");
    field.send_frame(first, 0x20, "GAP 1, 0");
    field.send_frame(second, 0x20, "GAP 2, 0");
    let listener = field.rig.attach(0);
    assert_eq!(field.frames(listener, 2000).iter().map(|frame| frame.id).collect::<Vec<_>>(), [0x10]);
}

#[test]
fn babbling_node_keeps_everybody_off_the_bus() {
    let mut field = Field::can(true, &[(1, 100)]);
    let host = field.host;
    field.rig.change(0, BusChange::Babble(true));
    field.send_frame(host, 1, "GAP 1, 0");
    let frames = field.frames(host, 10_000);
    assert!(frames.len() > 70 && frames.iter().all(|frame| frame.id == 0), "{}", frames.len());
    field.rig.change(0, BusChange::Babble(false));
    assert!(field.frames(host, 1000).iter().any(|frame| frame.id == 100));
}

#[test]
fn bit_rate_changes_with_the_next_power_up() {
    let mut field = Field::can(true, &[(1, 100)]);
    let (host, other) = (field.host, field.rig.attach(0));
    let answers = |field: &mut Field, host| {
        field.send_frame(host, 1, "GGP 69, 0");
        field.frames(host, 20_000).iter().any(|frame| frame.id == 100)
    };
    field.send_frame(host, 1, "SGP 69, 0, 6");
    assert!(answers(&mut field, host));
    field.rig.with_bench(0, Bench::reset);
    assert!(!answers(&mut field, host));
    field.rig.set_host_rate(host, 250_000);
    field.frames(other, 0);
    assert!(answers(&mut field, host));
    assert_eq!(field.frames(other, 0), [], "a host that stayed at 1 Mbit/s hears neither");
}

#[test]
fn module_on_two_buses_is_one_module() {
    let mut rig = Rig::from(Bench::with_defaults(&TMCM_3351));
    let can = rig.add_bus("can", BusKind::Can(Can::DEFAULT));
    rig.connect(0, can);
    let (usb, other) = (rig.attach(0), rig.attach(can));
    rig.send(usb, &datagram(1, "SGP 9, 2, 42"));
    rig.send_frame(other, Frame::request(1, &instruction("GGP 9, 2")));
    rig.run_for(1000);
    assert_eq!(rig.take_frame(other).map(|frame| frame.data()[6]), Some(42));
    let event = Instruction { opcode: Opcode::POSITION_EVENT, kind: 0, motor: 0, value: 1 };
    rig.send_frame(other, Frame::request(1, &event));
    rig.run_for(1000);
    rig.send(usb, &datagram(1, "MVP ABS, 0, 100"));
    rig.run_for(1_000_000);
    rig.take_frame(other);
    assert_eq!(rig.take_frame(other).map(|frame| frame.data()[1]), Some(128));
}

#[test]
fn modules_that_move_do_not_disturb_each_other_and_reruns_are_equal() {
    let run = |step_us: u64| {
        let mut field = Field::segment(Serial::rs485(115_200), &[1, 3, 4]);
        for address in [1, 3, 4] {
            field.ask(address, &format!("MVP ABS, 0, {}", 10_000 * i32::from(address)));
        }
        while field.rig.now() < 3_000_000 {
            field.rig.run_for(step_us);
        }
        [1, 3, 4].map(|address| field.ask(address, "GAP 1, 0").map(|reply| reply.value))
    };
    assert_eq!(run(1000), [Some(10_000), Some(30_000), Some(40_000)]);
    assert_eq!(run(1000), run(333_333));
}
