"""PyTrinamic's TMCM1617 class drives the virtual servo module, as the examples for the real one do."""

import time

from pytrinamic.tmcl import TMCLCommand


def until(condition, seconds=10.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.01)


def set_up(motor, commutation_mode):
    """Drive, ramp and regulators as the examples for a QBL4208-61 have them; the position regulator is stiffer, so that it
    ends in a small window."""
    motor.drive_settings.motor_type = motor.ENUM.MOTOR_TYPE_THREE_PHASE_BLDC
    motor.drive_settings.pole_pairs = 4
    motor.drive_settings.max_current = 4000
    motor.drive_settings.commutation_mode = commutation_mode
    motor.drive_settings.target_reached_distance = 500
    motor.drive_settings.target_reached_velocity = 500
    motor.linear_ramp.max_velocity = 2000
    motor.linear_ramp.max_acceleration = 4000
    motor.linear_ramp.enabled = 1
    motor.pid.torque_p = 600
    motor.pid.torque_i = 600
    motor.pid.velocity_p = 800
    motor.pid.velocity_i = 500
    motor.pid.position_p = 1500


def test_firmware_version(servo_connection):
    assert servo_connection.get_version_string() == "1617V108"
    assert servo_connection.send(TMCLCommand.GET_FIRMWARE_VERSION, 1, 0, 0).value == 0x06510108


def test_every_parameter_that_the_class_names_can_be_read(servo):
    motor = servo.motors[0]
    names = [name for name in vars(motor.AP) if not name.startswith("_")]
    assert len(names) > 80
    for name in names:
        motor.get_axis_parameter(getattr(motor.AP, name))


def test_settings_keep_what_was_written(servo):
    motor = servo.motors[0]
    set_up(motor, motor.ENUM.COMM_MODE_DISABLED)
    assert motor.drive_settings.max_current == 4000
    assert motor.linear_ramp.max_velocity == 2000
    assert motor.pid.torque_p == 600
    assert motor.pid.position_p == 1500
    assert motor.drive_settings.target_reached_distance == 500


def test_settings_are_stored(servo_simulator, servo, servo_connection):
    servo.motors[0].linear_ramp.max_acceleration = 1234
    servo_connection.store_axis_parameter(servo.motors[0].AP.MaxAcceleration, 0)
    servo_simulator.say("power off")
    servo_simulator.say("power on")
    until(lambda: servo.motors[0].linear_ramp.max_acceleration == 1234)


def test_digital_hall(servo):
    """The flow of the example for digital hall sensors."""
    motor = servo.motors[0]
    set_up(motor, motor.ENUM.COMM_MODE_DIGITAL_HALL)
    motor.digital_hall.direction = 0
    motor.digital_hall.polarity = 0
    motor.digital_hall.offset = 0
    motor.digital_hall.interpolation = 1
    print(motor.drive_settings, motor.digital_hall, motor.linear_ramp, motor.pid)
    motor.rotate(1000)
    until(lambda: abs(motor.actual_velocity - 1000) < 50)
    motor.rotate(-1000)
    until(lambda: abs(motor.actual_velocity + 1000) < 50)
    motor.stop()
    until(lambda: abs(motor.actual_velocity) < 200)


def test_encoder(servo):
    """The flow of the example for the ABN encoder: initialisation, velocity, position."""
    motor = servo.motors[0]
    motor.abn_encoder.resolution = 4096
    motor.abn_encoder.direction = 0
    motor.abn_encoder.init_mode = motor.ENUM.ENCODER_INIT_MODE_0
    set_up(motor, motor.ENUM.COMM_MODE_ABN_ENCODER)
    print(motor.drive_settings, motor.abn_encoder)
    until(lambda: motor.get_axis_parameter(motor.AP.EncoderInitState) != 0)
    until(lambda: motor.get_axis_parameter(motor.AP.EncoderInitState) == 0)
    motor.rotate(500)
    until(lambda: abs(motor.actual_velocity - 500) < 25)
    motor.stop()
    until(lambda: abs(motor.actual_velocity) < 25)
    motor.actual_position = 0
    motor.move_to(655_360)
    until(motor.get_position_reached)
    assert abs(motor.actual_position - 655_360) <= 500
    motor.move_by(-131_072)
    assert not motor.get_position_reached()
    until(motor.get_position_reached)
    servo.move_to(0, 0, velocity=1500)
    until(motor.get_position_reached)
    assert abs(motor.actual_position) <= 500


def test_torque(servo, servo_simulator):
    motor = servo.motors[0]
    set_up(motor, motor.ENUM.COMM_MODE_DIGITAL_HALL)
    servo_simulator.say("block 0")
    motor.set_axis_parameter(motor.AP.TargetTorque, 1500)
    until(lambda: abs(motor.get_axis_parameter(motor.AP.ActualTorque, signed=True) - 1500) < 50)
