//! Capture (command 142), as PyTrinamic's data logger uses it.

use gradus_firmware::{Link, LinkKind};
use gradus_tmcl::catalogue::Ap;
use gradus_tmcl::{
    Bulk, CaptureAction, CaptureInfo, CaptureSource, CaptureState, CaptureTrigger, Instruction, Opcode, Reply,
};

use crate::support::{Bench, frame, request};

/// Microseconds between two samples at the base rate.
const PERIOD_US: u64 = 500;

/// Selection of user variable 0.
const VARIABLE: i32 = 2 << 24;

impl Bench {
    fn capture(&mut self, action: CaptureAction, motor: u8, value: i32) -> (u8, i32) {
        self.obey(Instruction::new(Opcode::CAPTURE, action.0, motor, value))
    }

    fn set_capture(&mut self, action: CaptureAction, motor: u8, value: i32) {
        let answer = self.capture(action, motor, value);
        assert_eq!(answer, (100, value), "{action:?} {motor} {value}");
    }

    fn capture_state(&mut self) -> CaptureState {
        CaptureState(self.capture(CaptureAction::GET_STATE, 0, 0).1 as u8)
    }

    /// Asks for samples from an index on, and gives back status and value of the reply and the bytes behind it.
    fn bulk(&mut self, index: i32) -> (u8, i32, Vec<u8>) {
        let asked = request(bulk_download(index)).emit();
        assert_eq!(self.module.receive(&mut self.link, &asked), asked.len());
        assert_eq!(self.module.transmit_byte(&mut self.link), None, "nothing overtakes the reply");
        let reply = self.module.transmit(&mut self.link).and_then(|bytes| Reply::parse(&bytes).ok()).unwrap();
        let taken = self.module.receive(&mut self.link, &asked);
        let bytes: Vec<u8> = core::iter::from_fn(|| self.module.transmit_byte(&mut self.link)).collect();
        assert_eq!(taken == 0, !bytes.is_empty(), "the next command waits until the samples have gone");
        self.drain();
        (reply.status.0, reply.value, bytes)
    }

    fn captured(&mut self) -> Vec<i32> {
        let count = self.capture(CaptureAction::GET_INFO, 0, CaptureInfo::CAPTURED.0.into()).1;
        (0..count).map(|index| self.capture(CaptureAction::GET_SAMPLE, 0, index)).map(|(_, sample)| sample).collect()
    }
}

fn bulk_download(index: i32) -> Instruction {
    Instruction::new(Opcode::CAPTURE, CaptureAction::BULK_DOWNLOAD.0, 0, index)
}

/// A bench that has captured so many samples: 0, 1, 2, ...
fn captured_bench(count: i32) -> Bench {
    let mut bench = variable_bench(count, 0);
    bench.set_capture(CaptureAction::ENABLE_TRIGGER, CaptureTrigger::UNCONDITIONAL.0, 0);
    feed(&mut bench, 0..count);
    bench
}

/// A bench that will sample user variable 0.
fn variable_bench(length: i32, pretrigger: i32) -> Bench {
    let mut bench = Bench::new();
    bench.set_capture(CaptureAction::INIT, 0, 0);
    bench.set_capture(CaptureAction::SET_LENGTH, 0, length);
    bench.set_capture(CaptureAction::SET_CHANNEL, CaptureSource::GLOBAL_PARAMETER.0, VARIABLE);
    bench.set_capture(CaptureAction::SET_TRIGGER_CHANNEL, CaptureSource::GLOBAL_PARAMETER.0, VARIABLE);
    bench.set_capture(CaptureAction::SET_PRETRIGGER, 0, pretrigger);
    bench
}

/// Gives the variable one value after the other, one a sample.
fn feed(bench: &mut Bench, values: impl IntoIterator<Item = i32>) {
    for value in values {
        bench.ask(&format!("SGP 0, 2, {value}"));
        bench.advance_us(PERIOD_US);
    }
}

#[test]
fn samples_are_what_a_host_could_have_read() {
    let set_up = "SAP 4, 0, 200000; SAP 5, 0, 400000";
    let (mut bench, mut twin) = (Bench::set_up(set_up), Bench::set_up(set_up));
    bench.set_capture(CaptureAction::SET_LENGTH, 0, 1000);
    bench.set_capture(CaptureAction::SET_PRESCALER, 0, 2);
    for number in [3, 1] {
        bench.set_capture(CaptureAction::SET_CHANNEL, CaptureSource::AXIS_PARAMETER.0, number);
    }
    bench.set_capture(CaptureAction::ENABLE_TRIGGER, CaptureTrigger::UNCONDITIONAL.0, 0);
    for bench in [&mut bench, &mut twin] {
        bench.ask("ROR 0, 150000");
    }
    bench.advance_ms(1000);
    assert_eq!(bench.capture_state(), CaptureState::COMPLETE);
    let samples = bench.captured();
    assert_eq!(samples.len(), 1000);
    for row in samples.chunks(2) {
        twin.advance_us(3 * PERIOD_US);
        assert_eq!(row, [twin.peek(0, Ap::ActualSpeed), twin.peek(0, Ap::ActualPosition)], "at {} us", twin.now);
    }
    assert_eq!(samples[998], 150_000, "the step is in the capture");
}

