"""Messages about missing requirements."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[3] / "tools" / "create_environment.py"
_spec = importlib.util.spec_from_file_location("create_environment", SCRIPT)
tool = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(tool)


@pytest.mark.parametrize("version", [(3, 11, 0), (3, 12, 7), (3, 14, 1)])
def test_supported_python_versions(version) -> None:
    assert tool.python_problem(version, []) is None


def test_an_old_python_is_reported_with_a_supported_one() -> None:
    assert tool.python_problem((3, 10, 13), [(3, 12), (3, 13)]) == (
        "Python 3.11 to 3.14 is required, but this is Python 3.10; run: make run PYTHON=python3.12"
    )


def test_a_python_without_ros_wheels_is_reported() -> None:
    assert tool.python_problem((3, 15, 0), []) == (
        "Python 3.11 to 3.14 is required, but this is Python 3.15; "
        "install one and run: make run PYTHON=/path/to/python"
    )


def test_a_platform_without_ros_wheels_is_reported() -> None:
    assert tool.platform_problem("Linux", "x86_64") is None
    assert "not for Linux aarch64" in tool.platform_problem("Linux", "aarch64")


def test_a_missing_compiler_is_reported_with_the_command_to_install_it() -> None:
    assert tool.compiler_problem(True) is None
    assert tool.compiler_problem(False).endswith("sudo apt install g++")
