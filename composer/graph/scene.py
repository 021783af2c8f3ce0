"""What views look at: nodes with their ends, whether they were declared or found running.

``declared`` makes a scene of systems, ``live`` one of a ROS graph; every view reads scenes only.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from composer.graph.picture import Details
from composer.model import ChannelKind, PortKind

_SOURCES = (PortKind.PUBLISHER, PortKind.SERVICE, PortKind.ACTION_SERVER)
#: Where messages or requests come from; the arrow leads from these into the channel.
SENDING = (PortKind.PUBLISHER, PortKind.CLIENT, PortKind.ACTION_CLIENT)


@dataclass(frozen=True, slots=True)
class End:
    """One node's end of a topic, service or action.

    ``name`` is the port's (of a running node, that of the channel); ``rate_hz`` is how often it
    publishes, None where nobody knows. ``qos`` says the profile in short, and is empty where
    nothing was said about it. ``wrong`` is the diagnostic about it, empty for none.
    """

    kind: PortKind
    name: str
    channel: str
    interface: str
    qos: str = ""
    rate_hz: float | None = None
    details: Details = ()
    wrong: str = ""


@dataclass(frozen=True, slots=True)
class Actor:
    """A node. ``full_name`` is unique in a scene.

    ``note`` is said below the name. ``state`` is the lifecycle state the node is in, or will be
    brought to; empty for a node without one. ``steps`` are those of its bring-up. ``executor`` is
    the key of the group that runs it, empty where that is not known.
    """

    name: str
    full_name: str
    namespace: str
    note: str = ""
    state: str = ""
    steps: str = ""
    executor: str = ""
    ends: tuple[End, ...] = ()
    details: Details = ()
    wrong: str = ""


@dataclass(frozen=True, slots=True)
class Wait:
    """``waiting`` goes on after ``waited_for`` has; both are full names.

    ``implied`` is true where no file says so and it follows from who serves whom.
    """

    waiting: str
    waited_for: str
    reason: str
    implied: bool


@dataclass(frozen=True, slots=True)
class ExecutorGroup:
    """Something that calls the callbacks of nodes."""

    key: str
    label: str


@dataclass(frozen=True, slots=True)
class Scene:
    """Everything there is to draw.

    ``rates_hz`` is how often messages come over a topic where it is not known from whom.
    """

    title: str
    actors: tuple[Actor, ...]
    waits: tuple[Wait, ...] = ()
    executors: tuple[ExecutorGroup, ...] = ()
    rates_hz: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Meeting:
    """An end, and the node that has it."""

    actor: Actor
    end: End


@dataclass(frozen=True, slots=True)
class Channel:
    """A topic, service or action, and everyone who meets on it."""

    kind: ChannelKind
    name: str
    sources: tuple[Meeting, ...]  # publishers or servers
    sinks: tuple[Meeting, ...]  # subscriptions or clients

    @property
    def ends(self) -> tuple[Meeting, ...]:
        """Everyone, sources first."""
        return self.sources + self.sinks

    @property
    def types(self) -> tuple[str, ...]:
        """The interface, and any other that somebody has by mistake."""
        return tuple(dict.fromkeys(meeting.end.interface for meeting in self.ends))


def channels(actors: Iterable[Actor]) -> tuple[Channel, ...]:
    """Return every topic, service and action of some nodes, sorted by kind and name."""
    found: dict[tuple[ChannelKind, str], list[Meeting]] = {}
    for actor in actors:
        for end in actor.ends:
            found.setdefault((end.kind.channel, end.channel), []).append(Meeting(actor, end))
    return tuple(
        Channel(
            kind,
            name,
            tuple(meeting for meeting in met if meeting.end.kind in _SOURCES),
            tuple(meeting for meeting in met if meeting.end.kind not in _SOURCES),
        )
        for (kind, name), met in sorted(found.items())
    )
