use gradus_firmware::{Io, RotorInputs};
use gradus_plant::{HallSensors, Mechanics, ServoSetup, StepperAxis, Switch, Travel, Vane};
use gradus_tmcl::catalogue::{Ap, TMCM_3351};

use super::*;
use crate::SpiDevice;

fn parsed(text: &str) -> BenchFile {
    BenchFile::parse(text).unwrap_or_else(|problem| panic!("{problem}"))
}

fn axis(text: &str) -> StepperAxis {
    parsed(&format!("module = \"tmcm-3351\"\n{text}")).machine.axes[0].plant.clone()
}

#[test]
fn example_of_the_module_text_is_a_bench_file() {
    let lines = include_str!("../bench_file.rs").lines().map_while(|line| line.strip_prefix("//!"));
    let example = lines.skip_while(|line| *line != " ```toml").skip(1).take_while(|line| *line != " ```");
    let file = parsed(&example.collect::<Vec<_>>().join("\n"));
    assert_eq!((file.machine.axes[0].plant.position(), file.events.len()), (430_080, 1));
}

#[test]
fn servo_of_the_module_text_is_a_servo() {
    let lines = include_str!("../bench_file.rs").lines().map_while(|line| line.strip_prefix("//!"));
    let example = lines.skip_while(|line| *line != " module = \"tmcm-1617\"").take_while(|line| *line != " ```");
    let text = example.collect::<Vec<_>>().join("\n");
    let file = parsed(&format!("{text}\n[io]\nanalog.2 = 4095"));
    assert_eq!((file.machine.axes.len(), file.machine.io.clone().analog(2)), (0, 4095));
    let default = ServoSetup::default();
    let expected = ServoSetup {
        mechanics: Mechanics { load_nm: 0.02, ..default.mechanics },
        hall: HallSensors { placement_error_deg: [2.0, -1.0, 0.0], ..HallSensors::default() },
        ..default
    };
    assert_eq!(file.machine.servos[0].plant.setup(), &expected);
}

#[test]
fn servo_motor_is_named_or_described_by_its_sheet() {
    let motor = |text: &str| {
        let file = parsed(&format!("module = 'tmcm-1617'\n[servo]\nmotor = {text}"));
        file.machine.servos[0].plant.setup().motor
    };
    let sheet =
        "pole_pairs = 4, resistance = 0.72, inductance = 1.2, torque_constant = 0.036, current = 3.47, inertia = 48";
    assert_eq!(motor("'qbl4208-61'"), motor(&format!("{{ {sheet} }}")));
    let brushed =
        "direct_current = true, resistance = 1, inductance = 1, torque_constant = 0.05, current = 3, inertia = 100";
    assert_eq!(motor("'DC'"), motor(&format!("{{ {brushed} }}")));
}

#[test]
fn servo_without_an_encoder_has_none() {
    let mut bare = parsed("module = 'tmcm-1617'\n[servo]\nfriction = 0").machine;
    bare.servos[0].plant.place(1.0);
    assert_eq!(bare.servos[0].encoder(), 0);
}

#[test]
fn tables_are_those_of_the_module() {
    let problem = |text: &str| BenchFile::parse(text).unwrap_err().to_string();
    assert_eq!(problem("module = 'tmcm-1617'\n[axis.0]\nload = 1"), "2: axis.0: the axis of a TMCM-1617 is `[servo]`");
    assert_eq!(
        problem("module = 'tmcm-3351'\n[servo]\nload = 1"),
        "2: servo: the axes of a TMCM-3351 are `[axis.0]` and so on"
    );
    assert_eq!(
        problem("module = 'tmcm-1617'\n[servo]\nmotor = 'nema17'"),
        "3: servo.motor: invalid value: string \"nema17\", expected the data of a motor as a table, or a motor by name: \
         QBL4208-41, QBL4208-61, QBL4208-81, QBL4208-100, DC"
    );
}

