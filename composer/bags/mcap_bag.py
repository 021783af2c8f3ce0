"""Reads MCAP files, whole or cut off."""

from __future__ import annotations

from collections import Counter
from collections.abc import Container, Iterable, Iterator, Mapping
from dataclasses import replace
from heapq import heappop, heappush
from operator import attrgetter
from pathlib import Path
from typing import Any, BinaryIO

import zstandard
from lz4.frame import LZ4FrameDecompressor
from mcap.exceptions import McapError, UnsupportedCompressionError
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
from composer.base.files import open_regular

#: A longer record is taken for damage.
_LONGEST_RECORD_BYTES = 2**30
#: A few kilobytes of zstd can stand for gigabytes. Writers make chunks of one to four megabytes.
_LARGEST_CHUNK_BYTES = 2**28
#: Chunks that overlap in time are in memory together.
_LARGEST_OVERLAP_BYTES = 2**30
_COMPRESSIONS = ("", "zstd", "lz4")
_TIME = attrgetter("recorded_ns")


class _TooLarge(Exception):
    """Something that would take much memory; the text says how much."""


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
                    inside = (item for item in found if start_ns <= item.recorded_ns < end_ns)
                    yield from inside if file.problem else sorted(inside, key=_TIME)
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
            found = _reader(stream).get_summary()
            if found is not None and found.statistics is not None:
                for chunk in found.chunk_indexes:
                    _check_chunk(chunk)
                has_index = bool(found.chunk_indexes)
                return _McapFile(path, _summary(found, found.statistics), has_index)
        except (UnsupportedCompressionError, _TooLarge):
            raise
        except Exception:  # whatever the library raises for the wrong bytes
            problem = "its end is missing or damaged"
        stream.seek(0)
        return _McapFile(path, _scanned_summary(stream), has_index=False, problem=problem)


def _check_chunk(chunk: Chunk | ChunkIndex) -> None:
    """Raise UnsupportedCompressionError, or _TooLarge.

    The library takes chunks with an unknown compression for uncompressed ones.
    """
    if chunk.compression not in _COMPRESSIONS:
        raise UnsupportedCompressionError(chunk.compression)
    if chunk.uncompressed_size > _LARGEST_CHUNK_BYTES:
        size, most = chunk.uncompressed_size >> 20, _LARGEST_CHUNK_BYTES >> 20
        raise _TooLarge(f"it has a chunk of {size:,} MB, more than {most} MB")


def _records_in(chunk: Chunk) -> list[Any]:
    """Return the records of a chunk, whose data may decompress to more than it declares.

    The library decompresses all of the data.
    """
    _check_chunk(chunk)
    data, size = chunk.data, chunk.uncompressed_size
    if chunk.compression == "zstd":
        with zstandard.ZstdDecompressor().stream_reader(data) as source:
            data = source.read(size + 1)
    elif chunk.compression == "lz4":
        data = LZ4FrameDecompressor().decompress(data, size + 1)
    if len(data) != size:
        raise McapError(f"a chunk has {len(data):,} bytes or more, not {size:,}")
    return breakup_chunk(replace(chunk, compression="", data=data), validate_crc=True)


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
    found = _reader(stream).get_summary()
    channels = {} if found is None else found.channels
    names = {item.id: item.topic for item in channels.values() if item.topic in topics}
    waiting: list[tuple[int, int, int, Message]] = []  # by time, and place in the file
    size = 0
    for index in _chunks(found, names, start_ns, end_ns):
        while waiting and waiting[0][0] < index.message_start_time:
            message = heappop(waiting)[-1]
            size -= len(message.data)
            yield _message(names, message)
        stream.seek(index.chunk_start_offset)
        chunk = next(_records(stream, skip_magic=True))
        if not isinstance(chunk, Chunk):
            raise McapError("its index names a chunk where there is none")
        for place, item in enumerate(_records_in(chunk)):
            if not isinstance(item, Message) or item.channel_id not in names:
                continue
            if start_ns <= item.log_time < end_ns:
                heappush(waiting, (item.log_time, index.chunk_start_offset, place, item))
                size += len(item.data)
        if size > _LARGEST_OVERLAP_BYTES:
            raise _TooLarge(f"more than {_LARGEST_OVERLAP_BYTES >> 20:,} MB of it overlap in time")
    yield from (_message(names, heappop(waiting)[-1]) for _ in range(len(waiting)))


def _chunks(
    summary: McapSummary | None, channels: Container[int], start_ns: int, end_ns: int
) -> list[ChunkIndex]:
    """Return the chunks with messages of these channels and times, each once, in order."""
    wanted: dict[int, ChunkIndex] = {}
    for index in () if summary is None else summary.chunk_indexes:
        has_times = index.message_start_time < end_ns and index.message_end_time >= start_ns
        inside = index.message_index_offsets  # by channel; an index may leave them out
        if has_times and (not inside or any(channel in channels for channel in inside)):
            wanted[index.chunk_start_offset] = index
    return sorted(wanted.values(), key=attrgetter("message_start_time", "chunk_start_offset"))


def _message(names: Mapping[int, str], item: Message) -> BagMessage:
    return BagMessage(names[item.channel_id], item.log_time, item.publish_time, item.data)


def _reader(stream: BinaryIO) -> SeekingReader:
    return SeekingReader(stream, record_size_limit=_LONGEST_RECORD_BYTES)


def _records(stream: BinaryIO, *, skip_magic: bool = False) -> Iterator[Any]:
    """Yield the records of a file, and its chunks as such."""
    reader = StreamReader(
        stream, skip_magic, emit_chunks=True, record_size_limit=_LONGEST_RECORD_BYTES
    )
    return reader.records


def _batches(stream: BinaryIO) -> Iterator[list[Any]]:
    """Yield the records of a file without index, chunk by chunk, up to where it is damaged."""
    records = _records(stream)
    while True:
        try:
            record = next(records, None)
            if record is None:
                return
            batch = _records_in(record) if isinstance(record, Chunk) else [record]
        except (UnsupportedCompressionError, _TooLarge):
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
