//! Null channel of the encoder, measured speeds, stop on a deviation of speed (TMCM-3351 §6.2).

use gradus_firmware::NullEvent;

use crate::support::Bench;

// Null channel.

/// Lets a null event come at `null` and the counter reach `encoder`.
fn pass_null(bench: &mut Bench, null: i32, encoder: i32) {
    let stage = bench.stage(0);
    (stage.null, stage.encoder) = (Some(null), encoder);
}

/// Latched positions of motor and encoder, position of the encoder.
fn latched(bench: &mut Bench) -> [i32; 3] {
    [198, 199, 209].map(|number| bench.get(number, 0))
}

#[test]
fn encoder_mode_says_what_a_null_event_is() {
    let event = |n, ab| Some(NullEvent { n, ab });
    let (low, high) = (false, true);
    for (mode, expected) in [
        (0, None),
        (4, None),
        (256 + 15, None),
        (16, event(low, Some((low, low)))),
        (16 + 1, event(low, Some((high, low)))),
        (16 + 2, event(low, Some((low, high)))),
        (16 + 4, event(high, Some((low, low)))),
        (16 + 7, event(high, Some((high, high)))),
        (16 + 8, event(low, None)),
        (32 + 15, event(high, None)),
        (48 + 12, event(high, None)),
    ] {
        let mut bench = Bench::set_up(&format!("SAP 201, 0, {mode}"));
        assert_eq!(bench.stage(0).null_event, expected, "mode {mode}");
        bench.ask("SAP 201, 0, 0");
        assert_eq!(bench.stage(0).null_event, None, "after mode {mode}");
    }
}

#[test]
fn null_event_latches_the_positions_of_a_standing_axis() {
    let mut bench = Bench::set_up("SAP 201, 0, 28; SAP 1, 0, 700");
    pass_null(&mut bench, 4_096, 8_192);
    assert_eq!(latched(&mut bench), [700, 51_200, 102_400]);
    pass_null(&mut bench, -4_096, 0);
    assert_eq!(latched(&mut bench), [700, -51_200, 0], "the next event too");
}

#[test]
fn null_event_clears_the_encoder_where_the_mode_says_so() {
    for (mode, positions) in [
        // 100 counts are 1250 microsteps.
        (16, [51_200, 53_700, 54_950]),
        (32, [51_200, 51_200, 54_950]),
        (48, [51_200, 53_700, 54_950]),
        (256 + 16, [51_200, 2_500, 1_250]),
        (256 + 32, [51_200, 51_200, 3_750]),
    ] {
        let mut bench = Bench::set_up(&format!("SAP 201, 0, {}", mode + 12));
        pass_null(&mut bench, 4_096, 4_096);
        let first = latched(&mut bench)[1];
        pass_null(&mut bench, 4_296, 4_396);
        let [_, latch, encoder] = latched(&mut bench);
        assert_eq!([first, latch, encoder], positions, "mode {mode}");
        assert_eq!(bench.get(201, 0), mode + 12);
    }
}

#[test]
fn once_is_armed_again_by_writing_the_mode() {
    let mut bench = Bench::set_up("SAP 201, 0, 44");
    pass_null(&mut bench, 100, 100);
    assert_eq!(latched(&mut bench), [0, 1_250, 1_250]);
    assert_eq!(bench.stage(0).null_event, None);
    bench.ask("SAP 201, 0, 44");
    pass_null(&mut bench, 200, 200);
    assert_eq!(latched(&mut bench), [0, 2_500, 2_500]);
}

#[test]
fn moving_axis_latches_its_position_at_the_event() {
    // A tick is 5.12 microsteps, a count 12.5.
    for speed in [51_200_i32, -51_200] {
        let mut bench = Bench::fast();
        bench.stage(0).coupled = true;
        bench.all(&format!("SAP 201, 0, 28; ROR 0, {speed}"));
        bench.advance_ms(300);
        let encoder = bench.stage(0).encoder;
        let (null, apart) = (encoder - 40 * speed.signum(), 500 * speed.signum());
        bench.stage(0).null = Some(null);
        bench.advance_us(100);
        let here = bench.get(1, 0);
        let [motor, latch, _] = latched(&mut bench);
        assert!((here - motor - apart).abs() <= 18, "{speed} pps: {motor} latched, {here} now");
        assert!((motor - latch).abs() <= 13, "{speed} pps: motor {motor}, encoder {latch}");
    }
}

#[test]
fn restart_forgets_the_encoder_mode() {
    let mut bench = Bench::set_up("SAP 201, 0, 28");
    pass_null(&mut bench, 100, 100);
    assert_eq!(latched(&mut bench)[1], 1_250);
    bench.control(255, 0, 1234);
    bench.advance_ms(1);
    assert_eq!(bench.stage(0).null_event, None);
    assert_eq!(latched(&mut bench), [0, 0, 0]);
}

// Measured speeds.

/// One count in the window of 8 ms, in pps.
const COUNT_PPS: i32 = 1_563;

/// A bench whose encoder follows the coils of axis 0.
fn coupled(commands: &str) -> Bench {
    let mut bench = Bench::fast();
    bench.stage(0).coupled = true;
    bench.all(commands);
    bench
}

