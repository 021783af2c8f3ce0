"""The end of the process, whatever hangs in it."""

from __future__ import annotations

import faulthandler
import os
import signal
import sys
from typing import NoReturn

_SHORTEST_S = 0.001
_LAST_RESORT_S = 1.0


def end_within(limit_s: float | None) -> None:
    """End this process after ``limit_s`` seconds, if it still stands then; None calls that off.

    The exit code is 1, and the Python stacks of all threads say what was in the way. Nothing of
    this needs Python to go on: what hangs in C may have the GIL, and no signal handler written in
    Python gets its turn then. Where Python itself has ended already, SIGALRM ends the rest.
    """
    faulthandler.cancel_dump_traceback_later()
    signal.setitimer(signal.ITIMER_REAL, 0.0)
    if limit_s is not None:
        faulthandler.dump_traceback_later(max(limit_s, _SHORTEST_S), exit=True)
        signal.setitimer(signal.ITIMER_REAL, limit_s + _LAST_RESORT_S)


def end_now(exit_code: int) -> NoReturn:
    """End this process although a thread does not."""
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(exit_code)
