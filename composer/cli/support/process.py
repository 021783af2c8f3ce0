"""The process of ``compose run``: in the background, and with a dashboard that ends with it.

The process of a system ends even if it hangs.
"""

from __future__ import annotations

import ctypes
import faulthandler
import os
import select
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path
from types import MappingProxyType
from typing import BinaryIO, NoReturn

from composer.cli.support.c_streams import crash_fd
from composer.cli.support.errors import CommandError, require_extra
from composer.cli.support.line_format import CONSOLE_FORMAT_VARIABLE, file_format
from composer.cli.support.terminal import say

#: Holds the file descriptor on which a background process reports that the system is up.
READY_VARIABLE = "COMPOSE_READY_FD"
#: The beginning of a report that not all nodes are up.
_INCOMPLETE = "incomplete: "
_LOG_TAIL_LINES = 20
_READ_BYTES = 4096
_MIN_DELAY_S = 0.001
_LAST_RESORT_S = 1.0
_LONGEST_LIMIT_S = 1e8  # three years, within the range of C's timers
#: Holds the file descriptor on which a dashboard reports its address to ``compose run``.
_ADDRESS_VARIABLE = "COMPOSE_DASHBOARD_FD"
_DASHBOARD_READY_WITHIN_S = 20.0
#: The report that a system is up waits this long for the address.
_ADDRESS_WITHIN_S = 5.0
_DASHBOARD_ENDS_WITHIN_S = 1.0
_PR_SET_PDEATHSIG = 1  # of <sys/prctl.h>


def compose_command() -> tuple[str, ...]:
    """Return the first words of a command line that runs this program again."""
    # -P: do not import modules from the current folder
    return (sys.executable, "-P", "-m", "composer")


class ReportingProcess:
    """A command of this program in a process of its own, which reports to this one, once."""

    def __init__(
        self,
        words: Sequence[str],
        variable: str,
        output: BinaryIO | int,
        errors: BinaryIO | None = None,
        environment: Mapping[str, str] = MappingProxyType({}),
    ) -> None:
        """Start ``compose`` with ``words``; ``variable`` has the descriptor for its report."""
        self._reading, writing = os.pipe()
        try:
            self.process = subprocess.Popen(  # noqa: S603 - this very program
                [*compose_command(), *words],
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=errors,
                env={**os.environ, **environment, variable: str(writing)},
                pass_fds=(writing,),
                start_new_session=True,  # Ctrl-C and the end of the terminal do not end it
            )
        finally:
            os.close(writing)

    def report(self, within_s: float) -> str | None:
        """Return the report; empty if the process has ended without one, None if it is late.

        Call it once.
        """
        end_s = time.monotonic() + within_s
        received = b""
        with os.fdopen(self._reading, "rb") as pipe:
            while select.select([pipe], [], [], max(0.0, end_s - time.monotonic()))[0]:
                data = os.read(pipe.fileno(), _READ_BYTES)
                if not data:
                    return received.decode(errors="replace").strip()
                received += data
        return None


def run_in_background(system: str, arguments: Sequence[str], limit_s: float) -> str:
    """Start ``compose run`` with ``arguments``; return its report once the system is up.

    Its output goes to a file in the ROS log folder. Raises CommandError with the last lines of that
    file if the process ends first. After ``limit_s`` seconds without a report the process is
    killed. If a node is not up that the system needs, the process runs on, and CommandError is
    raised as well.
    """
    log = _log_path(system)
    with _new_file(log) as output:
        words, environment = ("run", *arguments), {CONSOLE_FORMAT_VARIABLE: file_format()}
        child = ReportingProcess(words, READY_VARIABLE, output, output, environment)
    process = child.process
    try:
        report = child.report(limit_s)
    except KeyboardInterrupt:
        process.terminate()
        process.wait()
        raise
    if report is None:
        os.killpg(process.pid, signal.SIGKILL)  # its own time limits did not work
        process.wait()
        raise _start_error(f"the system did not come up within {limit_s:g} s and was killed:", log)
    if not report:
        process.wait()
        raise _start_error(f"the system did not come up (exit code {process.returncode}):", log)
    text = report.removeprefix(_INCOMPLETE)
    if text != report:
        hint = "the others run; end them with 'compose down', or use --all-or-nothing"
        raise CommandError(f"{text} (process {process.pid}, log {log})", hint=hint)
    return f"{text} (process {process.pid}, log {log})"


def is_in_background() -> bool:
    """Return whether another command waits for the report of this process that it is up."""
    return READY_VARIABLE in os.environ


