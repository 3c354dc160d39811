//! Interrupts of a running program (BEHAVIOUR 4, TMCM-3351 §3.5.6).
//!
//! The programs have their handlers at fixed addresses behind an idle loop.

use crate::support::Bench;

/// A program that sets up interrupts, idles, and has handlers at addresses 20, 30 and 40.
fn with_handlers(set_up: &str, handlers: [&str; 3]) -> Bench {
    let mut bench = Bench::new();
    let length = crate::support::lines(set_up).count();
    assert!(length < 19, "the handlers begin at 20");
    for (address, handler) in [20, 30, 40].into_iter().zip(handlers) {
        bench.download_at(address, &format!("{handler}; RETI"));
    }
    bench.start(&format!("{set_up}; JA {length}"));
    bench
}

/// A program with one handler that counts in variable 1.
fn counting(set_up: &str) -> Bench {
    with_handlers(set_up, ["CALCV ADD, 1, 1", "STOP", "STOP"])
}

// Timers.

#[test]
fn timer_interrupts_at_its_period() {
    for (timer, period) in [(0, 1), (1, 7), (2, 100)] {
        let mut bench = counting(&format!("VECT {timer}, 20; SGP {timer}, 3, {period}; EI {timer}; EI 255"));
        bench.advance_us(period * 10_000 + 500);
        assert_eq!(bench.variable(1), 10, "timer {timer}");
    }
}

#[test]
fn timer_counts_from_ei() {
    let mut bench = counting("VECT 0, 20; SGP 0, 3, 10; WAIT TICKS, 0, 5; EI 255; EI 0");
    bench.advance_us(50_000 + 9_900);
    assert_eq!(bench.variable(1), 0);
    bench.advance_us(300);
    assert_eq!(bench.variable(1), 1);
}

#[test]
fn timer_keeps_its_rhythm() {
    let mut bench = with_handlers("VECT 0, 20; SGP 0, 3, 10; EI 0; EI 255", ["GGP 132, 0; AGP 1, 2", "STOP", "STOP"]);
    bench.advance_us(100_000 * 10 + 500);
    assert_eq!(bench.variable(1), 1000, "the hundredth interrupt comes after a second");
}

#[test]
fn writing_the_period_starts_the_timer_again() {
    let mut bench = counting("VECT 0, 20; SGP 0, 3, 10; EI 0; EI 255");
    bench.advance_ms(8);
    bench.ask("SGP 0, 3, 10");
    bench.advance_us(9_900);
    assert_eq!(bench.variable(1), 0);
    bench.advance_us(300);
    assert_eq!(bench.variable(1), 1);
}

#[test]
fn period_0_is_off_and_can_be_set_later() {
    let mut bench = counting("VECT 0, 20; EI 0; EI 255");
    bench.advance_ms(100);
    assert_eq!(bench.variable(1), 0);
    bench.ask("SGP 0, 3, 10");
    bench.advance_us(30_500);
    assert_eq!(bench.variable(1), 3);
    bench.ask("SGP 0, 3, 0");
    bench.advance_ms(100);
    assert_eq!(bench.variable(1), 3);
}

#[test]
fn disabled_timer_is_silent_and_starts_again_with_ei() {
    let mut bench = counting("VECT 0, 20; SGP 0, 3, 10; EI 0; EI 255");
    bench.advance_ms(25);
    bench.ask("DI 0");
    bench.advance_ms(100);
    assert_eq!(bench.variable(1), 2);
    bench.ask("EI 0");
    bench.advance_us(9_900);
    assert_eq!(bench.variable(1), 2);
    bench.advance_us(300);
    assert_eq!(bench.variable(1), 3);
}

// Edges.

#[test]
fn input_edges_by_their_setting() {
    for (transition, rising, falling) in [(0, 0, 0), (1, 1, 0), (2, 0, 1), (3, 1, 1)] {
        for input in 0..8 {
            let number = 39 + input;
            let mut bench = counting(&format!("VECT {number}, 20; SGP {number}, 3, {transition}; EI {number}; EI 255"));
            bench.advance_ms(1);
            bench.board().inputs = 1 << input;
            bench.advance_ms(1);
            bench.advance_ms(1);
            assert_eq!(bench.variable(1), rising, "input {input}, transition {transition}");
            bench.board().inputs = !(1 << input);
            bench.advance_ms(1);
            bench.advance_ms(1);
            assert_eq!(bench.variable(1), rising + falling, "input {input}, transition {transition}");
        }
    }
}

