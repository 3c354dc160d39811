"""A virtual module for every test, on the port that the test asks for: a TMCM-3351, or a TMCM-1617 where it wants a servo."""

import os
import subprocess
from pathlib import Path

import pytest
from pytrinamic.connections import ConnectionManager
from pytrinamic.modules import TMCM1617, TMCM3351

ROOT = Path(__file__).parent.parent
TARGET = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
GRADUS = TARGET / "release" / "gradus"


class Simulator:
    """`gradus sim` with its endpoints; `say` writes a line to its console."""

    def __init__(self, *arguments):
        self.process = subprocess.Popen(
            [GRADUS, "sim", *arguments], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        self.endpoints = {}
        for line in iter(self.process.stdout.readline, "ready\n"):
            assert line, "the simulator ended before it was ready"
            kind, address = line.split()
            self.endpoints[kind] = address

    def say(self, line):
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()

    def stop(self):
        self.process.terminate()
        assert self.process.wait(timeout=10) == 0


@pytest.fixture
def simulator(tmp_path):
    simulator = Simulator("--pty", str(tmp_path / "module"), "--tcp", "127.0.0.1:0")
    yield simulator
    simulator.stop()


def connect(simulator, interface):
    """Opens a port of the simulator as a script with command-line arguments does."""
    kind = {"serial_tmcl": "pty", "socket_serial_tmcl": "tcp"}[interface]
    return ConnectionManager(f"--interface {interface} --port {simulator.endpoints[kind]}").connect()


@pytest.fixture(params=["serial_tmcl", "socket_serial_tmcl"])
def connection(request, simulator):
    with connect(simulator, request.param) as connection:
        yield connection


@pytest.fixture
def module(connection):
    return TMCM3351(connection)


@pytest.fixture
def servo_simulator(tmp_path):
    simulator = Simulator("tmcm-1617", "--pty", str(tmp_path / "servo"), "--tcp", "127.0.0.1:0")
    yield simulator
    simulator.stop()


@pytest.fixture(params=["serial_tmcl", "socket_serial_tmcl"])
def servo_connection(request, servo_simulator):
    with connect(servo_simulator, request.param) as connection:
        yield connection


@pytest.fixture
def servo(servo_connection):
    return TMCM1617(servo_connection)
