"""An independent model of a stepper motor on its driver: what the simulated motor of Gradus is compared with.

Steps of 1 us. Each coil has a bridge that gives plus or minus the supply, whichever drives the current towards the wanted one
(a chopper with a hysteresis of nothing). Nothing of it is taken from the simulator but the equations of the motor:

    L di_a/dt = u_a - R i_a + k w sin(p x)      J dw/dt = k (i_b cos(p x) - i_a sin(p x)) - T_d sin(4 p x) - b w - friction - load
    L di_b/dt = u_b - R i_b - k w cos(p x)      dx/dt = w
"""

import math
from dataclasses import dataclass

from numba import njit

STEP_S = 1e-6
PERIODS = 50  # electrical periods in a turn


@dataclass(frozen=True)
class Motor:
    resistance_ohm: float
    inductance_h: float
    holding_nm: float
    detent_nm: float
    inertia_kgm2: float
    current_a: float = 2.8  # RMS

    def torque_constant(self):
        return self.holding_nm / (math.sqrt(2.0) * self.current_a)


MOTORS = {
    "QSH5718-41": Motor(0.7, 1.4e-3, 0.55, 0.020, 120e-7),
    "QSH5718-51": Motor(0.83, 2.2e-3, 1.01, 0.035, 275e-7),
    "QSH5718-56": Motor(0.9, 2.5e-3, 1.26, 0.039, 300e-7),
    "QSH5718-76": Motor(1.13, 3.6e-3, 1.89, 0.066, 480e-7),
    "QSH6018-45": Motor(0.75, 2.0e-3, 1.1, 0.039, 275e-7),
    "QSH6018-56": Motor(0.9, 3.6e-3, 1.65, 0.058, 400e-7),
    "QSH6018-65": Motor(1.2, 4.6e-3, 2.1, 0.074, 570e-7),
    "QSH6018-86": Motor(1.5, 6.8e-3, 3.1, 0.109, 840e-7),
}


@njit(cache=True)
def step(state, vector, amps, volts, motor, mechanics, load_nm):
    """One microsecond. The state is angle, speed and the two currents; the vector is in electrical radians."""
    resistance, inductance, constant, detent, rotor = motor
    inertia, friction, viscous = mechanics
    angle, speed, i_a, i_b = state
    sin, cos = math.sin(PERIODS * angle), math.cos(PERIODS * angle)
    u_a = volts if i_a < amps * math.cos(vector) else -volts
    u_b = volts if i_b < amps * math.sin(vector) else -volts
    i_a += STEP_S / inductance * (u_a - resistance * i_a + constant * speed * sin)
    i_b += STEP_S / inductance * (u_b - resistance * i_b - constant * speed * cos)
    torque = constant * (i_b * cos - i_a * sin) - detent * math.sin(4 * PERIODS * angle)
    change = STEP_S / (inertia + rotor)
    speed += change * (torque - load_nm - viscous * speed)
    held = change * friction
    speed = 0.0 if abs(speed) <= held else speed - math.copysign(held, speed)
    return angle + STEP_S * speed, speed, i_a, i_b


@njit(cache=True)
def pull_out(motor, mechanics, amps, volts, rps, rate, start_nm, damping):
    """Load in Nm at which a motor that turns with a speed falls out of step.

    The load rises by `rate` a second. The dynamometer damps the shaft against the speed of the vector, as in the tests of
    the simulator: without that the motor may oscillate itself out of step where the current begins to lag.
    """
    target = 2.0 * math.pi * rps
    turning, position, load = 0.0, 0.0, 0.0
    state = (0.0, 0.0, amps, 0.0)
    while position - state[0] < 8.0 * math.pi / (4 * PERIODS):
        turning = min(turning + 2.0 * math.pi * 20.0 * STEP_S, target)
        position += turning * STEP_S
        if turning == target:
            load += rate * STEP_S * (1.0 if load < start_nm else 0.2)
        against = load + damping * (state[1] - turning)
        state = step(state, PERIODS * position, amps, volts, motor, mechanics, against)
    return load


@njit(cache=True)
def unloaded(motor, mechanics, amps, volts, rps, seconds):
    """Mean load angle in degrees and current in A RMS of a motor that turns with nothing but its friction."""
    target = 2.0 * math.pi * rps
    turning, position = 0.0, 0.0
    state = (0.0, 0.0, amps, 0.0)
    ramp_s = rps / 20.0
    settle_s = 2.0
    degrees, square, count = 0.0, 0.0, 0
    for index in range(int((ramp_s + settle_s + seconds) / STEP_S)):
        turning = min(turning + 2.0 * math.pi * 20.0 * STEP_S, target)
        position += turning * STEP_S
        # It settles under the damping of the dynamometer, which then is taken away.
        damped = index * STEP_S < ramp_s + 0.5 * settle_s
        against = 0.03 * (state[1] - turning) if damped else 0.0
        state = step(state, PERIODS * position, amps, volts, motor, mechanics, against)
        if index * STEP_S > ramp_s + settle_s:
            degrees += math.degrees(PERIODS * (position - state[0]))
            square += state[2] * state[2] + state[3] * state[3]
            count += 1
    return degrees / count, math.sqrt(0.5 * square / count)


@njit(cache=True)
def overhauled(motor, mechanics, amps, volts, load_nm, seconds):
    """Turns that a load moves a motor whose vector stands, from rest at the vector."""
    state = (0.0, 0.0, amps, 0.0)
    for _ in range(int(seconds / STEP_S)):
        state = step(state, 0.0, amps, volts, motor, mechanics, load_nm)
    return abs(state[0]) / (2.0 * math.pi)


def data(motor):
    return (motor.resistance_ohm, motor.inductance_h, motor.torque_constant(), motor.detent_nm, motor.inertia_kgm2)


def frictionless(motor):
    """A load with the inertia of the rotor."""
    return (motor.inertia_kgm2, 0.0, 0.0)


DEFAULT_LOAD = (200e-7, 0.01, 1e-3)
