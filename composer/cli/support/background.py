"""A system in the background: started, waited for, and left to itself."""

from __future__ import annotations

import os
import select
import signal
import subprocess
import sys
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path
from typing import TextIO

from composer.cli.support.failure import FINDINGS, Failure

#: Names the file descriptor through which the process tells that the system is up.
READY_VARIABLE = "COMPOSE_READY_FD"
_LAST_LINES = 20


def run_in_background(system: str, arguments: Sequence[str], limit_s: float) -> str:
    """Start ``compose run`` with ``arguments``; return what it says once the system is up.

    What it prints goes to a file in the folder of ROS's logs. Raises Failure, with the end of that,
    when the process ends instead, or has said nothing for ``limit_s`` seconds: it is killed then.
    """
    log = _log_path(system)
    log.parent.mkdir(parents=True, exist_ok=True)
    reading, writing = os.pipe()
    with os.fdopen(reading, encoding="utf-8") as news, log.open("wb") as output:
        try:
            process = subprocess.Popen(  # noqa: S603 - this very program
                [sys.executable, "-m", "composer", "run", *arguments],
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=output,
                env={**os.environ, READY_VARIABLE: str(writing)},
                pass_fds=(writing,),
                start_new_session=True,  # neither Ctrl-C nor the terminal's end is meant for it
            )
        finally:
            os.close(writing)
        try:
            told = _read_within(news, limit_s)
        except KeyboardInterrupt:
            process.terminate()
            process.wait()
            raise
    if told is None:
        os.killpg(process.pid, signal.SIGKILL)  # it keeps limits of its own, if it can
        process.wait()
        raise _failure(f"the system did not come up within {limit_s:g} s and was killed:", log)
    if not told:
        process.wait()
        raise _failure(f"the system did not come up (exit code {process.returncode}):", log)
    return f"{told} (process {process.pid}, log {log})"


def _read_within(news: TextIO, limit_s: float) -> str | None:
    """Return what is written to a pipe until it is closed; None when nothing comes in time."""
    ready, _, _ = select.select([news], [], [], limit_s)
    return news.read() if ready else None


def _failure(what: str, log: Path) -> Failure:
    tail = log.read_text(encoding="utf-8", errors="replace").splitlines()[-_LAST_LINES:]
    return Failure(what, hint="\n".join([*tail, f"all of it: {log}"]), exit_code=FINDINGS)


def tell_ready(text: str) -> None:
    """Tell whoever started this process in the background that the system is up, once."""
    descriptor = os.environ.pop(READY_VARIABLE, None)
    if descriptor is not None:
        with os.fdopen(int(descriptor), "w", encoding="utf-8") as news:
            news.write(text)


def _log_path(system: str) -> Path:
    """Return where to write: beside the logs of ROS."""
    from composer.runtime.process.environment import log_folder

    folder = log_folder(os.environ) or Path.home() / ".ros" / "log"
    now = datetime.now().astimezone().strftime("%Y-%m-%d-%H-%M-%S")
    return folder / f"{system}-{now}-{os.getpid()}.log"
