"""For comparison with the soak of gradus-host: PyTrinamic on the same bad lines.

Each request asks for something whose answer identifies it: a user variable whose value tells which variable it is and which write it
was. Prints how many requests failed with an exception, and how many got another request's answer without one.

    .venv/bin/python conformance/soak.py [REQUESTS] [GRADUS]
"""

import random
import subprocess
import sys
import tempfile
from pathlib import Path

from pytrinamic.connections import ConnectionManager

VARIABLES = 20
BANK = 2
TIMEOUT_S = 0.15

count = int(sys.argv[1]) if len(sys.argv) > 1 else 10000
gradus = sys.argv[2] if len(sys.argv) > 2 else "target/release/gradus"


def soak(connection):
    """Failed requests and wrong values. A failed write leaves the variable unknown until it is written again."""
    dice = random.Random(1)
    known, failed, wrong, first_wrong = {}, 0, 0, None
    for number in range(count):
        index = dice.randrange(VARIABLES)
        try:
            if dice.random() < 0.5:
                value = number * VARIABLES + index
                known[index] = None
                connection.set_global_parameter(index, BANK, value)
                known[index] = value
            else:
                value = connection.get_global_parameter(index, BANK, signed=True)
                right = value == known[index] if known.get(index) is not None else value % VARIABLES == index or value == 0
                if not right:
                    wrong += 1
                    first_wrong = first_wrong or number
        except Exception:  # whatever the library raises, a script that goes on goes on
            failed += 1
    return failed, wrong, first_wrong


for kind, option, interface in [("pty", "--pty", "serial_tmcl"), ("slcan-pty", "--slcan", "slcan_tmcl")]:
    for profile in ["noisy-line", "late-replies"]:
        with tempfile.TemporaryDirectory() as folder:
            port = Path(folder) / "port"
            simulator = subprocess.Popen(
                [gradus, "sim", option, port, "--faults", profile], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
            )
            try:
                for line in iter(simulator.stdout.readline, "ready\n"):
                    assert line, "the simulator ended before it was ready"
                arguments = f"--interface {interface} --port {port} --timeout {TIMEOUT_S}"
                with ConnectionManager(arguments).connect() as connection:
                    failed, wrong, first = soak(connection)
            finally:
                simulator.terminate()
                simulator.wait()
        begin = f", the first at request {first}" if wrong else ""
        print(f"{interface}, {profile}: {count} requests, {failed} failed, {wrong} wrong values{begin}", flush=True)
