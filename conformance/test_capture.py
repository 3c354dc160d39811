"""PyTrinamic's data logger records the virtual modules."""

import pytest
from pytrinamic.datalogger import DataLogger
from pytrinamic.RAMDebug import Channel, RAMDebug, RAMDebug_Trigger
from test_servo import set_up

AP = DataLogger.DataTypeAp


def test_a_velocity_step_of_the_servo(servo, servo_connection):
    motor = servo.motors[0]
    set_up(motor, motor.ENUM.COMM_MODE_DIGITAL_HALL)
    logger = DataLogger(servo_connection)
    info = logger.get_info()
    assert (info.number_of_channels, info.sample_buffer_length, info.base_frequency_hz) == (4, 8192, 2000)
    ramp, velocity = AP(motor.AP.RampVelocity, signed=True), AP(motor.AP.ActualVelocity, signed=True)
    logger.config.samples_per_channel = 400
    logger.config.down_sampling_factor = 2
    logger.config.log_data = {"ramp": ramp, "velocity": velocity}
    logger.config.trigger = DataLogger.Config.Trigger(ramp, 1, DataLogger.TriggerEdge.RISING, 20)
    logger.start_capture()
    logger.wait_for_pretrigger_completion()
    motor.rotate(1000)
    logger.wait_for_capture_completion(timeout=20)
    logger.download_log()
    times, ramp, velocity = logger.log.time_vector, logger.log.data["ramp"].samples, logger.log.data["velocity"].samples
    assert len(times) == len(ramp) == len(velocity) == 400
    assert (logger.log.rate_hz, times[20]) == (1000, 0)
    assert all(sample < 1 for sample in ramp[:20]) and ramp[20] >= 1, "the trigger"
    for milliseconds, sample in enumerate(ramp[20:]):
        assert sample == pytest.approx(min(1000, 4 * (milliseconds + 1)), abs=5), "4000 rpm/s"
    assert velocity[-1] == pytest.approx(1000, abs=50)


def test_a_ramp_of_a_stepper(module, connection):
    motor = module.motors[1]
    motor.linear_ramp.max_acceleration = 100_000
    debug = RAMDebug(connection)
    debug.set_channel(Channel.axis_parameter(1, motor.AP.ActualVelocity))
    debug.set_channel(Channel.systick())
    debug.set_sample_count(300)
    debug.set_trigger(Channel.axis_parameter(1, motor.AP.ActualVelocity), RAMDebug_Trigger.TRIGGER_RISING_EDGE_SIGNED, 1)
    debug.set_pretrigger_samples(10)
    debug.start_measurement()
    while debug.is_pretriggering():
        pass
    motor.rotate(50_000)
    while not debug.is_measurement_done():
        pass
    speed, milliseconds = debug.get_samples()
    assert speed[9] < 1 <= speed[10]
    for sample, later in zip(speed[10:-1], speed[11:]):
        assert later - sample == pytest.approx(50, abs=10), "100 000 pps^2 in half a millisecond"
    assert milliseconds[-1] - milliseconds[0] in (149, 150)
