"""Reads the sqlite3 databases of rosbag2, by the library ``rosbags``."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import zstandard
from rosbags.rosbag2 import Reader

from composer.bags import qos_yaml
from composer.bags.bag import (
    Attachment,
    BagMessage,
    BagTopic,
    Summary,
    full_type_name,
    joined,
    reading,
)
from composer.base.files import read_regular

#: In metadata.yaml: that each message is compressed, of which the databases know nothing.
_COMPRESSED_MESSAGES = re.compile(
    rb"^[ \t]*compression_mode: *[\"']?message", re.IGNORECASE | re.MULTILINE
)
_LARGEST_METADATA_BYTES = 2**24
#: A few kilobytes of zstd can stand for gigabytes.
_LARGEST_MESSAGE_BYTES = 2**28


class SqliteBag:
    """A bag of sqlite3 databases, read by the library ``rosbags``.

    Each file is read on its own: for a folder, the library leaves out the messages of each topic
    whose QoS profiles or definition metadata.yaml writes in another way than the database, and
    parses metadata.yaml for minutes.
    """

    warnings = ()

    def __init__(self, path: Path, files: tuple[Path, ...]) -> None:
        """Raise BagError if the bag cannot be read."""
        self.files = [str(file) for file in files]
        self._is_compressed = _has_compressed_messages(path / "metadata.yaml")
        parts = [(_summary(file), file) for file in files]
        parts.sort(key=lambda part: part[0].start_ns)
        self._parts = [file for _, file in parts]
        self.summary = joined(summary for summary, _ in parts)

    def messages(self, topics: frozenset[str], start_ns: int, end_ns: int) -> Iterator[BagMessage]:
        """Yield the messages of these topics from ``start_ns`` to before ``end_ns``, in order.

        Raises BagError for a corrupt file.
        """
        for part in self._parts:
            with _reader(part) as reader:
                chosen = [item for item in reader.connections if item.topic in topics]
                found = reader.messages(chosen, start_ns, end_ns) if chosen else ()
                for item, at_ns, data in found:
                    content = _decompressed(data) if self._is_compressed else bytes(data)
                    yield BagMessage(item.topic, at_ns, at_ns, content)

    def attachments(self) -> Iterator[Attachment]:
        """Yield nothing: such bags have none."""
        return iter(())


def _has_compressed_messages(metadata: Path) -> bool:
    if not metadata.is_file():
        return False
    with reading(metadata):
        content = read_regular(metadata, _LARGEST_METADATA_BYTES)
    return _COMPRESSED_MESSAGES.search(content) is not None


def _decompressed(message: bytes) -> bytes:
    size = zstandard.frame_content_size(message)
    if not 0 <= size <= _LARGEST_MESSAGE_BYTES:
        raise ValueError("a compressed message is too large, or does not say how large it is")
    return zstandard.ZstdDecompressor().decompress(message)


@contextmanager
def _reader(path: Path) -> Iterator[Any]:
    with reading(path), Reader(path) as reader:
        yield reader


def _summary(path: Path) -> Summary:
    with _reader(path) as reader:
        topics = {item.topic: _sqlite_topic(item) for item in reader.connections}
        counts = Counter[str]()
        for item in reader.connections:
            counts[item.topic] += item.msgcount
        times = (reader.start_time, reader.end_time - 1) if reader.message_count else (0, 0)
        return Summary(topics, counts, *times)


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
        full_type_name(connection.msgtype),
        tuple(map(qos_yaml.from_plain, profiles)),
        connection.msgdef.data,
        encoding,
        connection.digest,
        connection.ext.serialization_format,
    )
