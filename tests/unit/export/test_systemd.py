"""Units with which systemd runs a system."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from composer.export.systemd import unit
from composer.loading import load
from composer.model import System

PYTHON = ("/opt/my robot/bin/python", "-P", "-m", "composer")


@pytest.fixture
def system(tmp_path: Path) -> tuple[System, Path]:
    path = tmp_path / "my robot.yaml"
    path.write_text("system: robot\ndescription: 100 %\nnodes: {a: {on_activate: {log: hello}}}\n")
    found = load(path).system
    assert found is not None
    return found, path


def test_a_unit_has_the_command_and_the_variables_of_ros(system: tuple[System, Path]) -> None:
    environment = {
        "ROS_DOMAIN_ID": "7",
        "PYTHONPATH": '/a "b" $HOME',
        "HOME": "/root",
        "LD_LIBRARY_PATH": "/wheels",
        "_ROS_WHEELS_BOOTSTRAP_COMPLETE": "1",
    }
    text = unit(*system, PYTHON, environment, user=False)
    path = system[1]
    assert f'ExecStart="/opt/my robot/bin/python" -P -m composer run "{path}"\n' in text
    assert f"WorkingDirectory={path.parent}\n" in text
    assert "Description=ROS 2 system robot: 100 %%\n" in text
    assert [line for line in text.splitlines() if line.startswith("Environment=")] == [
        'Environment="PYTHONPATH=/a \\"b\\" $HOME"',
        "Environment=ROS_DOMAIN_ID=7",
    ]
    assert "WantedBy=multi-user.target" in text
    assert "WantedBy=default.target" in unit(*system, PYTHON, {}, user=True)


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="needs systemd-analyze")
@pytest.mark.parametrize("user", [False, True])
def test_systemd_accepts_the_unit(user: bool, system: tuple[System, Path], tmp_path: Path) -> None:
    file = tmp_path / "robot.service"
    environment = {"ROS_DOMAIN_ID": "7", "PYTHONPATH": "/a b:/c%d"}
    python = (sys.executable, "-P", "-m", "composer")
    file.write_text(unit(*system, python, environment, user=user))
    command = ["systemd-analyze", "verify", *(["--user"] if user else []), str(file)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=30, check=False)
    about = [line for line in done.stderr.splitlines() if "robot.service" in line]
    assert about == []
