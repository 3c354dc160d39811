//! When the module works and when it rests.

use crate::support::Bench;

#[test]
fn ticks_come_once_a_pwm_period_while_the_driver_works() {
    for (hz, in_a_second) in
        [(25_000, 25_000), (50_000, 50_000), (100_000, 100_000), (30_000, 30_003), (60_000, 59_988)]
    {
        let mut bench = Bench::set_up(&format!("SAP 110, 0, {hz}"));
        assert_eq!((bench.drive().frequency_hz, bench.module.poll_at()), (hz, None), "nothing commutates");
        bench.set(15, 2);
        assert_eq!(bench.periods_in_ms(1000), in_a_second, "{hz} Hz by a counter of 100 MHz");
    }
}

#[test]
fn module_rests_when_driver_and_rotor_do() {
    let mut bench = Bench::set_up("SAP 15, 0, 2; SAP 255, 0, 0");
    assert!(bench.drive().rests, "the driver is off at once");
    bench.drive().counts_per_tick = 3;
    assert_eq!(bench.periods_in_ms(100), 2500, "the rotor turns");
    assert_eq!(bench.drive().duties, None);
    bench.drive().counts_per_tick = 0;
    assert_eq!(bench.periods_in_ms(1000), 1 + 6250, "a quarter of a second after it was seen to move");
    assert_eq!((bench.module.poll_at(), bench.drive().rests, bench.get(42)), (None, true, 0));
}

#[test]
fn rotor_that_somebody_turns_is_followed() {
    let mut bench = Bench::set_up("SAP 25, 0, 1");
    for _ in 0..10 {
        bench.drive().encoder += 100;
        bench.advance_ms(1000);
    }
    assert_eq!(bench.get(52), 16_000, "1000 of 4096 counts");
    assert_eq!(bench.module.poll_at(), None);
}

#[test]
fn nothing_moves_without_a_motor_or_a_commutation() {
    for set_up in ["SAP 14, 0, 0; SAP 15, 0, 2", "SAP 15, 0, 0"] {
        let mut bench = Bench::set_up(&format!("{set_up}; ROR 0, 1000"));
        assert_eq!(bench.periods_in_ms(100), 0, "{set_up}");
        assert!(bench.has_flags(1 << 9), "the command stands");
    }
}

#[test]
fn loops_run_always() {
    let mut bench = Bench::new();
    let loops = |bench: &mut Bench| [230, 231, 232].map(|number| bench.get(number));
    assert_eq!(loops(&mut bench), [1000, 25_000, 25_000], "at rest");
    bench.all("SAP 15, 0, 2; SAP 110, 0, 50000; SAP 30, 0, 100");
    assert_eq!(loops(&mut bench), [1000, 50_000, 50_000]);
    bench.ask("ROR 0, 100");
    assert_eq!(loops(&mut bench), [1000, 50_000, 50_000]);
}
