"""The maker's examples for the TMCM-1617, and the tests of its data logger, on the virtual module: unmodified but for the line
that says what they connect to."""

import subprocess
import sys
import time

import pytest
from conftest import ROOT, Simulator
from vendor import connected

EXAMPLES = "examples/modules/TMCM1617/TMCL"


@pytest.fixture
def bench(tmp_path):
    """Serves a bench file; gives back the simulator and a function that runs a script on it."""
    simulators = []

    def start(name):
        pty = str(tmp_path / "servo")
        simulator = Simulator("--bench", str(ROOT / "examples/benches" / name), "--pty", pty)
        simulators.append(simulator)
        return simulator, lambda script: connected(script, "serial_tmcl", pty, tmp_path)

    yield start
    for simulator in simulators:
        simulator.stop()


def run(script, seconds=120):
    """What a script prints; it must end well, and in time."""
    command = [sys.executable, "-u", str(script)]
    ended = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=seconds)
    assert ended.returncode == 0, ended.stdout
    return ended.stdout


def numbers(output, name):
    """The numbers that follow a name in the lines of a script."""
    return [int(line.split(f"{name}:")[1].split()[0]) for line in output.splitlines() if f"{name}:" in line]


def test_encoder_position_mode(bench):
    _, script = bench("pytrinamic-encoder.toml")
    output = run(script(f"{EXAMPLES}/encoder_position_mode.py"))
    assert output.rstrip().endswith("Ready.")
    assert set(numbers(output, "target position")) == {0, 50 * 4096}
    actual = numbers(output, "actual position")
    assert max(actual) > 49 * 4096 and abs(actual[0]) < 4096 and min(actual) > -4096


def test_hall_position_mode(bench):
    _, script = bench("pytrinamic-hall-position.toml")
    output = run(script(f"{EXAMPLES}/hall_position_mode.py"))
    assert output.rstrip().endswith("Ready.")
    assert set(numbers(output, "target position")) == {0, 4000}
    assert max(numbers(output, "actual position")) > 3900


def test_hall_digital_input(bench):
    simulator, script = bench("pytrinamic-hall-input.toml")
    process = subprocess.Popen(
        [sys.executable, "-u", str(script(f"{EXAMPLES}/hall_digital_input.py"))], stdout=subprocess.PIPE, text=True
    )
    output = ""
    for button in (0, 1):
        # The motor comes to its speed; then somebody presses the button.
        wanted, deadline = (500, -500)[button], time.monotonic() + 60
        for line in process.stdout:
            output += line
            speeds = numbers(line, "actual velocity")
            if speeds and abs(speeds[0] - wanted) < 50:
                break
            assert time.monotonic() < deadline, output
        simulator.say(f"in {button} 0")
    output += process.communicate(timeout=30)[0]
    assert process.returncode == 0 and output.rstrip().endswith("Ready."), output


def test_register_access(bench):
    _, script = bench("servo.toml")
    output = run(script(f"{EXAMPLES}/register_access.py"))
    assert "0x34363731" in output and "0x00010003" in output and "0x00000010" in output, output


def test_data_logger(bench, tmp_path):
    """Their tests of captures: they ask for noise on the currents and for a steady open loop."""
    _, script = bench("servo.toml")
    tests = script("tests/test_datalogger_tmcm_1617.py")
    command = [sys.executable, "-m", "pytest", "--quiet", "-p", "no:cacheprovider", "--rootdir", str(tmp_path), str(tests)]
    ended = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=300, cwd=tmp_path)
    assert ended.returncode == 0 and "46 passed" in ended.stdout, ended.stdout
