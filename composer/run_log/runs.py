"""The folders of runs: created by the process of a system, and found by its name."""

from __future__ import annotations

import fcntl
import json
import os
import re
import socket
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path

from composer.fast_dataclass import dataclass
from composer.run_log.rotation import log_files

FOLDER = "compose"
#: How many runs of a system are kept, with the one that starts.
MAX_RUNS = 20
_ABOUT = "run.json"
_NAME = re.compile(r"(\d{4}(?:-\d\d){5}-\d{3})-\d+")
_NAME_FORMAT = "%Y-%m-%d-%H-%M-%S-%f"


@dataclass(frozen=True, slots=True)
class Run:
    """A run of a system. ``system`` is its full name: ``/robot1/pipeline``."""

    folder: Path
    system: str

    @property
    def name(self) -> str:
        """The name of the run, by which runs are in the order of their start."""
        return self.folder.name

    @property
    def is_of_part(self) -> bool:
        """Whether the run is that of a process of a system, whose log has these lines as well."""
        try:
            about = json.loads((self.folder / _ABOUT).read_text(encoding="utf-8"))
            return about.get("part") is True
        except (OSError, ValueError, AttributeError):
            return False

    @property
    def started(self) -> datetime:
        """When the run started, in the local time zone."""
        text, _, _ = self.name.rpartition("-")
        return datetime.strptime(text, _NAME_FORMAT).replace(tzinfo=UTC).astimezone()

    @property
    def pid(self) -> str:
        """The id of the process."""
        return self.name.rpartition("-")[2]

    def is_running(self) -> bool:
        """Say whether the process that writes the log is running, on this computer."""
        try:
            with (self.folder / _ABOUT).open("rb") as file:
                fcntl.lockf(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
        except OSError:
            return False
        return False


class RunFolder:
    """The folder of a run that starts now, locked as long as the process runs."""

    def __init__(self, logs: Path, system: str, *, part: bool = False) -> None:
        """Create a folder below ``logs``, and remove the oldest runs of the system.

        ``system`` is the full name of the system, or of a process of it if it is a ``part``. Raises
        OSError.
        """
        parent = logs / FOLDER / _folder_name(system)
        parent.mkdir(parents=True, exist_ok=True)
        now = datetime.now(UTC).strftime(_NAME_FORMAT)[:-3]
        self.path = parent / f"{now}-{os.getpid()}"
        self.path.mkdir()
        # Not inherited by processes that user code forks, as a lock of flock() would be.
        self._about = (self.path / _ABOUT).open("x", encoding="utf-8")
        about = {"system": system, "host": socket.gethostname(), "pid": os.getpid(), "part": part}
        self._about.write(f"{json.dumps(about)}\n")
        self._about.flush()
        with suppress(OSError):  # a file system without locks: the run does not look running
            fcntl.lockf(self._about, fcntl.LOCK_EX | fcntl.LOCK_NB)
        for run in _runs_in(parent, system)[:-MAX_RUNS]:
            _remove(run)

    def close(self) -> None:
        """Mark the run as ended."""
        self._about.close()


def find_runs(logs: Path, system: str | None = None) -> list[Run]:
    """Return the runs below ``logs`` in the order of their start.

    ``system`` selects those of the systems with that full name or last part; by default, all but
    those of processes that are parts of systems.
    """
    runs = []
    with suppress(OSError):
        for folder in (logs / FOLDER).iterdir():
            name = "/" + folder.name.replace(".", "/")
            if system is None or name == system or name.endswith(f"/{system}"):
                found = _runs_in(folder, name)
                runs += found if system else [run for run in found if not run.is_of_part]
    return sorted(runs, key=lambda run: run.name)


def _runs_in(folder: Path, system: str) -> list[Run]:
    with suppress(OSError):
        names = sorted(item.name for item in folder.iterdir() if _NAME.fullmatch(item.name))
        return [Run(folder / name, system) for name in names]
    return []


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
