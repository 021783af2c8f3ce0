"""The dashboard of ``compose run --dashboard``: a child process that ends with the system."""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib.util import find_spec

from composer.cli.support.errors import CommandError
from composer.cli.support.process import ReportingProcess, is_in_background
from composer.cli.support.terminal import say

#: Holds the file descriptor on which a dashboard reports its address to ``compose run``.
_VARIABLE = "COMPOSE_DASHBOARD_FD"
_NEEDED = ("starlette", "uvicorn", "websockets")
_READY_WITHIN_S = 20.0
#: The report that a system is up waits this long for the address.
_ADDRESS_WITHIN_S = 5.0
_ENDS_WITHIN_S = 1.0
_PR_SET_PDEATHSIG = 1  # of <sys/prctl.h>


def require_dashboard(command: str) -> None:
    """Raise CommandError if the packages of the extra ``dashboard`` are not installed."""
    missing = [name for name in _NEEDED if find_spec(name) is None]
    if missing:
        raise CommandError(
            f"'{command}' needs {', '.join(missing)}, which this Python does not have",
            hint='pip install "ros2-composer[dashboard]"',
        )


def foxglove_line(url: str) -> str:
    """Return the line with the address for Foxglove, given that of the page."""
    address = url.replace("http://", "ws://", 1).replace("/?", "/foxglove?", 1)
    return f"Foxglove and Lichtblick: {address}"


def address_lines(url: str) -> str:
    """Return the lines with the addresses of a dashboard among those of other things."""
    return f"dashboard: {url}\n{foxglove_line(url)}"


@contextmanager
def shown_address(arguments: Sequence[str]) -> Iterator[Callable[[], str | None]]:
    """Run a dashboard for the length of a ``with`` block, and print its address when it is ready.

    Yield a function that returns the lines with the address, for a process in the background: its
    output is a file that others may read, so the address is not printed there.
    """
    dashboard = ReportingProcess(("dashboard", *arguments), _VARIABLE, subprocess.DEVNULL)
    found: list[str] = []

    def announce() -> None:
        url = dashboard.report(_READY_WITHIN_S)
        if url:
            found.append(url)
        if not in_background and not is_ending.is_set():
            say(address_lines(url) if url else "dashboard: it has not started, see above")

    in_background, is_ending = is_in_background(), threading.Event()
    thread = threading.Thread(target=announce, name="dashboard", daemon=True)
    thread.start()

    def address() -> str | None:
        thread.join(_ADDRESS_WITHIN_S)
        return address_lines(found[0]) if found else None

    try:
        yield address
    finally:
        is_ending.set()
        dashboard.process.terminate()
        try:
            dashboard.process.wait(_ENDS_WITHIN_S)
        except subprocess.TimeoutExpired:
            dashboard.process.kill()
            dashboard.process.wait()
        thread.join(_ENDS_WITHIN_S)


def follow_parent() -> int | None:
    """In a dashboard of ``compose run``: end with that process, however it ends.

    Return the file descriptor to report the address on; None if a user has started the dashboard.
    """
    descriptor = os.environ.pop(_VARIABLE, None)
    if descriptor is None:
        return None
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, ctypes.c_ulong(signal.SIGKILL))
    return int(descriptor)


def report_address(descriptor: int, url: str) -> None:
    """Report the address to ``compose run``; end this process if that has ended already."""
    try:
        os.write(descriptor, f"{url}\n".encode())
    except BrokenPipeError:
        os._exit(0)
    with suppress(OSError):
        os.close(descriptor)
