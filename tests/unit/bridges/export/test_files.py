"""Launch files that run a system."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from tests.cli.compose import compose

SYSTEM = "system: robot\nnodes: {a: {on_activate: {log: hello}}}\n"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "systems").mkdir()
    (tmp_path / "systems" / "robot.yaml").write_text(SYSTEM)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_launch_file_names_the_system_relative_to_itself(folder: Path) -> None:
    done = compose("export", "launch", "systems/robot.yaml", "-o", "launch/robot.launch.py")
    assert (done.code, done.out) == (0, ""), done.err
    text = (folder / "launch" / "robot.launch.py").read_text()
    ast.parse(text)
    assert "SYSTEM = (Path(__file__).parent / '../systems/robot.yaml').resolve()" in text
    again = ("export", "launch", "systems/robot.yaml", "-o", "launch/robot.launch.py")
    assert compose(*again).err == "launch/robot.launch.py is up to date\n"
    (folder / "launch" / "robot.launch.py").write_text("my own")
    done = compose(*again)
    assert done.code == 1
    assert "exists already" in done.err
    assert compose(*again, "--force").code == 0
    assert (folder / "launch" / "robot.launch.py").read_text() == text


def test_on_stdout_the_path_is_absolute(folder: Path) -> None:
    done = compose("export", "launch", "robot")
    assert done.code == 0, done.err
    assert f"SYSTEM = Path({str(folder / 'systems' / 'robot.yaml')!r})\n" in done.out
