//! Simulated seconds per second: axes that move, also while a program polls them.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use gradus_benches::Host;
use gradus_plant::{Currents, Mechanics, Motor, STEP_US, StepperAxis, Surroundings};
use gradus_sim::Bench;
use gradus_tmcl::Opcode;
use gradus_tmcl::catalogue::{TMCM_351, TMCM_3351};

/// Sends all motors to and fro, and asks until each has arrived.
const TO_AND_FRO: &str = "
    MVP ABS, 0, 512000
    MVP ABS, 1, -512000
    MVP ABS, 2, 256000
    GAP 8, 0
    JC ZE, 3
    GAP 8, 1
    JC ZE, 5
    GAP 8, 2
    JC ZE, 7
    MVP ABS, 0, 0
    MVP ABS, 1, 0
    MVP ABS, 2, 0
    GAP 8, 0
    JC ZE, 12
    GAP 8, 1
    JC ZE, 14
    GAP 8, 2
    JC ZE, 16
    JA 0
";

const SECONDS: u64 = 10;

/// A host at a module whose axes never lose a step, or at one with motors.
fn machines() -> [(&'static str, Bench); 2] {
    [("rigid axes", Bench::rigid(&TMCM_3351)), ("motors", Bench::with_defaults(&TMCM_3351))]
}

fn virtual_time(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("virtual time");
    group.sample_size(20).throughput(Throughput::Elements(SECONDS));
    for (axes, bench) in machines() {
        let mut host = Host::at(bench);
        host.run(TO_AND_FRO);
        group.bench_function(format!("three axes move under a program that polls them, {axes}, seconds"), |bencher| {
            bencher.iter(|| host.bench.run_for(SECONDS * 1_000_000));
        });
    }
    for (axes, bench) in [("rigid axes", Bench::rigid(&TMCM_351)), ("motors", Bench::with_defaults(&TMCM_351))] {
        let mut host = Host::at(bench);
        host.run(TO_AND_FRO);
        group.bench_function(format!("the same on a TMCM-351, {axes}, seconds"), |bencher| {
            bencher.iter(|| host.bench.run_for(SECONDS * 1_000_000));
        });
    }
    for turning in [3, 1] {
        for (axes, bench) in machines() {
            let mut host = Host::at(bench);
            for motor in 0..turning {
                host.command(Opcode::ROR, 0, motor, 51_200);
            }
            group.bench_function(format!("{turning} of three axes turn, {axes}, seconds"), |bencher| {
                bencher.iter(|| host.bench.run_for(SECONDS * 1_000_000));
            });
        }
    }

    let mut host = Host::at(Bench::with_defaults(&TMCM_3351));
    host.command(Opcode::SAP, 129, 0, 1);
    host.bench.run_for(3_000_000);
    host.command(Opcode::ROR, 0, 0, 51_200);
    group.bench_function("an axis turns in closed loop, seconds", |bencher| {
        bencher.iter(|| host.bench.run_for(SECONDS * 1_000_000));
    });
    group.finish();
}

/// A motor alone: 10 000 steps are a second.
fn motor(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("motor");
    group.throughput(Throughput::Elements(1));
    for currents in [Currents::Hybrid, Currents::QuasiStatic, Currents::Electrical] {
        let mut axis = StepperAxis::with_motor(Motor::default(), Mechanics::default(), currents);
        let (mut step, surroundings) = (0_u64, Surroundings::default());
        group.bench_function(format!("{currents:?}, seconds"), |bencher| {
            bencher.iter(|| {
                for _ in 0..10_000 {
                    step += 1;
                    axis.set_coils((step * 5) as i32, 255);
                    axis.advance(step * STEP_US, &surroundings);
                }
            });
        });
    }
    group.finish();
}

criterion_group!(benches, virtual_time, motor);
criterion_main!(benches);
