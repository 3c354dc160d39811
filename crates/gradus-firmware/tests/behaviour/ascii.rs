//! The ASCII interface, on the module that has it.

use gradus_firmware::{Link, LinkKind, Module};
use gradus_tmcl::catalogue::{Ap, TMCM_351, TMCM_1617, TMCM_3351};
use gradus_tmcl::{Instruction, Opcode, Reply, Request, Status};
use proptest::prelude::*;

use crate::support::{Bench, Machine, Memory, OWN_LINK};

/// A terminal on a module of address 1.
struct Terminal {
    module: Module<Machine, Memory>,
    link: Link,
    now: u64,
}

impl Terminal {
    /// A module in binary mode; global parameters of bank 0 are set as told.
    fn new(kind: LinkKind, globals: &[(u8, i32)]) -> Self {
        let module = Module::new(&TMCM_351, Machine::default(), Memory::blank(0));
        let mut terminal = Self { module, link: Link::new(OWN_LINK, kind, 0), now: 0 };
        terminal.wait(0);
        for (number, value) in globals {
            let set = terminal.datagram(Instruction::new(Opcode::SGP, *number, 0, *value));
            assert_eq!(set, Some((Status::OK, *value)), "global parameter {number}");
        }
        terminal
    }

    /// A module in ASCII mode that does not echo.
    fn quiet() -> Self {
        Self::entered(&[(67, 32)])
    }

    fn entered(globals: &[(u8, i32)]) -> Self {
        let mut terminal = Self::new(LinkKind::Usb, globals);
        assert_eq!(terminal.control(Opcode::ASCII_MODE), Some((Status::OK, 0)));
        terminal
    }

    fn wait(&mut self, us: u64) {
        self.now += us;
        self.module.poll(self.now);
    }

    fn power_cycle(self) -> Self {
        let (machine, memory) = self.module.into_parts();
        let module = Module::new(&TMCM_351, machine, memory);
        let mut terminal = Self { module, link: Link::new(OWN_LINK, LinkKind::Usb, 0), now: 0 };
        terminal.wait(0);
        terminal
    }

    /// A datagram, and what comes as a datagram.
    fn datagram(&mut self, instruction: Instruction) -> Option<(Status, i32)> {
        self.module.receive(&mut self.link, &Request { address: 1, instruction }.emit());
        let now = self.link.ready_at()?.max(self.now);
        self.wait(now - self.now);
        let reply = Reply::parse(&self.module.transmit(&mut self.link)?).unwrap();
        Some((reply.status, reply.value))
    }

    fn control(&mut self, opcode: Opcode) -> Option<(Status, i32)> {
        self.datagram(Instruction::new(opcode, 0, 0, 0))
    }

    /// Types, and gives back all that comes, with `.` for CR and `<` for a character that is rubbed out.
    fn types(&mut self, text: &str) -> String {
        let mut heard: Vec<u8> = Vec::new();
        let mut rest = text.as_bytes();
        loop {
            let taken = self.module.receive(&mut self.link, rest);
            rest = &rest[taken..];
            heard.extend(core::iter::from_fn(|| self.module.transmit_byte(&mut self.link)));
            if rest.is_empty() {
                return heard
                    .into_iter()
                    .map(char::from)
                    .collect::<String>()
                    .replace("\x08 \x08", "<")
                    .replace('\r', ".");
            }
            assert!(taken > 0, "it takes no more of {text}");
        }
    }
}

#[test]
fn command_139_leads_in_and_bin_out() {
    let mut terminal = Terminal::quiet();
    assert_eq!(terminal.types("AGAP 6, 0\r"), "BA 100 255.");
    assert_eq!(terminal.control(Opcode::GAP), None);
    assert_eq!(terminal.types("\rABIN\r"), "BA 100 0.");
    assert_eq!(terminal.datagram(Instruction::new(Opcode::GAP, 6, 0, 0)), Some((Status::OK, 255)));
    assert_eq!(terminal.types("AGAP 6, 0\r"), "");
}

