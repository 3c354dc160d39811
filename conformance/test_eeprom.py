"""What the module has acknowledged as stored survives the simulator."""

import signal

from conftest import Simulator, connect


def test_an_eeprom_file_keeps_what_was_stored(tmp_path):
    arguments = ("--tcp", "127.0.0.1:0", "--eeprom", str(tmp_path / "eeprom.bin"))
    simulator = Simulator(*arguments)
    with connect(simulator, "socket_serial_tmcl") as connection:
        connection.set_and_store_global_parameter(3, 2, 333)
        connection.set_global_parameter(75, 0, 7)
    simulator.stop()
    simulator = Simulator(*arguments)
    with connect(simulator, "socket_serial_tmcl") as connection:
        assert connection.get_global_parameter(3, 2) == 333
        assert connection.get_global_parameter(75, 0) == 7
        connection.set_and_store_global_parameter(3, 2, 444)
    simulator.process.send_signal(signal.SIGKILL)
    simulator.process.wait()
    simulator = Simulator(*arguments)
    with connect(simulator, "socket_serial_tmcl") as connection:
        assert connection.get_global_parameter(3, 2) == 444
    simulator.stop()


def test_a_link_is_removed_at_the_end(tmp_path):
    link = tmp_path / "port"
    simulator = Simulator("--pty", str(link))
    assert link.is_symlink()
    simulator.stop()
    assert not link.is_symlink()
