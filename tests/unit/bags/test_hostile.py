"""Bags that stand for much more than their size, wrong indexes, and the limit of a recorder."""

from __future__ import annotations

import os
import resource
import tracemalloc
from pathlib import Path

import pytest

pytest.importorskip("mcap")

import zstandard
from mcap.writer import CompressionType, Writer

from composer.bags.bag import BagError, BagMessage, BagTopic
from composer.bags.reader import open_bag
from composer.bags.recorder import Ring
from tests.unit.bags.test_form import read

#: Bytes of the message in a file of a few kilobytes, and what reading it may take.
LARGE, MOST = 200_000_000, 100_000_000


def write(path: Path, compression: CompressionType, size: int, count: int = 1) -> None:
    """Write messages of zeros, each in a chunk of its own."""
    with path.open("wb") as stream:
        writer = Writer(stream, compression=compression, chunk_size=1)
        writer.start("ros2")
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
        channel = writer.register_channel("/chat", "cdr", schema)
        for number in range(count):
            writer.add_message(channel, number, bytes(size), number)
        writer.finish()


def declare_size(path: Path, compression: CompressionType, size: int, *, indexed: bool) -> None:
    """Change the sizes that the last chunk and the index declare, or cut off the index."""
    name = compression.name.lower().encode()
    content = bytearray(path.read_bytes())
    starts = content.index(len(name).to_bytes(4, "little") + name)
    content[starts - 12 : starts - 4] = size.to_bytes(8, "little")
    at = content.rindex(name) + len(name) + 8
    content[at : at + 8] = size.to_bytes(8, "little")
    path.write_bytes(content if indexed else content[: at - 60])


@pytest.mark.parametrize("compression", [CompressionType.ZSTD, CompressionType.LZ4])
@pytest.mark.parametrize("indexed", [True, False])
def test_a_chunk_that_is_larger_than_it_says(
    tmp_path: Path, compression: CompressionType, indexed: bool
) -> None:
    path = tmp_path / "bag.mcap"
    write(path, compression, LARGE)
    declare_size(path, compression, 1000, indexed=indexed)
    before = resource.getrlimit(resource.RLIMIT_AS)
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + MOST, before[1]))
    try:
        if indexed:
            with pytest.raises(BagError, match="a chunk has 1,001 bytes or more, not 1,000"):
                read(open_bag(path))
        else:
            bag = open_bag(path)
            assert (read(bag), len(bag.warnings)) == ([], 1)
    finally:
        resource.setrlimit(resource.RLIMIT_AS, before)


def test_chunks_that_the_index_names_twice_are_read_once(tmp_path: Path) -> None:
    path = tmp_path / "bag.mcap"
    write(path, CompressionType.ZSTD, 10, count=3)
    bag = open_bag(path)
    expected = read(bag)
    assert [item.recorded_ns for item in expected] == [0, 1, 2]
    content = path.read_bytes()
    indexes = [at for at in range(len(content)) if content.startswith(b"\x08\x4e\0\0", at)]
    first, second = indexes[:2]
    length = second - first
    path.write_bytes(
        content[:second] + content[first : first + length] + content[second + length :]
    )
    assert [item.recorded_ns for item in read(open_bag(path))] == [0, 2]


def test_a_file_that_fills_the_disk(tmp_path: Path) -> None:
    path = tmp_path / "bag.db3.zstd"
    path.write_bytes(zstandard.compress(bytes(LARGE)))
    with pytest.raises(BagError, match="contains more than 1,000 times its size"):
        open_bag(path)


@pytest.mark.parametrize("name", ["bag", "bag.mcap", "bag.db3.zstd"])
def test_a_pipe_is_not_read(tmp_path: Path, name: str) -> None:
    os.mkfifo(tmp_path / name)
    with pytest.raises(BagError, match="is neither a file nor a folder"):
        open_bag(tmp_path / name)


@pytest.mark.parametrize("size", [1, 10_000])
def test_a_flight_recorder_whose_clock_is_set_back(
    monkeypatch: pytest.MonkeyPatch, size: int
) -> None:
    """No message is old then, and small messages take more memory than their bytes."""
    monkeypatch.setattr("composer.bags.recorder.LARGEST_BYTES", 1_000_000)
    ring = Ring(seconds=10.0)
    ring.add_topic(BagTopic("/chat", "std_msgs/msg/String"))
    tracemalloc.start()
    try:
        for number in range(20_000):
            ring.write(BagMessage("/chat", 10**18 - number, 10**18 - number, bytes(size)))
        used_bytes, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert used_bytes < 1_500_000
