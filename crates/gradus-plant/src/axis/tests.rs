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

/// Levels of the left switch in steps of 100 us after a rigid carriage has come upon it at once.
fn levels_after_the_edge(bounce_us: u32, steps: u64) -> Vec<bool> {
    let mut axis = StepperAxis::rigid(200);
    axis.travel.left = Some(Vane::below(-100));
    axis.travel.bounce_us[Switch::Left as usize] = bounce_us;
    axis.place(0);
    axis.set_coils(0, 9);
    axis.advance(STEP_US, &Surroundings::default());
    axis.set_coils(-200, 9);
    let level = |step| {
        axis.advance((step + 2) * STEP_US, &Surroundings::default());
        axis.switch(Switch::Left)
    };
    (0..steps).map(level).collect()
}

#[test]
fn contact_bounces_for_its_time_and_no_longer() {
    let levels = levels_after_the_edge(2_000, 100);
    assert!(levels[..20].contains(&false) && levels[..20].contains(&true), "{levels:?}");
    assert!(levels[20..].iter().all(|level| *level), "{levels:?}");
    assert_eq!(levels, levels_after_the_edge(2_000, 100), "the same each time");
    assert!(levels_after_the_edge(0, 10).iter().all(|level| *level));
}

#[test]
fn rigid_axis_has_steps_only_for_contacts_that_bounce() {
    let mut axis = StepperAxis::rigid(200);
    assert!(!axis.lives());
    axis.travel.bounce_us[0] = 100;
    axis.set_coils(10, 9);
    assert!(axis.lives() && axis.is_awake());
    let steps = (1..1_000).take_while(|step| {
        axis.advance(step * STEP_US, &Surroundings::default());
        axis.is_awake()
    });
    assert!(steps.count() < 100);
}

#[test]
fn end_stop_and_block_hold_a_rigid_rotor_and_the_vector_goes_on() {
    let mut axis = axis_after(&[(0, 9)]);
    axis.travel.ends = [None, Some(5_000)];
    // Behind the stop the rotor follows the vector in its next period, as that of a motor.
    let positions = [4_900, 5_100, 5_600, 5_700, 0].map(|phase| {
        axis.set_coils(phase, 9);
        axis.position()
    });
    assert_eq!(positions, [4_900, 5_000, 4_576, 4_676, -1_024]);
    axis.block(true);
    axis.set_coils(700, 9);
    assert_eq!(axis.position(), -1_024);
    axis.block(false);
    axis.set_coils(800, 9);
    assert_eq!(axis.position(), -1_024 - 224, "the nearest place with that angle");
}

#[test]
fn cut_encoder_loses_counts_and_sees_no_index() {
    let mut axis = axis_after(&[(0, 9)]);
    axis.encoder = Some(Encoder { index: Some(100), ..Encoder::default() });
    axis.watch_null(Some(NullEvent { n: true, ab: None }));
    axis.cut_encoder(true);
    axis.set_coils(12_800, 9);
    assert_eq!((axis.encoder_count(), axis.take_null()), (0, None));
    axis.cut_encoder(false);
    assert_eq!((axis.encoder_count(), axis.take_null()), (0, None));
    axis.set_coils(12_800 + 51_200, 9);
    assert_eq!((axis.encoder_count(), axis.take_null()), (4_096, Some(4_096 + 100 - 1_024)));
}

#[test]
fn driver_that_is_too_hot_lets_a_rigid_rotor_go() {
    let mut axis = axis_after(&[(0, 9)]);
    let positions = [(Some(160.0), 300), (Some(130.0), 600), (None, 900)].map(|(heat, phase)| {
        axis.heat(heat);
        axis.set_coils(phase, 9);
        axis.position()
    });
    assert_eq!(positions, [0, 0, -124]);
}
