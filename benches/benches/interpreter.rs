//! A counting loop in the interpreter, axes idle, and the same loop in Lua 5.4.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use gradus_benches::Host;
use mlua::{Function, Lua};

/// Three instructions a turn.
const COUNT: &str = "
    CALC ADD, 1
    COMP 2000000000
    JC LT, 0
    CALC LOAD, 0
    JA 0
";

/// One instruction takes 10 us.
const INSTRUCTIONS: u64 = 3_000_000;
const TIME_US: u64 = INSTRUCTIONS * 10;

const LUA: &str = "
    local count = 0
    return function(turns)
        local n = 0
        ::again::
        count = count + 1
        if count >= 2000000000 then count = 0 end
        n = n + 1
        if n < turns then goto again end
        return count
    end
";

fn interpreter(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("interpreter");
    group.sample_size(20).throughput(Throughput::Elements(INSTRUCTIONS));
    let mut host = Host::default();
    host.run(COUNT);
    group.bench_function("counting loop, TMCL instructions", |bencher| {
        bencher.iter(|| host.bench.run_for(TIME_US));
    });
    let lua = Lua::new();
    let turn: Function = lua.load(LUA).eval().expect("the program is valid");
    // A third of the instructions: one turn of the loop counts as the three TMCL instructions that it does.
    group.bench_function("counting loop, Lua 5.4", |bencher| {
        bencher.iter(|| turn.call::<i64>(INSTRUCTIONS / 3).expect("the loop runs"));
    });
    group.finish();
}

criterion_group!(benches, interpreter);
criterion_main!(benches);
