//! Each of the three modules with its machine: datagrams, lines of the console, steps of time.

#![no_main]

use gradus_sim::{Bench, Link, LinkKind, console};
use gradus_tmcl::catalogue::MODULES;
use gradus_tmcl::{Instruction, Opcode, Request};

const VERBS: [&str; 32] = [
    "in",
    "analog",
    "enable",
    "switch",
    "load",
    "friction",
    "inertia",
    "block",
    "unblock",
    "push",
    "encoder",
    "supply",
    "temperature",
    "coil",
    "short",
    "power",
    "hang",
    "reset",
    "show",
    "hall",
    "phase",
    "magnet",
    "slip",
    "couple",
    "viscous",
    "end",
    "bounce",
    "spi",
    "overtemperature",
    "help",
    "open",
    "motor",
];
const WORDS: [&str; 32] = [
    "0", "1", "2", "3", "7", "-1", "0.2", "-0.2", "1e3", "-1e9", "1e30", "1e-30", "1e308", "nan", "inf", "24", "9",
    "60", "on", "off", "left", "right", "home", "auto", "board", "a", "b", "u", "v", "w", "ok", "index",
];
/// Virtual time of an input, in microseconds.
const MOST_US: u64 = 200_000;

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    let Some((kind, script)) = data.split_first() else { return };
    let mut bench = Bench::with_defaults(MODULES[usize::from(*kind) % MODULES.len()]);
    let mut link = bench.attach(LinkKind::Usb, 0);
    let mut left_us = MOST_US;
    let mut script = script.iter().copied();
    while let Some(action) = script.next() {
        let mut next = || script.next().unwrap_or(0);
        match action % 8 {
            0..=4 => send(&mut bench, &mut link, &mut next),
            5 => {
                let verb = VERBS[usize::from(action / 8)];
                let words: Vec<&str> = (0..next() % 4).map(|_| WORDS[usize::from(next() % 32)]).collect();
                let _ = console::execute(&format!("{verb} {}", words.join(" ")), &mut bench);
            }
            _ => {
                let step_us = (u64::from(next()) << (action / 16)).min(left_us);
                left_us -= step_us;
                bench.run_for(step_us);
            }
        }
    }
    bench.run_for(left_us.min(10_000));
    let shown = console::execute("show", &mut bench).unwrap_or_default();
    assert!(!shown.contains("NaN") && !shown.contains("inf"), "{shown}");
});

fn send(bench: &mut Bench, link: &mut Link, next: &mut impl FnMut() -> u8) {
    let (opcode, kind, motor, value) = (Opcode(next()), next(), next() % 8, next());
    let value = match value {
        250 => i32::from_be_bytes([next(), next(), next(), next()]),
        251 => i32::MIN,
        252 => i32::MAX,
        253 => -1,
        254 => 100_000,
        255 => -100_000,
        small => i32::from(small),
    };
    let request = Request { address: 1, instruction: Instruction { opcode, kind, motor, value } };
    bench.send(link, &request.emit());
    while bench.take(link).is_some() {}
    while bench.take_byte(link).is_some() {}
}
