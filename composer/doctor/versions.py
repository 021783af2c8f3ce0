"""What is installed: the composer, Python, rclpy and the interfaces that come with the composer."""

from __future__ import annotations

import platform
import sys
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec

from composer.doctor.finding import Finding, error, fine, warning

AREA = "versions"
#: Jazzy's rclpy, see https://github.com/ros2/rclpy/tree/jazzy.
_MAJOR = "7"
_FROM_PYPI = 'pip install "ros2-composer[ros]"'
_SOURCED = "source /opt/ros/jazzy/setup.bash"


def look_at_versions(composer: str) -> Iterator[Finding]:
    """Yield what is installed; ``composer`` is its version."""
    system = f"{platform.system()} {platform.machine()}"
    yield fine(AREA, f"ros2-composer {composer}, Python {platform.python_version()}, {system}")
    yield rclpy_finding(has_rclpy=find_spec("rclpy") is not None, found=_version("rclpy"))


def rclpy_finding(*, has_rclpy: bool, found: str | None) -> Finding:
    """Judge the rclpy of this Python; ``found`` is its version where that is known."""
    if not has_rclpy:
        return error(
            AREA,
            f"rclpy is not installed in this Python ({sys.executable}): systems can be checked"
            " and drawn, not run",
            f"{_FROM_PYPI}   or: {_SOURCED}",
        )
    if found is None:
        return fine(AREA, "rclpy is installed, its version is not known")
    if found.split(".")[0] != _MAJOR:
        return warning(
            AREA,
            f"rclpy is {found}; the composer is made for Jazzy's, {_MAJOR}.x",
            f"{_FROM_PYPI}   or: {_SOURCED}",
        )
    return fine(AREA, f"rclpy {found}")


def _version(distribution: str) -> str | None:
    try:
        return version(distribution)
    except PackageNotFoundError:
        return None
