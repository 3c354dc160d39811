//! What survives: power cuts at every byte, write counters, blank memories (BEHAVIOUR 6).

use gradus_tmcl::catalogue::TMCM_3351;

use crate::support::{Bench, Machine, Memory, instruction};

/// Everything that a host can see of what is stored.
#[derive(Clone, PartialEq, Debug)]
struct Stored {
    globals: Vec<i32>,
    variables: Vec<i32>,
    coordinates: Vec<i32>,
    program: Vec<[u8; 9]>,
}

/// Stored global parameters that change nothing about replies and the visibility of the program.
const GLOBALS: [u8; 12] = [65, 68, 69, 70, 71, 75, 77, 82, 83, 84, 85, 87];
const VARIABLES: u8 = 6;
const COORDINATES: u8 = 4;
const PROGRAM: i32 = 6;

impl Stored {
    /// Reads it out of a module that is switched on with the memory.
    fn read(memory: &Memory) -> (Self, Bench) {
        let mut bench = Bench::with_memory(Memory { power: None, ..memory.clone() });
        let axes = [0, 1, 2];
        let stored = Self {
            globals: GLOBALS.iter().map(|number| bench.global(*number, 0)).collect(),
            variables: (0..VARIABLES).map(|number| bench.variable(number)).collect(),
            coordinates: (0..COORDINATES)
                .flat_map(|number| axes.map(|axis| format!("GCO {number}, {axis}")))
                .map(|command| bench.ask(&command))
                .collect(),
            program: (0..PROGRAM)
                .map(|address| bench.send(instruction(&format!("DATA 134, 0, 0, {address}"))).unwrap())
                .collect(),
        };
        (stored, bench)
    }

    /// Every value in one row.
    fn cells(&self) -> Vec<i64> {
        let numbers = self.globals.iter().chain(&self.variables).chain(&self.coordinates).map(|cell| i64::from(*cell));
        let program =
            self.program.iter().map(|bytes| bytes[1..8].iter().fold(0, |sum, byte| sum << 8 | i64::from(*byte)));
        numbers.chain(program).collect()
    }
}

/// A memory with something everywhere.
fn full() -> Memory {
    let mut bench = Bench::set_up(
        "SGP 68, 0, 60000; SGP 75, 0, 3; SGP 82, 0, 50000; SGP 84, 0, 1; SGP 1, 2, 1111; SGP 3, 2, 3333; STGP 1, 2; \
         STGP 3, 2; SCO 1, 0, 10; SCO 1, 1, 11; SCO 2, 2, 22; SCO 3, 0, 30",
    );
    bench.download("CALC LOAD, 1; CALC LOAD, 2; CALC LOAD, 3; STOP");
    let (_, memory) = bench.module.into_parts();
    memory
}

/// Cuts the power after every byte that `write` writes: each cell then reads as before or as after, and the module is fit for
/// the same again.
fn cut_power(name: &str, memory: &Memory, write: impl Fn(&mut Bench)) {
    let (before, _) = Stored::read(memory);
    let run = |power: Option<usize>| {
        let mut bench = Bench::with_memory(Memory { power, ..memory.clone() });
        write(&mut bench);
        bench.module.into_parts().1
    };
    let finished = run(None);
    let (after, _) = Stored::read(&finished);
    let bytes = finished.written() - memory.written();
    assert!(bytes > 0, "{name} writes nothing");
    for power in 0..=bytes {
        let cut = run(Some(power));
        let (found, mut bench) = Stored::read(&cut);
        for ((found, before), after) in found.cells().iter().zip(before.cells()).zip(after.cells()) {
            assert!(*found == before || *found == after, "{name}, cut after {power} bytes of {bytes}: {found}");
        }
        if power == bytes {
            assert_eq!(found, after, "{name} with all its bytes");
        }
        write(&mut bench);
        let (repeated, _) = Stored::read(&bench.module.into_parts().1);
        assert_eq!(repeated, after, "{name} again, after a cut after {power} bytes of {bytes}");
    }
}

#[test]
fn power_cut_in_sgp() {
    for value in [0, 1, 255, 59_999, 65_535] {
        cut_power("SGP", &full(), |bench| _ = bench.ask(&format!("SGP 68, 0, {value}")));
    }
    cut_power("first SGP", &Memory::blank(0xff), |bench| _ = bench.ask("SGP 82, 0, 1234"));
    cut_power("first SGP", &Memory::blank(0), |bench| _ = bench.ask("SGP 82, 0, 1234"));
}

#[test]
fn power_cut_in_stgp() {
    cut_power("STGP", &full(), |bench| bench.all("SGP 1, 2, -7; STGP 1, 2"));
    cut_power("STGP of 0", &full(), |bench| bench.all("SGP 3, 2, 0; STGP 3, 2"));
    cut_power("first STGP", &Memory::blank(0xff), |bench| bench.all("SGP 5, 2, -1; STGP 5, 2"));
}