#[test]
fn wiring_supply_and_noise_of_a_servo_have_keys() {
    let text = "module = 'tmcm-1617'\n[servo]\nhall = { polarity = 1, direction = 1, offset = -16384, order = 'cab' }\n\
                encoder = { counts_per_turn = 1000, reversed = true }\nsource = { quiescent = 200 }\ncurrent_noise = 3\nseed = 9";
    let drive = &parsed(text).machine.servos[0];
    let ServoSetup { hall, encoder, supply, .. } = *drive.plant.setup();
    assert_eq!((hall.inverted, hall.reversed, hall.offset_turns, hall.order.0), (true, true, -0.25, [2, 0, 1]));
    assert_eq!((encoder.reversed, supply.quiescent_a), (true, 0.2));
    let mut expected = drive.clone();
    expected.set_current_noise(3.0, 9);
    assert_eq!(*drive, expected);
}

#[test]
fn wiring_that_cannot_be_is_refused() {
    let problem =
        |key: &str| BenchFile::parse(&format!("module = 'tmcm-1617'\n[servo]\n{key}")).unwrap_err().to_string();
    for (key, words) in [
        ("hall = { polarity = 2 }", "a whole number from 0 to 1"),
        ("hall = { offset = 65536 }", "from -32768 to 32767"),
        ("hall = { order = 'aab' }", "expected one of `abc`, `acb`, `bac`, `bca`, `cab`, `cba`"),
        ("hall = { turned = 1 }", "unknown field `turned`"),
        ("source = { quiescent = -1 }", "milliamperes from 0 to 10000"),
        ("current_noise = -1", "steps from 0 to 1000"),
        ("motor = { resistance = 100, inductance = 1, torque_constant = 0.1, current = 1, inertia = 10 }", "10.000 us"),
    ] {
        assert!(problem(key).contains(words), "{key}: {}", problem(key));
    }
}

#[test]
fn what_is_not_named_does_not_exist() {
    let file = parsed("module = \"TMCM-3351\"");
    assert_eq!((file.module.name, file.events.len(), file.machine.axes.len()), ("TMCM-3351", 0, 3));
    for (seed, axis) in (1..).zip(&file.machine.axes) {
        let mut bare = StepperAxis::default();
        bare.set_stallguard_noise(10.0, seed);
        bare.encoder = None;
        bare.place(0);
        assert_eq!(axis.plant, bare);
    }
    assert_eq!(file.machine.io, MachineIo::default());
}

#[test]
fn lengths_are_in_the_unit_of_the_axis() {
    let cases = [
        ("", 51_200, 102_400, -51_200),
        ("full_steps = 400", 102_400, 204_800, -102_400),
        ("travel_per_turn = 5", 10_240, 20_480, -10_240),
        ("motor = 'rigid'\ntravel_per_turn = 0.9\nfull_steps = 200", 56_889, 113_778, -56_889),
    ];
    for (keys, home, right, left) in cases {
        let switches = "start = 2\ntravel = { left = { at = -1 }, right = { at = 2.0 }, home = { at = 1, width = 2 } }";
        let axis = axis(&format!("[axis.0]\n{keys}\n{switches}"));
        assert_eq!(axis.travel.left, Some(Vane::below(left)), "{keys}");
        assert_eq!(axis.travel.right, Some(Vane::above(right)), "{keys}");
        assert_eq!(axis.travel.home, Some(Vane::between(0, 2 * home)), "{keys}");
        assert_eq!(axis.position(), right, "{keys}");
    }
}

#[test]
fn switches_may_be_narrow_and_normally_closed() {
    let travel = axis(
        "[axis.0.travel]\nleft = { at = -1, width = 0.5 }\nright = { at = 1, width = 2, normally_closed = true }\n\
         home = { at = 0, width = 1, normally_closed = true }",
    )
    .travel;
    assert_eq!(travel.left, Some(Vane::between(-76_800, -51_200)));
    assert_eq!(travel.right, Some(Vane { opens: true, ..Vane::between(51_200, 153_600) }));
    assert_eq!(travel.home, Some(Vane { opens: true, ..Vane::between(-25_600, 25_600) }));
}

#[test]
fn motors_have_names_or_data() {
    let by_name = axis("[axis.0]\nmotor = 'qsh6018-45'");
    let data =
        "resistance = 0.75, inductance = 2, current = 2.8, holding_torque = 1.1, detent_torque = 0.039, inertia = 275";
    assert_eq!(format!("{by_name:?}"), format!("{:?}", axis(&format!("[axis.0]\nmotor = {{ {data} }}"))));
    assert_eq!(axis("[axis.0]\nmotor = 'QSH5718-76'\nfull_steps = 400").microsteps_per_turn(), 102_400);
    assert!(axis("[axis.0]\nmotor = 'rigid'").mechanics().is_none());
}

