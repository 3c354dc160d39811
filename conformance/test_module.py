"""PyTrinamic's TMCM3351 class and its connection drive the virtual module."""

import time

import pytest
from pytrinamic.tmcl import TMCLCommand, TMCLReplyStatusError


def until(condition, seconds=5.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.01)


def test_firmware_version_as_text_and_as_numbers(connection):
    assert connection.get_version_string() == "3351V111"
    assert connection.send(TMCLCommand.GET_FIRMWARE_VERSION, 1, 0, 0).value == 0x0D17010B


def test_axis_parameters_keep_what_was_written(module):
    for motor, current in zip(module.motors, [50, 100, 150]):
        motor.set_axis_parameter(motor.AP.RunCurrent, current)
        motor.drive_settings.standby_current = 8
        motor.linear_ramp.max_velocity = 200_000 + current
        motor.linear_ramp.max_acceleration = 400_000 + current
    for motor, current in zip(module.motors, [50, 100, 150]):
        assert motor.get_axis_parameter(motor.AP.RunCurrent) == current
        # The class's own getter asks for a parameter that this module does not name, and gives back None.
        assert motor.get_axis_parameter(motor.AP.StandbyCurrent) == 8
        assert motor.linear_ramp.max_velocity == 200_000 + current
        assert motor.linear_ramp.max_acceleration == 400_000 + current


def test_every_parameter_that_the_class_names_can_be_read(module):
    for motor in module.motors:
        names = [name for name in vars(motor.AP) if not name.startswith("_")]
        assert len(names) > 100
        for name in names:
            motor.get_axis_parameter(getattr(motor.AP, name))


def test_rotate_and_stop(module):
    motor = module.motors[1]
    motor.set_axis_parameter(motor.AP.MaxDeceleration, 1_000_000)
    motor.linear_ramp.max_acceleration = 1_000_000
    motor.rotate(-102_400)
    until(lambda: motor.actual_velocity == -102_400)
    assert motor.actual_position < 0
    motor.stop()
    until(lambda: motor.actual_velocity == 0)


def test_move_to_and_move_by_reach_their_positions(module):
    motor = module.motors[0]
    motor.set_axis_parameter(motor.AP.MaxDeceleration, 1_000_000)
    motor.linear_ramp.max_velocity = 200_000
    motor.linear_ramp.max_acceleration = 1_000_000
    motor.move_to(51_200)
    assert not motor.get_position_reached()
    until(motor.get_position_reached)
    assert motor.actual_position == 51_200
    motor.move_by(-10_000)
    until(motor.get_position_reached)
    assert motor.actual_position == 41_200
    module.move_to(0, 0, velocity=400_000)
    until(motor.get_position_reached)
    assert motor.actual_position == 0


def test_closed_loop_makes_good_what_a_load_took(simulator, module):
    motor = module.motors[0]
    motor.set_axis_parameter(motor.AP.CLstartUp, 0)
    motor.set_axis_parameter(motor.AP.ClosedLoopMode, 1)
    until(lambda: motor.get_axis_parameter(motor.AP.ClosedLoopInitFlag) == 1)
    motor.move_to(51_200)
    time.sleep(0.3)
    simulator.say("load 0 0.7")
    time.sleep(0.2)
    simulator.say("load 0 0")
    until(motor.get_position_reached)
    assert abs(motor.get_axis_parameter(motor.AP.EncoderPosition) - 51_200) <= 100


def test_reply_of_a_relative_move_is_its_target(connection):
    connection.set_axis_parameter(1, 2, 5_000)
    assert connection.move_by(2, 300) == 5_300


def test_user_variables(connection):
    for number, value in [(0, 1), (55, -7), (255, -(2**31))]:
        connection.set_global_parameter(number, 2, value)
    assert connection.get_global_parameter(0, 2) == 1
    assert connection.get_global_parameter(55, 2, signed=True) == -7
    assert connection.get_global_parameter(255, 2, signed=True) == -(2**31)


def test_stored_variables_come_back_after_a_reset(connection):
    connection.set_and_store_global_parameter(7, 2, 4711)
    connection.set_global_parameter(8, 2, 1)
    connection.send(TMCLCommand.BOOT + 13, 0, 0, 1234)
    assert connection.get_global_parameter(7, 2) == 4711
    assert connection.get_global_parameter(8, 2) == 0


