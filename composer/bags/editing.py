"""Makes new bags of parts of others."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from math import inf
from operator import attrgetter
from pathlib import Path

from composer.bags.bag import NANOSECONDS, Bag, BagError, BagMessage, BagTopic
from composer.bags.definitions import full_definition
from composer.bags.writer import BagWriter, SplitLimits
from composer.base.fast_dataclass import dataclass
from composer.interfaces import Interfaces

#: After the end of any bag, in nanoseconds since 1970.
END_NS = 2**63 - 1


@dataclass(frozen=True, slots=True)
class Selection:
    """A part of a bag: topics, and the time from ``start_s`` after its first message."""

    is_wanted: Callable[[str], bool] = lambda _: True
    start_s: float = 0.0
    duration_s: float = inf

    def topics(self, *bags: Bag) -> frozenset[str]:
        """Return the topics in these bags. Raises BagError if the bags only have others."""
        known = {name for bag in bags for name in bag.summary.topics}
        found = frozenset(filter(self.is_wanted, known))
        if known and not found:
            what = "the bag" if len(bags) == 1 else "the bags"
            raise BagError(f"no topic of {what} matches", f"topics: {', '.join(sorted(known))}")
        return found

    def messages(self, bag: Bag) -> Iterator[BagMessage]:
        """Yield the messages of the topics, if there are any, in order. Raises BagError."""
        names = frozenset(filter(self.is_wanted, bag.summary.topics))
        start_ns = bag.summary.start_ns + round(self.start_s * NANOSECONDS)
        length = self.duration_s * NANOSECONDS
        end_ns = min(start_ns + round(length), END_NS) if length < inf else END_NS
        return bag.messages(names, start_ns, end_ns) if names else iter(())


def write_bag(
    bags: Sequence[Bag], selection: Selection, folder: Path, limits: SplitLimits
) -> BagWriter:
    """Write the messages of several bags in the order of their times; return the closed writer.

    Raises BagError, also for a topic that has different types in the bags. Then, and if it is
    interrupted, there is no new bag.
    """
    topics = _joined_topics(bags, selection)
    attached = [item for bag in bags for item in bag.attachments()]
    writer = BagWriter(folder, limits, tuple(dict.fromkeys(attached)))
    parts: Iterable[Iterator[BagMessage]] = [selection.messages(bag) for bag in bags]
    try:
        for topic in topics:
            writer.add_topic(topic)
        for message in heapq.merge(*parts, key=attrgetter("recorded_ns")):
            writer.write(message)
        writer.close()
    except BaseException:
        writer.discard()
        raise
    return writer


def _joined_topics(bags: Sequence[Bag], selection: Selection) -> list[BagTopic]:
    """Return the topics of all bags; with definitions from this computer if they have none."""
    interfaces = Interfaces.load()
    found: dict[str, BagTopic] = {}
    wanted = sorted(selection.topics(*bags))
    for bag in bags:
        for name in (name for name in wanted if name in bag.summary.topics):
            topic = bag.summary.topics[name]
            other = found.get(name, topic)
            if other.type_name != topic.type_name:
                types = f"{other.type_name} and {topic.type_name}"
                raise BagError(f"'{name}' has different types in the bags: {types}")
            profiles = tuple(dict.fromkeys((*other.qos, *topic.qos)))
            definition = other.definition or topic.definition
            encoding = other.encoding or topic.encoding
            if not definition:
                definition = full_definition(topic.type_name, interfaces)
                encoding = "ros2msg" if definition else ""
            found[name] = replace(topic, qos=profiles, definition=definition, encoding=encoding)
    return list(found.values())
