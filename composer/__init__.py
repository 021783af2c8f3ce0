"""Declare, prove and run a ROS 2 system: YAML in, real lifecycle nodes out, in one process."""

#: The name of the distribution on PyPI.
DISTRIBUTION = "ros2-composer"


def version() -> str:
    """Return the version of the installed distribution; ``0+source`` in a checkout without it."""
    from importlib import metadata  # noqa: PLC0415 - every module of this package imports this one

    try:
        return metadata.version(DISTRIBUTION)
    except metadata.PackageNotFoundError:
        return "0+source"
