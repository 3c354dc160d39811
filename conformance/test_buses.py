"""CAN behind a serial adapter, and several modules on one bus."""

import threading
import time

import pytest
from conftest import Simulator
from pytrinamic.connections import ConnectionManager
from pytrinamic.modules import TMCM3351
from pytrinamic.tmcl import TMCLReplyStatusError


def connect(interface, port, host=2, module=1):
    return ConnectionManager(
        f"--interface {interface} --port {port} --host-id {host} --module-id {module} --timeout 5"
    ).connect()


@pytest.fixture
def serve(tmp_path):
    """Serves a bench file; the endpoints come in its order."""
    simulators = []

    def start(text):
        bench = tmp_path / "bench.toml"
        bench.write_text(text.replace("FOLDER", str(tmp_path)))
        simulators.append(Simulator("--bench", str(bench)))
        return simulators[-1]

    yield start
    for simulator in simulators:
        simulator.stop()


def move_to(module, motor, target):
    module.motors[motor].move_to(target)
    deadline = time.monotonic() + 20
    while not module.motors[motor].get_position_reached():
        assert time.monotonic() < deadline
    return module.motors[motor].actual_position


def test_a_module_behind_a_serial_can_adapter(tmp_path):
    adapter = str(tmp_path / "adapter")
    simulator = Simulator("--slcan", adapter)
    with connect("slcan_tmcl", adapter) as connection:
        module = TMCM3351(connection)
        assert connection.get_version_string() == "3351V111"
        for value in (0, 1, -1, 2**31 - 1, -(2**31)):
            connection.set_global_parameter(9, 2, value)
            assert connection.get_global_parameter(9, 2, signed=True) == value
        with pytest.raises(TMCLReplyStatusError):
            connection.set_axis_parameter(6, 0, 256)
        assert move_to(module, 0, 25_600) == 25_600
    simulator.stop()


MODULE = """
[[module]]
name = "{name}"
bus = "line"
module = "tmcm-3351"
"""

SEGMENT = """
[[bus]]
name = "line"
kind = "rs485"
baud = 115200
endpoints = ["pty:FOLDER/line"]
""" + "".join(MODULE.format(name=f"m{address}") + f"address = {address}\n" for address in (1, 3, 4))


def test_three_modules_on_one_segment(serve):
    simulator = serve(SEGMENT)
    with connect("serial_tmcl", simulator.endpoints["pty"]) as connection:
        modules = {address: TMCM3351(connection, module_id=address) for address in (1, 3, 4)}
        for address, module in modules.items():
            assert connection.get_version_string(module_id=address) == "3351V111"
            module.motors[0].move_to(10_000 * address)
        for address, module in modules.items():
            assert move_to(module, 1, -1000 * address) == -1000 * address
            assert move_to(module, 0, 10_000 * address) == 10_000 * address
        with pytest.raises(Exception):
            connection.get_global_parameter(66, 0, module_id=2)


CAN = """
[[bus]]
name = "line"
kind = "can"
endpoints = ["slcan:FOLDER/one", "slcan:FOLDER/two"]
""" + "".join(
    MODULE.format(name=f"m{can_id}") + f"can_id = {can_id}\ncan_reply_id = {can_id + 1}\n" for can_id in (1, 3)
)


def test_two_modules_on_one_can_bus_driven_at_once(serve, tmp_path):
    serve(CAN)
    found = {}

    def drive(adapter, can_id):
        with connect("slcan_tmcl", str(tmp_path / adapter), can_id + 1, can_id) as connection:
            values = []
            for value in range(300):
                connection.set_global_parameter(9, 2, 1000 * can_id + value)
                values.append(connection.get_global_parameter(9, 2))
            module = TMCM3351(connection, module_id=can_id)
            found[can_id] = values, move_to(module, 0, 5000 * can_id)

    drivers = [threading.Thread(target=drive, args=arguments) for arguments in (("one", 1), ("two", 3))]
    for driver in drivers:
        driver.start()
    for driver in drivers:
        driver.join()
    for can_id in (1, 3):
        assert found[can_id] == ([1000 * can_id + value for value in range(300)], 5000 * can_id)
