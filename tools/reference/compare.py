"""Compares the simulated stepper motor of Gradus with the independent model in stepper.py.

    python3 -m venv .venv && .venv/bin/pip install -r tools/reference/requirements.txt
    .venv/bin/python tools/reference/compare.py

The tests of `crates/gradus-plant/tests/saturation.rs` print what the simulated motor does and the number that they expect.
This computes the expected numbers anew, prints all three, and ends with 1 if a test expects something else than the model.
"""

import math
import re
import subprocess
import sys
from pathlib import Path

from stepper import DEFAULT_LOAD, MOTORS, data, overhauled, pull_out, unloaded

ROOT = Path(__file__).resolve().parents[2]
TEST = ["cargo", "test", "-q", "-p", "gradus-plant", "--test", "saturation", "--", "--nocapture", "--test-threads", "1"]

# Share by which the expectation of a test may differ from the model: its numbers are rounded.
ROUNDED = 0.01


def reference(what, name, volts, value):
    """What the model says for a line of the test."""
    motor = MOTORS[name]
    amps = math.sqrt(2.0) * motor.current_a
    args = (data(motor), DEFAULT_LOAD, amps, volts)
    if what == "pull-out Nm":
        # The load rises by 1 Nm a second, and nothing damps the shaft but its own load.
        return pull_out(*args, value / 60.0, 1.0, 1e9, 0.0)
    if what == "falling turns":
        return overhauled(*args, value, 0.5)
    degrees, current = unloaded(*args, value / 60.0, 1.0)
    return degrees if what == "unloaded deg" else current


def main():
    printed = subprocess.run(TEST, cwd=ROOT, capture_output=True, text=True, check=False).stdout
    rows = re.findall(r"= (.+?) \| (.+?) \| (.+?) V \| (.+?) \| (.+?) \| (.+?) \| (.+)", printed)
    wrong = 0
    print(f"{'':13} {'motor':10} {'V':>3} {'rpm or Nm':>9} {'model':11} {'Gradus':>8} {'test':>8} {'reference':>9}")
    for what, name, volts, value, model, found, expected in rows:
        now = reference(what, name, float(volts), float(value))
        off = abs(now - float(expected)) > ROUNDED * max(abs(now), 1.0)
        wrong += off
        print(
            f"{what:13} {name:10} {volts:>3} {value:>9} {model:11} {float(found):8.3f} {expected:>8} {now:9.3f}"
            + ("  <- the test expects something else" if off else "")
        )
    if not rows:
        print("the tests printed nothing; do they build?", file=sys.stderr)
    return 1 if wrong or not rows else 0


if __name__ == "__main__":
    sys.exit(main())