#[test]
fn edges_start_a_capture_and_levels_do_not() {
    use CaptureTrigger as T;
    let values = [5, 20, 9, 10, 10, 10, 3, -4, 12];
    let cases = [
        (T::UNCONDITIONAL, 10, 0),
        (T::RISING_SIGNED, 10, 1),
        (T::RISING_SIGNED, 21, 9),
        (T::FALLING_SIGNED, 10, 2),
        (T::FALLING_SIGNED, -4, 7),
        (T::BOTH_SIGNED, 4, 1 + 5),
        (T::RISING_UNSIGNED, 100, 7),
        (T::FALLING_UNSIGNED, 100, 8),
        (T::BOTH_UNSIGNED, i32::MIN, 7),
    ];
    for (trigger, threshold, expected) in cases {
        let values = if trigger == T::BOTH_SIGNED { [5, 6, 7, 8, 9, 9, 3, 3, 3] } else { values };
        let mut bench = variable_bench(20, 0);
        bench.set_capture(CaptureAction::ENABLE_TRIGGER, trigger.0, threshold);
        feed(&mut bench, values);
        assert_eq!(bench.captured(), values[expected..], "{trigger:?} {threshold}");
    }
}

#[test]
fn samples_before_the_trigger_stand_in_front() {
    let mut bench = variable_bench(6, 4);
    assert_eq!(bench.capture_state(), CaptureState::IDLE);
    bench.set_capture(CaptureAction::ENABLE_TRIGGER, CaptureTrigger::RISING_SIGNED.0, 1000);
    feed(&mut bench, [2000, 0, 1500]);
    assert_eq!(bench.capture_state(), CaptureState::PRETRIGGER, "an edge before there are enough samples is none");
    feed(&mut bench, 0..9000);
    assert_eq!(bench.captured(), [996, 997, 998, 999, 1000, 1001]);
    assert_eq!(bench.capture_state(), CaptureState::COMPLETE);
}

#[test]
fn samples_before_the_trigger_are_a_whole_number_of_every_channel() {
    for (channels, asked, kept) in [(1, 3, 3), (2, 3, 2), (2, 4, 4), (2, 1, 0), (3, 5, 3)] {
        let mut bench = variable_bench(12, asked);
        for _ in 1..channels {
            bench.set_capture(CaptureAction::SET_CHANNEL, CaptureSource::GLOBAL_PARAMETER.0, VARIABLE);
        }
        bench.set_capture(CaptureAction::ENABLE_TRIGGER, CaptureTrigger::RISING_SIGNED.0, 1000);
        assert_eq!(bench.capture(CaptureAction::GET_PRETRIGGER, 0, 0), (100, kept), "{asked} of {channels} channels");
        feed(&mut bench, 980..1020);
        let samples: Vec<i32> =
            (1000 - kept / channels..).flat_map(|value| vec![value; channels as usize]).take(12).collect();
        assert_eq!(bench.captured(), samples, "{asked} of {channels} channels");
    }
}

#[test]
fn states_follow_the_capture() {
    let mut bench = variable_bench(3, 1);
    bench.set_capture(CaptureAction::ENABLE_TRIGGER, CaptureTrigger::FALLING_SIGNED.0, -1);
    let mut states = vec![bench.capture_state()];
    for value in [7, 7, -7, -7, -7] {
        feed(&mut bench, [value]);
        states.push(bench.capture_state());
    }
    let (waits, samples) = (CaptureState::TRIGGER, CaptureState::CAPTURE);
    let complete = CaptureState::COMPLETE;
    assert_eq!(states, [CaptureState::PRETRIGGER, waits, waits, samples, complete, complete]);
    assert_eq!(bench.captured(), [7, -7, -7]);
}

#[test]
fn trigger_looks_at_the_masked_bits() {
    let cases = [
        (CaptureTrigger::RISING_UNSIGNED, 8, 0xf00, 10, [0xf_0ff, 0x9ff, 0xa00], 2),
        (CaptureTrigger::FALLING_SIGNED, 8, 0xf00, -1, [0x700, 0x000, 0xf00], 2),
        (CaptureTrigger::RISING_UNSIGNED, 31, i32::MIN, 1, [0x7fff_ffff, -1, 0], 1),
    ];
    for (trigger, shift, mask, threshold, values, expected) in cases {
        let mut bench = variable_bench(3, 0);
        bench.set_capture(CaptureAction::SET_SHIFT_MASK, shift, mask);
        bench.set_capture(CaptureAction::ENABLE_TRIGGER, trigger.0, threshold);
        feed(&mut bench, values);
        assert_eq!(bench.captured(), values[expected..], "{trigger:?} {mask:#x}");
    }
}

