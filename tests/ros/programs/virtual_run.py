"""Prints all messages, log lines and transitions of a system in virtual time.

Arguments: the system file, the seconds. Messages are printed, not serialized: Fast CDR does not
initialize the bytes between fields.
"""

from __future__ import annotations

import sys
from pathlib import Path

from composer.model import ChannelKind, channels
from composer.testing.declarations import load_file
from composer.testing.system_test import SystemTest

path, seconds = sys.argv[1:]
model, _ = load_file(Path(path), {}, {})
all_channels = channels(model.nodes, with_transforms=True)
topics = {channel.name for channel in all_channels if channel.kind is ChannelKind.TOPIC}
with SystemTest(model) as system:
    system.advance(float(seconds))
    for topic in sorted(topics):
        for item in system.messages(topic):
            print(topic, repr(item.time_s), item.message)
for entry in (*system.log, *system.events):
    print(entry)
