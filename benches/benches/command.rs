//! Framing, executing and answering one command in process.

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use gradus_benches::Host;
use gradus_tmcl::{Instruction, Opcode, Request};

fn command(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("command");
    let mut host = Host::default();
    for (name, opcode, kind) in
        [("GAP 1, 0", Opcode::GAP, 1), ("GAP 4, 0", Opcode::GAP, 4), ("SAP 4, 0, 51200", Opcode::SAP, 4)]
    {
        let datagram = Request { address: 1, instruction: Instruction::new(opcode, kind, 0, 51_200) }.emit();
        group.bench_function(name, |bencher| {
            bencher.iter_batched(|| datagram, |datagram| host.send(&datagram), BatchSize::SmallInput);
        });
    }
    group.finish();
}

criterion_group!(benches, command);
criterion_main!(benches);
