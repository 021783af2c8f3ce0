"""SIGINT, SIGTERM and SIGHUP as requests to stop."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

from composer.runtime.process.wakeup_pipe import WakeupPipe

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@contextmanager
def stop_signals(
    stop: Callable[[str], None], bell: WakeupPipe, *, ends_process: bool
) -> Iterator[None]:
    """Call ``stop(name of the signal)`` for each signal, on the main thread.

    That happens between two instructions of Python. The main thread therefore sleeps only until
    ``bell`` rings, or for a limited time.

    Where the process ends after this, as the signals ask for, they are ignored from then on: it is
    to say how the run was, and not to die of an impatient Ctrl-C.

    ``stop`` must not take a lock that the main thread may hold. On any other thread than the main
    one nothing is installed, since Python allows it there alone.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def handle(number: int, _: FrameType | None) -> None:
        stop(signal.Signals(number).name)

    before = {number: signal.signal(number, handle) for number in _SIGNALS}
    rung_before = signal.set_wakeup_fd(bell.fd, warn_on_full_buffer=False)
    try:
        yield
    finally:
        signal.set_wakeup_fd(rung_before)
        for number, handler in before.items():
            signal.signal(number, signal.SIG_IGN if ends_process else handler)
