"""PyTrinamic on a CAN interface of Linux. Not collected with the others: `can-vm` runs it where there is one."""

from conftest import Simulator
from pytrinamic.modules import TMCM3351
from test_buses import connect, move_to


def test_a_module_on_a_can_interface():
    simulator = Simulator("--can", "can0")
    with connect("socketcan_tmcl", "can0") as connection:
        assert connection.get_version_string() == "3351V111"
        for value in range(100):
            connection.set_global_parameter(9, 2, value)
            assert connection.get_global_parameter(9, 2) == value
        assert move_to(TMCM3351(connection), 0, 25_600) == 25_600
    simulator.stop()