#[test]
fn text_and_datagrams_in_one_stream_stay_in_order() {
    let mut terminal = Terminal::new(LinkKind::Usb, &[(67, 32)]);
    let enter = Request { address: 1, instruction: Instruction::new(Opcode::ASCII_MODE, 0, 0, 0) }.emit();
    let gap = Request { address: 1, instruction: Instruction::new(Opcode::GAP, 6, 0, 0) }.emit();
    let stream = [&enter[..], b"AGAP 6, 1\rABIN\r", &gap, &gap].concat();
    let (mut rest, mut heard) = (stream.as_slice(), Vec::new());
    while !rest.is_empty() {
        let taken = terminal.module.receive(&mut terminal.link, rest);
        rest = &rest[taken..];
        if let Some(datagram) = terminal.module.transmit(&mut terminal.link) {
            heard.push(format!("{} {}", datagram[2], datagram[3]));
        }
        let text: Vec<u8> = core::iter::from_fn(|| terminal.module.transmit_byte(&mut terminal.link)).collect();
        heard.push(String::from_utf8(text).unwrap());
    }
    heard.retain(|heard| !heard.is_empty());
    assert_eq!(heard, ["100 139", "BA 100 255\r", "BA 100 0\r", "100 6"]);
    assert!(terminal.module.transmit(&mut terminal.link).is_some());
}

#[test]
fn the_module_starts_as_global_parameter_67_says() {
    let mut terminal = Terminal::new(LinkKind::Usb, &[(67, 33)]);
    assert!(terminal.control(Opcode::NOP).is_some(), "still binary");
    let mut terminal = terminal.power_cycle();
    assert_eq!(terminal.types("AGAP 6, 0\r"), "BA 100 255.");
    assert_eq!(terminal.types("ASGP 67, 0, 32\rABIN\r"), "BA 100 32.BA 100 0.");
    assert!(terminal.power_cycle().control(Opcode::NOP).is_some());
}

#[test]
fn echo_modes() {
    let cases = [
        (0, "AGAP 6, 0\r", "AGAP 6, 0.BA 100 255."),
        (0, "AGAX\x08P 6, 0\r\n", "AGAX<P 6, 0.BA 100 255."),
        (0, "AB\x08\x08\x08BGAP 6, 0\r", "AB<<"),
        (0, "BGAP 6, 0\r\r", ""),
        (16, "AGAX\x7fP 6, 0\r", "AGAP 6, 0.BA 100 255."),
        (16, "BGAP 6, 0\r", ""),
        (32, "AGAX\x08P 6, 0\r", "BA 100 255."),
    ];
    for (mode, typed, heard) in cases {
        assert_eq!(Terminal::entered(&[(67, mode)]).types(typed), heard, "{mode} {typed:?}");
    }
}

#[test]
fn lines_are_for_the_address_and_the_secondary_address() {
    let mut terminal = Terminal::entered(&[(67, 32), (87, 5), (76, 7)]);
    assert_eq!(terminal.types("EGAP 6, 0\rAGAP 6, 0\raGAP 6, 0\r"), "GA 100 255.GA 100 255.");
    assert_eq!(terminal.types("ASGP 66, 0, 3\rAGAP 6, 0\rCGAP 6, 0\r"), "GA 100 3.GC 100 255.");
    assert_eq!(terminal.types("CSGP 76, 0, 200\rCGAP 6, 0\r"), "GC 100 200.?C 100 255.");
}

#[test]
fn an_address_without_a_letter_keeps_to_datagrams() {
    let mut terminal = Terminal::new(LinkKind::Usb, &[(66, 63)]);
    assert_eq!(terminal.control(Opcode::ASCII_MODE), Some((Status::NOT_AVAILABLE, 0)));
    let mut terminal = Terminal::quiet();
    terminal.types("ASGP 66, 0, 63\r");
    assert!(terminal.control(Opcode::NOP).is_some());
}

#[test]
fn commands_move_motors_and_programs_run_and_stop() {
    let mut terminal = Terminal::new(LinkKind::Usb, &[(67, 32)]);
    assert!(terminal.control(Opcode::ENTER_DOWNLOAD).is_some());
    for (opcode, kind, value) in [(Opcode::SGP, 7, 9), (Opcode::JA, 0, 0)] {
        let instruction = Instruction::new(opcode, kind, if opcode == Opcode::SGP { 2 } else { 0 }, value);
        assert_eq!(terminal.datagram(instruction), Some((Status::LOADED, value)));
    }
    assert!(terminal.control(Opcode::EXIT_DOWNLOAD).is_some());
    assert!(terminal.control(Opcode::ASCII_MODE).is_some());
    assert_eq!(terminal.types("ARUN\r"), "BA 100 0.");
    terminal.wait(100_000);
    assert_eq!(terminal.types("A STOP\rAGGP 7, 2\r"), "BA 100 0.BA 100 9.");
    assert_eq!(terminal.types("A MVP ABS, 1, 1000\r"), "BA 100 1000.");
    terminal.wait(20_000_000);
    assert_eq!(terminal.module.get_axis(1, Ap::ActualPosition), Some(1000));
}