#[test]
fn stop_switch_edges_by_their_setting() {
    for (transition, rising, falling) in [(0, 0, 0), (1, 1, 0), (2, 0, 1), (3, 1, 1)] {
        for switch in 0..6 {
            let number = 27 + switch;
            let mut bench = counting(&format!("VECT {number}, 20; SGP {number}, 3, {transition}; EI {number}; EI 255"));
            bench.advance_ms(1);
            for (level, expected) in [(true, rising), (false, rising + falling)] {
                let switches = &mut bench.stage(switch / 2).switches;
                *(if switch % 2 == 0 { &mut switches.left } else { &mut switches.right }) = level;
                bench.advance_ms(1);
                bench.advance_ms(1);
                assert_eq!(bench.variable(1), expected, "switch {switch}, transition {transition}, {level}");
            }
        }
    }
}

#[test]
fn several_edges_at_once_are_handled_by_number() {
    let mut bench = with_handlers(
        "VECT 40, 20; VECT 41, 30; VECT 39, 40; SGP 39, 3, 1; SGP 40, 3, 1; SGP 41, 3, 1; EI 39; EI 40; EI 41; EI 255",
        ["CALCV MUL, 1, 10; CALCV ADD, 1, 2", "CALCV MUL, 1, 10; CALCV ADD, 1, 3", "CALCV MUL, 1, 10; CALCV ADD, 1, 1"],
    );
    bench.advance_ms(1);
    bench.board().inputs = 0b111;
    bench.advance_ms(1);
    bench.advance_ms(1);
    assert_eq!(bench.variable(1), 123);
}

// Motion.

#[test]
fn position_reached() {
    for axis in 0..3 {
        let number = 3 + axis;
        let mut bench = counting(&format!("VECT {number}, 20; EI {number}; EI 255; MVP ABS, {axis}, 1000"));
        bench.advance_ms(1);
        assert_eq!(bench.variable(1), 0);
        bench.arrive(axis);
        bench.advance_ms(1);
        assert_eq!(bench.variable(1), 1, "axis {axis}");
        bench.ask(&format!("ROR {axis}, 10"));
        bench.advance_ms(1000);
        assert_eq!(bench.variable(1), 1, "not in velocity mode");
        bench.ask(&format!("MVP ABS, {axis}, 0"));
        bench.advance_ms(1000);
        assert_eq!(bench.variable(1), 2, "axis {axis}");
    }
}

#[test]
fn stall() {
    let mut bench = counting("VECT 16, 20; EI 16; EI 255; SAP 181, 1, 1000; ROR 1, 20000");
    bench.advance_ms(500);
    bench.stage(1).driver.flags = 1;
    bench.advance_ms(1);
    assert_eq!((bench.variable(1), bench.get(3, 1)), (1, 0));
    assert_eq!((bench.get(207, 1), bench.get(207, 1)), (1, 0), "AP 207 is cleared by reading");
}

#[test]
fn stall_that_stops_nothing_is_raised_once() {
    let mut bench = counting("VECT 16, 20; EI 16; EI 255; SAP 5, 1, 1000000; ROR 1, 60000");
    bench.advance_ms(500);
    for stalls in 1..3 {
        bench.stage(1).driver.flags = 1;
        bench.advance_ms(10);
        assert_eq!((bench.variable(1), bench.get(3, 1)), (stalls, 60_000));
        bench.stage(1).driver.flags = 0;
        bench.advance_ms(10);
    }
}

#[test]
fn deviation() {
    let mut bench = counting("VECT 22, 20; EI 22; EI 255; SAP 212, 1, 100; ROR 1, 5000");
    bench.advance_ms(500);
    assert_eq!((bench.variable(1), bench.get(3, 1)), (1, 0));
    assert_eq!((bench.get(207, 1), bench.get(207, 1)), (2, 0));
}

