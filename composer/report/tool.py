"""The name and version of this tool."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version

NAME = "ros2-composer"


def tool_version() -> str:
    """Return the version of the installed distribution; ``0+source`` in a checkout without it."""
    try:
        return version(NAME)
    except PackageNotFoundError:
        return "0+source"
