"""What a system records of itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from composer.base.fast_dataclass import dataclass
from composer.base.source import Located
from composer.model.names import matches_wildcard

#: The end of the topic with the requests and responses of a service: ROS 2's introspection.
EVENT_TOPIC = "_service_event"


def owner_of_topic(topic: str) -> tuple[str, str]:
    """Return what a topic belongs to: the kind, and the name of the topic, service or action.

    The kind is a key of ``recording``: ``topics``, ``services`` or ``actions``.
    """
    action, separator, _ = topic.partition("/_action/")
    if separator:
        return "actions", action
    service = topic.removesuffix(f"/{EVENT_TOPIC}")
    return ("topics" if service == topic else "services"), service


def is_chosen(topic: str, patterns: Mapping[str, Sequence[str]]) -> bool:
    """Return whether a topic matches the patterns of its kind; without any patterns, it does."""
    kind, name = owner_of_topic(topic)
    if not any(patterns.values()):
        return True
    return any(matches_wildcard(pattern, name) for pattern in patterns[kind])


@dataclass(frozen=True, slots=True)
class Recording:
    """The ``recording`` of a system.

    ``topics``, ``services``, ``actions`` and ``exclude`` are patterns of full names; without the
    first three, everything is recorded. ``ring_s`` makes it a flight recorder: it keeps the last
    seconds, and writes them after a fault. A new file begins before one is larger than ``split_mb``
    or longer than ``split_s``.
    """

    folder: str = "bags"
    topics: tuple[Located[str], ...] = ()
    services: tuple[Located[str], ...] = ()
    actions: tuple[Located[str], ...] = ()
    exclude: tuple[Located[str], ...] = ()
    ring_s: float | None = None
    split_mb: float | None = None
    split_s: float | None = None

    @property
    def patterns(self) -> Mapping[str, tuple[Located[str], ...]]:
        """The patterns of what is recorded, by kind."""
        return {"topics": self.topics, "services": self.services, "actions": self.actions}

    def includes(self, topic: str) -> bool:
        """Return whether a topic is recorded, by its full name."""
        _, name = owner_of_topic(topic)
        if any(matches_wildcard(pattern.value, name) for pattern in self.exclude):
            return False
        kinds = self.patterns.items()
        return is_chosen(topic, {kind: [item.value for item in found] for kind, found in kinds})