#[test]
fn power_cut_in_coordinate_commands() {
    cut_power("SCO", &full(), |bench| bench.all("SCO 1, 0, -5; SCO 2, 1, 7"));
    cut_power("ACO", &full(), |bench| bench.all("CALC LOAD, -5; ACO 3, 0"));
    cut_power("CCO", &full(), |bench| bench.all("SAP 1, 1, -5; CCO 1, 1"));
    let set = "SGP 84, 0, 0; SCO 1, 0, 5; SCO 2, 0, 6; SCO 3, 2, 7";
    cut_power("SCO n, 255, 0", &full(), |bench| bench.all(&format!("{set}; SCO 3, 255, 0")));
    cut_power("SCO 0, 255, 0", &full(), |bench| bench.all(&format!("{set}; SCO 0, 255, 0")));
}

#[test]
fn power_cut_in_a_download() {
    cut_power("download", &full(), |bench| bench.download_at(1, "MVP ABS, 1, -1; DATA 99, 255, 255, -1; STOP; STOP"));
    cut_power("first download", &Memory::blank(0xff), |bench| bench.download("CALC LOAD, 5; STOP"));
}

#[test]
fn power_cut_in_factory_settings() {
    cut_power("137", &full(), |bench| assert_eq!(bench.send(instruction("DATA 137, 0, 0, 1234")), None));
}

#[test]
fn power_cut_in_erasing_the_program() {
    let mut bench = Bench::with_memory(full());
    bench.ask("SGP 81, 0, 1");
    let memory = bench.module.into_parts().1;
    let bytes = {
        let mut bench = Bench::with_memory(memory.clone());
        bench.ask("SGP 81, 0, 0");
        bench.memory().written() - memory.written()
    };
    for power in 0..=bytes {
        let mut bench = Bench::with_memory(Memory { power: Some(power), ..memory.clone() });
        bench.ask("SGP 81, 0, 0");
        let cut = bench.module.into_parts().1;
        let (found, mut bench) = Stored::read(&cut);
        let protected = bench.global(81, 0);
        let visible = found.program.iter().any(|bytes| bytes[1..8] != [0; 7]);
        assert!(!visible, "the program is never shown, cut after {power} bytes of {bytes}");
        assert_eq!((found.globals[1], found.variables[1]), (60_000, 1111), "nothing else is lost");
        assert!(power < bytes || protected == 0);
    }
}

#[test]
fn unchanged_values_are_not_written_again() {
    for (first, again) in [
        ("SGP 68, 0, 100", "SGP 68, 0, 100"),
        ("SGP 68, 0, 0", "SGP 68, 0, 0"),
        ("SGP 1, 2, 5; STGP 1, 2", "STGP 1, 2"),
        ("SGP 84, 0, 1; SCO 1, 0, 5", "SCO 1, 0, 5"),
        ("SCO 1, 0, 5; SCO 0, 255, 0", "GCO 0, 255; SCO 0, 255, 0; SCO 1, 255, 0"),
        ("SGP 1, 2, 5; STGP 1, 2", "SGP 1, 2, 6; RSGP 1, 2; STGP 1, 2"),
    ] {
        let mut bench = Bench::set_up(first);
        let written = bench.memory().written();
        bench.all(again);
        assert_eq!(bench.memory().written(), written, "{again}");
        let mut bench = bench.power_cycle();
        bench.all(again);
        assert_eq!(bench.memory().written(), written, "{again} after a power cycle");
    }
}

#[test]
fn unchanged_program_is_not_written_again() {
    let program = "CALC LOAD, 1; DATA 0, 0, 0, 0; STOP";
    let mut bench = Bench::new();
    bench.download(program);
    let written = bench.memory().written();
    bench.download(program);
    let mut bench = bench.power_cycle();
    bench.download(program);
    assert_eq!(bench.memory().written(), written);
}

#[test]
fn write_costs_at_most_nine_byte_writes() {
    let mut bench = Bench::new();
    for (i, value) in [1, 65_535, 0, 258, 77].into_iter().enumerate() {
        let written = bench.memory().written();
        bench.ask(&format!("SGP 68, 0, {value}"));
        let cost = bench.memory().written() - written;
        assert!((1..=9).contains(&cost), "write {i} costs {cost}");
    }
}

#[test]
fn writes_alternate_between_two_slots() {
    let mut bench = Bench::new();
    for value in 1..=1000 {
        bench.ask(&format!("SGP 68, 0, {value}"));
    }
    let most = bench.memory().writes.iter().copied().max();
    assert!(most <= Some(1000), "{most:?} writes of one cell: header out and in, every other time");
    assert_eq!(bench.power_cycle().global(68, 0), 1000);
}

