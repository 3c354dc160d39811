//! One tick of the ramp generator.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use gradus_motion::{Limits, Ramp};

const TICKS: u64 = 10_000;

fn ramp(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("ramp");
    group.throughput(Throughput::Elements(TICKS));
    let limits = Limits { max_speed_pps: 51_200, acceleration: 51_200, deceleration: 51_200, ..Limits::default() };
    let mut ramp = Ramp::new(limits.gains(10_000));
    group.bench_function("trapezoid, ticks", |bencher| {
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

criterion_group!(benches, ramp);
criterion_main!(benches);
