"""Host software that knows the TMCM-351's unit system: PyTrinamic's generic interface, and pyTMCL."""

import time

import pytest
import pyTMCL
import serial
from conftest import Simulator, connect
from pytrinamic.tmcl import TMCLCommand, TMCLReplyStatusError

POSITION, SPEED, TARGET_SPEED, MAX_SPEED, ACCELERATION, REACHED = 1, 3, 2, 4, 5, 8
RAMP_DIVISOR, PULSE_DIVISOR = 153, 154


@pytest.fixture
def module(tmp_path):
    simulator = Simulator("tmcm-351", "--pty", str(tmp_path / "module"), "--tcp", "127.0.0.1:0")
    yield simulator
    simulator.stop()


def until(condition, seconds=5.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.01)


def pps(speed, pulse_divisor):
    return speed * 16e6 / (2**pulse_divisor * 2048 * 32)


@pytest.mark.parametrize("interface", ["serial_tmcl", "socket_serial_tmcl"])
def test_pytrinamic_moves_in_units_of_the_chip(module, interface):
    with connect(module, interface) as connection:
        assert connection.get_version_string() == "351V.445"
        for number, value in [(PULSE_DIVISOR, 5), (RAMP_DIVISOR, 7), (MAX_SPEED, 2000), (ACCELERATION, 500)]:
            for axis in range(2):
                connection.set_axis_parameter(number, axis, value)
        connection.move_to(0, 5000)
        until(lambda: connection.get_axis_parameter(REACHED, 0) == 1)
        assert connection.get_axis_parameter(POSITION, 0) == 5000
        connection.rotate(1, -1000)
        until(lambda: connection.get_axis_parameter(SPEED, 1, signed=True) == -1000)
        start, begin = connection.get_axis_parameter(POSITION, 1, signed=True), time.monotonic()
        time.sleep(1.0)
        moved, seconds = connection.get_axis_parameter(POSITION, 1, signed=True) - start, time.monotonic() - begin
        assert moved / seconds == pytest.approx(-pps(1000, 5), rel=0.05)
        connection.stop(1)
        until(lambda: connection.get_axis_parameter(SPEED, 1) == 0)


@pytest.mark.parametrize(
    ("status", "request_"),
    [
        (2, (TMCLCommand.CALCV, 0, 0, 0)),
        (4, (TMCLCommand.SAP, MAX_SPEED, 0, 2048)),
        (3, (TMCLCommand.GAP, 14, 0, 0)),
    ],
)
def test_what_the_module_lacks(module, status, request_):
    with connect(module, "serial_tmcl") as connection:
        with pytest.raises(TMCLReplyStatusError) as error:
            connection.send(*request_)
        assert error.value.status_code == status


def test_pytmcl_drives_three_motors(module):
    with serial.Serial(module.endpoints["pty"], timeout=2) as port:
        motors = [pyTMCL.connect(port).get_module(1).get_motor(axis) for axis in range(3)]
        for motor, target in zip(motors, [3000, -2000, 1000]):
            motor.set_axis_parameter(RAMP_DIVISOR, 7)
            motor.axis.max_positioning_speed = 1500
            motor.axis.max_accelleration = 400
            assert motor.get_axis_parameter(MAX_SPEED) == 1500
            motor.move_absolute(target)
        until(lambda: all(motor.get_position_reached() for motor in motors))
        assert [motor.axis.actual_position for motor in motors] == [3000, -2000, 1000]
        motors[0].rotate_left(500)
        until(lambda: motors[0].get_axis_parameter(SPEED) == -500)
        motors[0].stop()
        until(lambda: motors[0].get_axis_parameter(SPEED) == 0)
        motors[1].move_relative(2500)
        until(motors[1].get_position_reached)
        assert motors[1].axis.actual_position == 500
        motors[2].set_user_var(7, 42)
        assert motors[2].get_user_var(7) == 42
