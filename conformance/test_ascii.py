"""pyserial and a plain socket speak the TMCM-351's ASCII interface."""

import socket

import pytest
import serial
from conftest import Simulator
from pytrinamic.connections import ConnectionManager
from pytrinamic.tmcl import TMCLReplyStatusError

ENTER_ASCII = 139


@pytest.fixture
def simulator(tmp_path):
    simulator = Simulator("tmcm-351", "--pty", str(tmp_path / "module"), "--tcp", "127.0.0.1:0")
    yield simulator
    simulator.stop()


def enter(simulator):
    port = simulator.endpoints["pty"]
    with ConnectionManager(f"--interface serial_tmcl --port {port}").connect() as connection:
        assert connection.send(ENTER_ASCII, 0, 0, 0).status == 100


def test_serial_port_types_and_reads(simulator):
    enter(simulator)
    with serial.Serial(simulator.endpoints["pty"], 9600, timeout=5) as port:
        port.write(b"A MVP REL, 1, 5000\r")
        assert port.read_until(b"\r") == b"A MVP REL, 1, 5000\r"
        assert port.read_until(b"\r") == b"BA 100 5000\r"
        port.write(b"ASGP 67, 0, 32\r")
        assert port.read_until(b"\r") == b"ASGP 67, 0, 32\r"
        assert port.read_until(b"\r") == b"BA 100 32\r"
        port.write(b"AGAP 250, 0\rBMST 1\rABIN\r")
        assert [port.read_until(b"\r") for _ in range(2)] == [b"BA 3 0\r", b"BA 100 0\r"]


def test_socket_leads_back_to_datagrams(simulator):
    enter(simulator)
    host, port = simulator.endpoints["tcp"].rsplit(":", 1)
    with socket.create_connection((host, int(port)), timeout=5) as stream:
        stream.sendall(b"ABIN\r")
        heard = b""
        while heard.count(b"\r") < 2:
            heard += stream.recv(100)
        assert heard == b"ABIN\rBA 100 0\r"
    with ConnectionManager(f"--interface serial_tmcl --port {simulator.endpoints['pty']}").connect() as connection:
        assert connection.get_version_string().startswith("351V")


def test_other_modules_refuse(tmp_path):
    simulator = Simulator("tmcm-3351", "--pty", str(tmp_path / "other"))
    with ConnectionManager(f"--interface serial_tmcl --port {simulator.endpoints['pty']}").connect() as connection:
        with pytest.raises(TMCLReplyStatusError):
            connection.send(ENTER_ASCII, 0, 0, 0)
    simulator.stop()
