"""The npm package ``@mcap/core``, with which web pages read bags, reads every message of ours."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import pytest

from tests.programs import require_package

pytest.importorskip("mcap")

from composer.bags.bag import Attachment, BagMessage, BagTopic
from composer.bags.definitions import full_definition
from composer.bags.writer import BagWriter, SplitLimits
from composer.interfaces import Interfaces

FOLDER = Path(__file__).parent
TYPES = {"/chat": "std_msgs/msg/String", "/odometry": "nav_msgs/msg/Odometry"}


def test_every_message_is_the_same(tmp_path: Path) -> None:
    require_package(FOLDER, "@mcap/core")
    attachment = Attachment("system.yaml", "application/yaml", b"system: demo\n")
    writer = BagWriter(tmp_path / "bag", SplitLimits(duration_s=2.0), (attachment,))
    interfaces = Interfaces.load()
    for name, type_name in TYPES.items():
        definition = full_definition(type_name, interfaces)
        writer.add_topic(BagTopic(name, type_name, definition=definition))
    messages = [
        BagMessage(list(TYPES)[number % 2], 10**18 + number * 10**6, number, b"%04d" % number * 50)
        for number in range(5000)
    ]
    for message in messages:
        writer.write(message)
    writer.close()
    files = sorted((tmp_path / "bag").glob("*.mcap"))
    assert len(files) == 3
    found = []
    for file in files:
        command = ["node", str(FOLDER / "read.mjs"), str(file)]
        done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
        *lines, last = map(json.loads, done.stdout.splitlines())
        assert last == ["system.yaml", "application/yaml", attachment.data.hex()]
        found += lines
    assert found == [
        [item.topic, TYPES[item.topic], "ros2msg", *map(str, item[1:3]), item.data.hex()]
        for item in messages
    ]
