//! The driver chip: what it is told, and what it reports.

use gradus_firmware::{CoolStep, DriverSettings, DriverState, StealthChop};

use crate::support::Bench;

/// What the chip of axis 0 was told after some commands.
fn settings(commands: &str) -> DriverSettings {
    let mut bench = Bench::new();
    bench.all(commands);
    bench.stage(0).driver_settings.unwrap()
}

/// What a chip is told at the start.
const FACTORY: DriverSettings = DriverSettings {
    enabled: true,
    shorted: false,
    stall_threshold: 0,
    stall_filter: false,
    cool_step: None,
    stealth_chop: None,
};

#[test]
fn parameters_become_settings_of_the_chip() {
    let cool = CoolStep { above: 16_777_215, low: 3, hysteresis: 0, up: 1, down: 32, quarter: false };
    let stealth = StealthChop { below: 16_777_215, gradient: 4, amplitude: 128, autoscale: true };
    let cases = [
        ("", FACTORY),
        ("SAP 174, 0, -12", DriverSettings { stall_threshold: -12, ..FACTORY }),
        ("SAP 173, 0, 1", DriverSettings { stall_filter: true, ..FACTORY }),
        ("SAP 167, 0, 0", DriverSettings { enabled: false, ..FACTORY }),
        ("SAP 168, 0, 1; SAP 169, 0, 3; SAP 170, 0, 5; SAP 171, 0, 3; SAP 182, 0, 5000", FACTORY),
        ("SAP 172, 0, 3", DriverSettings { cool_step: Some(cool), ..FACTORY }),
        (
            "SAP 172, 0, 3; SAP 168, 0, 1; SAP 169, 0, 2; SAP 170, 0, 5; SAP 171, 0, 3; SAP 182, 0, 5000",
            DriverSettings {
                cool_step: Some(CoolStep { above: 5_000, hysteresis: 5, up: 8, down: 2, quarter: true, ..cool }),
                ..FACTORY
            },
        ),
        ("SAP 186, 0, 5000; SAP 188, 0, 70; SAP 192, 0, 0", FACTORY),
        ("SAP 187, 0, 4", DriverSettings { stealth_chop: Some(stealth), ..FACTORY }),
        (
            "SAP 187, 0, 4; SAP 186, 0, 5000; SAP 188, 0, 70; SAP 192, 0, 0",
            DriverSettings {
                stealth_chop: Some(StealthChop { below: 5_000, amplitude: 70, autoscale: false, ..stealth }),
                ..FACTORY
            },
        ),
        ("SAP 204, 0, 1", FACTORY),
        ("SAP 204, 0, 2", DriverSettings { shorted: true, ..FACTORY }),
        ("SAP 204, 0, 3", DriverSettings { shorted: true, ..FACTORY }),
    ];
    for (commands, expected) in cases {
        assert_eq!(settings(commands), expected, "{commands}");
    }
}

#[test]
fn speeds_are_those_of_the_coil_vector() {
    for (resolution, factor) in [(8, 1), (4, 16), (0, 256)] {
        for commands in ["SAP 172, 0, 1; SAP 182, 0, 1000; SAP 140", "SAP 172, 0, 1; SAP 140"] {
            let later = if commands.contains("182") { "" } else { "; SAP 182, 0, 1000" };
            let above = settings(&format!("{commands}, 0, {resolution}{later}")).cool_step.unwrap().above;
            assert_eq!(above, 1_000 * factor, "resolution {resolution}");
        }
    }
    assert_eq!(settings("SAP 140, 0, 0; SAP 172, 0, 1; SAP 182, 0, 2147483647").cool_step.unwrap().above, u32::MAX);
}

#[test]
fn coils_of_a_driver_that_is_switched_off_are_open() {
    let mut bench = Bench::new();
    bench.all("SAP 204, 0, 2");
    let shorted = [false, true].map(|enable| {
        bench.board().enable = enable;
        bench.advance_ms(1);
        bench.stage(0).driver_settings.unwrap().shorted
    });
    assert_eq!(shorted, [false, true]);
}

#[test]
fn restart_gives_the_chip_its_first_settings() {
    let mut bench = Bench::new();
    bench.all("SAP 174, 0, 5");
    bench.control(255, 0, 1234);
    bench.advance_ms(1);
    assert_eq!(bench.stage(0).driver_settings, Some(FACTORY));
}

#[test]
fn reports_of_the_chip_can_be_read() {
    let mut bench = Bench::new();
    bench.advance_ms(100);
    bench.stage(2).driver = DriverState { load: 321, flags: 6, current_step: 12, pwm_scale: 200, stealth_chop: true };
    for (number, expected) in [(206, 321), (208, 6 | 128), (180, 12), (189, 200), (190, 1)] {
        assert_eq!(bench.get(number, 2), expected, "parameter {number}");
    }
    bench.ask("ROR 2, 1000");
    bench.advance_ms(10);
    assert_eq!(bench.get(208, 2), 6, "no standstill");
}

#[test]
fn standstill_is_flagged_after_two_to_the_twentieth_clocks() {
    const STANDSTILL: i32 = 128;
    let mut bench = Bench::fast();
    bench.advance_us(65_000);
    assert_eq!(bench.get(208, 0), 0, "after power-on");
    bench.advance_us(1_000);
    assert_eq!(bench.get(208, 0), STANDSTILL);
    bench.ask("MVP ABS, 0, 100");
    bench.arrive(0);
    assert_eq!(bench.get(208, 0), 0, "just arrived");
    bench.advance_us(65_000);
    assert_eq!(bench.get(208, 0), 0);
    bench.advance_us(1_000);
    assert_eq!(bench.get(208, 0), STANDSTILL);
}

#[test]
fn reading_of_zero_is_a_stall_above_one_turn_a_second_only() {
    for (settings, speed, stall) in [
        ("", 0, 0),
        ("", 51_000, 0),
        ("", 52_000, 1),
        ("", -52_000, 1),
        ("SAP 140, 0, 4", 3_000, 0),
        ("SAP 140, 0, 4", 3_300, 1),
        ("SAP 202, 0, 400", 102_000, 0),
        ("SAP 202, 0, 400", 103_000, 1),
    ] {
        let mut bench = Bench::fast();
        bench.all(&format!("{settings}; ROR 0, {speed}"));
        bench.advance_ms(200);
        bench.stage(0).driver.flags = DriverState::STALL;
        bench.advance_ms(1);
        let what = format!("{settings}, {speed} pps");
        assert_eq!(bench.get(208, 0) & 1, stall, "{what}: AP 208");
        assert_eq!((bench.get(207, 0), bench.get(207, 0)), (stall, 0), "{what}: AP 207, once");
        assert_eq!(bench.get(3, 0), speed, "{what}: it goes on without AP 181");
    }
}