// Rules.

#[test]
fn handler_restores_accumulator_x_register_and_flags() {
    let mut bench = with_handlers(
        "VECT 0, 20; SGP 0, 3, 1; CALC LOAD, 5; CALCX LOAD; COMP 9; EI 0; EI 255; DATA 0, 0, 0, 0; JC GE, 12; JC ZE, 12; JA 7",
        ["CALC LOAD, 0; CALCX LOAD; CALC LOAD, 77; CALCV ADD, 1, 1", "STOP", "STOP"],
    );
    bench.advance_us(20_500);
    bench.control(128, 0, 0);
    assert_eq!((bench.variable(1), bench.accumulator(), bench.x()), (20, 5, 5));
    assert!((7..12).contains(&bench.program_counter()), "flags kept, at {}", bench.program_counter());
}

#[test]
fn deviation_during_a_handler_is_known_after_it() {
    let mut bench = with_handlers(
        "VECT 39, 20; SGP 39, 3, 1; EI 39; EI 255; CALC LOAD, 7; COMP 9; DATA 0, 0, 0, 0; JC EDV, 9; JA 6; JC LT, 11; STOP; \
         SGP 3, 2, 1; STOP",
        ["CALC LOAD, 0; WAIT TICKS, 0, 50", "STOP", "STOP"],
    );
    bench.all("SAP 212, 1, 100");
    bench.advance_ms(1);
    bench.board().inputs = 1;
    bench.advance_ms(10);
    bench.all("ROR 1, 50000");
    bench.advance_ms(400);
    assert_eq!(bench.get(207, 1), 2, "it happens while the handler waits");
    bench.advance_ms(100);
    assert_eq!((bench.variable(3), bench.is_running()), (1, false), "EDV stays, LT is restored");
}

#[test]
fn wait_that_times_out_in_a_handler_leaves_eto() {
    let mut bench = with_handlers(
        "VECT 39, 20; SGP 39, 3, 1; EI 39; EI 255; JC ETO, 6; JA 4; SGP 3, 2, 1; STOP",
        ["WAIT REFSW, 0, 5", "STOP", "STOP"],
    );
    bench.advance_ms(1);
    bench.board().inputs = 1;
    bench.advance_ms(60);
    assert_eq!(bench.variable(3), 1);
}

#[test]
fn error_that_a_handler_has_cleared_stays_cleared() {
    let mut bench = with_handlers(
        "VECT 39, 20; SGP 39, 3, 1; EI 39; WAIT REFSW, 0, 1; EI 255; WAIT TICKS, 0, 10; JC ETO, 8; SGP 3, 2, 1; STOP",
        ["CLE ETO", "STOP", "STOP"],
    );
    bench.advance_ms(20);
    bench.board().inputs = 1;
    bench.advance_ms(200);
    assert_eq!((bench.variable(3), bench.is_running()), (1, false));
}

#[test]
fn handler_interrupts_a_wait_which_goes_on_with_its_old_deadline() {
    let mut bench = with_handlers(
        "VECT 39, 20; SGP 39, 3, 1; EI 39; EI 255; WAIT TICKS, 0, 10; GGP 132, 0; AGP 2, 2",
        ["GGP 132, 0; AGP 1, 2; WAIT TICKS, 0, 3", "STOP", "STOP"],
    );
    bench.advance_ms(50);
    bench.board().inputs = 1;
    bench.advance_us(0);
    bench.advance_ms(60);
    assert_eq!((bench.variable(1), bench.variable(2)), (50, 100));
}

#[test]
fn wait_whose_deadline_passes_in_a_handler_ends_with_it() {
    let mut bench = with_handlers(
        "VECT 39, 20; SGP 39, 3, 1; EI 39; EI 255; WAIT REFSW, 0, 10; GGP 132, 0; AGP 2, 2; JC ETO, 9; JA 8; SGP 3, 2, 1",
        ["WAIT TICKS, 0, 30", "STOP", "STOP"],
    );
    bench.advance_ms(50);
    bench.board().inputs = 1;
    bench.advance_us(0);
    bench.advance_ms(400);
    assert_eq!((bench.variable(2), bench.variable(3)), (350, 1), "after the handler, with ETO set");
}

