"""Seconds of simulated time in a second: Gradus beside gym-electric-motor and motulator.

The same for all: a QBL4208-61 with a load of 50 gcm2 at 24 V, a velocity step to 3000 rpm, field-oriented control with currents
and velocity regulated every 40 us, one process on one core.

    python3 -m venv /tmp/peers && /tmp/peers/bin/pip install -r benches/peers/requirements.txt
    /tmp/peers/bin/python benches/peers/peers.py            # runs `cargo bench` for Gradus

`--gradus 300` takes a figure of Gradus instead. The others' times are those of the processor, so that other processes do not
count; the benchmark of Gradus takes the time of the wall, and wants a quiet machine.
"""

import argparse
import math
import re
import subprocess
import time
from pathlib import Path

PERIOD = 40e-6
SUPPLY = 24.0
POLE_PAIRS = 4
RESISTANCE = 0.36
INDUCTANCE = 0.6e-3
TORQUE_CONSTANT = 0.036
FLUX = TORQUE_CONSTANT / (1.5 * POLE_PAIRS)
INERTIA = 4.8e-6 + 5e-6
MAX_CURRENT = 4.0
TARGET = 3000 * 2 * math.pi / 60

CURRENT_BANDWIDTH = 4000.0
VELOCITY_BANDWIDTH = 200.0


def motulator(seconds):
    """Speed at the end in rad/s, and the time that took."""
    from motulator.drive import model
    from motulator.drive.utils import SynchronousMachinePars
    from motulator.drive.control import sm

    pars = SynchronousMachinePars(n_p=POLE_PAIRS, R_s=RESISTANCE, L_d=INDUCTANCE, L_q=INDUCTANCE, psi_f=FLUX)
    drive = model.Drive(
        model.VoltageSourceConverter(u_dc=SUPPLY),
        model.SynchronousMachine(pars),
        model.StiffMechanicalSystem(J=INERTIA),
    )
    reference = sm.CurrentReferenceCfg(pars, max_i_s=MAX_CURRENT, nom_w_m=POLE_PAIRS * TARGET)
    control = sm.CurrentVectorControl(pars, reference, T_s=PERIOD, J=INERTIA, alpha_c=CURRENT_BANDWIDTH, sensorless=False)
    control.ref.w_m = lambda _: POLE_PAIRS * TARGET
    simulation = model.Simulation(drive, control)
    start = time.process_time()
    simulation.simulate(t_stop=seconds)
    return drive.mechanics.state.w_M.real, time.process_time() - start


def gym_electric_motor(seconds):
    """The same, with the regulators that this package leaves to its user."""
    import gym_electric_motor as gem

    limits = dict(omega=600.0, i=20.0, u=SUPPLY)
    environment = gem.make(
        "Cont-SC-PMSM-v0",
        tau=PERIOD,
        motor=dict(
            motor_parameter=dict(
                p=POLE_PAIRS, r_s=RESISTANCE, l_d=INDUCTANCE, l_q=INDUCTANCE, psi_p=FLUX, j_rotor=4.8e-6
            ),
            limit_values=limits,
            nominal_values=limits,
        ),
        supply=dict(u_nominal=SUPPLY),
        load=dict(load_parameter=dict(a=0.0, b=0.0, c=0.0, j_load=5e-6)),
        visualization=None,
        constraints=(),
    )
    system = environment.unwrapped.physical_system
    scale, names = system.limits, system.state_names
    at = {name: names.index(name) for name in ("omega", "i_sd", "i_sq", "epsilon")}
    (state, _), _ = environment.reset()
    control = Control()
    start = time.process_time()
    for _ in range(round(seconds / PERIOD)):
        omega, d, q, angle = (float(state[at[name]] * scale[at[name]]) for name in ("omega", "i_sd", "i_sq", "epsilon"))
        (state, _), _, _, _, _ = environment.step(control.cycle(omega, d, q, angle))
    return float(state[at["omega"]] * scale[at["omega"]]), time.process_time() - start


class Control:
    """Cascade of velocity and currents, in plain Python."""

    def __init__(self):
        self.velocity = self.volts_d = self.volts_q = 0.0

    def cycle(self, omega, d, q, angle):
        velocity_p = VELOCITY_BANDWIDTH * INERTIA / TORQUE_CONSTANT
        error = TARGET - omega
        wanted = velocity_p * error + self.velocity
        wanted_q = max(-MAX_CURRENT, min(MAX_CURRENT, wanted))
        if wanted == wanted_q:
            self.velocity += velocity_p * VELOCITY_BANDWIDTH / 5 * error * PERIOD
        volts_d = CURRENT_BANDWIDTH * INDUCTANCE * -d + self.volts_d
        volts_q = CURRENT_BANDWIDTH * INDUCTANCE * (wanted_q - q) + self.volts_q
        self.volts_d += CURRENT_BANDWIDTH * RESISTANCE * -d * PERIOD
        self.volts_q += CURRENT_BANDWIDTH * RESISTANCE * (wanted_q - q) * PERIOD
        sin, cos = math.sin(angle), math.cos(angle)
        alpha, beta = volts_d * cos - volts_q * sin, volts_d * sin + volts_q * cos
        phases = [alpha, -alpha / 2 + math.sqrt(0.75) * beta, -alpha / 2 - math.sqrt(0.75) * beta]
        middle = (max(phases) + min(phases)) / 2
        return [max(-1.0, min(1.0, 2 * (phase - middle) / SUPPLY)) for phase in phases]


def gradus():
    """Simulated seconds in a second of the benchmark `foc`."""
    root = Path(__file__).resolve().parents[2]
    command = ["cargo", "bench", "--package", "gradus-benches", "--bench", "foc", "--", "simulated servo"]
    output = subprocess.run(command, cwd=root, check=True, capture_output=True, text=True).stdout
    value, unit = re.search(r"time:\s+\[\S+ \S+ (\S+) (\S+)", output).groups()
    return 0.1 / (float(value) * {"µs": 1e-6, "us": 1e-6, "ms": 1e-3}[unit])


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--gradus", type=float, help="simulated seconds in a second, instead of `cargo bench`")
    arguments.add_argument("--seconds", type=float, default=0.5, help="how much the others simulate")
    arguments = arguments.parse_args()
    speeds = {}
    for peer in (gym_electric_motor, motulator):
        peer(arguments.seconds / 10)
        omega, took = peer(arguments.seconds)
        speeds[peer.__name__] = arguments.seconds / took
        print(f"{peer.__name__:>20}: {speeds[peer.__name__]:8.3f} s/s, ends at {omega * 60 / (2 * math.pi):.0f} rpm")
    own = arguments.gradus or gradus()
    print(f"{'gradus':>20}: {own:8.1f} s/s, {own / max(speeds.values()):.0f} times the faster of the two")


if __name__ == "__main__":
    main()