#[test]
fn shaft_carries_what_the_file_says() {
    let axis = axis("[axis.0]\ninertia = 500\nfriction = 0.02\nviscous = 0.003\nload = -0.1");
    let Some(Mechanics { inertia_kgm2, friction_nm, viscous_nms, load_nm }) = axis.mechanics().copied() else {
        panic!()
    };
    assert!((inertia_kgm2 - 5e-5).abs() < 1e-12);
    assert_eq!((friction_nm, viscous_nms, load_nm), (0.02, 0.003, -0.1));
}

#[test]
fn end_stops_and_bounce_belong_to_the_travel() {
    let keys =
        "travel_per_turn = 5\ntravel = { left = { at = 0, bounce = 0.002 }, ends = { left = -1, right = 11.5 } }";
    let Travel { ends, bounce_us, .. } = axis(&format!("[axis.0]\n{keys}")).travel;
    assert_eq!((ends, bounce_us), ([Some(-10_240), Some(117_760)], [2_000, 0, 0]));
}

#[test]
fn reversed_axis_is_a_mirror_image() {
    let keys = "start = 20\ntravel_per_turn = 5\ntravel = { left = { at = 0 }, right = { at = 100, width = 1 }, \
                home = { at = 60, width = 2 }, ends = { left = -1, right = 101 } }";
    let [straight, reversed] = [false, true].map(|reversed| axis(&format!("[axis.0]\nreversed = {reversed}\n{keys}")));
    assert_eq!(straight.travel.left, Some(Vane::below(0)));
    assert_eq!(
        reversed.travel.left,
        Some(Vane::above(0)),
        "the left switch is where the motor turns in positive direction"
    );
    assert_eq!(straight.travel.right, Some(Vane::between(1_024_000, 1_034_240)));
    assert_eq!(reversed.travel.right, Some(Vane::between(-1_034_240, -1_024_000)));
    assert_eq!(reversed.travel.home, Some(Vane::between(-624_640, -604_160)));
    assert_eq!(reversed.travel.ends, [Some(-1_034_240), Some(10_240)]);
    assert_eq!((straight.position(), reversed.position()), (204_800, -204_800));
}

#[test]
fn encoder_may_be_reversed_and_have_slipped() {
    let mut axis = axis("[axis.0]\nencoder = { counts_per_turn = 4000, reversed = true, slip = 90 }");
    axis.place(25_600);
    assert_eq!(axis.encoder_count(), -1000);
}

#[test]
fn module_has_its_supply_and_climate() {
    let io = parsed("module = 'tmcm-3351'\nsupply = 19.5\ntemperature = 40").machine.io;
    assert_eq!(io.surroundings, Surroundings { supply_v: 19.5, temperature_c: 40.0 });
}

#[test]
fn carriage_may_stand_on_a_switch() {
    let axis = axis("[axis.0]\nstart = -0.1\ntravel.left.at = 0\ntravel.home = { at = 0, width = 0.1 }");
    assert_eq!(Switch::ALL.map(|switch| axis.switch(switch)), [true, false, false]);
}

#[test]
fn encoder_counts_what_the_file_says() {
    let mut axis = axis("[axis.0]\nencoder = { counts_per_turn = 10_000 }");
    axis.place(25_600);
    assert_eq!(axis.encoder_count(), 5000);
}

#[test]
fn encoder_has_a_null_channel_if_the_file_names_its_count() {
    let index = |text: &str| axis(text).encoder.and_then(|encoder| encoder.index);
    assert_eq!(index("[axis.0]\nencoder = { counts_per_turn = 4096, index = 7 }"), Some(7));
    assert_eq!(index("[axis.0]\nencoder = { counts_per_turn = 4096 }"), None);
}

#[test]
fn inputs_have_their_levels_when_the_module_starts() {
    let file = parsed("module = \"tmcm-3351\"\n[io]\nenable = false\ninputs = { 3 = true, 4 = false }\nanalog.0 = 512");
    let mut io = file.machine.io;
    assert_eq!((io.enable(), io.inputs(), io.analog(0)), (false, 1 << 3, 512));
}

