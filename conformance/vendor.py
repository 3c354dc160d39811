"""The examples and tests that come with PyTrinamic, from its source distribution. Nothing of them is kept here: pip fetches the
archive of the version that requirements.txt names, once, into the target folder."""

import re
import subprocess
import sys
import tarfile
from pathlib import Path

from conftest import ROOT, TARGET

FOLDER = TARGET / "conformance"


def source():
    """The folder of the source distribution."""
    version = re.search(r"^pytrinamic==(\S+)", (ROOT / "conformance/requirements.txt").read_text(), re.M).group(1)
    folder = FOLDER / f"pytrinamic-{version}"
    if not folder.is_dir():
        FOLDER.mkdir(parents=True, exist_ok=True)
        pip = [sys.executable, "-m", "pip", "download", "--quiet", "--disable-pip-version-check", "--no-deps"]
        archive = ["--no-binary", "pytrinamic", "--dest", str(FOLDER), f"pytrinamic=={version}"]
        subprocess.run(pip + archive, check=True)
        with tarfile.open(f"{folder}.tar.gz") as tar:
            tar.extractall(FOLDER, filter="data")
    return folder


def connected(script, interface, port, to):
    """A copy of a script, unmodified but for the one line that says what it connects to."""
    text = (source() / script).read_text()
    line = re.compile(r'^(?!\s*#)(.*ConnectionManager\()"[^"]*"(\).*)$', re.M)
    text, changed = line.subn(rf'\g<1>"--interface {interface} --port {port}"\g<2>', text)
    assert changed == 1, f"{script} connects in {changed} places"
    copy = Path(to) / Path(script).name
    copy.write_text(text)
    return copy