#[test]
fn errors_are_status_numbers() {
    let mut terminal = Terminal::quiet();
    let long = format!("A{}\r", " ".repeat(80));
    let cases = [
        ("A\r", "BA 2 0."),
        ("AFLY 1\r", "BA 2 0."),
        ("A\u{e9}\r", "BA 2 0."),
        (long.as_str(), "BA 2 0."),
        ("AGAP 250, 0\r", "BA 3 0."),
        ("ASAP 4, 0, 99999\r", "BA 4 99999."),
        ("AMVP ABS, 0\r", "BA 4 0."),
        ("AMVP ABS, 0, 2147483648\r", "BA 4 0."),
        ("AMVP REL, 0, 4294967295\r", "BA 4 0."),
        ("AROL 0, -2147483649\r", "BA 4 0."),
        ("ASAP 0, 0, 99999999999999999999\r", "BA 4 0."),
        ("ASCO 1, 0, 2147483648\r", "BA 4 0."),
        ("AGAP 0, 0\r", "BA 100 0."),
        ("ACALC ADD, 1\r", "BA 6 0."),
        ("AGAP 1, 0\r", "BA 100 0."),
    ];
    for (typed, heard) in cases {
        assert_eq!(terminal.types(typed), heard, "{typed:?}");
    }
}

#[test]
fn mst_alone_stops_motor_0() {
    let mut terminal = Terminal::quiet();
    terminal.types("AROR 0, 500\r");
    terminal.types("AROR 1, 500\r");
    assert_eq!(terminal.types("AMST\r"), "BA 100 0.");
    assert_eq!(terminal.types("Amst \r"), "BA 100 0.");
    assert_eq!([terminal.types("AGAP 2, 0\r"), terminal.types("AGAP 2, 1\r")], ["BA 100 0.", "BA 100 500."]);
}

#[test]
fn on_rs485_the_telegram_pause_comes_before_the_reply() {
    let mut terminal = Terminal::new(LinkKind::Rs485, &[(75, 5)]);
    assert!(terminal.control(Opcode::ASCII_MODE).is_some());
    assert_eq!(terminal.types("AGAP 6, 0"), "AGAP 6, 0", "characters come back at once");
    let start = terminal.now;
    assert_eq!(terminal.types("\r"), "");
    assert_eq!(terminal.link.ready_at(), Some(start + 5_000));
    assert_eq!(terminal.module.receive(&mut terminal.link, b"A"), 0);
    terminal.wait(5_000);
    assert_eq!(terminal.types(""), ".BA 100 255.");
}

#[test]
fn an_event_waits_for_datagrams() {
    let mut terminal = Terminal::new(LinkKind::Usb, &[(67, 32)]);
    assert!(terminal.datagram(Instruction::new(Opcode::POSITION_EVENT, 0, 0, 1)).is_some());
    assert!(terminal.control(Opcode::ASCII_MODE).is_some());
    terminal.types("AMVP ABS, 0, 100\r");
    terminal.wait(20_000_000);
    assert_eq!(terminal.module.transmit(&mut terminal.link), None);
    terminal.types("ABIN\r");
    let event = Reply::parse(&terminal.module.transmit(&mut terminal.link).unwrap()).unwrap();
    assert_eq!((event.status, event.value), (Status::POSITION_REACHED, 1));
}

#[test]
fn other_modules_have_no_ascii_interface() {
    let mut bench = Bench::new();
    let reply = bench.send(Instruction::new(Opcode::ASCII_MODE, 0, 0, 0)).unwrap();
    assert_eq!(reply[2], Status::NOT_AVAILABLE.0);
    for module in [&TMCM_3351, &TMCM_1617] {
        assert!(!module.mode(Opcode::ASCII_MODE).direct(), "{}", module.name);
    }
}

proptest! {
    #[test]
    fn any_bytes_end_in_a_module_that_answers(bytes in prop::collection::vec(any::<u8>(), 0..200), mode in 0..3) {
        let mut terminal = Terminal::entered(&[(67, 16 * mode)]);
        let mut rest = bytes.as_slice();
        while !rest.is_empty() {
            let taken = terminal.module.receive(&mut terminal.link, rest);
            rest = &rest[taken..];
            while terminal.module.transmit_byte(&mut terminal.link).is_some() {}
        }
        prop_assert!(terminal.types("\rAGAP 6, 0\r").ends_with("BA 100 255."));
    }
}
