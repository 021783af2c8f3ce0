"""The folders of runs and their log files: written by ``compose run``, read by ``compose logs``.

::

    <ROS log folder>/compose/robot1.pipeline/2026-03-01-08-30-00-125-4711/   one run, named in UTC
        run.json                     the system, and its process, which holds a lock on this file
        log-000001.jsonl             the oldest file that is left, one JSON object per line
        log-000002.jsonl             written to now

See docs/decisions/0010-output-never-blocks.md.
"""

from __future__ import annotations

import fcntl
import json
import os
import re
import socket
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from composer.base.fast_dataclass import dataclass
from composer.base.files import open_regular, read_regular, write_whole
from composer.model.names import is_selected

MAX_FILE_BYTES = 10 * 1024 * 1024
MAX_FILES = 5
_FILE_NAME = re.compile(r"log-(\d{6,12})\.jsonl")
FOLDER = "compose"
#: How many runs of a system are kept, with the one that starts.
MAX_RUNS = 20
_ABOUT = "run.json"
_MAX_ABOUT_BYTES = 65_536
#: The folders of systems: their names, with dots in place of slashes.
_SYSTEM = re.compile(r"\w+(\.\w+)*", re.ASCII)
_NAME = re.compile(r"(\d{4}(?:-\d\d){5}-\d{3})-\d+")
_NAME_FORMAT = "%Y-%m-%d-%H-%M-%S-%f"


def log_files(folder: Path) -> list[Path]:
    """Return the log files in ``folder``, oldest first."""
    with suppress(OSError):
        found = [
            (int(match[1]), path)
            for path in folder.iterdir()
            if (match := _FILE_NAME.fullmatch(path.name))
        ]
        return [path for _, path in sorted(found)]
    return []


class RotatingFile:
    """Writes lines to numbered files in a folder. Use it from one thread."""

    def __init__(
        self, folder: Path, max_bytes: int = MAX_FILE_BYTES, max_files: int = MAX_FILES
    ) -> None:
        """Keep the newest ``max_files`` files of about ``max_bytes`` bytes."""
        self._folder = folder
        self._max_bytes = max_bytes
        self._max_files = max_files
        self._number = 0
        self._size = 0
        self._fd = -1
        self._is_line_complete = True

    def write(self, data: bytes) -> int:
        """Write the beginning of ``data``; return the number of bytes written. Raises OSError."""
        is_full = self._size >= self._max_bytes and self._is_line_complete
        if self._fd < 0 or is_full:
            self._open_next()
        count = os.write(self._fd, data[: self._end(data)])
        self._size += count
        self._is_line_complete = data[:count].endswith(b"\n")
        return count

    def close(self) -> None:
        """Close the file."""
        if self._fd >= 0:
            os.close(self._fd)
            self._fd = -1

    def _end(self, data: bytes) -> int:
        """Return how much of ``data`` belongs into this file: up to the line that fills it."""
        newline = data.find(b"\n", max(0, self._max_bytes - self._size - 1))
        return len(data) if newline < 0 else newline + 1

    def _open_next(self) -> None:
        path = self._path(self._number + 1)
        fd = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666)
        self.close()
        self._fd, self._size, self._number = fd, 0, self._number + 1
        with suppress(OSError):
            self._path(self._number - self._max_files).unlink(missing_ok=True)

    def _path(self, number: int) -> Path:
        return self._folder / f"log-{number:06}.jsonl"


