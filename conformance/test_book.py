"""The Python programs of the book's chapter "From Python" run, each against a virtual module of its own."""

import re
from pathlib import Path

import pytest

CHAPTER = Path(__file__).parent.parent / "docs/src/python.md"
PROGRAMS = re.findall(r"```python\n(.*?)```", CHAPTER.read_text(), re.DOTALL)
ADDRESS = "127.0.0.1:4322"


def test_the_chapter_has_its_programs():
    assert len(PROGRAMS) == 3


@pytest.mark.parametrize("program", [program for program in PROGRAMS if "import pytest" not in program])
def test_program_of_the_book_runs(simulator, program, capsys):
    host, port = simulator.endpoints["tcp"].split(":")
    program = program.replace(ADDRESS, f"{host}:{port}").replace('("127.0.0.1", 4322)', f'("{host}", {port})')
    exec(compile(program, str(CHAPTER), "exec"), {})
    assert capsys.readouterr().out in ("51200\n", "51200\n51200\n")
