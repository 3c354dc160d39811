use super::*;
use crate::Vane;

fn axis_after(vectors: &[(i32, u8)]) -> StepperAxis {
    let mut axis = StepperAxis::rigid(200);
    for (phase, current) in vectors {
        axis.set_coils(*phase, *current);
    }
    axis
}

#[test]
fn rotor_follows_the_vector() {
    let follows = |name, vectors: &[_], position| assert_eq!(axis_after(vectors).position(), position, "{name}");
    follows("one vector", &[(100, 255)], 100);
    follows("there and back", &[(0, 255), (51_200, 255), (-10, 128)], -10);
    follows("phase wraps upwards", &[(0, 1), (i32::MAX, 1), (i32::MIN, 1)], i64::from(i32::MAX) + 1);
    follows("phase wraps downwards", &[(0, 1), (i32::MIN, 1), (i32::MAX, 1)], i64::from(i32::MIN) - 1);
    follows("moved without current", &[(0, 255), (300, 255), (5000, 0)], 300);
    follows("caught again ahead", &[(0, 255), (300, 255), (300, 0), (1024 + 400, 255)], 400);
    follows("restarted at phase 0", &[(0, 255), (51_300, 255), (0, 0), (0, 255)], 51_200);
}

#[test]
fn released_rotor_is_pulled_by_two_full_steps_at_most() {
    for phase in -3000..3000 {
        let mut axis = StepperAxis::rigid(200);
        axis.place(70_007);
        axis.set_coils(phase, 1);
        assert!((axis.position() - 70_007).abs() <= 512, "phase {phase}");
        assert_eq!((axis.position() - i64::from(phase)).rem_euclid(1024), 0, "phase {phase}");
    }
}

#[test]
fn forced_switch_ignores_the_travel_until_it_is_given_back() {
    let mut axis = StepperAxis::rigid(200);
    axis.travel.left = Some(Vane::below(0));
    for (forced, closed) in [(Some(false), false), (None, true), (Some(true), true)] {
        axis.force_switch(Switch::Left, forced);
        assert_eq!(axis.switch(Switch::Left), closed, "{forced:?}");
    }
}

#[test]
fn encoder_follows_the_rotor_and_may_be_missing() {
    let mut axis = axis_after(&[(0, 9), (51_200, 9)]);
    assert_eq!(axis.encoder_count(), 4096);
    axis.encoder = None;
    assert_eq!(axis.encoder_count(), 0);
}

#[test]
fn null_event_is_latched_between_two_vectors() {
    let mut axis = axis_after(&[(0, 9)]);
    axis.encoder = Some(Encoder { index: Some(100), ..Encoder::default() });
    axis.watch_null(Some(NullEvent { n: true, ab: None }));
    for (phase, expected) in [(1_000, None), (1_300, Some(100)), (1_400, None), (51_200, None), (60_000, Some(4_196))] {
        axis.set_coils(phase, 9);
        assert_eq!(axis.take_null(), expected, "at {phase}");
    }
    axis.watch_null(None);
    axis.set_coils(0, 9);
    assert_eq!(axis.take_null(), None, "nobody asks");
}

#[test]
fn turns_become_microsteps() {
    assert_eq!([0.5, -2.0, 1e-6].map(|turns| StepperAxis::rigid(200).microsteps(turns)), [25_600, -102_400, 0]);
    assert_eq!(StepperAxis::rigid(400).microsteps_per_turn(), 102_400);
}