#[test]
fn wait_whose_condition_comes_true_in_a_handler_ends_with_it() {
    let mut bench = with_handlers(
        "VECT 39, 20; SGP 39, 3, 1; EI 39; EI 255; MVP ABS, 0, 500; WAIT POS, 0, 0; GGP 132, 0; AGP 2, 2",
        ["WAIT TICKS, 0, 100", "STOP", "STOP"],
    );
    bench.advance_ms(10);
    bench.board().inputs = 1;
    bench.advance_us(0);
    bench.advance_ms(2000);
    assert_eq!(bench.variable(2), 1010);
}

#[test]
fn handlers_do_not_nest_and_events_wait_one_deep() {
    // Interrupt 39 comes four times while the handler of 0 runs, timer 0 itself five times.
    let mut bench = with_handlers(
        "VECT 0, 20; VECT 39, 30; SGP 0, 3, 10; SGP 39, 3, 1; EI 39; EI 0; EI 255",
        ["CALCV ADD, 1, 1; DI 0; WAIT TICKS, 0, 5; CALCVV LOAD, 3, 2", "CALCV ADD, 2, 1", "STOP"],
    );
    bench.advance_ms(20);
    assert_eq!(bench.variable(1), 1);
    for _ in 0..4 {
        bench.board().inputs = 1;
        bench.advance_ms(1);
        bench.board().inputs = 0;
        bench.advance_ms(1);
    }
    assert_eq!(bench.variable(2), 0, "no nesting");
    bench.advance_ms(100);
    assert_eq!((bench.variable(1), bench.variable(2), bench.variable(3)), (1, 1, 0));
}

#[test]
fn event_during_its_own_handler_is_pending() {
    let mut bench = with_handlers(
        "VECT 39, 20; SGP 39, 3, 3; EI 39; EI 255",
        ["CALCV ADD, 1, 1; WAIT TICKS, 0, 5", "STOP", "STOP"],
    );
    bench.advance_ms(1);
    for level in [1, 0, 1] {
        bench.board().inputs = level;
        bench.advance_ms(1);
    }
    bench.advance_ms(200);
    assert_eq!(bench.variable(1), 2, "the first, and one of the two that came meanwhile");
}

#[test]
fn lower_number_goes_first_among_the_pending() {
    let mut bench = with_handlers(
        "VECT 0, 20; VECT 40, 30; VECT 41, 40; SGP 0, 3, 10; SGP 40, 3, 1; SGP 41, 3, 1; EI 40; EI 41; EI 0; EI 255",
        ["DI 0; WAIT TICKS, 0, 5", "CALCVV LOAD, 1, 3; CALCV ADD, 2, 1", "CALCV ADD, 3, 1"],
    );
    bench.advance_ms(20);
    bench.board().inputs = 0b100;
    bench.advance_ms(1);
    bench.board().inputs = 0b110;
    bench.advance_ms(100);
    assert_eq!([1, 2, 3].map(|number| bench.variable(number)), [0, 1, 1], "40 came later and ran first");
}

#[test]
fn event_is_lost_while_its_interrupt_is_disabled() {
    for enable in ["EI 255; DI 39", "DI 255; EI 39"] {
        let mut bench = counting(&format!("VECT 39, 20; SGP 39, 3, 1; {enable}"));
        bench.advance_ms(1);
        bench.board().inputs = 1;
        bench.advance_ms(1);
        bench.all("EI 39; EI 255");
        bench.advance_ms(1);
        assert_eq!(bench.variable(1), 0, "{enable}");
    }
}

#[test]
fn event_without_a_vector_is_lost() {
    let mut bench = counting("SGP 39, 3, 1; EI 39; EI 255");
    bench.advance_ms(1);
    bench.board().inputs = 1;
    bench.advance_ms(1);
    assert!(bench.is_running());
    bench.ask("VECT 39, 20");
    bench.advance_ms(1);
    assert_eq!(bench.variable(1), 0);
}

