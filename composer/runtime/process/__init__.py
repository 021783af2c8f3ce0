"""What concerns the whole process: instance lock, query socket, signals, exit."""

from __future__ import annotations


class StartRefused(Exception):
    """The environment does not allow a start. ``hint`` is how to fix that."""

    def __init__(self, message: str, hint: str) -> None:
        super().__init__(message)
        self.hint = hint


def start_refused(error: Exception) -> StartRefused:
    """Return the error for ``error`` of rcl, which was raised when this process joined ROS.

    rcl has no error codes that distinguish the causes.
    """
    text = " ".join(str(error).split())
    hint = "see the lines above; 'compose doctor' checks the installation"
    if "security libraries" in text:
        text = "security is enabled, but this build of Fast DDS has no security libraries"
        hint = (
            "use a build with them, such as ROS 2 Jazzy from packages.ros.org, or unset"
            " ROS_SECURITY_ENABLE"
        )
    return StartRefused(f"ROS does not start: {text}", hint)