@dataclass(frozen=True, slots=True)
class Run:
    """A run of a system. ``system`` is its full name: ``/robot1/pipeline``."""

    folder: Path
    system: str

    @property
    def name(self) -> str:
        """The name of the run; sorted by name, runs are in the order of their start."""
        return self.folder.name

    @property
    def is_of_part(self) -> bool:
        """Whether a process of a system, and not the whole system, made the run."""
        return self.about().get("part") is True

    @property
    def host(self) -> str:
        """The name of the computer that wrote the log."""
        return str(self.about().get("host", ""))

    @property
    def domain(self) -> str:
        """The ROS domain id; empty if it is not known."""
        domain = self.about().get("domain")
        return domain if isinstance(domain, str) and domain.isdecimal() else ""

    @property
    def whole_system(self) -> str:
        """The full name of the system, if a process of the system made the run."""
        return self.system.rpartition("/")[0]

    @property
    def started(self) -> datetime:
        """When the run started, in the local time zone."""
        return _started(self.name)

    @property
    def pid(self) -> str:
        """The id of the process."""
        return self.name.rpartition("-")[2]

    def written_ns(self) -> int:
        """Return when the last line was written, since the Unix epoch; 0 if there is none."""
        files = log_files(self.folder)
        with suppress(OSError):
            return files[-1].stat().st_mtime_ns if files else 0
        return 0

    def about(self) -> dict[str, Any]:
        """Return what the run says about itself; nothing if that cannot be read."""
        with suppress(OSError, ValueError, RecursionError):
            about = json.loads(read_regular(self.folder / _ABOUT, _MAX_ABOUT_BYTES))
            return about if isinstance(about, dict) else {}
        return {}

    def is_running(self) -> bool:
        """Say whether the process that writes the log is running, on this computer."""
        try:
            with open_regular(self.folder / _ABOUT) as file:
                fcntl.lockf(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
        except OSError:
            return False
        return False


class RunFolder:
    """The folder of a run that starts now, locked as long as the process runs."""

    def __init__(
        self, logs: Path, system: str, *, part: bool = False, forwarded: bool = False
    ) -> None:
        """Create a folder below ``logs``, and remove the oldest runs of the system.

        ``system`` is the full name of the system, or of a process of it if it is a ``part``. Its
        lines are ``forwarded`` if the run of the whole system logs them as well. Raises OSError.
        """
        parent = logs / FOLDER / _folder_name(system)
        parent.mkdir(parents=True, exist_ok=True)
        now = datetime.now(UTC).strftime(_NAME_FORMAT)[:-3]
        self.path = parent / f"{now}-{os.getpid()}"
        self.path.mkdir()
        about = {"system": system, "host": socket.gethostname(), "pid": os.getpid()}
        about |= {"part": part, "forwarded": forwarded, "domain": current_domain()}
        try:
            write_whole(self.path / _ABOUT, f"{json.dumps(about)}\n")
        except OSError:
            self.path.rmdir()
            raise
        # Not inherited by processes that user code forks, as a lock of flock() would be.
        self._about = (self.path / _ABOUT).open("r+", encoding="utf-8")
        with suppress(OSError):  # a file system without locks: the run does not look running
            fcntl.lockf(self._about, fcntl.LOCK_EX | fcntl.LOCK_NB)
        for run in _runs_in(parent, system)[:-MAX_RUNS]:
            _remove(run)

    def close(self) -> None:
        """Mark the run as ended."""
        self._about.close()


def current_domain() -> str:
    """Return the ROS domain id of this process, without leading zeros."""
    return os.environ.get("ROS_DOMAIN_ID", "").lstrip("0") or "0"


def find_runs(logs: Path, system: str | None = None) -> list[Run]:
    """Return the runs below ``logs`` in the order of their start.

    ``system`` selects the runs of systems with that full name or last part. By default, all runs
    are returned, except runs of processes that are parts of systems. If there are only parts of a
    system, as on a computer that runs no other of its processes, they are returned.
    """
    runs: list[Run] = []
    parts: list[Run] = []
    for name, folder in _systems(logs):
        found = _runs_in(folder, name)
        if system is not None and is_selected(name, system):
            runs += found
        elif system is None or is_selected(name.rpartition("/")[0], system):
            parts += [run for run in found if run.is_of_part]
            runs += [run for run in found if system is None and not run.is_of_part]
    whole = {run.system for run in runs}
    runs += [run for run in parts if run.whole_system not in whole]
    return sorted(runs, key=lambda run: run.name)


def find_parts(logs: Path, whole: Run) -> list[Run]:
    """Return the runs of processes of a system whose lines its own run does not log."""
    own: dict[str, Any] = {"part": True, "forwarded": False, "host": whole.host}
    if whole.domain:
        own["domain"] = whole.domain
    return [
        run
        for name, folder in _systems(logs)
        if name.rpartition("/")[0] == whole.system
        for run in _runs_in(folder, name)
        if own.items() <= run.about().items()
    ]


def _systems(logs: Path) -> list[tuple[str, Path]]:
    """Return the full names of systems and processes, and the folders of their runs."""
    with suppress(OSError):
        folders = sorted((logs / FOLDER).iterdir())
        names = [("/" + folder.name.replace(".", "/"), folder) for folder in folders]
        return [(name, folder) for name, folder in names if _SYSTEM.fullmatch(folder.name)]
    return []


def _runs_in(folder: Path, system: str) -> list[Run]:
    with suppress(OSError):
        names = sorted(item.name for item in folder.iterdir() if _is_run(item.name))
        return [Run(folder / name, system) for name in names]
    return []


def _is_run(name: str) -> bool:
    with suppress(ValueError, OverflowError, OSError):  # not a date
        return _NAME.fullmatch(name) is not None and _started(name) is not None
    return False


def _started(name: str) -> datetime:
    """Return when the run of a folder started. Raises ValueError, OverflowError, OSError."""
    text, _, _ = name.rpartition("-")
    return datetime.strptime(text, _NAME_FORMAT).replace(tzinfo=UTC).astimezone()


def _remove(run: Run) -> None:
    """Remove a run that has ended; files that are not ours keep their folder."""
    if not run.is_running():
        with suppress(OSError):
            for file in (*log_files(run.folder), run.folder / _ABOUT):
                file.unlink(missing_ok=True)
            run.folder.rmdir()


def _folder_name(system: str) -> str:
    """Return the name of the folder of a system: names have no dots."""
    return system.strip("/").replace("/", ".")