#[test]
fn memory_holds_8192_samples_of_four_channels_at_2_khz() {
    let mut bench = Bench::new();
    let info = [0, 1, 2].map(|entry| bench.capture(CaptureAction::GET_INFO, 0, entry));
    assert_eq!(info, [(100, 4), (100, 8192), (100, 2000)]);
    for source in [CaptureSource::TIME, CaptureSource::ANALOG_INPUT, CaptureSource::TIME] {
        bench.set_capture(CaptureAction::SET_CHANNEL, source.0, 3);
    }
    bench.set_capture(CaptureAction::ENABLE_TRIGGER, CaptureTrigger::UNCONDITIONAL.0, 0);
    let took_us = bench.until(10_000, |bench| bench.capture_state() == CaptureState::COMPLETE);
    assert_eq!(took_us, 2731 * PERIOD_US, "8192 / 3, the last row in part");
    let samples = bench.captured();
    assert_eq!(samples.len(), 8192);
    assert_eq!(samples[samples.len() - 5..], [1365, 300, 1365, 1365, 300]);
    assert_eq!(bench.module.poll_at(), None, "a capture that is over costs nothing");
}

#[test]
fn channels_say_what_they_sample() {
    let mut bench = variable_bench(10, 3);
    bench.set_capture(CaptureAction::SET_CHANNEL, CaptureSource::AXIS_PARAMETER.0, 1 << 24 | 3);
    bench.set_capture(CaptureAction::SET_CHANNEL, CaptureSource::DISABLED.0, 0);
    assert_eq!(bench.capture(CaptureAction::GET_CHANNEL_TYPE, 1, 0), (100, 1));
    assert_eq!(bench.capture(CaptureAction::GET_CHANNEL_ADDRESS, 1, 0), (100, 1 << 24 | 3));
    assert_eq!(bench.capture(CaptureAction::GET_CHANNEL_TYPE, 2, 9), (4, 9), "a disabled channel is none");
    assert_eq!(bench.capture(CaptureAction::GET_PRETRIGGER, 0, 0), (100, 3));
    bench.set_capture(CaptureAction::INIT, 0, 0);
    assert_eq!(bench.capture(CaptureAction::GET_CHANNEL_TYPE, 0, 0).0, 4);
    assert_eq!(bench.capture(CaptureAction::GET_PRETRIGGER, 0, 0), (100, 0));
}

#[test]
fn what_cannot_be_captured_is_refused() {
    use CaptureAction as A;
    let cases = [
        (A(15), 0, 1000, 3, "process frequency"),
        (A::BULK_DOWNLOAD, 0, 0, 4, "a bulk download of nothing"),
        (A::SET_CHANNEL, 1, 10_000, 3, "parameter number of more than a byte"),
        (A::SET_CHANNEL, 1, 30, 3, "axis parameter"),
        (A::SET_CHANNEL, 1, 3 << 24 | 1, 4, "axis"),
        (A::SET_CHANNEL, 2, 1, 3, "register of a chip"),
        (A::SET_CHANNEL, 6, 40, 3, "analogue input"),
        (A::SET_CHANNEL, 8, 1 << 24, 3, "bank"),
        (A::SET_LENGTH, 0, 8193, 4, "length"),
        (A::SET_LENGTH, 0, 2, 4, "shorter than what stands before the trigger"),
        (A::SET_LENGTH, 0, 0, 4, "nothing"),
        (A::SET_PRETRIGGER, 0, 11, 4, "more before the trigger than at all"),
        (A::SET_SHIFT_MASK, 32, -1, 4, "shift"),
        (A::ENABLE_TRIGGER, 7, 0, 3, "trigger"),
        (A::GET_SAMPLE, 0, 0, 4, "a sample that is not there"),
        (A::GET_SAMPLE, 0, -1, 4, "a sample before the first"),
        (A::GET_INFO, 0, 4, 4, "entry"),
    ];
    for (action, motor, value, status, what) in cases {
        let mut bench = variable_bench(10, 3);
        assert_eq!(bench.capture(action, motor, value), (status, value), "{what}");
    }
    let mut bench = Bench::new();
    assert_eq!(bench.capture(A::ENABLE_TRIGGER, 0, 0).0, 6, "without a channel");
    for _ in 0..4 {
        bench.set_capture(A::SET_CHANNEL, CaptureSource::TIME.0, 0);
    }
    assert_eq!(bench.capture(A::SET_CHANNEL, CaptureSource::TIME.0, 0).0, 4, "a fifth channel");
    assert_eq!(bench.capture(A::ENABLE_TRIGGER, 1, 0).0, 6, "without a trigger channel");
    bench.set_capture(A::ENABLE_TRIGGER, CaptureTrigger::UNCONDITIONAL.0, 0);
    assert_eq!(bench.capture(A::SET_LENGTH, 0, 5).0, 6, "while samples are taken");
    bench.set_capture(A::INIT, 0, 0);
    assert_eq!(bench.module.poll_at(), None, "INIT ends a capture");
}