#[test]
fn interrupts_come_only_while_a_program_runs() {
    let mut bench = counting("VECT 39, 20; SGP 39, 3, 1; EI 39; EI 255");
    bench.advance_ms(1);
    bench.control(128, 0, 0);
    bench.board().inputs = 1;
    bench.advance_ms(1);
    bench.control(129, 0, 0);
    bench.advance_ms(1);
    assert_eq!(bench.variable(1), 0);
    bench.board().inputs = 0;
    bench.advance_ms(1);
    bench.board().inputs = 1;
    bench.advance_ms(1);
    bench.advance_ms(1);
    assert_eq!(bench.variable(1), 1);
}

#[test]
fn vectors_can_be_changed() {
    let mut bench = with_handlers(
        "VECT 39, 20; SGP 39, 3, 3; EI 39; EI 255",
        ["CALCV ADD, 1, 1; VECT 39, 30", "CALCV ADD, 2, 1", "STOP"],
    );
    for level in [1, 0, 1] {
        bench.advance_ms(1);
        bench.board().inputs = level;
        bench.advance_ms(1);
    }
    bench.advance_ms(1);
    assert_eq!((bench.variable(1), bench.variable(2)), (1, 2));
}

#[test]
fn reti_outside_a_handler_does_nothing() {
    let mut bench = Bench::new();
    bench.run("RETI; CALC LOAD, 3; STOP");
    assert_eq!((bench.accumulator(), bench.last_error()), (3, (0, 0)));
}

#[test]
fn rst_in_a_handler_ends_it() {
    let mut bench = with_handlers(
        "VECT 39, 20; SGP 39, 3, 3; EI 39; EI 255; JA 7; STOP; STOP",
        ["CALCV ADD, 1, 1; RST 7", "STOP", "STOP"],
    );
    for level in [1, 0, 1] {
        bench.advance_ms(1);
        bench.board().inputs = level;
        bench.advance_ms(1);
    }
    bench.advance_ms(1);
    assert_eq!(bench.variable(1), 3);
}

#[test]
fn run_from_another_address_ends_a_handler() {
    let mut bench = with_handlers(
        "VECT 39, 20; SGP 39, 3, 1; EI 39; EI 255",
        ["CALCV ADD, 1, 1; WAIT TICKS, 0, 10000", "STOP", "STOP"],
    );
    for _ in 0..2 {
        bench.advance_ms(1);
        bench.board().inputs = 1;
        bench.advance_ms(1);
        bench.board().inputs = 0;
        bench.advance_ms(1);
        bench.control(129, 1, 4);
    }
    assert_eq!(bench.variable(1), 2);
}

#[test]
fn stopped_handler_goes_on_and_returns() {
    let mut bench = with_handlers(
        "VECT 39, 20; SGP 39, 3, 1; EI 39; EI 255; CALC LOAD, 5; JA 5",
        ["CALC LOAD, 9; STOP; CALCV ADD, 1, 1", "STOP", "STOP"],
    );
    bench.download_at(21, "WAIT TICKS, 0, 10");
    bench.control(131, 0, 0);
    bench.control(129, 0, 0);
    bench.advance_ms(1);
    bench.board().inputs = 1;
    bench.advance_ms(1);
    bench.control(128, 0, 0);
    assert_eq!((bench.program_counter(), bench.accumulator()), (21, 9));
    bench.advance_ms(100);
    bench.control(129, 0, 0);
    bench.advance_ms(110);
    assert_eq!((bench.variable(1), bench.accumulator(), bench.program_counter()), (1, 5, 5));
}

#[test]
fn direct_mode_configures_interrupts_too() {
    let mut bench = Bench::new();
    bench.download_at(20, "CALCV ADD, 1, 1; RETI");
    bench.start("JA 0");
    bench.all("VECT 0, 20; SGP 0, 3, 10; EI 0; EI 255");
    bench.advance_us(50_500);
    assert_eq!(bench.variable(1), 5);
    bench.all("DI 255");
    bench.advance_ms(50);
    assert_eq!(bench.variable(1), 5);
}
