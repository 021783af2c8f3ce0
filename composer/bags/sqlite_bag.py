"""Reads the sqlite3 databases of rosbag2, by the library ``rosbags``."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rosbags.rosbag2 import Reader

from composer.bags import qos_yaml
from composer.bags.bag import Attachment, BagMessage, BagTopic, Summary, reading


class SqliteBag:
    """A bag of sqlite3 databases, read by the library ``rosbags``."""

    warnings = ()

    def __init__(self, path: Path, files: tuple[Path, ...]) -> None:
        """Raise BagError if the bag cannot be read."""
        self._path = path
        self.files = [str(file) for file in files]
        with self._reader() as reader:
            topics = [_sqlite_topic(item) for item in reader.connections]
            counts = Counter[str]()
            for item in reader.connections:
                counts[item.topic] += item.msgcount
            times = (reader.start_time, reader.end_time - 1) if reader.message_count else (0, 0)
            self.summary = Summary({item.name: item for item in topics}, counts, *times)

    def messages(self, topics: frozenset[str], start_ns: int, end_ns: int) -> Iterator[BagMessage]:
        """Yield the messages of these topics from ``start_ns`` to before ``end_ns``, in order.

        Raises BagError for a corrupt file.
        """
        with self._reader() as reader:
            chosen = [item for item in reader.connections if item.topic in topics]
            if not chosen:
                return
            for item, at_ns, data in reader.messages(chosen, start_ns, end_ns):
                yield BagMessage(item.topic, at_ns, at_ns, bytes(data))

    def attachments(self) -> Iterator[Attachment]:
        """Yield nothing: such bags have none."""
        return iter(())

    @contextmanager
    def _reader(self) -> Iterator[Any]:
        with reading(self._path), Reader(self._path) as reader:
            yield reader


def _sqlite_topic(connection: Any) -> BagTopic:
    profiles = [
        {
            name: {"sec": value.sec, "nsec": value.nsec}
            if hasattr(value, "nsec")
            else getattr(value, "value", value)
            for name, value in profile._asdict().items()
        }
        for profile in connection.ext.offered_qos_profiles
    ]
    encoding = {1: "ros2msg", 2: "ros2idl"}.get(connection.msgdef.format.value, "")
    return BagTopic(
        connection.topic,
        connection.msgtype,
        tuple(map(qos_yaml.from_plain, profiles)),
        connection.msgdef.data,
        encoding,
        connection.digest,
    )
