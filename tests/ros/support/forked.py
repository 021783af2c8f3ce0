"""``compose``, and programs with rclpy, in processes forked from one that has imported both.

A new interpreter spends half a second of CPU time on imports, and the tests start a thousand
commands. Each is a process of its own, forked before any ROS context exists: importing rclpy starts
two threads of LTTng, which a forked process lacks. Tests of how a process starts or ends start a
new interpreter.
"""

from __future__ import annotations

import multiprocessing
import os
import pkgutil
import runpy
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import IO, Self, TextIO

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
_context.set_forkserver_preload([*_modules(), "tests.ros.support.frozen"])


class ForkedProcess:
    """A process of its own that calls a function, used like a ``subprocess.Popen``.

    ``stdout`` and ``stderr`` are pipes, or the given files. With ``merged``, stderr goes where
    stdout goes. With ``reads``, ``stdin`` is a pipe.
    """

    def __init__(
        self,
        call: Callable[[list[str]], None],
        arguments: tuple[str, ...],
        environment: dict[str, str],
        *,
        stdout: IO[str] | None = None,
        stderr: IO[str] | None = None,
        merged: bool = False,
        reads: bool = False,
        cwd: Path | None = None,
    ) -> None:
        self.args = arguments
        self.stdout, out = (None, _duplicate(stdout)) if stdout else _pipe()
        if merged:
            self.stderr, error = None, _duplicate(out)
        else:
            self.stderr, error = (None, _duplicate(stderr)) if stderr else _pipe()
        self.stdin, source = _pipe_to() if reads else (None, None)
        work = (call, list(arguments), str(cwd or Path.cwd()), environment)
        self._process = _context.Process(
            target=_run, args=(*work, source, out, error), daemon=False
        )
        self._process.start()
        # Whenever a process starts, multiprocessing looks at all others in this set: if one of them
        # ends while another thread waits for it, that thread gets 255 as its exit code.
        multiprocessing.process._children.discard(self._process)  # type: ignore[attr-defined]
        for connection in filter(None, (source, out, error)):
            connection.close()
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
        if self.stdin is not None:
            self.stdin.close()
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

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.wait()
        for stream in (self.stdin, self.stdout, self.stderr):
            if stream is not None:
                stream.close()


class ForkedCommand(ForkedProcess):
    """A ``compose`` command in a process of its own.

    Unless it ``chooses_profile``, it has the Fast DDS profile of the tests.
    """

    def __init__(
        self,
        *arguments: str,
        stdout: IO[str] | None = None,
        stderr: IO[str] | None = None,
        merged: bool = False,
        cwd: Path | None = None,
        env: Mapping[str, str] | None = None,
        chooses_profile: bool = True,
    ) -> None:
        environment = _environment(env or {}, chooses_profile=chooses_profile)
        super().__init__(
            _run_command,
            ("compose", *arguments),
            environment,
            stdout=stdout,
            stderr=stderr,
            merged=merged,
            cwd=cwd,
        )


class ForkedProgram(ForkedProcess):
    """A Python program in a process of its own, with pipes as stdin and stdout.

    It finds rclpy and the message packages imported. If it ``chooses_profile``, it has no Fast DDS
    profile, as commands.
    """

    stdin: TextIO
    stdout: TextIO

    def __init__(self, program: Path, *arguments: str, chooses_profile: bool = False) -> None:
        with os.fdopen(os.dup(2), "w") as stderr:  # where pytest captures it
            super().__init__(
                _run_program,
                (str(program), *arguments),
                _environment({}, chooses_profile=chooses_profile),
                stderr=stderr,
                reads=True,
            )


def _environment(variables: Mapping[str, str], *, chooses_profile: bool) -> dict[str, str]:
    if not chooses_profile:
        return {**os.environ, **variables}
    environment = {**os.environ, **_DISCOVERY, **variables}
    environment.pop(_PROFILE, None)
    return environment


def _pipe() -> tuple[TextIO, Connection]:
    reading, writing = os.pipe()
    return os.fdopen(reading, encoding="utf-8"), Connection(writing, readable=False)


def _pipe_to() -> tuple[TextIO, Connection]:
    reading, writing = os.pipe()
    return os.fdopen(writing, "w", encoding="utf-8"), Connection(reading, writable=False)


def _duplicate(stream: IO[str] | Connection) -> Connection:
    return Connection(os.dup(stream.fileno()), readable=False)


def _run(
    call: Callable[[list[str]], None],
    arguments: list[str],
    folder: str,
    environment: Mapping[str, str],
    source: Connection | None,
    out: Connection,
    error: Connection,
) -> None:
    """Make this forked process what a new one would be, and call the function."""
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    for connection, number in ((source, 0), (out, 1), (error, 2)):
        if connection is not None:
            os.dup2(connection.fileno(), number)
            connection.close()
    if source is not None:
        sys.stdin = open(0, encoding="utf-8")  # noqa: SIM115
    is_unbuffered = bool(environment.get("PYTHONUNBUFFERED"))
    out_text = open(1, "w", encoding="utf-8", buffering=1 if is_unbuffered else -1)  # noqa: SIM115
    sys.stdout = sys.__stdout__ = out_text  # what Fast DDS prints there is not data of commands
    sys.stderr = open(2, "w", encoding="utf-8", buffering=1, errors="backslashreplace")  # noqa: SIM115
    sys.argv = arguments
    call(arguments)


def _run_command(_: list[str]) -> None:
    sys.exit(main())


def _run_program(arguments: list[str]) -> None:
    program = arguments[0]
    sys.path.insert(0, str(Path(program).parent))
    runpy.run_path(program, run_name="__main__")
