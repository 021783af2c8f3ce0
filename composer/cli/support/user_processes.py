"""Run code of users in a process of its own, and read what it reports."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from composer.cli.support.errors import CommandError
from composer.cli.support.output.terminal import say

#: The name of an exception of the composer at the end of a traceback; its text says it all.
_OWN_EXCEPTION = re.compile(r"^composer\.[\w.]+: ")


def run_user_process(what: str, module: str, arguments: Sequence[str], timeout_s: float) -> str:
    """Run a module of the composer; return what it writes to the file that is its first argument.

    ``what`` describes it, as in "constructing 'driver:Driver'". The user reads before it runs that
    it will. Raises CommandError with the last line of its output if it fails or takes too long.
    """
    say(f"{what}: this runs its code, with all that you may do")
    with tempfile.TemporaryDirectory(prefix="compose-") as folder:
        report = Path(folder, "report")
        process = subprocess.Popen(  # noqa: S603 - a module of this very program
            # -P: do not import modules from the current folder
            [sys.executable, "-P", "-m", module, str(report), *arguments],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            start_new_session=True,
            env={**os.environ, "TMPDIR": folder},  # removes what it leaves behind
            text=True,
            errors="replace",
        )
        try:
            shown, _ = process.communicate(timeout=timeout_s)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.communicate()
            raise CommandError(
                f"{what} did not end within {timeout_s:g} s",
                hint="its code must not wait or spin; --timeout sets another limit",
            ) from None
        if process.returncode != 0 or not report.is_file():
            if os.environ.get("COMPOSE_DEBUG"):
                say(shown.rstrip())
            last = shown.strip().splitlines()[-1:] or [f"exit code {process.returncode}"]
            text = _OWN_EXCEPTION.sub("", last[0])
            raise CommandError(f"{what} failed: {text}", hint="COMPOSE_DEBUG=1 shows its output")
        return report.read_text(encoding="utf-8")