#[test]
fn reset_ends_a_capture() {
    let mut bench = variable_bench(10, 0);
    bench.set_capture(CaptureAction::ENABLE_TRIGGER, CaptureTrigger::UNCONDITIONAL.0, 0);
    feed(&mut bench, [1, 2]);
    assert_eq!(bench.control(255, 0, 1234).0, 100);
    bench.advance_ms(10);
    assert_eq!((bench.capture_state(), bench.captured()), (CaptureState::IDLE, vec![]));
}

#[test]
fn a_bulk_download_sends_samples_behind_its_reply() {
    let mut bench = captured_bench(150);
    for (index, count) in [(0, 64), (64, 64), (128, 22), (149, 1)] {
        let (status, value, bytes) = bench.bulk(index);
        assert_eq!((status, value), (100, count), "from {index}");
        assert_eq!(bytes, Bulk::new(index..index + count).bytes(), "from {index}");
    }
    for index in [150, -1, i32::MAX, i32::MIN] {
        assert_eq!(bench.bulk(index), (4, index, vec![]), "there is no sample {index}");
    }
}

#[test]
fn samples_of_a_bulk_download_are_as_they_were_when_it_was_answered() {
    let mut bench = captured_bench(70);
    bench.module.receive(&mut bench.link, &request(bulk_download(10)).emit());
    let mut other = Link::new(2, LinkKind::Usb, 0);
    let init = Instruction::new(Opcode::CAPTURE, CaptureAction::INIT.0, 0, 0);
    assert_eq!(bench.module.receive(&mut other, &request(init).emit()), 9);
    bench.advance_ms(1);
    assert_eq!(bench.drain().len(), 1);
    let bytes: Vec<u8> = core::iter::from_fn(|| bench.module.transmit_byte(&mut bench.link)).collect();
    assert_eq!(bytes, Bulk::new(10..70).bytes());
}

#[test]
fn an_event_waits_until_the_samples_have_gone() {
    let mut bench = captured_bench(20);
    bench.all("SAP 4, 0, 200000; SAP 5, 0, 1000000");
    bench.control(138, 0, 1);
    bench.ask("MVP ABS, 0, 100");
    bench.module.receive(&mut bench.link, &request(bulk_download(0)).emit());
    bench.advance_ms(1000);
    assert_eq!(bench.drain().len(), 1, "the reply");
    assert_eq!(bench.drain().len(), 0, "no event among the samples");
    assert_eq!(core::iter::from_fn(|| bench.module.transmit_byte(&mut bench.link)).count(), 84);
    assert_eq!(bench.drain().len(), 1, "the event");
}

#[test]
fn lines_that_carry_no_raw_bytes_refuse_a_bulk_download() {
    let mut bench = captured_bench(20);
    let mut segment = Link::new(2, LinkKind::Rs485, 0);
    bench.module.receive(&mut segment, &request(bulk_download(0)).emit());
    bench.advance_ms(100);
    let reply = bench.module.transmit(&mut segment).and_then(|bytes| Reply::parse(&bytes).ok()).unwrap();
    assert_eq!((reply.status.0, reply.value), (6, 0));
    assert_eq!(bench.module.transmit_byte(&mut segment), None);
    let mut bus = Link::new(3, LinkKind::Can, 0);
    bench.module.receive_frame(&mut bus, &frame(1, false, bulk_download(0), 7));
    assert_eq!(bench.module.transmit_frame(&mut bus).unwrap().data()[1], 6);
    assert_eq!(bench.module.transmit_byte(&mut bus), None);
}

#[test]
fn a_suppressed_reply_suppresses_the_samples() {
    let mut bench = captured_bench(20);
    bench.raw(&request(Instruction::parse("SGP 255, 0, 1", bench.module.catalogue()).unwrap()).emit());
    bench.module.receive(&mut bench.link, &request(bulk_download(0)).emit());
    assert_eq!((bench.drain().len(), bench.module.transmit_byte(&mut bench.link)), (0, None));
}
