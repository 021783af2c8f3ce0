"""Reads MCAP files, whole or cut off."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from operator import attrgetter
from pathlib import Path
from typing import Any, BinaryIO

from mcap.exceptions import UnsupportedCompressionError
from mcap.reader import SeekingReader
from mcap.records import Attachment as AttachmentRecord
from mcap.records import Channel, Chunk, ChunkIndex, Message, Schema, Statistics
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.summary import Summary as McapSummary
from mcap.writer import MCAP0_MAGIC

from composer.bags import qos_yaml
from composer.bags.bag import (
    Attachment,
    BagError,
    BagMessage,
    BagTopic,
    Summary,
    full_type_name,
    joined,
    reading,
)
from composer.base.fast_dataclass import dataclass
from composer.base.regular_files import open_regular

#: A longer record is taken for damage.
_LONGEST_RECORD_BYTES = 2**30
#: A few kilobytes of zstd can stand for gigabytes. Writers make chunks of one to four megabytes.
_LARGEST_CHUNK_BYTES = 2**28
_COMPRESSIONS = ("", "zstd", "lz4")


class _TooLargeChunk(Exception):
    """A chunk that would take much memory; the text says how much."""


@dataclass(slots=True)
class _McapFile:
    """A file of a bag; ``problem`` says what is missing, as after the end of its writer."""

    path: Path
    summary: Summary
    has_index: bool = True
    problem: str = ""


class McapBag:
    """A bag of MCAP files."""

    def __init__(self, paths: Iterable[Path]) -> None:
        """Raise BagError if a file cannot be read at all."""
        files = [_open_mcap(path) for path in paths]
        self._files = sorted(files, key=lambda file: file.summary.start_ns)
        self.summary = joined([file.summary for file in self._files])
        self.files = [str(file.path) for file in self._files]
        self.warnings = [
            f"{file.path} is not complete ({file.problem}): it is read as far as possible"
            for file in self._files
            if file.problem
        ]

    def messages(self, topics: frozenset[str], start_ns: int, end_ns: int) -> Iterator[BagMessage]:
        """Yield the messages of these topics from ``start_ns`` to before ``end_ns``, in order.

        Raises BagError for a corrupt file.
        """
        for file in self._files:
            with reading(file.path), open_regular(file.path) as stream:
                if not file.has_index:
                    found = _scanned(stream, topics)
                    yield from (item for item in found if start_ns <= item.recorded_ns < end_ns)
                else:
                    yield from _indexed(stream, topics, start_ns, end_ns)

    def attachments(self) -> Iterator[Attachment]:
        """Yield the attached files. Raises BagError for a corrupt file."""
        file = self._files[0]
        with reading(file.path), open_regular(file.path) as stream:
            for record in _records(stream):
                if isinstance(record, AttachmentRecord):
                    yield Attachment(record.name, record.media_type, record.data)
                elif isinstance(record, Chunk):
                    return  # attachments come first


def _open_mcap(path: Path) -> _McapFile:
    with reading(path), open_regular(path) as stream:
        start = stream.read(len(MCAP0_MAGIC))
        if start != MCAP0_MAGIC:
            raise BagError(f"{path} is {'not an MCAP file' if start else 'empty'}")
        problem = ""  # an index is optional
        stream.seek(0)
        try:
            found = SeekingReader(stream, record_size_limit=_LONGEST_RECORD_BYTES).get_summary()
            if found is not None and found.statistics is not None:
                _check_chunks(found.chunk_indexes)
                return _McapFile(path, _summary(found, found.statistics))
        except (UnsupportedCompressionError, _TooLargeChunk):
            raise
        except Exception:  # whatever the library raises for the wrong bytes
            problem = "its end is missing or damaged"
        stream.seek(0)
        return _McapFile(path, _scanned_summary(stream), has_index=False, problem=problem)


def _check_chunks(chunks: Iterable[Chunk | ChunkIndex]) -> None:
    """Raise UnsupportedCompressionError, or _TooLargeChunk.

    The library takes chunks with an unknown compression for uncompressed ones.
    """
    for chunk in chunks:
        if chunk.compression not in _COMPRESSIONS:
            raise UnsupportedCompressionError(chunk.compression)
        if chunk.uncompressed_size > _LARGEST_CHUNK_BYTES:
            size, most = chunk.uncompressed_size >> 20, _LARGEST_CHUNK_BYTES >> 20
            raise _TooLargeChunk(f"it has a chunk of {size:,} MB, more than {most} MB")


def _summary(found: McapSummary, statistics: Statistics) -> Summary:
    topics = {
        item.topic: _topic(item, found.schemas.get(item.schema_id))
        for item in found.channels.values()
    }
    counts = Counter[str]()
    for channel, count in statistics.channel_message_counts.items():
        counts[found.channels[channel].topic] += count
    return Summary(topics, counts, statistics.message_start_time, statistics.message_end_time)


def _topic(channel: Channel, schema: Schema | None) -> BagTopic:
    return BagTopic(
        channel.topic,
        "" if schema is None else full_type_name(schema.name),
        qos_yaml.from_text(channel.metadata.get("offered_qos_profiles", "")),
        "" if schema is None else schema.data.decode(errors="replace"),
        "" if schema is None else schema.encoding,
        channel.metadata.get("topic_type_hash", ""),
        channel.message_encoding,
    )


def _indexed(
    stream: BinaryIO, topics: frozenset[str], start_ns: int, end_ns: int
) -> Iterator[BagMessage]:
    reader = SeekingReader(stream, validate_crcs=True, record_size_limit=_LONGEST_RECORD_BYTES)
    found = reader.iter_messages(topics, starting_at=start_ns, ending_before=end_ns)
    for _, channel, message in found:
        yield BagMessage(channel.topic, message.log_time, message.publish_time, message.data)


def _records(stream: BinaryIO) -> Iterator[Any]:
    """Yield the records of a file, and its chunks as such."""
    reader = StreamReader(stream, emit_chunks=True, record_size_limit=_LONGEST_RECORD_BYTES)
    return reader.records


def _batches(stream: BinaryIO) -> Iterator[list[Any]]:
    """Yield the records of a file without index, chunk by chunk, up to where it is damaged."""
    records = _records(stream)
    while True:
        try:
            record = next(records, None)
            if record is None:
                return
            batch = [record]
            if isinstance(record, Chunk):
                _check_chunks([record])
                batch = breakup_chunk(record, validate_crc=True)
        except (UnsupportedCompressionError, _TooLargeChunk):
            raise
        except Exception:  # whatever the library raises for the wrong bytes
            return
        yield batch


def _scanned(stream: BinaryIO, topics: frozenset[str]) -> Iterator[BagMessage]:
    channels: dict[int, str] = {}
    for batch in _batches(stream):
        channels |= {item.id: item.topic for item in batch if isinstance(item, Channel)}
        messages = [item for item in batch if isinstance(item, Message)]
        for item in sorted(messages, key=attrgetter("log_time")):
            topic = channels.get(item.channel_id)
            if topic is not None and topic in topics:
                yield BagMessage(topic, item.log_time, item.publish_time, item.data)


def _scanned_summary(stream: BinaryIO) -> Summary:
    channels: dict[int, Channel] = {}
    schemas: dict[int, Schema] = {}
    counts = Counter[str]()
    times: list[int] = []
    for batch in _batches(stream):
        for item in batch:
            if isinstance(item, Schema):
                schemas[item.id] = item
            elif isinstance(item, Channel):
                channels[item.id] = item
            elif isinstance(item, Message) and item.channel_id in channels:
                counts[channels[item.channel_id].topic] += 1
                times = [min([item.log_time, *times[:1]]), max([item.log_time, *times[1:]])]
    topics = {item.topic: _topic(item, schemas.get(item.schema_id)) for item in channels.values()}
    return Summary(topics, counts, *(times or (0, 0)))
