//! Simulated seconds per second: three axes move while a program polls them.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use gradus_benches::Host;
use gradus_tmcl::Opcode;

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

fn virtual_time(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("virtual time");
    group.sample_size(20).throughput(Throughput::Elements(SECONDS));
    let mut host = Host::default();
    host.run(TO_AND_FRO);
    group.bench_function("three axes move under a program that polls them, seconds", |bencher| {
        bencher.iter(|| host.bench.run_for(SECONDS * 1_000_000));
    });

    let mut host = Host::default();
    for motor in 0..3 {
        host.command(Opcode::ROR, 0, motor, 51_200);
    }
    group.bench_function("three axes turn, seconds", |bencher| {
        bencher.iter(|| host.bench.run_for(SECONDS * 1_000_000));
    });

    let mut host = Host::default();
    host.command(Opcode::SAP, 129, 0, 1);
    host.bench.run_for(3_000_000);
    host.command(Opcode::ROR, 0, 0, 51_200);
    group.bench_function("an axis turns in closed loop, seconds", |bencher| {
        bencher.iter(|| host.bench.run_for(SECONDS * 1_000_000));
    });
    group.finish();
}

criterion_group!(benches, virtual_time);
criterion_main!(benches);
