"""Bags as files: what we write, other libraries read; what is damaged is named."""

from __future__ import annotations

import os
import signal
import sqlite3
import subprocess
import sys
from collections.abc import Callable
from contextlib import closing
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import yaml

pytest.importorskip("mcap")
pytest.importorskip("rosbags")

import zstandard
from mcap.reader import make_reader
from mcap.writer import Writer
from rosbags.rosbag2 import Reader
from rosbags.rosbag2.enums import StoragePlugin
from rosbags.rosbag2.writer import Writer as RosbagsWriter
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from composer.bags import qos_yaml
from composer.bags.bag import Attachment, Bag, BagError, BagMessage, BagTopic
from composer.bags.definitions import full_definition
from composer.bags.editing import Selection, write_bag
from composer.bags.reader import open_bag
from composer.bags.writer import BagWriter, SplitLimits
from composer.cli.support.bags import bag_errors
from composer.interfaces import Interfaces
from composer.model.qos import PRESETS, Durability, History, Liveliness, QosProfile
from composer.runtime.process import watchdog

TYPES = (
    "std_msgs/msg/String",
    "nav_msgs/msg/Odometry",
    "sensor_msgs/msg/PointCloud2",
    "tf2_msgs/msg/TFMessage",
    "diagnostic_msgs/msg/DiagnosticArray",
    "geometry_msgs/msg/PoseWithCovarianceStamped",
)
ALL = (0, 2**62)
START_NS = 1_700_000_000_000_000_000


@cache
def store() -> Any:
    return get_typestore(Stores.ROS2_JAZZY)


def text(content: str) -> bytes:
    """Return a serialized std_msgs/String."""
    type_name = "std_msgs/msg/String"
    message = store().types[type_name](data=content)
    return bytes(store().serialize_cdr(message, type_name))


def write(
    folder: Path, count: int = 100, limits: SplitLimits | None = None, padding: bytes = b""
) -> list[BagMessage]:
    """Write a bag with one topic, a message each 10 ms, and return the messages."""
    type_name = "std_msgs/msg/String"
    times = [START_NS + number * 10_000_000 for number in range(count)]
    data = text("hello") + padding
    messages = [BagMessage("/chat", at, at, b"%s%d" % (data, at)) for at in times]
    attachment = Attachment("system.yaml", "application/yaml", b"system: demo\n")
    writer = BagWriter(folder, limits or SplitLimits(), (attachment,))
    definition = full_definition(type_name, Interfaces.load())
    writer.add_topic(BagTopic("/chat", type_name, (PRESETS["state"],), definition))
    for message in messages:
        writer.write(message)
    writer.close()
    return messages


def read(bag: Bag) -> list[BagMessage]:
    """Return all messages of a bag."""
    return list(bag.messages(frozenset(bag.summary.topics), *ALL))


@pytest.mark.parametrize(
    ("limits", "files"),
    [(SplitLimits(), 1), (SplitLimits(duration_s=0.05), 4), (SplitLimits(size_bytes=1), 20)],
)
def test_others_read_what_we_write(tmp_path: Path, limits: SplitLimits, files: int) -> None:
    folder = tmp_path / "bag"
    messages = write(folder, 20, limits)
    found = open_bag(folder)
    assert (len(found.files), found.warnings) == (files, [])
    assert read(found) == messages
    assert found.summary.counts == {"/chat": 20}
    assert found.summary.topics["/chat"].qos == (PRESETS["state"],)
    assert [item.data for item in found.attachments()] == [b"system: demo\n"]
    with Reader(folder) as reader:
        assert [data for _, _, data in reader.messages()] == [item.data for item in messages]
        assert reader.message_count == 20
        assert reader.duration == 19 * 10_000_000 + 1
    by_mcap = []
    for path in found.files:
        with Path(path).open("rb") as stream:
            by_mcap += [
                (channel.topic, message.log_time, message.publish_time, message.data)
                for _, channel, message in make_reader(stream, validate_crcs=True).iter_messages()
            ]
    assert sorted(by_mcap) == [tuple(item) for item in messages]
    information = yaml.safe_load((folder / "metadata.yaml").read_text())
    assert information["rosbag2_bagfile_information"]["version"] == 9


