"""``compose`` as a child of a launch: SIGTERM ends it when the launch ends, however that happens.

Run as ``python -P -m composer.launch.child PID ARGUMENTS...``; PID is the process of the launch.
``ros2 launch`` itself leaves its processes running when a SIGTERM or SIGKILL ends it.
"""

from __future__ import annotations

import ctypes
import os
import signal
import sys

_PR_SET_PDEATHSIG = 1


def main() -> None:
    """Become a command of compose."""
    launch_pid, *arguments = sys.argv[1:]
    # Not the signal of a thread: launch starts processes on its main thread.
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
    if os.getppid() != int(launch_pid):
        sys.exit(1)  # the launch has ended already
    # The signal remains set in the new program.
    os.execv(sys.executable, [sys.executable, "-P", "-m", "composer", *arguments])  # noqa: S606


if __name__ == "__main__":
    main()
