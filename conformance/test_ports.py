"""Clients come, go and share; the ports stay."""

import os
import pty
import signal
import socket
import struct
import time

import serial
from conftest import GRADUS, connect


def datagram(command, kind=0, motor=0, value=0, address=1):
    body = struct.pack(">BBBBi", address, command, kind, motor, value)
    return body + bytes([sum(body) & 0xFF])


def test_a_pty_survives_clients(simulator):
    for _ in range(5):
        with connect(simulator, "serial_tmcl") as connection:
            assert connection.get_version_string() == "3351V111"


def test_tcp_takes_many_clients_at_once(simulator):
    host, port = simulator.endpoints["tcp"].split(":")
    clients = [socket.create_connection((host, int(port))) for _ in range(20)]
    for number, client in enumerate(clients):
        client.sendall(datagram(9, number, 2, 1000 + number))
    for client in clients:
        assert client.recv(9)[2] == 100
    for number, client in enumerate(clients):
        client.sendall(datagram(10, number, 2))
    for number, client in enumerate(clients):
        assert struct.unpack(">i", client.recv(9)[4:8]) == (1000 + number,)
        client.close()


def test_pty_and_tcp_reach_the_same_module(simulator):
    with connect(simulator, "serial_tmcl") as one, connect(simulator, "socket_serial_tmcl") as other:
        one.set_global_parameter(1, 2, 42)
        assert other.get_global_parameter(1, 2) == 42


def test_any_address_is_answered_with_the_own_one(simulator):
    with serial.Serial(simulator.endpoints["pty"], 9600, timeout=2) as port:
        for address in (0, 1, 255):
            port.write(datagram(6, 1, 0, 0, address))
            assert port.read(9)[:3] == bytes([2, 1, 100])


def test_position_reached_event_comes_after_its_move(simulator):
    with serial.Serial(simulator.endpoints["pty"], 9600, timeout=5) as port:
        for request in (datagram(5, 5, 0, 1_000_000), datagram(138, 1, 0, 1), datagram(4, 0, 0, 10_000)):
            port.write(request)
            assert port.read(9)[2] == 100
        assert port.read(9)[2:8] == bytes([128, 138, 0, 0, 0, 1])


def test_nine_zeros_bring_the_line_back_into_step(simulator):
    with serial.Serial(simulator.endpoints["pty"], 9600, timeout=0.3) as port:
        port.write(datagram(6, 1)[:4])
        port.write(bytes(9))
        port.read(100)
        port.write(datagram(6, 1))
        assert port.read(9)[2:4] == bytes([100, 6])


def test_power_off_is_silence_and_power_on_a_fresh_start(simulator):
    with connect(simulator, "serial_tmcl") as connection:
        connection.set_global_parameter(60, 2, 5)
        connection.set_global_parameter(77, 0, 0)
        simulator.say("power off")
        simulator.say("power on")
    with connect(simulator, "serial_tmcl") as connection:
        deadline = 50
        while connection.get_global_parameter(60, 2) and deadline:
            deadline -= 1
        assert connection.get_global_parameter(60, 2) == 0


def test_a_simulator_in_the_background_leaves_the_keys_to_the_shell(tmp_path):
    """Reading the terminal from the background would stop the simulator, and with it the module."""
    link = str(tmp_path / "module")
    shell, terminal = pty.fork()
    if shell == 0:
        os.execvp("sh", ["sh", "-mc", f"'{GRADUS}' sim --pty '{link}' & echo pid $!; wait"])
    with open(terminal, "r+b", buffering=0) as keys:
        said = b""
        while b"ready" not in said:
            said += keys.read(1000)
        keys.write(b"a command for the shell\n")
        time.sleep(0.3)
        try:
            with serial.Serial(link, 9600, timeout=2) as port:
                port.write(datagram(6, 1))
                assert port.read(9)[2:4] == bytes([100, 6])
        finally:
            simulator = int(said.split(b"pid ")[1].split()[0])
            os.kill(simulator, signal.SIGTERM)
            os.kill(simulator, signal.SIGCONT)
            os.waitpid(shell, 0)
