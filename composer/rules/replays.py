"""Bags that steps of scenarios replay: their files, topics and types, and the nodes they replace.

Only ``metadata.yaml`` of a bag is read. A bag without it, such as a single file, is checked when it
is played.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from composer.base.diagnostics import Diagnostic, Label, suggestion
from composer.base.fast_dataclass import dataclass
from composer.base.files import read_regular
from composer.base.source import Located
from composer.language.document import parse_bytes
from composer.language.rules import MAX_BYTES, OUT_OF_RANGE, UNREADABLE_FILE
from composer.language.tree import plain
from composer.model import Channel, ChannelKind, PortOfNode, channels
from composer.model.names import matches_wildcard
from composer.model.scenario import Replay
from composer.rules.analysis.context import Context, is_unresolved
from composer.rules.connections import no_node, undescribed_node
from composer.rules.references import UNDECLARED_NAME, UNKNOWN_NODE
from composer.rules.types import TYPE_MISMATCH


@dataclass(frozen=True, slots=True)
class Recorded:
    """What the metadata of a bag say: the types of its topics, its length, start and messages.

    ``start_s`` is in seconds since 1970.
    """

    types: Mapping[str, str]
    duration_s: float
    start_s: float = 0.0
    messages: int = 0


def check_replays(context: Context) -> Iterator[Diagnostic]:
    """Check each step with a bag."""
    scenario = context.scenario
    if scenario is None:
        return
    topics = _topics(context, scenario.replaced)
    for action in scenario.actions:
        replay, name = action.replay, action.name
        if replay is None or is_unresolved(name.value):
            continue
        if not context.is_partial:
            yield from _unknown_nodes(context, replay)
        path = replay.bag
        if not path.exists():
            siblings = [item.name for item in path.parent.glob("*")]
            hint = suggestion(path.name, siblings)
            yield Diagnostic(UNREADABLE_FILE, f"there is no bag '{name}'", name.span, hint=hint)
            continue
        recorded = read_metadata(path)
        if recorded is None:
            continue
        start_s = replay.start_s
        if start_s is not None and start_s.value > recorded.duration_s:
            message = f"the bag lasts {recorded.duration_s:g} s"
            yield Diagnostic(OUT_OF_RANGE, message, start_s.span)
        if not context.is_partial:
            problems = list(_listed(context, replay, recorded, topics))
            yield from problems or _played(context, name, replay, recorded, topics)


def _topics(context: Context, replaced: tuple[str, ...]) -> Mapping[str, Channel]:
    """Return the topics of the nodes that no bag replaces."""
    system = context.system.without_nodes(replaced)
    return {
        channel.name: channel
        for channel in channels(system.nodes, with_transforms=True)
        if channel.kind is ChannelKind.TOPIC
    }


def read_metadata(path: Path) -> Recorded | None:
    """Return what is in a bag; None if that is not known."""
    try:
        content = read_regular(path / "metadata.yaml", MAX_BYTES)
        tree, _, _ = parse_bytes(content, "metadata.yaml")
        metadata = None if tree is None else tree.get("rosbag2_bagfile_information")
        facts: Any = None if metadata is None else plain(metadata)
        return Recorded(
            {
                item["topic_metadata"]["name"]: item["topic_metadata"]["type"]
                for item in facts["topics_with_message_count"]
            },
            facts["duration"]["nanoseconds"] / 1e9,
            facts.get("starting_time", {}).get("nanoseconds_since_epoch", 0) / 1e9,
            int(facts.get("message_count", 0)),
        )
    except (OSError, ValueError, TypeError, LookupError, AttributeError):  # it may contain anything
        return None


def _unknown_nodes(context: Context, replay: Replay) -> Iterator[Diagnostic]:
    names = [node.name.value for node in context.system.nodes]
    for pattern in replay.replaced:
        if not any(matches_wildcard(pattern.value, name) for name in names):
            message = f"'replace' names node '{pattern}', which is not a node of this system"
            hint = suggestion(pattern.value, names)
            yield Diagnostic(UNKNOWN_NODE, message, pattern.span, hint=hint)


def _listed(
    context: Context, replay: Replay, recorded: Recorded, topics: Mapping[str, Channel]
) -> Iterator[Diagnostic]:
    """Check the topics that are listed."""
    for pattern in replay.topics:
        if not any(matches_wildcard(pattern.value, name) for name in recorded.types):
            hint = suggestion(pattern.value, recorded.types)
            message = f"the bag has no topic '{pattern}'"
            yield Diagnostic(UNDECLARED_NAME, message, pattern.span, hint=hint)
        elif "*" in pattern.value:
            continue  # of these, what the system does not receive is not played
        elif pattern.value not in topics or not topics[pattern.value].sinks:
            received = [name for name, topic in topics.items() if topic.sinks]
            message, hint = no_node(context, "subscribes to", pattern.value, received)
            yield Diagnostic(UNDECLARED_NAME, message, pattern.span, hint=hint)
        elif publishers := topics[pattern.value].sources:
            yield _conflict(pattern, publishers)


def _conflict(topic: Located[str], publishers: tuple[PortOfNode, ...]) -> Diagnostic:
    nodes = _names(publishers)
    verb = "publishes" if len(nodes) == 1 else "publish"
    message = f"'{topic}' cannot come from the bag: {', '.join(nodes)} {verb} it"
    labels = (Label(publishers[0].port.name.span, "published here"),)
    hint = f"let the bag replace it: replace: [{', '.join(nodes)}]"
    return Diagnostic(UNDECLARED_NAME, message, topic.span, labels, hint)


def _played(
    context: Context,
    name: Located[str],
    replay: Replay,
    recorded: Recorded,
    topics: Mapping[str, Channel],
) -> Iterator[Diagnostic]:
    """Check that something is played, and its types."""
    received = {
        topic: type_name
        for topic, type_name in recorded.types.items()
        if replay.includes(topic) and topic in topics and topics[topic].sinks
    }
    played = {topic: item for topic, item in received.items() if not topics[topic].sources}
    if not played:
        nodes = sorted({item for topic in received for item in _names(topics[topic].sources)})
        hint: str | None = f"'replace' nodes that publish topics of the bag: {', '.join(nodes)}"
        if not nodes:
            undescribed = context.once(undescribed_node)
            hint = None if undescribed is None else f"declare the subscriptions of '{undescribed}'"
        message = "the bag has no topic that the system receives and does not publish"
        yield Diagnostic(UNDECLARED_NAME, message, name.span, hint=hint)
    for topic, type_name in sorted(played.items()):
        port = topics[topic].sinks[0].port
        if port.interface.value != type_name and not is_unresolved(port.interface.value):
            message = f"'{topic}' is {type_name} in the bag, and {port.interface} in the system"
            labels = (Label(port.interface.span, "declared here"),)
            yield Diagnostic(TYPE_MISMATCH, message, name.span, labels)


def _names(ports: tuple[PortOfNode, ...]) -> list[str]:
    return list(dict.fromkeys(end.node.name.value for end in ports))
