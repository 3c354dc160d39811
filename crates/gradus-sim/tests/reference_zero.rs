//! Where a reference search puts zero: a grid of modes, speeds, accelerations, switches and stops, rigid and with physics.
//!
//! The far ends are 40 turns from the middle, so that every speed of the grid is reached before the switch.

mod host;

use gradus_plant::{StepperAxis, Travel, Vane};
use gradus_sim::Bench;
use gradus_tmcl::catalogue::{Ap, TMCM_3351};

use host::Host;

const TURN: i64 = 51_200;

/// The middles of the switches and the places where a search begins, in whole electrical periods.
const LEFT: i64 = -40 * TURN;
const HOME: i64 = 0;
const RIGHT: i64 = 40 * TURN;
const START: i64 = 35 * TURN;

/// A period of the coil vector: so many microsteps the rotor may have lost without a difference.
const PERIOD: i64 = 1_024;

const MODES: [i32; 16] = [1, 2, 3, 4, 5, 6, 7, 8, 65, 66, 67, 68, 133, 134, 135, 136];
const SPEEDS: [i32; 5] = [10_000, 51_200, 100_000, 200_000, 400_000];
const ACCELERATIONS: [i32; 2] = [51_200, 400_000];
/// Half widths: switches of 0.1 and 1 turn.
const HALVES: [i64; 2] = [TURN / 20, TURN / 2];

#[derive(Clone, Copy, Debug)]
struct Case {
    rigid: bool,
    mode: i32,
    speed: i32,
    acceleration: i32,
    half: i64,
    /// Axis parameter 34, with the deceleration of the ramp in 21.
    soft: i32,
}

impl Case {
    /// Twice the place where zero belongs: an edge lies between two microsteps.
    fn twice_zero(self) -> i64 {
        match self.mode {
            1 | 2 => 2 * (LEFT + self.half) + 1,
            3 | 4 => 2 * LEFT,
            65 | 66 => 2 * (RIGHT - self.half) - 1,
            67 | 68 => 2 * RIGHT,
            _ => 2 * HOME,
        }
    }

    fn is_edge(self) -> bool {
        matches!(self.mode, 1 | 2 | 65 | 66)
    }

    fn start(self) -> i64 {
        match self.mode {
            5 | 8 | 133 | 136 => START,
            6 | 7 | 134 | 135 => -START,
            _ => 0,
        }
    }

    fn plant(self) -> StepperAxis {
        let mut plant = if self.rigid { StepperAxis::rigid(200) } else { StepperAxis::default() };
        let vane = |middle, opens| Some(Vane { opens, ..Vane::between(middle - self.half, middle + self.half) });
        plant.travel = Travel {
            left: vane(LEFT, false),
            right: vane(RIGHT, false),
            home: vane(HOME, self.mode >= 128),
            ..Travel::default()
        };
        plant.place(self.start());
        plant
    }

    /// The host of the module after the search.
    fn search(self) -> Host {
        let mut bench = Bench::with_defaults(&TMCM_3351);
        bench.machine().axes[0].plant = self.plant();
        let mut host = Host::new(bench);
        let Self { mode, speed, acceleration, soft, .. } = self;
        host.tell(&format!("SAP 5, 0, {acceleration}; SAP 17, 0, {acceleration}; SAP 21, 0, {acceleration}"));
        host.tell(&format!("SAP 34, 0, {soft}; SAP 193, 0, {mode}; SAP 194, 0, {speed}; RFS START, 0"));
        let limit = host.bench.now() + 3_000_000_000;
        while host.ask("RFS STATUS, 0") != 0 {
            host.bench.run_for(100_000);
            assert!(host.bench.now() < limit, "{self:?}: it runs for ever");
        }
        host.bench.run_for(1_000_000);
        host
    }

    /// Twice the distance of zero from where it belongs, and where the rotor then stands, in microsteps.
    fn errors(self) -> (i64, i64) {
        let mut host = self.search();
        assert_eq!(host.get(Ap::ExtendedErrorFlags), 0, "{self:?}");
        let zero = i64::from(host.get(Ap::LastReferencePosition)) + self.start();
        let rotor = host.bench.machine().axes[0].plant.position();
        let lost = (rotor - zero + PERIOD / 2).div_euclid(PERIOD) * PERIOD;
        (2 * (zero + lost) - self.twice_zero(), rotor - self.twice_zero() / 2)
    }

    fn check(self) -> Option<String> {
        let (twice, rotor) = self.errors();
        let allowed = match (self.rigid, self.is_edge()) {
            (true, false) => 0,
            (true, true) => 1,
            (false, _) => 4,
        };
        (twice.abs() > allowed || rotor.abs() > 40).then(|| format!("{self:?}: {} {rotor}", twice as f64 / 2.0))
    }
}

fn check(cases: impl Iterator<Item = Case>) {
    let (mut count, mut wrong) = (0, vec![]);
    for case in cases {
        count += 1;
        wrong.extend(case.check());
    }
    assert!(wrong.is_empty(), "{} of {count}:\n{}", wrong.len(), wrong.join("\n"));
}

fn grid(rigid: bool) -> impl Iterator<Item = Case> {
    let rows = MODES.into_iter().flat_map(|mode| SPEEDS.map(|speed| (mode, speed)));
    let rows = rows.flat_map(|(mode, speed)| ACCELERATIONS.map(|acceleration| (mode, speed, acceleration)));
    let rows = rows.flat_map(|row| HALVES.map(|half| (row, half)));
    rows.flat_map(move |((mode, speed, acceleration), half)| {
        [0, 1].map(|soft| Case { rigid, mode, speed, acceleration, half, soft })
    })
}

#[test]
fn zero_is_right_at_every_mode_speed_width_and_stop() {
    // By hand: all 320 searches of either kind of axis, which takes minutes.
    if let Ok(axis) = std::env::var("GRADUS_SEARCH_GRID") {
        return check(grid(axis == "rigid"));
    }
    // Each mode once, and each other value several times; the long ways of slow braking are for the whole grid.
    let cases = MODES.into_iter().enumerate().flat_map(|(index, mode)| {
        [false, true].map(|rigid| Case {
            rigid,
            mode,
            speed: SPEEDS[index % 5],
            acceleration: if index % 5 < 2 { ACCELERATIONS[index / 2 % 2] } else { ACCELERATIONS[1] },
            half: HALVES[index / 4 % 2],
            soft: index as i32 / 8 % 2,
        })
    });
    check(cases);
}
