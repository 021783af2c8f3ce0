"""Messages of a bag for a system under test."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

from composer.bags.bag import NANOSECONDS, Bag, BagError, BagMessage
from composer.bags.comparing import decoded
from composer.bags.editing import Selection
from composer.model import ChannelKind, System, channels


def inputs(system: System, bag: Bag, is_wanted: Callable[[str], bool]) -> frozenset[str]:
    """Return the topics of a bag that the system receives and does not publish.

    Raises BagError if there is none, or if one has another type in the bag.
    """
    topics = [
        channel
        for channel in channels(
            (node for node in system.nodes if node.in_process), with_transforms=True
        )
        if channel.kind is ChannelKind.TOPIC
    ]
    received = {item.name: item.sinks[0].port for item in topics if item.sinks and not item.sources}
    found = {name for name in bag.summary.topics if name in received and is_wanted(name)}
    if not found:
        hint = "leave out the nodes that publish topics of the bag: --replace NODE"
        if received:
            hint = f"{system.name} only receives {', '.join(sorted(received))}"
        raise BagError(f"the bag has no topic that {system.name} only receives", hint)
    for name in sorted(found):
        types = bag.summary.topics[name].type_name, received[name].interface.value
        if types[0] != types[1]:
            raise BagError(f"'{name}' is {types[0]} in the bag, and {types[1]} in the system")
    return frozenset(found)


def messages_of(
    bag: Bag, selection: Selection, system: System, at_s: float, at_ns: int
) -> Iterator[tuple[float, str, Any]]:
    """Return the times, topics and messages of a part of a bag, which starts at ``at_s``.

    Stamps in headers are shifted to the time of the nodes, which is ``at_ns`` then. Raises
    BagError, also while the messages are read.
    """
    names = inputs(system, bag, selection.is_wanted)
    start_ns = bag.summary.start_ns + round(selection.start_s * NANOSECONDS)

    def timed(message: BagMessage) -> tuple[float, str, Any]:
        content = decoded(message, bag.summary.topics[message.topic].type_name)
        shift_stamps(content, at_ns - start_ns)
        return at_s + (message.recorded_ns - start_ns) / NANOSECONDS, message.topic, content

    return map(timed, replace(selection, is_wanted=names.__contains__).messages(bag))


def shift_stamps(message: Any, by_ns: int) -> None:
    """Add a time to the stamps of all headers in a message, except for those that are not set."""
    for name, type_name in message.get_fields_and_field_types().items():
        if "/" not in type_name:
            continue
        value = getattr(message, name)
        if type_name == "std_msgs/Header":
            stamp = value.stamp
            at_ns = stamp.sec * NANOSECONDS + stamp.nanosec
            if at_ns:
                stamp.sec, stamp.nanosec = divmod(max(at_ns + by_ns, 0), NANOSECONDS)
        else:
            for item in value if isinstance(value, list) else [value]:
                shift_stamps(item, by_ns)