#[test]
fn reading_and_power_cycles_write_nothing() {
    let mut bench = Bench::with_memory(full());
    let written = bench.memory().written();
    for _ in 0..3 {
        bench = bench.power_cycle();
        bench.all("GGP 68, 0; RSGP 1, 2; GCO 1, 0; GCO 0, 255");
    }
    assert_eq!(bench.memory().written(), written);
}

#[test]
fn motion_and_programs_write_nothing() {
    let mut bench = Bench::new();
    bench.download("SGP 5, 2, 1; SAP 4, 0, 100; MVP ABS, 0, 5; WAIT POS, 0, 0; SCO 1, 0, 5; STOP");
    let written = bench.memory().written();
    bench.control(129, 0, 0);
    bench.advance_ms(5000);
    assert_eq!(bench.memory().written(), written);
}

#[test]
fn user_variables_are_stored_by_stgp_only() {
    for (commands, value) in
        [("SGP 55, 2, 5", 0), ("SGP 55, 2, 5; STGP 55, 2", 5), ("SGP 55, 2, 5; STGP 55, 2; SGP 55, 2, 6", 5)]
    {
        assert_eq!(Bench::set_up(commands).power_cycle().variable(55), value, "{commands}");
    }
}

#[test]
fn rsgp_restores_a_variable() {
    let mut bench = Bench::set_up("SGP 3, 2, 5; STGP 3, 2; SGP 3, 2, 6; RSGP 3, 2; SGP 4, 2, 7; RSGP 4, 2");
    assert_eq!((bench.variable(3), bench.variable(4)), (5, 0), "what was never stored is 0");
}

#[test]
fn global_parameter_85_lets_user_variables_start_at_0() {
    let bench = Bench::set_up("SGP 3, 2, 5; STGP 3, 2; SGP 85, 0, 1");
    let mut bench = bench.power_cycle();
    assert_eq!(bench.variable(3), 0);
    bench.all("RSGP 3, 2; SGP 85, 0, 0");
    assert_eq!(bench.variable(3), 5, "still stored");
    assert_eq!(bench.power_cycle().variable(3), 5);
}

#[test]
fn there_is_no_lock_of_the_eeprom() {
    let mut bench = Bench::new();
    assert_eq!((bench.exchange("SGP 73, 0, 1234").0, bench.exchange("GGP 73, 0").0), (3, 3));
}

#[test]
fn blank_memories_hold_defaults_and_an_empty_program() {
    for blank in [0, 0xff] {
        let (stored, _) = Stored::read(&Memory::blank(blank));
        assert_eq!(stored, Stored::read(&Memory::blank(0)).0, "bytes of {blank}");
        assert!(stored.variables.iter().chain(&stored.coordinates).all(|value| *value == 0));
        assert_eq!(stored.program[0], [2, 0, 0, 0, 0, 0, 0, 0, 2]);
        cut_power("on a blank memory", &Memory::blank(blank), |bench| {
            bench.all("SGP 68, 0, 5; SGP 1, 2, -1; STGP 1, 2");
        });
    }
}

#[test]
fn stored_value_that_its_row_does_not_accept_leaves_the_default() {
    const RECORD: usize = 16;
    let row = |number| TMCM_3351.global_parameters.iter().position(|row| row.bank == 0 && row.first == number).unwrap();
    let record = |number| (usize::from(TMCM_3351.program_len) + row(number)) * RECORD;
    let mut bench = Bench::set_up("SGP 75, 0, 200");
    let (pause, auto_start) = (record(75), record(77));
    bench.memory().bytes.copy_within(pause..pause + RECORD, auto_start);
    let mut bench = bench.power_cycle();
    assert_eq!([75, 77].map(|number| bench.global(number, 0)), [200, 0]);
}

#[test]
fn absent_memory_leaves_a_working_module() {
    let nothing = Memory { bytes: Vec::new(), writes: Vec::new(), power: Some(0) };
    let mut bench = Bench::with(Machine::default(), nothing);
    bench.all("SGP 68, 0, 500; SGP 1, 2, 5; STGP 1, 2");
    assert_eq!((bench.global(68, 0), bench.variable(1)), (500, 5));
    assert_eq!(bench.power_cycle().global(68, 0), 0);
}

#[test]
fn random_memory_is_survived() {
    let mut seed = 1_u64;
    for _ in 0..20 {
        let mut memory = Memory::blank(0);
        for byte in &mut memory.bytes {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            *byte = (seed >> 56) as u8;
        }
        let mut bench = Bench::with_memory(memory);
        bench.raw(&crate::support::request(instruction("DATA 129, 0, 0, 0")).emit());
        bench.advance_ms(20);
    }
}