def take_ready_descriptor() -> str | None:
    """Return where to report that the system is up, if a command waits for that.

    Child processes do not inherit it.
    """
    return os.environ.pop(READY_VARIABLE, None)


def report_ready(descriptor: str | None, text: str, *, is_complete: bool = True) -> None:
    """Report to the command that started this process in the background that the system is up.

    Without ``is_complete``, a node is not up that the system needs.
    """
    if descriptor is not None:
        with os.fdopen(int(descriptor), "w", encoding="utf-8") as pipe:
            pipe.write(text if is_complete else f"{_INCOMPLETE}{text}")


def end_within(limit_s: float | None) -> None:
    """End this process after ``limit_s`` seconds with exit code 1; None cancels that.

    The Python stacks of all threads are printed first. None of this needs the interpreter: code in
    C that hangs may hold the GIL, and then no Python signal handler runs. SIGALRM ends the process
    if the interpreter has already shut down.
    """
    faulthandler.cancel_dump_traceback_later()
    signal.setitimer(signal.ITIMER_REAL, 0.0)
    if limit_s is not None:
        limit_s = min(max(limit_s, _MIN_DELAY_S), _LONGEST_LIMIT_S)
        faulthandler.dump_traceback_later(limit_s, exit=True, file=crash_fd())
        signal.setitimer(signal.ITIMER_REAL, limit_s + _LAST_RESORT_S)


def end_now(exit_code: int) -> NoReturn:
    """End this process without waiting for its threads."""
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(exit_code)


def _start_error(message: str, log: Path) -> CommandError:
    tail = log.read_text(encoding="utf-8", errors="replace").splitlines()[-_LOG_TAIL_LINES:]
    return CommandError(message, hint="\n".join([*tail, f"full log: {log}"]))


def _log_path(system: str) -> Path:
    """Return a new file name in the ROS log folder."""
    from composer.runtime.middleware.environment import log_folder

    try:
        folder = log_folder(os.environ) or Path.home() / ".ros" / "log"
    except RuntimeError as error:  # no HOME, and a user id without an account, as in containers
        raise CommandError(
            "there is no folder for the log: neither ROS_LOG_DIR nor HOME is set, and user"
            f" {os.geteuid()} has no home folder",
            hint="set ROS_LOG_DIR to a writable folder",
        ) from error
    now = datetime.now().astimezone().strftime("%Y-%m-%d-%H-%M-%S")
    return folder / f"{system}-{now}-{os.getpid()}.log"


def _new_file(path: Path) -> BinaryIO:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        return path.open("xb")  # follows no symbolic link that is there already
    except OSError as problem:
        raise CommandError(
            f"cannot write the log of the system to '{path}': {problem.strerror}",
            hint="set ROS_LOG_DIR to a writable folder",
        ) from problem


def require_dashboard(command: str) -> None:
    """Raise CommandError if the packages of the extra ``dashboard`` are not installed."""
    require_extra(command, "dashboard", "starlette", "uvicorn", "websockets")


def foxglove_line(url: str) -> str:
    """Return the line with the address for Foxglove; ``url`` is the address of the page."""
    address = url.replace("http://", "ws://", 1).replace("/?", "/foxglove?", 1)
    return f"Foxglove and Lichtblick: {address}"


def address_lines(url: str) -> str:
    """Return the lines with the address of a dashboard, and its address for Foxglove."""
    return f"dashboard: {url}\n{foxglove_line(url)}"


@contextmanager
def shown_address(arguments: Sequence[str]) -> Iterator[Callable[[], str | None]]:
    """Run a dashboard for the length of a ``with`` block, and print its address when it is ready.

    Yield a function that returns the lines with the address, for a process in the background: its
    output is a file that others may read, so the address is not printed there.
    """
    dashboard = ReportingProcess(("dashboard", *arguments), _ADDRESS_VARIABLE, subprocess.DEVNULL)
    found: list[str] = []

    def announce() -> None:
        url = dashboard.report(_DASHBOARD_READY_WITHIN_S)
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
            dashboard.process.wait(_DASHBOARD_ENDS_WITHIN_S)
        except subprocess.TimeoutExpired:
            dashboard.process.kill()
            dashboard.process.wait()
        thread.join(_DASHBOARD_ENDS_WITHIN_S)


def follow_parent() -> int | None:
    """In a dashboard of ``compose run``: end with that process, however it ends.

    Return the file descriptor to report the address on; None if a user has started the dashboard.
    """
    descriptor = os.environ.pop(_ADDRESS_VARIABLE, None)
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
