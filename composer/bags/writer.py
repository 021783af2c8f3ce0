"""Writes bags: a folder of MCAP files with rosbag2's ``metadata.yaml``."""

from __future__ import annotations

import shutil
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from math import inf
from pathlib import Path
from typing import Any, BinaryIO

import yaml
from mcap.writer import Writer

from composer.bags import qos_yaml
from composer.bags.bag import NANOSECONDS, Attachment, BagError, BagMessage, BagTopic
from composer.base.fast_dataclass import dataclass

_BYTES_PER_MB = 1_000_000
#: Of rosbag2 in Jazzy.
_METADATA_VERSION = 9
_ROS_DISTRO = "jazzy"
#: The extension of libyaml is not everywhere.
_DUMPER = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
#: A process that is killed loses what it has written since the last flush.
_FLUSH_S = 1.0


@dataclass(frozen=True, slots=True)
class SplitLimits:
    """When a new file of the bag begins: before a file is larger or longer than this."""

    size_bytes: float = inf
    duration_s: float = inf


def split_limits(megabytes: float | None, seconds: float | None) -> SplitLimits:
    """Return the limits; None for unlimited."""
    return SplitLimits(
        inf if megabytes is None else megabytes * _BYTES_PER_MB, inf if seconds is None else seconds
    )


@dataclass(slots=True)
class _File:
    """One MCAP file of a bag."""

    path: Path
    stream: BinaryIO
    writer: Writer
    channels: dict[str, int]
    start_ns: int = 0
    end_ns: int = 0
    count: int = 0


