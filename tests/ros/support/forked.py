"""``compose`` in processes forked from one that has imported it: see docs/decisions/0035."""

from __future__ import annotations

import multiprocessing
import os
import pkgutil
import signal
import subprocess
import sys
import threading
from collections.abc import Mapping
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import IO, TextIO

import composer
from composer.cli import main

#: Without the Fast DDS profile of the tests, so that ros2-composer chooses its own.
_PROFILE = "FASTRTPS_DEFAULT_PROFILES_FILE"
_DISCOVERY = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
#: Interfaces of the example systems; commands would import them when they meet them.
_INTERFACES = ("composer_interfaces", "geometry_msgs", "nav_msgs", "sensor_msgs", "std_msgs")


def _modules() -> list[str]:
    """Return the names of all modules that a command may import."""
    modules = [module.name for module in pkgutil.walk_packages(composer.__path__, "composer.")]
    modules.remove("composer.__main__")
    return [*modules, *(f"{package}.{kind}" for package in _INTERFACES for kind in ("msg", "srv"))]


_context = multiprocessing.get_context("forkserver")
_context.set_forkserver_preload(_modules())


class ForkedCommand:
    """A ``compose`` command in a process of its own, used like a ``subprocess.Popen``.

    ``stdout`` and ``stderr`` are pipes, or the given files. With ``merged``, stderr goes where
    stdout goes.
    """

    def __init__(
        self,
        *arguments: str,
        stdout: IO[str] | None = None,
        stderr: IO[str] | None = None,
        merged: bool = False,
        cwd: Path | None = None,
        env: Mapping[str, str] | None = None,
    ) -> None:
        self.args = ("compose", *arguments)
        self.stdout, out = (None, _duplicate(stdout)) if stdout else _pipe()
        if merged:
            self.stderr, error = None, _duplicate(out)
        else:
            self.stderr, error = (None, _duplicate(stderr)) if stderr else _pipe()
        environment = {**os.environ, **_DISCOVERY, **(env or {})}
        environment.pop(_PROFILE, None)
        work = (str(cwd or Path.cwd()), environment, list(arguments))
        self._process = _context.Process(target=_run, args=(*work, out, error), daemon=False)
        self._process.start()
        # Whenever a process starts, multiprocessing looks at all others in this set: if one of them
        # ends while another thread waits for it, that thread gets 255 as its exit code.
        multiprocessing.process._children.discard(self._process)  # type: ignore[attr-defined]
        out.close()
        error.close()
        assert self._process.pid is not None
        self.pid = self._process.pid

    @property
    def returncode(self) -> int | None:
        return self._process.exitcode

    def poll(self) -> int | None:
        return self._process.exitcode

    def wait(self, timeout: float | None = None) -> int:
        """Return the exit code. Raises subprocess.TimeoutExpired."""
        self._process.join(timeout)
        if self._process.exitcode is None:
            raise subprocess.TimeoutExpired(self.args, timeout or 0.0)
        return self._process.exitcode

    def communicate(self, timeout: float | None = None) -> tuple[str, str]:
        """Return what is written to the pipes until the end. Raises subprocess.TimeoutExpired."""
        texts = ["", ""]

        def read(number: int, stream: TextIO) -> None:
            texts[number] = stream.read()

        streams = enumerate((self.stdout, self.stderr))
        readers = [
            threading.Thread(target=read, args=(number, stream), daemon=True)
            for number, stream in streams
            if stream is not None
        ]
        for reader in readers:
            reader.start()
        self.wait(timeout)
        for reader in readers:
            reader.join(timeout)
        return texts[0], texts[1]

    def send_signal(self, number: int) -> None:
        if self.poll() is None:
            with suppress(ProcessLookupError):  # it is not a child of this process
                os.kill(self.pid, number)

    def terminate(self) -> None:
        self.send_signal(signal.SIGTERM)

    def kill(self) -> None:
        self.send_signal(signal.SIGKILL)

    def __enter__(self) -> ForkedCommand:
        return self

    def __exit__(self, *_: object) -> None:
        self.wait()
        for stream in (self.stdout, self.stderr):
            if stream is not None:
                stream.close()


def _pipe() -> tuple[TextIO, Connection]:
    reading, writing = os.pipe()
    return os.fdopen(reading, encoding="utf-8"), Connection(writing, readable=False)


def _duplicate(stream: IO[str] | Connection) -> Connection:
    return Connection(os.dup(stream.fileno()), readable=False)


def _run(
    folder: str,
    environment: Mapping[str, str],
    arguments: list[str],
    out: Connection,
    error: Connection,
) -> None:
    """Make this forked process what a new one would be, and run the command."""
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    for connection, number in ((out, 1), (error, 2)):
        os.dup2(connection.fileno(), number)
        connection.close()
    is_unbuffered = bool(environment.get("PYTHONUNBUFFERED"))
    sys.stdout = open(1, "w", encoding="utf-8", buffering=1 if is_unbuffered else -1)  # noqa: SIM115
    sys.stderr = open(2, "w", encoding="utf-8", buffering=1, errors="backslashreplace")  # noqa: SIM115
    sys.argv = ["compose", *arguments]
    sys.exit(main())