@pytest.mark.parametrize("type_name", TYPES)
def test_definitions_are_complete(type_name: str) -> None:
    found = get_types_from_msg(full_definition(type_name, Interfaces.load()), type_name)
    assert type_name in found
    for name, (_, fields) in found.items():
        assert fields == store().fielddefs[name][1], name
    nested = {name for _, (_, fields) in found.items() for name in _messages_in(fields)}
    assert nested == found.keys() - {type_name}


def _messages_in(fields: object) -> set[str]:
    return {name for name in store().fielddefs if f"'{name}'" in repr(fields)}


@pytest.mark.parametrize(
    "profile",
    [
        *PRESETS.values(),
        QosProfile(
            history=History.KEEP_ALL,
            durability=Durability.TRANSIENT_LOCAL,
            deadline_ms=12.5,
            lifespan_ms=2000.0,
            liveliness=Liveliness.MANUAL_BY_TOPIC,
            liveliness_lease_duration_ms=1e5,
        ),
    ],
)
def test_qos_profiles_survive(profile: QosProfile) -> None:
    assert qos_yaml.from_text(qos_yaml.to_text([profile])) == (profile,)


@pytest.mark.parametrize(
    "damage",
    [
        *("", "{", "3", "- 3", "[" * 5000, "- {history: 7, depth: x, deadline: 3}"),
        *(f"- {{depth: {depth}}}" for depth in (-1, 2**32, 2**70)),
        f"- {{deadline: {{sec: -5, nsec: 1}}, lifespan: {{sec: 1, nsec: {2**70}}}}}",
    ],
)
def test_other_texts_have_no_qos_profiles(damage: str) -> None:
    assert set(qos_yaml.from_text(damage)) <= {QosProfile()}


def test_numbers_of_older_versions_are_read() -> None:
    old = "- {history: 2, depth: 1, reliability: 2, durability: 1, liveliness: 3}"
    [profile] = qos_yaml.from_text(old)
    values = (profile.history, profile.reliability, profile.durability, profile.liveliness)
    assert values == ("keep_all", "best_effort", "transient_local", "manual_by_topic")


def _with_other_profiles(bag: Path) -> None:
    """The database writes the profiles of its topics in another way than metadata.yaml."""
    [path] = bag.glob("*.db3")
    with closing(sqlite3.connect(path)) as database:
        database.execute("update topics set offered_qos_profiles = ''")
        database.commit()


def _without_metadata(bag: Path) -> None:
    (bag / "metadata.yaml").unlink()


def _compressed(bag: Path) -> None:
    for path in list(bag.glob("*.mcap")) + list(bag.glob("*.db3")):
        data = zstandard.ZstdCompressor().compress(path.read_bytes())
        path.with_name(f"{path.name}.zstd").write_bytes(data)
        path.unlink()


@pytest.mark.parametrize(
    ("plugin", "change"),
    [
        (StoragePlugin.SQLITE3, None),
        (StoragePlugin.MCAP, None),
        (StoragePlugin.SQLITE3, _with_other_profiles),
        (StoragePlugin.SQLITE3, _without_metadata),
        (StoragePlugin.SQLITE3, _compressed),
        (StoragePlugin.MCAP, _compressed),
    ],
)
def test_we_read_what_rosbags_writes_and_users_make_of_it(
    tmp_path: Path, plugin: StoragePlugin, change: Callable[[Path], None] | None
) -> None:
    with RosbagsWriter(tmp_path / "bag", version=9, storage_plugin=plugin) as writer:
        connection = writer.add_connection("/chat", "std_msgs/msg/String", typestore=store())
        for number in range(20):
            writer.write(connection, START_NS + number, text(str(number)))
    if change is not None:
        change(tmp_path / "bag")
    bag = open_bag(tmp_path / "bag")
    assert [item.data for item in read(bag)] == [text(str(number)) for number in range(20)]
    assert (bag.summary.start_ns, bag.summary.end_ns) == (START_NS, START_NS + 19)
    assert bag.summary.topics["/chat"].type_name == "std_msgs/msg/String"
    assert bag.summary.counts["/chat"] == 20
    assert list(bag.warnings) == []
    assert all(Path(path).exists() for path in bag.files)
    [part] = bag.messages(frozenset({"/chat"}), START_NS + 3, START_NS + 4)
    assert part.recorded_ns == START_NS + 3


