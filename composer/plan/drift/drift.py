"""What was observed in the ROS graph, and its differences from what is declared."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import field
from enum import StrEnum

from composer.base.fast_dataclass import dataclass
from composer.base.source import Span
from composer.language.tree import Plain
from composer.model import PortKind
from composer.model.node import TOOL_SERVICES
from composer.model.qos import QosProfile

#: Topics of every node for tools.
_TOOL_TOPICS = {
    "/rosout": "rcl_interfaces/msg/Log",
    "/parameter_events": "rcl_interfaces/msg/ParameterEvent",
}
_TRANSITION_EVENT = "lifecycle_msgs/msg/TransitionEvent"
#: The last name of the manager of a running system, and a service that every manager has.
MANAGER, _MANAGER_SERVICE = "manager", ("is_active", "std_srvs/srv/Trigger")


@dataclass(frozen=True, slots=True)
class ObservedEndpoint:
    """A publisher, subscription, service, ... of a node.

    ``qos`` is the profile that the node offers or requests. Discovery reports it for topics only,
    without history and depth; for services and actions it is None.
    """

    kind: PortKind
    name: str
    type: str
    qos: QosProfile | None = None

    @property
    def is_for_tools(self) -> bool:
        """True for the endpoints of parameters, logs and lifecycle."""
        last = self.name.rpartition("/")[2]
        if self.kind.channel.value == "service":
            return TOOL_SERVICES.get(last) == self.type
        if self.kind.channel.value == "topic":
            known = _TOOL_TOPICS.get(self.name) == self.type
            return known or (last == "transition_event" and self.type == _TRANSITION_EVENT)
        return False


def is_manager(node: str, endpoints: Iterable[ObservedEndpoint]) -> bool:
    """Return whether a node with these endpoints is the manager of a running system."""
    name, kind = _MANAGER_SERVICE
    service = (f"{node}/{name}", kind)
    return node.endswith(f"/{MANAGER}") and any(
        (item.name, item.type) == service for item in endpoints
    )


@dataclass(frozen=True, slots=True)
class ObservedNode:
    """A node of the graph.

    ``state`` is its lifecycle state: empty if it has none, None if it did not respond.
    ``parameters`` are its values by name, None if it did not respond. ``count`` is the number of
    nodes with that name; ``endpoints`` contains the endpoints of all of them. ``container`` is the
    full name of the node that has loaded it.
    """

    full_name: str
    endpoints: tuple[ObservedEndpoint, ...] = ()
    state: str | None = ""
    parameters: Mapping[str, Plain] | None = field(default_factory=dict)
    count: int = 1
    container: str = ""

    @property
    def is_hidden(self) -> bool:
        """True for nodes of tools: a part of their name starts with an underscore."""
        return any(part.startswith("_") for part in self.full_name.split("/"))


@dataclass(frozen=True, slots=True)
class ObservedProcess:
    """A process of a running system, with the full names of its nodes.

    ``name`` is the namespace of its manager. ``host`` and ``pid`` are empty if it does not report.
    """

    name: str
    host: str
    pid: str
    nodes: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Snapshot:
    """The nodes of the graph. Endpoints for tools are left out.

    ``processes`` are the processes of running systems, if a caller has asked for them.
    """

    nodes: tuple[ObservedNode, ...]
    processes: tuple[ObservedProcess, ...] = ()

    def node(self, full_name: str) -> ObservedNode | None:
        """Return the node with that name, or None."""
        return next((node for node in self.nodes if node.full_name == full_name), None)


class DriftKind(StrEnum):
    """The kinds of difference."""

    MISSING_NODE = "missing node"
    EXTRA_NODE = "extra node"
    DUPLICATE_NODE = "duplicate node"
    MISSING_ENDPOINT = "missing endpoint"
    EXTRA_ENDPOINT = "extra endpoint"
    WRONG_TYPE = "wrong type"
    WRONG_QOS = "wrong qos"
    WRONG_STATE = "wrong state"
    MISSING_PARAMETER = "missing parameter"
    WRONG_PARAMETER = "wrong parameter"
    NO_ANSWER = "no answer"


_SENTENCES = {
    DriftKind.MISSING_NODE: "the node does not exist",
    DriftKind.EXTRA_NODE: "the node exists, but is not declared",
    DriftKind.DUPLICATE_NODE: "{live} nodes have this name",
    DriftKind.MISSING_ENDPOINT: "{subject} is missing",
    DriftKind.MISSING_PARAMETER: "{subject} is missing",
    DriftKind.EXTRA_ENDPOINT: "{subject} exists, but is not declared",
    DriftKind.NO_ANSWER: "no response to the request for its {subject}",
}


@dataclass(frozen=True, slots=True)
class Drift:
    """One difference.

    ``node`` is a full name. ``subject`` is the part of it that differs, empty for the node itself.
    ``declared`` and ``live`` describe the two sides, empty if one has nothing. ``span`` is the
    declaration.
    """

    kind: DriftKind
    node: str
    subject: str = ""
    declared: str = ""
    live: str = ""
    hint: str = ""
    span: Span | None = field(default=None, compare=False)

    @property
    def identity(self) -> tuple[DriftKind, str, str]:
        """The identity of the difference, independent of its value."""
        return (self.kind, self.node, self.subject)

    def plain(self) -> dict[str, str | None]:
        """Return the difference as data for JSON, None for what it does not have."""
        return {
            "kind": self.kind.value,
            "node": self.node,
            "subject": self.subject or None,
            "declared": self.declared or None,
            "live": self.live or None,
            "message": self.message,
            "hint": self.hint or None,
            "declared_at": None if self.span is None else str(self.span),
        }

    @property
    def message(self) -> str:
        """The difference in one line, without the hint."""
        sentence = _SENTENCES.get(self.kind, "{subject} is {live}, declared {declared}")
        return f"{self.node}: " + sentence.format(
            subject=self.subject, live=self.live, declared=self.declared
        )


@dataclass(frozen=True, slots=True)
class DriftChange:
    """The changes since the last update: new differences, and reported ones that are resolved."""

    appeared: tuple[Drift, ...]
    resolved: tuple[Drift, ...]


class Debouncer:
    """Reports differences that last for at least ``grace_s`` seconds.

    Others come and go during bring-up and transitions.
    """

    def __init__(self, grace_s: float) -> None:
        self._grace_s = grace_s
        self._since_s: dict[tuple[DriftKind, str, str], float] = {}
        self._reported: dict[tuple[DriftKind, str, str], Drift] = {}

    @property
    def reported(self) -> tuple[Drift, ...]:
        """The differences that were reported and still exist."""
        return tuple(self._reported.values())

    def update(self, now_s: float, drifts: Iterable[Drift]) -> DriftChange:
        """Process the differences observed at ``now_s``; return what to report.

        A reported difference whose value changes is reported again.
        """
        observed = {drift.identity: drift for drift in drifts}
        self._since_s = {key: self._since_s.get(key, now_s) for key in observed}
        lasting = {
            key: drift
            for key, drift in observed.items()
            if key in self._reported or now_s - self._since_s[key] >= self._grace_s
        }
        appeared = tuple(
            drift for key, drift in lasting.items() if self._reported.get(key) != drift
        )
        resolved = tuple(drift for key, drift in self._reported.items() if key not in lasting)
        self._reported = lasting
        return DriftChange(appeared, resolved)

    def is_settled(self, drifts: Iterable[Drift]) -> bool:
        """Return whether all of ``drifts``, from the last update, have lasted long enough."""
        return all(drift.identity in self._reported for drift in drifts)