#[test]
fn measured_speed_is_that_of_the_motor() {
    for (settings, speed, expected) in [
        ("", 51_200, 51_200),
        ("", -51_200, -51_200),
        ("", 200_000, 200_000),
        ("", 1_000, 1_000),
        ("SAP 210, 0, -4096", 51_200, -51_200),
        ("SAP 140, 0, 4", 3_200, 3_200),
        ("SAP 210, 0, 0", 51_200, 0),
    ] {
        let mut bench = coupled(&format!("{settings}; ROR 0, {speed}"));
        bench.advance_ms(400);
        for _ in 0..50 {
            bench.advance_ms(1);
            let [mean, now] = [131, 132].map(|number| bench.get(number, 0));
            assert!((now - expected).abs() <= COUNT_PPS, "{settings} {speed} pps: {now}");
            assert!((mean - expected).abs() <= COUNT_PPS / 2, "{settings} {speed} pps: {mean} averaged");
        }
    }
}

#[test]
fn measured_speed_of_a_standing_axis_is_0() {
    let mut bench = coupled("ROR 0, 51200");
    bench.advance_ms(300);
    bench.ask("MST 0");
    bench.until(1_000, |bench| bench.get(3, 0) == 0);
    bench.advance_ms(2);
    assert_eq!(bench.get(132, 0), 0);
    bench.advance_ms(50);
    assert_eq!(bench.get(131, 0), 0);
}

#[test]
fn shaft_turned_by_hand_has_a_speed() {
    let mut bench = Bench::new();
    bench.advance_ms(1_000);
    bench.stage(0).encoder = 4_096;
    // A turn in the second since power-on.
    assert_eq!([131, 132].map(|number| bench.get(number, 0)), [51_200, 51_200]);
}

#[test]
fn average_follows_with_the_time_constant_of_its_parameters() {
    // Milliseconds after the middle of the ramp, by which the mean has 63 % of the speed: 4 of the window and the filter's.
    for (settings, milliseconds) in [
        ("SAP 137, 0, 0", 4),
        ("", 8),
        ("SAP 137, 0, 10", 36),
        ("SAP 138, 0, 8000", 68),
        ("SAP 136, 0, 100; SAP 138, 0, 400; SAP 137, 0, 12", 132),
    ] {
        let mut bench = coupled(&format!("{settings}; SAP 5, 0, 10000000; ROR 0, 100000"));
        let reached = bench.until(1_000, |bench| bench.get(131, 0) >= 63_200);
        let expected = 5_000 + milliseconds * 1_000;
        assert!(reached.abs_diff(expected) <= 2_000 + expected / 20, "{settings:?}: {reached} us, expected {expected}");
    }
}

// Deviation of speed.

#[test]
fn blocked_shaft_stops_the_motor_when_its_speed_deviates() {
    for (limit, stops) in [(0, false), (30_000, true), (50_000, true), (60_000, false)] {
        let mut bench = coupled(&format!("SAP 213, 0, {limit}; ROR 0, 51200"));
        bench.advance_ms(300);
        assert_eq!(bench.get(3, 0), 51_200, "limit {limit}: the shaft follows");
        bench.stage(0).coupled = false;
        bench.advance_ms(30);
        assert_eq!(bench.get(3, 0) == 0, stops, "limit {limit}");
        assert_eq!(bench.get(207, 0), if stops { 2 } else { 0 }, "limit {limit}");
        assert_eq!(bench.get(1, 0) == bench.get(209, 0), stops, "limit {limit}");
    }
}

#[test]
fn motor_that_is_followed_never_deviates_in_speed() {
    for (name, commands, stop_switch) in [
        ("steep ramp", "SAP 5, 0, 10000000; ROR 0, 200000", false),
        ("start speed", "SAP 15, 0, 100000; ROR 0, 200000", false),
        ("hard stop at a switch", "SAP 12, 0, 3; ROR 0, 200000", true),
        ("reversal", "ROR 0, 100000; ROR 0, -100000", false),
        ("new position counter", "ROR 0, 100000; SAP 1, 0, -7777777", false),
        ("new encoder position", "ROR 0, 100000; SAP 209, 0, -7777777", false),
    ] {
        let mut bench = coupled(&format!("SAP 213, 0, {}", 2 * COUNT_PPS));
        for command in commands.split(';') {
            bench.all(command);
            bench.advance_ms(300);
        }
        bench.stage(0).switches.right = stop_switch;
        bench.advance_ms(300);
        assert_eq!(bench.get(207, 0), 0, "{name}");
    }
}

#[test]
fn motor_starts_again_after_a_deviation_of_speed() {
    let mut bench = coupled("SAP 213, 0, 20000; ROR 0, 51200");
    bench.advance_ms(300);
    bench.stage(0).coupled = false;
    bench.until(30, |bench| bench.get(3, 0) == 0);
    // The shaft comes to where the coils are before the motor starts.
    bench.stage(0).coupled = true;
    bench.ask("SAP 6, 0, 200");
    bench.advance_ms(10);
    bench.ask("ROR 0, 51200");
    bench.advance_ms(300);
    assert_eq!((bench.get(3, 0), bench.get(207, 0)), (51_200, 0));
}

#[test]
fn deviation_of_speed_raises_interrupt_and_flag() {
    let mut bench = Bench::new();
    bench.run(
        "VECT 21, 8; EI 21; EI 255; SAP 213, 0, 1000; ROR 0, 10000; WAIT TICKS, 0, 50; JC EDV, 7; STOP; \
         SGP 1, 2, 1; RETI",
    );
    assert_eq!(bench.variable(1), 1);
}
