//! Datagrams out of a stream of bytes.

use gradus_tmcl::{Framer, Instruction, Opcode, Request};

const GAP_US: u32 = 5_000;

/// The nine bytes of a `MVP ABS, 0, 51200` for module 1.
fn datagram() -> [u8; 9] {
    Request { address: 1, instruction: Instruction::new(Opcode::MVP, 0, 0, 51_200) }.emit()
}

/// Pushes bytes that come `pause_us` apart; gives back what comes out.
fn push(framer: &mut Framer, bytes: &[u8], now_us: &mut u64, pause_us: u64) -> Vec<[u8; 9]> {
    let mut push = |byte: &u8| {
        *now_us += pause_us;
        framer.push(*byte, *now_us)
    };
    bytes.iter().filter_map(&mut push).collect()
}

#[test]
fn datagrams_in_a_row_come_out_one_by_one() {
    let (mut framer, mut now) = (Framer::new(GAP_US), 0);
    let stream = [datagram(); 3].concat();
    assert_eq!(push(&mut framer, &stream, &mut now, 0), [datagram(); 3]);
    assert!(framer.pending().is_empty());
}

#[test]
fn datagram_split_at_any_point_is_one() {
    for split in 0..=9 {
        let (mut framer, mut now) = (Framer::new(GAP_US), 0);
        let (head, tail) = (&datagram()[..split], &datagram()[split..]);
        let first = push(&mut framer, head, &mut now, 100);
        now += u64::from(GAP_US) - 100; // the longest pause that is allowed
        let second = push(&mut framer, tail, &mut now, 100);
        assert_eq!([first, second].concat(), [datagram()], "split at {split}");
    }
}

#[test]
fn pause_inside_a_datagram_discards_its_beginning() {
    for cut in 1..9 {
        let (mut framer, mut now) = (Framer::new(GAP_US), 0);
        assert!(push(&mut framer, &datagram()[..cut], &mut now, 100).is_empty());
        assert_eq!(framer.pending(), &datagram()[..cut]);
        now += u64::from(GAP_US) + 1;
        assert_eq!(push(&mut framer, &datagram(), &mut now, 100), [datagram()], "cut after {cut}");
    }
}

#[test]
fn without_a_gap_no_pause_is_too_long() {
    let (mut framer, mut now) = (Framer::new(0), 0);
    assert_eq!(push(&mut framer, &datagram(), &mut now, 3_600_000_000), [datagram()]);
}

#[test]
fn nine_zero_bytes_in_step_are_one_datagram() {
    let (mut framer, mut now) = (Framer::new(GAP_US), 0);
    let out = push(&mut framer, &[0; 9], &mut now, 100);
    assert_eq!(out, [[0; 9]]);
    assert_eq!(Request::parse(&out[0]).map(|request| request.instruction.opcode), Ok(Opcode(0)));
}

#[test]
fn nine_zero_bytes_and_a_pause_bring_the_line_into_step() {
    for lost in 1..9 {
        let (mut framer, mut now) = (Framer::new(GAP_US), 0);
        push(&mut framer, &datagram()[lost..], &mut now, 100);
        let out = push(&mut framer, &[0; 9], &mut now, 100);
        assert_eq!(out.len(), 1, "{lost} bytes lost"); // answered, which tells the host to go on
        now += u64::from(GAP_US) + 1;
        assert_eq!(push(&mut framer, &datagram(), &mut now, 100), [datagram()], "{lost} bytes lost");
    }
}

#[test]
fn zero_bytes_up_to_the_first_answer_bring_the_line_into_step_without_a_gap() {
    for lost in 1..9 {
        let (mut framer, mut now) = (Framer::new(0), 0);
        push(&mut framer, &datagram()[lost..], &mut now, 100);
        while push(&mut framer, &[0], &mut now, 100).is_empty() {}
        assert_eq!(push(&mut framer, &datagram(), &mut now, 100), [datagram()], "{lost} bytes lost");
    }
}

#[test]
fn reset_forgets_an_unfinished_datagram() {
    let (mut framer, mut now) = (Framer::new(0), 0);
    push(&mut framer, &[1, 2, 3], &mut now, 100);
    framer.reset();
    assert_eq!(push(&mut framer, &datagram(), &mut now, 100), [datagram()]);
}
