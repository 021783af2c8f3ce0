"""The versions of ros2-composer, Python and rclpy."""

from __future__ import annotations

import platform
import sys
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec

from composer.doctor.result import CheckResult, error, ok, warning

AREA = "versions"
#: Jazzy's rclpy, see https://github.com/ros2/rclpy/tree/jazzy.
_MAJOR = "7"
_FROM_PYPI = 'pip install "ros2-composer[ros]"'
_SOURCED = "source /opt/ros/jazzy/setup.bash"


def check_versions(composer: str) -> Iterator[CheckResult]:
    """Check the installed versions; ``composer`` is that of ros2-composer."""
    system = f"{platform.system()} {platform.machine()}"
    yield ok(AREA, f"ros2-composer {composer}, Python {platform.python_version()}, {system}")
    yield check_rclpy(has_rclpy=find_spec("rclpy") is not None, found=_version("rclpy"))


def check_rclpy(*, has_rclpy: bool, found: str | None) -> CheckResult:
    """Check rclpy in this Python; ``found`` is its version if known."""
    if not has_rclpy:
        return error(
            AREA,
            f"rclpy is not installed in this Python ({sys.executable}): systems can be validated"
            " and drawn, but not run",
            f"{_FROM_PYPI}   or: {_SOURCED}",
        )
    if found is None:
        return ok(AREA, "rclpy is installed; its version is unknown")
    if found.split(".")[0] != _MAJOR:
        return warning(
            AREA,
            f"rclpy is {found}; ros2-composer supports {_MAJOR}.x (Jazzy)",
            f"{_FROM_PYPI}   or: {_SOURCED}",
        )
    return ok(AREA, f"rclpy {found}")


def _version(distribution: str) -> str | None:
    try:
        return version(distribution)
    except PackageNotFoundError:
        return None
