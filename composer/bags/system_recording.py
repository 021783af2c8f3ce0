"""Records what the nodes of a system publish in this process, from inside."""

from __future__ import annotations

import json
import platform
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from time import strftime

from composer import version
from composer.bags.bag import Attachment, BagError, BagTopic
from composer.bags.definitions import full_definition
from composer.bags.recorder import Recorder, Ring, Source
from composer.bags.writer import BagWriter, split_limits
from composer.interfaces import Interfaces
from composer.model import System
from composer.model.qos import QosProfile
from composer.model.system import Recording
from composer.runtime.clock import Clock
from composer.runtime.supervision.events import Event, NodeFailed

#: The attachment with facts, and the time at which the process of the system began to start.
FACTS, STARTED = "recording.json", "started_ns"
#: One fault often leads to others.
_AFTER_FAULT_S = 0.5


def attachments(system: System | None, **facts: object) -> tuple[Attachment, ...]:
    """Return what explains a bag: the files of the system, the versions it ran with, and facts."""
    facts |= {"composer": version(), "python": platform.python_version()}
    if system is None:
        return (Attachment(FACTS, "application/json", json.dumps(facts).encode()),)
    facts["system"] = system.name.value
    files = {node.span.file for node in system.nodes} | {system.source}
    return (
        Attachment(FACTS, "application/json", json.dumps(facts).encode()),
        *(
            Attachment(file.path, "application/yaml", file.text.encode())
            for file in sorted(files, key=lambda file: file.path)
        ),
    )


def new_folder(folder: Path, name: str) -> Path:
    """Return the path of a new bag, with the time in its name."""
    first = folder / f"{name.strip('/').replace('/', '-')}-{strftime('%Y%m%d-%H%M%S')}"
    path, number = first, 1
    while path.exists():
        number += 1
        path = first.with_name(f"{first.name}-{number}")
    return path


class SystemRecording:
    """Records a run of a system: all of it, or with ``ring_s`` the seconds before a fault.

    It is the ``recording`` of the options of a host.
    """

    def __init__(
        self,
        system: System,
        recording: Recording,
        clock: Clock,
        say: Callable[[str], None],
        bag: Path | None = None,
    ) -> None:
        """``say`` receives what users have to know.

        ``bag`` is the folder of the new bag; by default, its name has the time. Raises BagError if
        the bag cannot be made.
        """
        self._system = system
        self._settings = recording
        self._folder = Path(recording.folder)
        self._bag = bag
        self._say = say
        self._interfaces = Interfaces.installed()
        self._profiles: dict[str, dict[QosProfile, None]] = {}  # of all publishers of a topic
        self._faults: list[str] = []
        self._ring: Ring | None = None
        self._writer: BagWriter | None = None
        if recording.ring_s is None:
            self._writer = self._new_writer(**{STARTED: clock.time_ns()})
            self._recorder = Recorder(
                self._writer,
                clock,
                lambda problem: say(f"warning: nothing more is recorded: {problem}"),
            )
        else:
            self._ring = Ring(recording.ring_s)
            self._recorder = Recorder(self._ring, clock)
            self._prepare_folder()

    @contextmanager
    def running(self) -> Iterator[None]:
        """Record during a ``with`` block; say at the end what was recorded.

        A run that does not start leaves no bag.
        """
        recorder, writer = self._recorder, self._writer
        try:
            with recorder:
                yield
        except BaseException:
            if writer is not None and not writer.count:
                writer.discard()
            raise
        if recorder.problem is not None:
            self._say(f"the recording is not complete: {recorder.problem}")
        dropped = f", {recorder.dropped} dropped" if recorder.dropped else ""
        if writer is not None:
            self._say(f"recorded {writer.count} messages{dropped}: {writer.folder}")
        elif dropped:
            self._say(f"the flight recorder has lost messages: {recorder.dropped}")

    def tap(self, topic: str, type_name: str, profile: QosProfile) -> Source | None:
        """Return what receives the messages of a topic; None if it is not recorded."""
        if not self._settings.includes(topic):
            return None
        profiles = self._profiles.setdefault(topic, {})
        profiles[profile] = None
        definition = full_definition(type_name, self._interfaces)
        return self._recorder.source(BagTopic(topic, type_name, tuple(profiles), definition))

    def save(self, done: Callable[[bool, str], None]) -> None:
        """Write the last seconds; ``done`` receives whether that succeeded, and the folder or why.

        It is called on another thread.
        """
        self._recorder.call_later(0.0, lambda: done(*self._save("requested")))

    def on_event(self, event: Event) -> None:
        """Write the last seconds soon if a node has failed; once for faults that come together."""
        if self._ring is None or not isinstance(event, NodeFailed):
            return
        if not self._faults:
            self._recorder.call_later(_AFTER_FAULT_S, self._save_faults)
        self._faults.append(str(event))

    def _save_faults(self) -> None:
        faults, self._faults = self._faults, []
        success, text = self._save("\n".join(faults))
        self._say(f"recorded the last seconds: {text}" if success else f"cannot record: {text}")

    def _save(self, reason: str) -> tuple[bool, str]:
        if self._ring is None:
            return False, "it records all the time: its 'recording' has no 'ring_s'"
        try:
            writer = self._new_writer(reason=reason)
            self._ring.save(writer)
            writer.close()
        except BagError as error:
            return False, str(error)
        return True, str(writer.folder)

    def _new_writer(self, **facts: object) -> BagWriter:
        limits = split_limits(self._settings.split_mb, self._settings.split_s)
        path = self._bag or new_folder(self._folder, self._system.name.value)
        return BagWriter(path, limits, attachments(self._system, **facts))

    def _prepare_folder(self) -> None:
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            probe = self._folder / ".writable"
            probe.touch()
            probe.unlink()
        except OSError as error:
            raise BagError(f"cannot write to {self._folder}: {error.strerror}") from error
