//! One tick of the ramp generator.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use gradus_motion::{Gains, Limits, Ramp, Tmc428Limits, Tmc428Ramp, Tmc428Units};

const TICKS: u64 = 10_000;
const TICK_HZ: u32 = 10_000;

/// Moves forth and back, without end.
fn ticks(criterion: &mut Criterion, name: &str, gains: Gains) {
    let mut group = criterion.benchmark_group("ramp");
    group.throughput(Throughput::Elements(TICKS));
    let mut ramp = Ramp::new(gains);
    group.bench_function(name, |bencher| {
        bencher.iter(|| {
            for _ in 0..TICKS {
                if ramp.is_idle() {
                    ramp.move_to(102_400 - ramp.position());
                }
                ramp.tick();
            }
            ramp.position()
        });
    });
    group.finish();
}

fn limits() -> Limits {
    Limits { max_speed_pps: 51_200, acceleration: 51_200, deceleration: 51_200, ..Limits::default() }
}

fn trapezoid(criterion: &mut Criterion) {
    ticks(criterion, "trapezoid, ticks", limits().gains(TICK_HZ));
}

fn s_shape(criterion: &mut Criterion) {
    ticks(criterion, "S-shape, ticks", limits().gains(TICK_HZ).s_shaped([100_000, 200_000, 100_000, 200_000]));
}

/// Ticks of the chip: 6.25 in a control tick with ramp divisor 3, and 50 with 0.
fn tmc428(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("ramp");
    for (ramp_div, chip_ticks) in [(3, TICKS * 25 / 4), (0, TICKS * 50)] {
        let units = Tmc428Units { pulse_div: 2, ramp_div };
        let limits = Tmc428Limits { units, min_speed: 1, max_speed: 1000, acceleration: 500 };
        let mut ramp = Tmc428Ramp::new(limits.gains(TICK_HZ));
        group.throughput(Throughput::Elements(chip_ticks));
        group.bench_function(format!("TMC428, ramp divisor {ramp_div}, ticks of the chip"), |bencher| {
            bencher.iter(|| {
                for _ in 0..TICKS {
                    if ramp.is_idle() {
                        ramp.move_to(102_400 - ramp.position());
                    }
                    ramp.tick();
                }
                ramp.position()
            });
        });
    }
    group.finish();
}

criterion_group!(benches, trapezoid, s_shape, tmc428);
criterion_main!(benches);