#[test]
fn devices_hang_on_the_spi_bus() {
    let io = "[io]\nspi = { 0 = 'loop-back', 1 = '74hc595', 2 = ['9F00: 00C2', '05: 01'] }";
    let devices = parsed(&format!("module = 'tmcm-351'\n{io}")).machine.io.spi;
    assert_eq!(devices[..2], [SpiDevice::Loopback, SpiDevice::Outputs(0)]);
    assert!(matches!(&devices[2], SpiDevice::Script { exchanges, next: 0 } if exchanges.len() == 2));
}

#[test]
fn events_happen_at_their_time() {
    let text = "module = \"tmcm-3351\"\n\
        [[event]]\nat = 2.5\ndo = \"switch 0 home 0\"\n[[event]]\nat = 1\ndo = \"switch 0 home 1\"";
    let mut bench = parsed(text).build(Eeprom::of(&TMCM_3351));
    let levels = [999_999, 1_000_000, 2_499_999, 2_500_000].map(|time_us| {
        bench.run_until(time_us);
        bench.axis_parameter(0, Ap::HomeSwitch)
    });
    assert_eq!(levels, [Some(0), Some(1), Some(1), Some(0)]);
}

#[test]
fn problems_name_line_and_key_and_say_what_is_expected() {
    let cases = [
        ("module = 3351", "1: module: invalid type: integer `3351`, expected a string"),
        (
            "module = 'tmcm-1140'",
            "1: module: expected a module that runs, tmcm-3351, tmcm-351, tmcm-1617, not `tmcm-1140`",
        ),
        (
            "axes = 3",
            "2: axes: unknown field `axes`, expected one of `module`, `supply`, `temperature`, `axis`, `servo`, `io`, `event`",
        ),
        ("\n[axis.3]", "3: axis.3: expected an axis: 0, 1, 2"),
        ("[axis.00]", "2: axis.00: expected an axis: 0, 1, 2"),
        (
            "[axis.0]\nfull_step = 200",
            "3: axis.0.full_step: unknown field `full_step`, expected one of `motor`, `currents`, `inertia`, `friction`, `viscous`, \
             `load`, `full_steps`, `travel_per_turn`, `reversed`, `start`, `travel`, `encoder`, `stallguard`",
        ),
        (
            "[axis.1]\nfull_steps = 0",
            "3: axis.1.full_steps: invalid value: integer `0`, expected a whole number from 1 to 10000",
        ),
        (
            "[axis.1]\nfull_steps = 1.5",
            "3: axis.1.full_steps: invalid value: floating point `1.5`, expected a whole number from 1 to 10000",
        ),
        (
            "[axis.0]\ntravel_per_turn = 0",
            "3: axis.0.travel_per_turn: invalid value: integer `0`, expected a length from 0.001 to 1000000",
        ),
        (
            "[axis.0]\nstart = 'left'",
            "3: axis.0.start: invalid type: string \"left\", expected a length from -1000000 to 1000000",
        ),
        (
            "[axis.0]\nstart = nan",
            "3: axis.0.start: invalid value: floating point `NaN`, expected a length from -1000000 to 1000000",
        ),
        (
            "[axis.0.travel]\nhome = 5",
            "3: axis.0.travel.home: invalid type: integer `5`, expected a table such as { at = 60.0, width = 2.0 }",
        ),
        ("[axis.0.travel]\nhome = { at = 5 }", "3: axis.0.travel.home: missing field `width`"),
        ("[axis.0]\n[axis.1]\n[axis.0.travel.home]\nat = 5", "4: axis.0.travel.home: missing field `width`"),
        (
            "[axis.0.travel.home]\nat = 5\nwidth = -1",
            "4: axis.0.travel.home.width: invalid value: integer `-1`, expected a length from 0 to 1000000",
        ),
        (
            "[axis.0]\nencoder = true",
            "3: axis.0.encoder: invalid type: boolean `true`, expected a table such as { counts_per_turn = 4096 }",
        ),
        ("[io]\nspi.3 = 'loop-back'", "3: io.spi.3: expected a chip select: 0, 1, 2"),
        ("[io]\nspi.0 = 'flash'", "3: io.spi.0: `loop-back`, `74hc595` or a list such as [\"9F000000: 00C22017\"]"),
        ("[io]\nspi.0 = ['9F']", "3: io.spi.0: expected two times 1 to 4 bytes as in `9F000000: 00C22017`, not `9F`"),
        ("[io]\ninputs = { 3 = 1 }", "3: io.inputs.3: invalid type: integer `1`, expected a boolean"),
        ("[io]\ninputs = { 8 = true }", "3: io.inputs.8: expected an input: 0, 1, 2, 3, 4, 5, 6, 7"),
        ("[io]\nanalog.4 = 1", "3: io.analog.4: expected an analogue input: 0, 1, 2, 3, 6, 7"),
        (
            "[io]\nanalog.0 = 1024",
            "3: io.analog.0: invalid value: integer `1024`, expected a whole number from 0 to 1023",
        ),
        (
            "[[event]]\nat = 1\ndo = 'in 1 1'\n[[event]]\nat = -1\ndo = 'in 1 1'",
            "6: event.at: invalid value: integer `-1`, expected seconds from 0 to 1000000000",
        ),
        ("[[event]]\nat = 1\ndo = 'in 1 1'\n[[event]]\nat = 1", "5: event: missing field `do`"),
        (
            "[[event]]\nat = 1\ndo = 'show'",
            "4: event.do: expected a line of the console that changes the machine; `show` changes nothing",
        ),
        (
            "[[event]]\nat = 1\ndo = 'switch 3 home 1'",
            "4: event.do: expected a line of the console that changes the machine; `3` is no AXIS; usage: switch AXIS \
             left|right|home 0|1|auto",
        ),
        ("[axis.0]\nstart = 1\nstart = 2", "4: duplicate key"),
        (
            "[axis.0]\nmotor = 'QSH'",
            "3: axis.0.motor: invalid value: string \"QSH\", expected \"rigid\", the data of a motor as a table, or a motor by name: \
             QSH5718-41, QSH5718-51, QSH5718-56, QSH5718-76, QSH6018-45, QSH6018-56, QSH6018-65, QSH6018-86",
        ),
        ("[axis.0]\nmotor = { resistance = 1 }", "3: axis.0.motor: missing field `inductance`"),
        (
            "[axis.0.motor]\nresistance = 0",
            "3: axis.0.motor.resistance: invalid value: integer `0`, expected ohms from 0.001 to 1000",
        ),
        (
            "[axis.0]\ncurrents = 'exact'",
            "3: axis.0.currents: unknown variant `exact`, expected one of `hybrid`, `quasi-static`, `electrical`",
        ),
        (
            "[axis.0]\nstallguard = { noise = -1 }",
            "3: axis.0.stallguard.noise: invalid value: integer `-1`, expected counts from 0 to 1000",
        ),
        (
            "[axis.0]\nfriction = -1",
            "3: axis.0.friction: invalid value: integer `-1`, expected a torque in Nm from 0 to 1000",
        ),
        (
            "[axis.0.travel.left]\nat = 1\nbounce = 11",
            "4: axis.0.travel.left.bounce: invalid value: integer `11`, expected seconds from 0 to 10",
        ),
        ("supply = 61", "2: supply: invalid value: integer `61`, expected volts from 0 to 60"),
        ("[axis.0", "2: unclosed table, expected `]`"),
    ];
    for (text, message) in cases {
        let whole = if text.starts_with("module") { text.into() } else { format!("module = 'tmcm-3351'\n{text}") };
        assert_eq!(BenchFile::parse(&whole).unwrap_err().to_string(), message, "{text}");
    }
    assert_eq!(BenchFile::parse("").unwrap_err().to_string(), "1: missing field `module`");
}

#[test]
fn text_of_any_kind_gets_a_problem_within_it() {
    let text = include_str!("../../../../examples/benches/rotary-table.toml");
    for end in (0..text.len()).filter(|end| text.is_char_boundary(*end)) {
        if let Err(problem) = BenchFile::parse(&text[..end]) {
            assert!((1..=text[..end].lines().count().max(1) + 1).contains(&problem.line), "{end}: {problem}");
        }
    }
}
