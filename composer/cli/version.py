"""Which composer this is."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version


def composer_version() -> str:
    """Return the version of the installed distribution."""
    try:
        return version("ros2-composer")
    except PackageNotFoundError:
        return "(run from source, not installed)"
