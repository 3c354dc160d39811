//! Field-oriented control: a cycle of the current loop, of the whole servo, and a servo with its simulated motor.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use gradus_motion::foc::{
    Commutation, CurrentGains, CurrentLoop, Dq, Feedback, HallSettings, MotorKind, PiSettings, Servo, ServoSettings,
};
use gradus_plant::{Bridge, ServoMachine, ServoSetup};

const PWM_HZ: u32 = 25_000;

/// Gains for the default machine: a QBL4208-61 with a light load.
fn settings() -> ServoSettings {
    ServoSettings {
        commutation: Commutation::Hall,
        hall: HallSettings { interpolation: true, ..HallSettings::default() },
        torque: PiSettings { p: 1_400, i: 7_000 },
        velocity: PiSettings { p: 600, i: 600 },
        pwm_hz: PWM_HZ,
        ..ServoSettings::default()
    }
}

/// Clarke, Park, two regulators, circular limit, inverse Park, space-vector modulation; limit: 60 ns.
fn current_loop(c: &mut Criterion) {
    let gains = CurrentGains::new(settings().torque, MotorKind::ThreePhase, PWM_HZ);
    let mut current_loop = CurrentLoop::default();
    let mut angle = 0_i16;
    c.bench_function("FOC cycle", |bencher| {
        bencher.iter(|| {
            angle = angle.wrapping_add(523);
            let phases_ma = black_box([i32::from(angle) / 16, -i32::from(angle) / 24]);
            current_loop.cycle(&gains, angle, phases_ma, black_box(Dq { d: 0, q: 1_500 }))
        });
    });
}

/// The same with sensors, ramp, velocity and position regulator.
fn servo(c: &mut Criterion) {
    let mut servo = Servo::new(ServoSettings { commutation: Commutation::Hall, ..settings() }.gains());
    servo.turn(3_000);
    let mut count = 0_i32;
    c.bench_function("servo cycle", |bencher| {
        bencher.iter(|| {
            count = count.wrapping_add(8);
            let phases_ma = black_box([1_000, -300]);
            servo.cycle(&Feedback { phases_ma, hall_bits: 1 + (count >> 8) as u8 % 6, encoder_count: count })
        });
    });
}

/// Seconds of simulated time in a second: 300 are asked for. Throughput is counted in simulated milliseconds.
fn simulation(c: &mut Criterion) {
    let mut group = c.benchmark_group("simulated servo");
    let mut servo = Servo::new(settings().gains());
    let mut machine = ServoMachine::new(ServoSetup::default());
    servo.turn(3_000);
    let mut period = move || {
        let [a, b, _] = machine.phase_currents_a().map(|current| (current * 1_000.0) as i32);
        let feedback =
            Feedback { phases_ma: [a, b], hall_bits: machine.hall_bits(), encoder_count: machine.encoder_count() };
        let bridge = servo
            .cycle(&feedback)
            .map_or(Bridge::Open, |duties| Bridge::Duties(duties.q15.map(|duty| f64::from(duty) * (1.0 / 32_768.0))));
        machine.step(1.0 / f64::from(PWM_HZ), bridge);
        machine.velocity_rpm()
    };
    group.throughput(Throughput::Elements(100));
    group.bench_function("100 ms, plant and control at 25 kHz", |bencher| {
        bencher.iter(|| (0..PWM_HZ / 10).map(|_| period()).fold(0.0, f64::max));
    });
    group.finish();
}

criterion_group!(benches, current_loop, servo, simulation);
criterion_main!(benches);
