"""Bags that are damaged or unfinished: what is left is read, and what is wrong is named."""

from __future__ import annotations

import os
import resource
import sqlite3
import subprocess
import sys
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest

pytest.importorskip("mcap")
pytest.importorskip("rosbags")

from composer.bags.bag import BagError
from composer.bags.editing import Selection, write_bag
from composer.bags.reader import open_bag
from composer.bags.writer import BagWriter, SplitLimits
from tests.unit.bags.test_form import read, write
from tests.unit.support.waiting import wait_until

_ENDLESS = """
import sys, time
from pathlib import Path
from composer.bags.bag import BagMessage, BagTopic
from composer.bags.writer import BagWriter
writer = BagWriter(Path(sys.argv[1]))
writer.add_topic(BagTopic("/chat", "std_msgs/msg/String"))
number = 0
while True:
    number += 1
    writer.write(BagMessage("/chat", number, number, b"0123456789"))
    time.sleep(0.001)  # a second of it fits into one chunk
"""


def test_what_a_killed_process_has_written_can_be_read(tmp_path: Path) -> None:
    folder = tmp_path / "bag"
    with subprocess.Popen([sys.executable, "-c", _ENDLESS, str(folder)]) as process:
        try:
            wait_until(
                lambda: sum(path.stat().st_size for path in folder.glob("*.mcap")) > 2000,
                "the first chunk, after a second",
            )
        finally:
            process.kill()
    bag = open_bag(folder)
    numbers = [item.recorded_ns for item in read(bag)]
    assert len(numbers) > 10
    assert numbers == list(range(1, len(numbers) + 1))
    assert "is not complete (its end is missing or damaged)" in bag.warnings[0]


@pytest.mark.parametrize("share", [0.3, 0.6, 0.9, 0.999])
def test_a_truncated_file_is_read_up_to_there(tmp_path: Path, share: float) -> None:
    messages = write(tmp_path / "bag", count=5000, padding=os.urandom(1000))
    [path] = (tmp_path / "bag").glob("*.mcap")
    content = path.read_bytes()
    path.write_bytes(content[: int(len(content) * share)])
    bag = open_bag(path)
    found = read(bag)
    assert found == messages[: len(found)]
    assert len(found) == pytest.approx(5000 * share, abs=1100)
    assert bag.warnings
    assert [item.name for item in bag.attachments()] == ["system.yaml"]


def _damage_chunk(path: Path) -> None:
    content = bytearray(path.read_bytes())
    data = content.index(b"zstd") + 100
    content[data : data + 20] = b"x" * 20
    path.write_bytes(content)


def _with_a_chunk_of_4_gb(path: Path) -> None:
    """Change the size in the index, which ends with the compression and two sizes."""
    content = bytearray(path.read_bytes())
    end = content.rindex(b"zstd") + len(b"zstd") + 8
    content[end : end + 8] = (2**32).to_bytes(8, "little")
    path.write_bytes(content)


def _with_a_chunk_of_4_gb_and_no_index(path: Path) -> None:
    content = bytearray(path.read_bytes())
    name = content.index(b"\x04\0\0\0zstd")
    content[name - 12 : name - 4] = (2**32).to_bytes(8, "little")
    path.write_bytes(content[: -len(content) // 4])


@pytest.mark.parametrize(
    ("damage", "text"),
    [
        (_damage_chunk, "is corrupt or not supported"),
        (
            lambda path: path.write_bytes(path.read_bytes().replace(b"zstd", b"zzzz")),
            "is corrupt or not supported: .*zzzz",
        ),
        (_with_a_chunk_of_4_gb, "is corrupt or not supported: it has a chunk of 4,096 MB"),
        (_with_a_chunk_of_4_gb_and_no_index, "it has a chunk of 4,096 MB, more than 256 MB"),
        (lambda path: path.write_text("system: demo"), "is not an MCAP file"),
        (lambda path: path.write_bytes(b""), "is empty"),
        (Path.unlink, "is not a bag: it has neither"),
    ],
)
def test_damage_is_named(tmp_path: Path, damage: Callable[[Path], object], text: str) -> None:
    write(tmp_path / "bag", count=1000)
    [path] = (tmp_path / "bag").glob("*.mcap")
    damage(path)
    with pytest.raises(BagError, match=text):
        read(open_bag(tmp_path / "bag"))


def test_new_bags_are_made_of_all_or_not_at_all(tmp_path: Path) -> None:
    write(tmp_path / "bag", count=1000)
    [path] = (tmp_path / "bag").glob("*.mcap")
    BagWriter(tmp_path / "empty").close()
    bags = [open_bag(tmp_path / name) for name in ("empty", "bag", "empty")]
    joined = write_bag(bags, Selection(), tmp_path / "joined", SplitLimits())
    assert joined.count == 1000
    with pytest.raises(BagError, match="no topic of the bags matches"):
        write_bag(bags, Selection(lambda _: False), tmp_path / "none", SplitLimits())
    damaged = open_bag(tmp_path / "bag")
    _damage_chunk(path)
    with pytest.raises(BagError, match="is corrupt"):
        write_bag([damaged], Selection(), tmp_path / "new", SplitLimits())
    assert {item.name for item in tmp_path.iterdir()} == {"bag", "empty", "joined"}


def test_damaged_databases_are_named(tmp_path: Path) -> None:
    with pytest.raises(BagError, match="there is no bag"):
        open_bag(tmp_path / "missing")
    path = tmp_path / "bag.db3"
    path.write_bytes(b"no database" * 100)
    with pytest.raises(BagError, match="is corrupt or not supported"):
        read(open_bag(path))
    with closing(sqlite3.connect(tmp_path / "empty.db3")) as database:
        database.execute("create table other (id integer)")
    with pytest.raises(BagError, match="is corrupt or not supported"):
        read(open_bag(tmp_path / "empty.db3"))


def test_nothing_is_overwritten_and_a_full_disk_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # A module that is first imported while the disk is full would leave half a bytecode file.
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    write(tmp_path / "bag")
    with pytest.raises(BagError, match="exists already"):
        BagWriter(tmp_path / "bag")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    for size in (10, 100_000):  # the disk is full from the beginning, or later
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
        try:
            with pytest.raises(BagError, match=r"cannot write .*File too large"):
                write(tmp_path / f"full{size}", 20_000, padding=bytes(range(256)) * 4)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert not (tmp_path / "full10").exists()
    assert len(read(open_bag(tmp_path / "full100000"))) > 1000
