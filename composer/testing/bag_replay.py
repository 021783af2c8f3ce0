"""Replays a bag into a system in virtual time: its topics stand in for nodes that are left out."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain
from operator import attrgetter
from typing import Any

from rclpy.serialization import serialize_message

from composer.bags.bag import NANOSECONDS, Bag, BagError, BagMessage, BagTopic
from composer.bags.comparing import Difference, Tolerances, decoded, differences
from composer.bags.definitions import full_definition
from composer.bags.editing import Selection
from composer.bags.system_recording import FACTS, STARTED
from composer.base.diagnostics import suggestion
from composer.base.fast_dataclass import dataclass
from composer.interfaces import Interfaces
from composer.model import ChannelKind, System, channels
from composer.model.names import matches_wildcard
from composer.testing.bag_messages import inputs
from composer.testing.system_test import SystemTest

#: Nodes are active when the first message arrives, if the bag does not say when its system started.
_BEFORE_FIRST_NS = 100_000_000
_STARTS_WITHIN_NS = 60 * NANOSECONDS


@dataclass(frozen=True, slots=True)
class Replay:
    """What a replay has done: the messages that it played, and what the system has published.

    ``bag_start_ns`` is the time of the first message of the bag, ``start_ns`` the start of
    the system.
    """

    bag_start_ns: int
    start_ns: int
    played: Sequence[BagMessage]
    topics: Sequence[BagTopic]
    messages: Sequence[BagMessage]

    def differences(self, golden: Bag, tolerances: Tolerances) -> list[Difference]:
        """Compare what the system has published up to the last played message with a bag.

        Each difference says which message was played before. Raises BagError.
        """
        names = frozenset(topic.name for topic in self.topics) & golden.summary.topics.keys()
        if not names:
            published = ", ".join(topic.name for topic in self.topics) or "nothing"
            text = "the bag has no topic that the system publishes"
            raise BagError(text, f"the system publishes {published}")
        end_ns = self.played[-1].recorded_ns
        found = differences(
            golden.messages(names, self.start_ns, end_ns),
            [item for item in self.messages if item.topic in names and item.recorded_ns < end_ns],
            {topic.name: topic.type_name for topic in self.topics},
            self.bag_start_ns,
            tolerances,
        )
        return [replace(item, text=f"{item.text}{self._cause(item)}") for item in found]

    def _cause(self, difference: Difference) -> str:
        at_ns = self.bag_start_ns + round(difference.at_s * NANOSECONDS)
        before = [item for item in self.played if item.recorded_ns <= at_ns]
        if not before:
            return ""
        last = before[-1]
        number = sum(item.topic == last.topic for item in before)
        return f"; after message {number} of {last.topic}"


def without_nodes(system: System, patterns: Sequence[str]) -> System:
    """Return the system without the nodes that match. Raises BagError if a pattern matches none."""
    names = [node.name.value for node in system.nodes]
    for pattern in patterns:
        if not any(matches_wildcard(pattern, name) for name in names):
            text = f"{system.name} has no node '{pattern}'"
            raise BagError(text, suggestion(pattern, names))
    return system.without_nodes(patterns)


def replay(system: System, bag: Bag, selection: Selection) -> Replay:
    """Play the topics that the system receives, at their times, until the last one.

    The clock of the system shows the time of the bag. Raises BagError, TestFailure, StartRefused.
    """
    wanted = inputs(system, bag, selection.is_wanted)
    messages = replace(selection, is_wanted=wanted.__contains__).messages(bag)
    first = next(messages, None)
    if first is None:
        raise BagError("the bag has no messages in this time", "see 'compose bag info'")
    start_ns = _start_ns(bag, first.recorded_ns)
    types = {name: bag.summary.topics[name].type_name for name in wanted}
    played: list[BagMessage] = []
    test = SystemTest(system, start_ns=start_ns)

    def timed() -> Iterator[tuple[float, str, Any]]:
        for message in chain([first], messages):
            at_s = (message.recorded_ns - start_ns) / NANOSECONDS
            played.append(message)
            yield at_s, message.topic, decoded(message, types[message.topic])

    with test:
        test.play(timed())
    topics = list(_outputs(system))
    published = [item for topic in topics for item in _published(test, topic, start_ns)]
    published.sort(key=attrgetter("recorded_ns"))
    return Replay(bag.summary.start_ns, start_ns, played, topics, published)


def _start_ns(bag: Bag, first_ns: int) -> int:
    """Return when the system starts: as when it was recorded, or just before the first message."""
    for item in bag.attachments():
        if item.name == FACTS:
            try:
                started = json.loads(item.data).get(STARTED)
            except (ValueError, AttributeError):
                continue
            if isinstance(started, int) and 0 <= first_ns - started <= _STARTS_WITHIN_NS:
                return started
    return first_ns - _BEFORE_FIRST_NS


def _outputs(system: System) -> Iterator[BagTopic]:
    interfaces = Interfaces.installed()
    nodes = [node for node in system.nodes if node.in_process]
    for channel in channels(nodes, with_transforms=True):
        if channel.kind is ChannelKind.TOPIC and channel.sources:
            ports = [end.port for end in channel.sources]
            type_name = ports[0].interface.value
            profiles = tuple(dict.fromkeys(port.qos.profile for port in ports))
            definition = full_definition(type_name, interfaces)
            yield BagTopic(channel.name, type_name, profiles, definition)


def _published(test: SystemTest, topic: BagTopic, start_ns: int) -> Iterator[BagMessage]:
    for item in test.messages(topic.name):
        at_ns = start_ns + round(item.time_s * NANOSECONDS)
        data: Any = serialize_message(item.message)
        yield BagMessage(topic.name, at_ns, at_ns, bytes(data))
