"""The bags in the folder ``bags``: what the dashboard records, lists and plays.

``compose record`` and ``compose replay`` run as processes that end with the dashboard.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, Any

from composer.base.fast_dataclass import dataclass
from composer.dashboard.context import Declared
from composer.dashboard.feeds import Feed
from composer.dashboard.protocol.messages import BadRequestError, RequestError, Values, to_json
from composer.dashboard.protocol.outbox import Update
from composer.rules.replays import Recorded, read_metadata

FOLDER = Path("bags")
_MOST_BAGS = 500
_MOST_OUTPUT = 2000  # characters of a command
#: To complete a bag.
_ENDS_WITHIN_S = 10.0
#: The full name of a topic, with '*' for any text. As arguments of a command, names have no null
#: bytes and are not long.
_PATTERN = re.compile(r"[\w/*]{1,255}", re.ASCII)


@dataclass(slots=True)
class _Command:
    """A running command; ``bag`` is the name of what it records or plays."""

    bag: str
    process: subprocess.Popen[bytes]
    output: IO[bytes]
    started_s: float

    def text(self) -> str:
        """Return the end of what it has printed."""
        self.output.seek(0)
        return self.output.read().decode(errors="replace")[-_MOST_OUTPUT:].strip()


class Recordings:
    """One recording and one replay at a time. Its methods may be called from any thread."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._lock = threading.Lock()
        self._running: dict[str, _Command] = {}
        self._problems: dict[str, str] = {}
        self._metadata: dict[str, tuple[int, Recorded | None]] = {}  # by bag, with its time

    def state(self) -> dict[str, Any]:
        """Return the bags, the newest first, what is recorded and played, and what went wrong."""
        with self._lock:
            self._look()
            running = {
                verb: {"bag": item.bag, "for_s": time.monotonic() - item.started_s}
                for verb, item in self._running.items()
            }
            problems = dict(self._problems)
        found = {"record": None, "replay": None, **running}
        return {"folder": str(self._folder), "bags": self._bags(), "problems": problems, **found}

    def record(self, topics: list[str]) -> str:
        """Record topics, or all, in a new bag; return its name. Raises RequestError."""
        from composer.bags.system_recording import new_folder

        for topic in topics:
            if not _PATTERN.fullmatch(topic):
                raise BadRequestError(f"'{topic:.80}' is not the name of a topic, or a pattern")
        path = new_folder(self._folder, "recording")
        patterns = [word for topic in topics for word in ("--topics", topic)]
        return self._start("record", path.name, ["record", "-o", str(path), *patterns])

    def replay(self, bag: str) -> str:
        """Publish a bag to the ROS graph. Raises RequestError for a bag that is not listed."""
        if bag not in {item["name"] for item in self._bags()}:
            raise RequestError("not_found", f"there is no bag '{bag:.200}' in {self._folder}")
        return self._start("replay", bag, ["replay", "--", str(self._folder / bag)])

    def stop(self, verb: str) -> str:
        """End the recording or the replay, and return what it has printed. Raises RequestError."""
        with self._lock:
            self._look()
            command = self._running.pop(verb, None)
        if command is None:
            raise RequestError("not_found", f"no {verb} is running")
        _end([command.process])
        return command.text().rpartition("\n")[2] or f"the {verb} had not begun"

    def close(self) -> None:
        """End what is running."""
        with self._lock:
            _end([command.process for command in self._running.values()])
            self._running.clear()

    def _start(self, verb: str, bag: str, words: list[str]) -> str:
        with self._lock:
            self._look()
            if verb in self._running:
                raise RequestError("busy", f"a {verb} is running: '{self._running[verb].bag}'")
            self._problems.pop(verb, None)
            child = [sys.executable, "-P", "-m", "composer.launch.child", str(os.getpid())]
            try:
                output = TemporaryFile()  # noqa: SIM115 - closed with the command
                process = subprocess.Popen(  # noqa: S603
                    [*child, *words], stdin=subprocess.DEVNULL, stdout=output, stderr=output
                )
            except OSError as error:  # as of a full disk
                reason = error.strerror or str(error)
                raise RequestError("failed", f"cannot start 'compose {verb}': {reason}") from error
            self._running[verb] = _Command(bag, process, output, time.monotonic())
        return bag

    def _look(self) -> None:
        """Forget what has ended; keep why, if it failed."""
        for verb, command in list(self._running.items()):
            code = command.process.poll()
            if code is not None:
                del self._running[verb]
                if code != 0:
                    self._problems[verb] = command.text() or f"it ended with code {code}"

    def _bags(self) -> list[dict[str, Any]]:
        """Return facts about the bags: folders with MCAP or sqlite3 files; no links."""
        try:
            folders = [
                item for item in os.scandir(self._folder) if item.is_dir(follow_symlinks=False)
            ]
        except OSError:
            return []
        folders.sort(key=_changed_s, reverse=True)
        found = (self._facts(Path(item.path)) for item in folders[:_MOST_BAGS])
        return [facts for facts in found if facts is not None]

    def _facts(self, path: Path) -> dict[str, Any] | None:
        try:
            sizes = [
                item.stat().st_size
                for item in path.iterdir()
                if item.name.endswith((".mcap", ".db3", ".zstd"))
            ]
        except OSError:
            return None
        if not sizes:
            return None
        metadata = self._metadata_of(path)
        facts = {"name": path.name, "bytes": sum(sizes), "is_complete": metadata is not None}
        if metadata is None:
            return facts
        times = {"start_s": metadata.start_s, "duration_s": metadata.duration_s}
        return {**facts, **times, "messages": metadata.messages, "topics": len(metadata.types)}

    def _metadata_of(self, path: Path) -> Recorded | None:
        try:
            changed_ns = (path / "metadata.yaml").stat().st_mtime_ns
        except OSError:
            return None
        cached = self._metadata.get(path.name)
        if cached is None or cached[0] != changed_ns:
            cached = self._metadata[path.name] = changed_ns, read_metadata(path)
        return cached[1]


def _changed_s(folder: os.DirEntry[str]) -> float:
    try:
        return folder.stat(follow_symlinks=False).st_mtime
    except OSError:  # it has just been deleted
        return 0.0


def _end(processes: list[subprocess.Popen[bytes]]) -> None:
    """End commands by SIGTERM, after which they complete their bags; all within one limit.

    SIGINT makes Python print a traceback while it starts.
    """
    for process in processes:
        process.terminate()
    end_s = time.monotonic() + _ENDS_WITHIN_S
    for process in processes:
        try:
            process.wait(max(0.0, end_s - time.monotonic()))
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


#: Those of this process, which is one dashboard.
RECORDINGS = Recordings(FOLDER)


class BagsFeed(Feed):
    """The bags, every second."""

    def __init__(self, values: Values, _: Declared | None) -> None:
        del values
        self._last = ""

    def poll(self) -> Iterator[Update]:
        """Yield the list if something has changed."""
        text = to_json(RECORDINGS.state())
        if text != self._last:
            self._last = text
            yield Update(text)