class BagWriter:
    """Writes one bag. Not for use by several threads at once.

    What it has written can be read without :meth:`close`, except for the last second: its chunks
    are complete.
    """

    def __init__(
        self,
        folder: Path,
        limits: SplitLimits = SplitLimits(),  # noqa: B008 - immutable
        attachments: Sequence[Attachment] = (),
    ) -> None:
        """Create the folder, which must not exist. Raises BagError."""
        self.folder = folder
        self._limits = limits
        self._attachments = attachments
        self._topics: dict[str, BagTopic] = {}
        self._counts: Counter[str] = Counter()
        self._files: list[_File] = []
        self._closed_bytes = 0
        self._flushed_at_s = time.monotonic()
        try:
            folder.mkdir(parents=True)
        except FileExistsError as error:
            raise BagError(f"{folder} exists already", "name a new folder") from error
        except OSError as error:
            raise BagError(f"cannot create {folder}: {error.strerror}") from error
        try:
            self._open_file()
        except BagError:
            with suppress(OSError):
                folder.rmdir()
            raise

    @property
    def size_bytes(self) -> int:
        """What has been written, without the current chunk."""
        current = self._files[-1].stream
        return self._closed_bytes + (0 if current.closed else current.tell())

    @property
    def count(self) -> int:
        """The number of messages."""
        return self._counts.total()

    def add_topic(self, topic: BagTopic) -> None:
        """Declare a topic; again to replace its QoS profiles in ``metadata.yaml``."""
        self._topics[topic.name] = topic

    def write(self, message: BagMessage) -> None:
        """Write a message of a declared topic. Raises BagError."""
        with self._errors():
            file = self._files[-1]
            if file.count and self._is_full(file, message.recorded_ns):
                self._finish(file)
                file = self._open_file()
            channel = file.channels.get(message.topic)
            if channel is None:
                channel = self._add_channel(file, self._topics[message.topic])
            file.writer.add_message(
                channel, message.recorded_ns, message.data, message.published_ns
            )
            if not file.count:
                file.start_ns = message.recorded_ns
            file.start_ns = min(file.start_ns, message.recorded_ns)
            file.end_ns = max(file.end_ns, message.recorded_ns)
            file.count += 1
            self._counts[message.topic] += 1
            self.flush_if_due()

    def flush_if_due(self) -> None:
        """Complete the current chunk, once per second. Raises BagError."""
        now_s = time.monotonic()
        if now_s >= self._flushed_at_s + _FLUSH_S:
            self._flushed_at_s = now_s
            with self._errors():
                self._files[-1].writer.flush()

    def close(self) -> None:
        """Complete the bag. Raises BagError; what was written before can still be read."""
        file = self._files[-1]
        if not file.stream.closed:
            with self._errors():
                self._finish(file)

    def discard(self) -> None:
        """Delete the bag, after :meth:`close`."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def _is_full(self, file: _File, recorded_ns: int) -> bool:
        duration_s = (recorded_ns - file.start_ns) / NANOSECONDS
        return (
            duration_s >= self._limits.duration_s or file.stream.tell() >= self._limits.size_bytes
        )

    def _open_file(self) -> _File:
        path = self.folder / f"{self.folder.name}_{len(self._files)}.mcap"
        with self._errors():
            stream = path.open("xb")
            writer = Writer(stream)
            try:
                self._start(writer)
            except OSError:
                with suppress(OSError):  # of what is still to be written
                    stream.close()
                path.unlink(missing_ok=True)
                raise
        file = _File(path, stream, writer, {})
        self._files.append(file)
        return file

    def _start(self, writer: Writer) -> None:
        writer.start(profile="ros2", library="ros2-composer")
        for item in self._attachments:
            now_ns = time.time_ns()
            writer.add_attachment(now_ns, now_ns, *item)
        writer.flush()

    def _add_channel(self, file: _File, topic: BagTopic) -> int:
        schema = file.writer.register_schema(
            topic.type_name, topic.encoding, topic.definition.encode()
        )
        metadata = {"offered_qos_profiles": qos_yaml.to_text(topic.qos)}
        if topic.type_hash:
            metadata["topic_type_hash"] = topic.type_hash
        channel = file.writer.register_channel(topic.name, topic.message_encoding, schema, metadata)
        file.channels[topic.name] = channel
        return channel

    def _finish(self, file: _File) -> None:
        file.writer.finish()
        file.stream.flush()
        self._closed_bytes += file.stream.tell()
        file.stream.close()
        self._write_metadata()

    def _write_metadata(self) -> None:
        path = self.folder / "metadata.yaml"
        new = path.with_suffix(".new")
        content = {"rosbag2_bagfile_information": self._metadata()}
        new.write_text(yaml.dump(content, Dumper=_DUMPER, sort_keys=False), encoding="utf-8")
        new.replace(path)

    def _metadata(self) -> Mapping[str, Any]:
        with_messages = [file for file in self._files if file.count]
        start_ns = min((file.start_ns for file in with_messages), default=0)
        end_ns = max((file.end_ns for file in with_messages), default=0)
        topics = [
            {
                "topic_metadata": {
                    "name": topic.name,
                    "type": topic.type_name,
                    "serialization_format": topic.message_encoding,
                    "offered_qos_profiles": [qos_yaml.to_plain(profile) for profile in topic.qos],
                    "type_description_hash": topic.type_hash,
                },
                "message_count": self._counts[topic.name],
            }
            for topic in self._topics.values()
        ]
        return {
            "version": _METADATA_VERSION,
            "storage_identifier": "mcap",
            "duration": {"nanoseconds": end_ns - start_ns},
            "starting_time": {"nanoseconds_since_epoch": start_ns},
            "message_count": self.count,
            "topics_with_message_count": topics,
            "compression_format": "",
            "compression_mode": "",
            "relative_file_paths": [file.path.name for file in self._files],
            "files": [
                {
                    "path": file.path.name,
                    "starting_time": {"nanoseconds_since_epoch": file.start_ns},
                    "duration": {"nanoseconds": file.end_ns - file.start_ns},
                    "message_count": file.count,
                }
                for file in self._files
            ],
            "custom_data": {},
            "ros_distro": _ROS_DISTRO,
        }

    @contextmanager
    def _errors(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            for file in self._files[-1:]:
                with suppress(OSError):
                    file.stream.close()
            raise BagError(f"cannot write {self.folder}: {error.strerror}") from error
