"""PyTrinamic behind the broker: several clients share one module."""

import subprocess
import threading

import pytest
from pytrinamic.connections import ConnectionManager
from pytrinamic.modules import TMCM3351
from pytrinamic.tmcl import TMCLReplyStatusError

from conftest import GRADUS


def serve(simulator, *arguments):
    """`gradus serve` for the simulator's pseudo-terminal, and its address."""
    command = [GRADUS, "serve", "--port", simulator.endpoints["pty"], "--tcp", "127.0.0.1:0", *arguments]
    broker = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    address = broker.stdout.readline().split()[1]
    assert broker.stdout.readline() == "ready\n"
    return broker, address


def connect(address):
    return ConnectionManager(f"--interface socket_serial_tmcl --port {address}").connect()


@pytest.fixture
def address(simulator):
    broker, address = serve(simulator)
    yield address
    broker.terminate()
    assert broker.wait(timeout=10) == 0


def test_each_client_gets_its_own_answers(address):
    wrong = []

    def work(client):
        with connect(address) as connection:
            for number in range(200):
                value = client * 1000 + number
                connection.set_global_parameter(client, 2, value)
                if connection.get_global_parameter(client, 2) != value:
                    wrong.append(value)

    threads = [threading.Thread(target=work, args=(client,)) for client in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert wrong == []


def test_a_reader_may_not_move_a_motor(simulator):
    broker, address = serve(simulator, "--read-only")
    with connect(address) as connection:
        motor = TMCM3351(connection).motors[0]
        assert motor.actual_position == 0
        with pytest.raises(TMCLReplyStatusError):
            motor.move_to(1000)
    broker.terminate()
    assert broker.wait(timeout=10) == 0
