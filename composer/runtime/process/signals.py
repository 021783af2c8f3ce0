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
    stop: Callable[[str], None], wakeup: WakeupPipe, *, ends_process: bool
) -> Iterator[None]:
    """Call ``stop(name of the signal)`` for each signal, on the main thread.

    Python calls signal handlers between two instructions of the main thread, which therefore must
    sleep only in ``wakeup.wait()``. ``stop`` must not acquire a lock that the main thread may hold.

    If the process ends after this (``ends_process``), signals are ignored from then on, so that
    another Ctrl-C does not kill the process before it has reported the outcome.

    Python installs signal handlers on the main thread only; on other threads this does nothing.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def handle(number: int, _: FrameType | None) -> None:
        stop(signal.Signals(number).name)

    before = {number: signal.signal(number, handle) for number in _SIGNALS}
    fd_before = signal.set_wakeup_fd(wakeup.fd, warn_on_full_buffer=False)
    try:
        yield
    finally:
        signal.set_wakeup_fd(fd_before)
        for number, handler in before.items():
            signal.signal(number, signal.SIG_IGN if ends_process else handler)
