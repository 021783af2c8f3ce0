"""External processes that subscribe or publish to two topics, and what they have missed."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from tests.ros.support.sequences import Sequences

PEER = "tests.ros.programs.delivery_peer"
ROOT = Path(__file__).parents[3]
#: A topic with in-process delivery, and one by DDS only.
STREAM, CONTROL = TOPICS = ("/stream", "/control")

_SOON_MISSED = """<builtin>
          <discovery_config>
            <leaseDuration><sec>3</sec></leaseDuration>
            <leaseAnnouncement><sec>0</sec><nanosec>300000000</nanosec></leaseAnnouncement>
          </discovery_config>"""


def soon_missed(folder: Path) -> dict[str, str]:
    """Return variables of a process that others miss after 3 s instead of 20 s.

    This matters if it is killed, or if its goodbye message, which is sent once, is lost.
    """
    profile_of_tests = Path(os.environ["FASTRTPS_DEFAULT_PROFILES_FILE"])
    profiles = folder / "external.xml"
    text = profile_of_tests.read_text(encoding="utf-8").replace("<builtin>", _SOON_MISSED)
    profiles.write_text(text, encoding="utf-8")
    return {"FASTRTPS_DEFAULT_PROFILES_FILE": str(profiles)}


class ExternalProcess:
    """Another process that listens or talks; its output is read continuously.

    ``profile`` is reliability and depth; ``writer`` is who it talks as.
    """

    def __init__(self, what: str, profile: tuple[str, int], writer: int, folder: Path) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", PEER, what, *map(str, (*profile, writer, *TOPICS))],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env={
                **os.environ,
                "PYTHONPATH": f"{ROOT}:{os.environ.get('PYTHONPATH', '')}",
                **soon_missed(folder),
            },
        )
        self.received: dict[str, list[int]] = {topic: [] for topic in TOPICS}
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def __enter__(self) -> ExternalProcess:
        return self

    def __exit__(self, *_: object) -> None:
        self.go(killed=True)

    def has_received(self, count: int) -> bool:
        """Return whether ``number`` messages of each topic have arrived."""
        return all(len(numbers) >= count for numbers in self.received.values())

    def go(self, *, killed: bool) -> int:
        """Stop it, by SIGKILL or cleanly; return its exit code."""
        assert self._process.stdin is not None
        if killed:
            self._process.kill()
        else:
            self._process.stdin.close()
        code = self._process.wait(timeout=60.0)
        self._reader.join()
        return code

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            # Fast DDS prints errors to standard output, and a killed process stops mid-line.
            if line.startswith("{") and line.endswith("}\n"):
                for topic, numbers in json.loads(line).items():
                    self.received[topic] += numbers


class Missing:
    """How many messages were missing on the stream, and how many on the control."""

    def __init__(self) -> None:
        self.stream = 0
        self.control = 0

    def add_all(self, received: Mapping[str, Sequence[int]]) -> None:
        """Count missing messages between the first and the last one of each topic."""
        stream, control = (sequences_of(received[topic]) for topic in TOPICS)
        self.add_counted(stream.missing, control.missing)

    def add_counted(self, stream: Mapping[int, int], control: Mapping[int, int]) -> None:
        """Add up missing messages by writer."""
        self.stream += sum(stream.values())
        self.control += sum(control.values())


def sequences_of(numbers: Iterable[int]) -> Sequences:
    """Check all numbers: none may arrive twice or out of order."""
    sequences = Sequences()
    for item in numbers:
        sequences.take(item)
    assert sequences.disordered == []
    return sequences
