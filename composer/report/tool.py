"""What the reports say about who made them."""

from __future__ import annotations

from importlib.metadata import version

NAME = "ros2-composer"


def tool_version() -> str:
    """Return the version of the installed distribution."""
    return version(NAME)