_ENDED = """
import os, signal, sys
from pathlib import Path
from typing import Any
from composer.bags.reader import open_bag
from composer.cli.support.bags import bag_errors
signal.signal(int(sys.argv[2]), signal.SIG_DFL)  # which these tests may have been started to ignore
with bag_errors():
    bag = open_bag(Path(sys.argv[1]))
    os.kill(os.getpid(), int(sys.argv[2]))
    print("not ended")
"""


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT])
def test_a_signal_leaves_no_decompressed_file(tmp_path: Path, number: int) -> None:
    write(tmp_path / "bag")
    _compressed(tmp_path / "bag")
    (tmp_path / "temporary").mkdir()
    command = [sys.executable, "-c", _ENDED, str(tmp_path / "bag"), str(int(number))]
    variables = {**os.environ, "TMPDIR": str(tmp_path / "temporary")}
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=variables)
    assert "KeyboardInterrupt" in done.stderr
    assert done.stdout == ""
    assert list((tmp_path / "temporary").iterdir()) == []


def test_signals_of_one_moment_are_one_request(monkeypatch: pytest.MonkeyPatch) -> None:
    """Linux repeats the signal of a parent's end for each of its threads."""
    monkeypatch.setattr(watchdog, "SAME_REQUEST_S", 60.0)
    before, requests = signal.signal(signal.SIGTERM, signal.SIG_DFL), 0
    try:
        with bag_errors():
            for _ in range(2):
                try:
                    signal.raise_signal(signal.SIGTERM)
                except KeyboardInterrupt:
                    requests += 1
    finally:
        signal.signal(signal.SIGTERM, before)
    assert requests == 1


def _compress_messages(bag: Path, add_size: bool) -> None:
    """Compress messages as rosbag2 does in its mode ``message``."""
    compressor = zstandard.ZstdCompressor(write_content_size=add_size)
    [file] = bag.glob("*.db3")
    with closing(sqlite3.connect(file)) as database:
        for number, data in list(database.execute("select id, data from messages")):
            values = (compressor.compress(data), number)
            database.execute("update messages set data = ? where id = ?", values)
        database.commit()
    metadata = bag / "metadata.yaml"
    content = metadata.read_text(encoding="utf-8")
    content = content.replace("compression_mode: ''", "compression_mode: MESSAGE")
    # The library would parse this for minutes.
    metadata.write_text(f"{content}\nmore: {'[' * 300_000}", encoding="utf-8")


def test_compressed_messages(tmp_path: Path) -> None:
    for name, add_size in (("bag", True), ("no-size", False)):
        options = {"version": 9, "storage_plugin": StoragePlugin.SQLITE3}
        with RosbagsWriter(tmp_path / name, **options) as writer:
            connection = writer.add_connection("/chat", "std_msgs/msg/String", typestore=store())
            writer.write(connection, START_NS, text("a" * 1000))
        _compress_messages(tmp_path / name, add_size)
    assert [item.data for item in read(open_bag(tmp_path / "bag"))] == [text("a" * 1000)]
    with pytest.raises(BagError, match="does not say how large it is"):
        read(open_bag(tmp_path / "no-size"))


def test_files_of_other_programs(tmp_path: Path) -> None:
    """Types of ROS 1, other encodings and missing statistics are kept as they are."""
    with (tmp_path / "a.mcap").open("wb") as stream:
        writer = Writer(stream, use_statistics=False)
        writer.start()
        schema = writer.register_schema("std_msgs/String", "ros2msg", b"string data")
        channel = writer.register_channel("/chat", "cdr", schema)
        writer.add_message(channel, 1, text("a"), 1)
        schema = writer.register_schema("Pose", "jsonschema", b"{}")
        channel = writer.register_channel("/pose", "json", schema)
        writer.add_message(channel, 2, b"{}", 2)
        writer.finish()
    first = open_bag(tmp_path / "a.mcap")
    assert first.warnings == []
    write_bag([first], Selection(), tmp_path / "b", SplitLimits())
    for bag in (first, open_bag(tmp_path / "b")):
        topics = bag.summary.topics
        assert topics["/chat"].type_name == "std_msgs/msg/String"
        facts = topics["/pose"]
        assert (facts.type_name, facts.encoding, facts.message_encoding, facts.definition) == (
            *("Pose", "jsonschema", "json", "{}"),
        )
        assert [item.data for item in read(bag)] == [text("a"), b"{}"]
