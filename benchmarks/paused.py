"""Running programs that are paused, so that several can run alternately without restarts."""

from __future__ import annotations

import os
import signal
import subprocess
import threading
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any, Self

from benchmarks.processes import ROOT, STARTED_LINE, ProgramFailed, command, no_result, result_in


class PausedPrograms:
    """Context manager: programs of ``benchmarks.programs`` that run only during :meth:`work`.

    ``parts`` are the name and the arguments of each program; the first one measures. They form a
    process group, which is otherwise stopped (SIGSTOP). Entering the context raises ProgramFailed
    if the measurement has not started after ``timeout_s``.
    """

    def __init__(
        self, parts: Sequence[Sequence[str]], variables: Mapping[str, str], timeout_s: float
    ) -> None:
        self._parts = parts
        self._variables = variables
        self._timeout_s = timeout_s
        self._processes: list[subprocess.Popen[str]] = []

    def __enter__(self) -> Self:
        try:
            for part in self._parts:
                self._processes.append(self._start(*part))
            self._wait_until_started()
        except BaseException:
            self._end()
            raise
        self._send(signal.SIGSTOP)
        return self

    def __exit__(self, *_: object) -> None:
        self._end()

    def work(self, seconds: float) -> None:
        """Let the programs run for a while."""
        self._send(signal.SIGCONT)
        time.sleep(seconds)
        self._send(signal.SIGSTOP)

    def result(self) -> dict[str, Any]:
        """Return the result of the first program. Raises ProgramFailed."""
        self._send(signal.SIGCONT)
        first = self._processes[0]
        try:
            output, errors = first.communicate("stop\n", timeout=self._timeout_s)
        except subprocess.TimeoutExpired as error:
            raise ProgramFailed(f"no result within {self._timeout_s:g} s") from error
        return result_in(output, errors, first.returncode)

    def _start(self, name: str, *arguments: str) -> subprocess.Popen[str]:
        is_first = not self._processes
        return subprocess.Popen(
            command(name, *arguments, "--until-stopped"),
            cwd=ROOT,
            env=self._variables,
            stdin=subprocess.PIPE if is_first else subprocess.DEVNULL,
            stdout=subprocess.PIPE if is_first else subprocess.DEVNULL,
            stderr=subprocess.PIPE if is_first else subprocess.DEVNULL,
            text=True,
            process_group=0 if is_first else self._processes[0].pid,
        )

    def _wait_until_started(self) -> None:
        first = self._processes[0]
        assert first.stdout is not None
        timeout = threading.Timer(self._timeout_s, first.kill)
        timeout.start()
        try:
            line = first.stdout.readline()
        finally:
            timeout.cancel()
        if line.rstrip() != STARTED_LINE:
            _, errors = first.communicate()
            killed = first.returncode == -signal.SIGKILL
            late = f"not started within {self._timeout_s:g} s"
            raise ProgramFailed(late) if killed else no_result(errors, first.returncode)

    def _send(self, number: signal.Signals) -> None:
        with suppress(ProcessLookupError):  # all have exited
            os.killpg(self._processes[0].pid, number)

    def _end(self) -> None:
        if self._processes:
            self._send(signal.SIGKILL)
        for process in self._processes:
            process.wait()
            for stream in (process.stdin, process.stdout, process.stderr):
                if stream is not None:
                    stream.close()
