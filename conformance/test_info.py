"""PyTrinamic's own command-line tool reads who each virtual module is."""

import subprocess
import sys
from pathlib import Path

import pytest
from conftest import Simulator

TMCLINFO = Path(sys.executable).with_name("tmclinfo")

MODULES = {"tmcm-3351": ("3351", "v1.11"), "tmcm-1617": ("1617", "v1.8"), "tmcm-351": ("351", "v4.45")}


@pytest.mark.parametrize("name", MODULES)
@pytest.mark.parametrize("interface, kind", [("serial_tmcl", "pty"), ("socket_serial_tmcl", "tcp")])
def test_tmclinfo_prints_the_module(tmp_path, name, interface, kind):
    simulator = Simulator(name, "--pty", str(tmp_path / "module"), "--tcp", "127.0.0.1:0")
    try:
        port = simulator.endpoints[kind]
        tool = subprocess.run(
            [TMCLINFO, "--interface", interface, "--port", port], capture_output=True, text=True, timeout=60
        )
    finally:
        simulator.stop()
    assert (tool.returncode, tool.stderr) == (0, "")
    number, version = MODULES[name]
    found = dict(line.split(":", 1) for line in tool.stdout.splitlines() if line)
    found = {key: value.strip() for key, value in found.items()}
    assert found == {
        "Module ID": number,
        "Firmware version": version,
        "Firmware type": "TMCL",
        "Firmware release": "Local",
        "Git info": "0000000",
    }
