//! The null channel of the encoder (TMCM-3351 §6.2).

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