def test_digital_outputs_and_inputs(simulator, connection):
    connection.set_digital_output(3)
    assert connection.get_digital_output(3) == 1
    connection.clear_digital_output(3)
    assert connection.get_digital_output(3) == 0
    simulator.say("in 5 1")
    until(lambda: connection.get_digital_input(5) == 1)
    simulator.say("analog 0 512")
    until(lambda: connection.get_analog_input(0) == 512)


@pytest.mark.parametrize(
    ("status", "request_"),
    [
        (2, (99, 0, 0, 0)),
        (6, (TMCLCommand.JA, 0, 0, 0)),
        (4, (TMCLCommand.GAP, 1, 3, 0)),
        (3, (TMCLCommand.GAP, 99, 0, 0)),
        (3, (TMCLCommand.SAP, 3, 0, 1)),
        (4, (TMCLCommand.SAP, 6, 0, 256)),
        (4, (TMCLCommand.ROR, 0, 0, 2**31 - 1)),
    ],
)
def test_error_statuses(connection, status, request_):
    with pytest.raises(TMCLReplyStatusError) as error:
        connection.send(*request_)
    assert error.value.status_code == status


def download(connection, program):
    connection.send(TMCLCommand.START_DOWNLOAD_MODE, 0, 0, 0)
    for instruction in program:
        assert connection.send(*instruction).status == 101
    connection.send(TMCLCommand.QUIT_DOWNLOAD_MODE, 0, 0, 0)


COUNTER = 20
COUNT = [
    (TMCLCommand.CALCV, 0, COUNTER, 1),  # add 1 to user variable 20
    (TMCLCommand.WAIT, 0, 0, 1),  # 10 ms
    (TMCLCommand.JA, 0, 0, 0),
]


def test_downloaded_program_runs(connection):
    download(connection, COUNT)
    connection.send(TMCLCommand.RUN_APPLICATION, 1, 0, 0)
    until(lambda: connection.get_global_parameter(COUNTER, 2) > 10)
    assert connection.get_global_parameter(128, 0) == 1
    connection.send(TMCLCommand.STOP_APPLICATION, 0, 0, 0)
    stopped = connection.get_global_parameter(COUNTER, 2)
    time.sleep(0.05)
    assert connection.get_global_parameter(COUNTER, 2) == stopped
    assert connection.get_global_parameter(128, 0) == 0


def test_three_axes_move_while_a_program_runs(module, connection):
    download(connection, COUNT)
    connection.send(TMCLCommand.RUN_APPLICATION, 1, 0, 0)
    targets = [51_200, -40_000, 25_600]
    for motor, target in zip(module.motors, targets):
        motor.linear_ramp.max_velocity = 100_000
        motor.linear_ramp.max_acceleration = 500_000
        motor.move_to(target)
    assert [motor.actual_velocity == 0 for motor in module.motors].count(True) < 3
    until(lambda: all(motor.get_position_reached() for motor in module.motors))
    assert [motor.actual_position for motor in module.motors] == targets
    assert connection.get_global_parameter(COUNTER, 2) > 5
    assert connection.get_global_parameter(128, 0) == 1


def test_three_motors_settings_rotation_moves_and_return(module):
    """The tour that a user's first script makes: settings, rotate, stop, move by the actual position, return to zero."""
    motors = module.motors
    for motor in motors:
        motor.set_axis_parameter(motor.AP.RunCurrent, 128)
        motor.set_axis_parameter(motor.AP.MaxDeceleration, 1_000_000)
        motor.drive_settings.standby_current = 16
        motor.drive_settings.boost_current = 0
        motor.drive_settings.microstep_resolution = motor.ENUM.microstep_resolution_256_microsteps
        motor.linear_ramp.max_velocity = 500_000
        motor.linear_ramp.max_acceleration = 1_000_000
        motor.actual_position = 0
    for motor, direction in zip(motors, [1, -1, 1]):
        motor.rotate(direction * 100_000)
    time.sleep(0.3)
    for motor in motors:
        motor.stop()
    until(lambda: all(motor.actual_velocity == 0 for motor in motors))
    for motor, direction in zip(motors, [1, -1, 1]):
        position = motor.actual_position
        assert position * direction > 0
        motor.move_by(position)
        until(motor.get_position_reached)
        assert motor.actual_position == 2 * position
    for motor in motors:
        motor.move_to(0)
    until(lambda: all(motor.get_position_reached() for motor in motors))
    assert [motor.actual_position for motor in motors] == [0, 0, 0]
