"""What a manager reports of its system: the states of the nodes, and the timings of callbacks."""

from __future__ import annotations

import hmac
from collections.abc import Mapping
from dataclasses import field

from composer.base.characters import shortened
from composer.base.fast_dataclass import dataclass
from composer.plan import STARTING, Condition

_MAX_LISTED = 5
_DIGEST = "sha256"


@dataclass(frozen=True, slots=True)
class NodeReport:
    """The status of one node.

    ``desired`` is the state that the supervisor keeps it in; ``since_s`` is when it reached its
    state, in seconds since 1970. ``held_down`` is why a failed node is held down, else empty;
    ``condition`` says in words what becomes of it, or what it waits for. ``is_required`` is whether
    the system needs it, ``is_optional`` whether the system is up without it: it is not required, or
    depends on such a node. ``starts_active`` is whether a start of the system activates it.
    ``depends_on`` are the states
    that the nodes it depends on must have, by their full names. ``left_to_manager`` are the
    services that the manager node has instead (see :class:`composer.model.Introspection`).
    ``process`` is the process of the system that the node runs in, empty for the one that reports.
    ``pid`` is the id of the operating system's process, empty while none runs or it is not known,
    and ``host`` its computer, empty for the computer of the process that reports.

    Rates are in hertz from burst to burst of the last seconds; ``busy`` is the share of a thread
    that its callbacks took in the last second. They are None if they are not known, as of an
    executable. ``slowest`` is the callback with the longest call so far, and its time. ``calls``
    and ``skipped`` are as in a ``NodeSummary``.
    ``overruns`` counts calls over their ``budget_ms``, ``queue_drops`` messages and calls that full
    queues dropped, ``qos_events`` the events of :mod:`composer.runtime.ports.qos_events` by name.
    ``sent``, ``received`` and ``dropped`` count messages by topic.
    """

    node: str
    desired: str
    starts_active: bool = True
    is_required: bool = True
    is_optional: bool = False
    depends_on: Mapping[str, str] = field(default_factory=dict)
    left_to_manager: tuple[str, ...] = ()
    process: str = ""
    host: str = ""
    pid: str = ""
    state: str = "unconfigured"
    since_s: float = 0.0
    restarts: int = 0
    last_error: str = ""
    held_down: str = ""
    condition: str = ""
    errors: int = 0
    sent_hz: float | None = None
    received_hz: float | None = None
    busy: float | None = None
    slowest: str = ""
    overruns: int = 0
    queue_drops: int = 0
    calls: int = 0
    skipped: int = 0
    qos_events: Mapping[str, int] = field(default_factory=dict)
    sent: Mapping[str, int] = field(default_factory=dict)
    received: Mapping[str, int] = field(default_factory=dict)
    dropped: Mapping[str, int] = field(default_factory=dict)

    @property
    def counts(self) -> bool:
        """Whether the system is not up without the node."""
        return not self.is_optional and self.condition != Condition.IGNORED


@dataclass(frozen=True, slots=True)
class CallbackFigures:
    """The callbacks of one port or timer of a node, since the node was created.

    ``total_ms`` is the time that they kept a thread; ``late_...`` the time from when a timer call
    was due to its start. ``p99_ms`` is right within 10 %. ``kind``, ``overruns`` and ``dropped``
    are those of :class:`composer.runtime.metrics.statistics.CallbackStatistics`. ``histogram`` is
    the text of :attr:`composer.runtime.metrics.statistics.Histogram.text`.
    """

    node: str
    kind: str
    name: str
    count: int = 0
    total_ms: float = 0.0
    mean_ms: float = 0.0
    p99_ms: float = 0.0
    longest_ms: float = 0.0
    late_p99_ms: float = 0.0
    late_longest_ms: float = 0.0
    overruns: int = 0
    dropped: int = 0
    histogram: str = ""

    @property
    def callback(self) -> str:
        """The kind and name: ``timer 'tick'``."""
        return f"{self.kind} '{self.name}'"


@dataclass(frozen=True, slots=True)
class ChainFigures:
    """The latencies of a chain, from its first publisher to its last.

    ``late`` counts latencies above ``latency_ms``.
    """

    chain: str
    latency_ms: float
    count: int = 0
    mean_ms: float = 0.0
    p99_ms: float = 0.0
    longest_ms: float = 0.0
    late: int = 0

    @property
    def text(self) -> str:
        """The figures in one line."""
        return (
            f"{self.count} times, mean {self.mean_ms:.3f} ms, "
            f"p99 {self.p99_ms:.3f} ms, max {self.longest_ms:.3f} ms, "
            f"{self.late} over {self.latency_ms:g} ms"
        )


@dataclass(frozen=True, slots=True)
class TimingReport:
    """The timings of callbacks and chains at ``at_s``.

    ``at_s`` is in seconds since 1970 or of simulated time, and 0 before the first report.
    """

    callbacks: tuple[CallbackFigures, ...] = ()
    chains: tuple[ChainFigures, ...] = ()
    at_s: float = 0.0


@dataclass(frozen=True, slots=True)
class SystemReport:
    """A system, its process, and its nodes in the order of the bring-up.

    ``name`` is the namespace of the manager. ``started_s`` is the start of the process in seconds
    since 1970, ``at_s`` the time of the report, in seconds since 1970 or of simulated time.
    ``number`` counts the reports of the process. ``is_child`` is whether the coordinating process
    of the system has started this one. ``participant`` is the prefix of the ids of the endpoints of
    the process, in hexadecimal digits. ``callbacks`` and ``chains`` are included on request, with
    their time ``callbacks_at_s``. Clients add the timings of other processes, with their times
    ``processes_at_s``.
    """

    name: str
    activity: str  # "starting", "running", "pausing", "stopping" ...
    nodes: tuple[NodeReport, ...]
    host: str
    pid: str
    started_s: float = 0.0
    at_s: float = 0.0
    number: int = 0
    is_child: bool = False
    participant: str = ""
    callbacks: tuple[CallbackFigures, ...] = ()
    chains: tuple[ChainFigures, ...] = ()
    callbacks_at_s: float = 0.0
    processes_at_s: Mapping[str, float] = field(default_factory=dict)

    @property
    def failed(self) -> tuple[NodeReport, ...]:
        """The nodes that are held down, and that the system needs."""
        return tuple(node for node in self.nodes if node.held_down and node.is_required)

    @property
    def is_active(self) -> bool:
        """Whether every node that a start activates is active, and no node has failed.

        Optional nodes, and those whose failure is ignored, do not count. A system in which a start
        activates no node is never active.
        """
        nodes = [node for node in self.nodes if node.starts_active]
        are_active = all(node.state == "active" for node in nodes if node.counts)
        return bool(nodes) and not self.failed and are_active

    @property
    def is_ready(self) -> bool:
        """Whether it is up: as ``is_active``, and no node is in another state than desired.

        A system in which a start activates no node is ready if it runs.
        """
        active = self.is_active or not any(node.starts_active for node in self.nodes)
        settled = all(node.state == node.desired for node in self.nodes if node.counts)
        return self.activity == "running" and active and not self.failed and settled

    @property
    def remarks(self) -> tuple[str, ...]:
        """What keeps nodes from being up, in words."""
        return self.missing_nodes(reasons=True)

    def missing_nodes(self, *, reasons: bool) -> tuple[str, ...]:
        """Return which nodes are not up, in words; with the reasons of those that have failed."""
        missing = (Condition.ABSENT, STARTING)
        absent = [node.node for node in self.nodes if node.condition in missing]
        down = [node for node in self.nodes if node.held_down and node.node not in absent]
        waiting = [f"waiting for {shortened(absent, _MAX_LISTED)}"] if absent else []
        failed = [
            f"{node.node} is {node.condition or 'down'}" + f": {node.held_down}" * reasons
            for node in down
        ]
        more = [f"{len(down) - _MAX_LISTED} more are down"] if len(down) > _MAX_LISTED else []
        return (*waiting, *failed[:_MAX_LISTED], *more)

    @property
    def active(self) -> int:
        """The number of active nodes."""
        return sum(node.state == "active" for node in self.nodes)

    @property
    def message(self) -> str:
        """The system in one line: ``2 of 3 nodes active, /planner is isolated: no map``."""
        return ", ".join((f"{self.active} of {len(self.nodes)} nodes active", *self.remarks))

    @property
    def processes(self) -> Mapping[str, str]:
        """The names of the managers of other processes, by the names of the processes."""
        names = sorted({node.process for node in self.nodes if node.process})
        return {name: f"{self.name}/{name}" for name in names}

    def callbacks_at(self, process: str) -> float:
        """Return the time of the callbacks of a process, empty for the one that reports."""
        return self.processes_at_s.get(process, 0.0) if process else self.callbacks_at_s

    @property
    def is_starting(self) -> bool:
        """Whether it has no nodes yet, and would refuse requests."""
        return self.activity == "starting"

    @property
    def is_stopping(self) -> bool:
        """Whether it takes its nodes down because the process ends."""
        return self.activity in ("stopping", "stopped")


def signed(document: str, key: str) -> str:
    """Return a document with its signature (HMAC) before it; unchanged without a key.

    Any node can publish on ``state``, and a replayed bag does. The coordinating process gives the
    key to the processes that it starts. It reads the key of others in their instance locks or, from
    other computers, asks their services for it.
    """
    return f"{_signature(document, key)}{document}" if key else document


def split_signature(text: str) -> tuple[str, str]:
    """Return the signature before a document, empty if there is none, and the document."""
    signature, brace, content = text.partition("{")
    return signature, brace + content


def is_signed(text: str, key: str) -> bool:
    """Return whether a process with this key, which is not empty, has signed a document."""
    signature, document = split_signature(text)
    expected = _signature(document, key).encode()
    return bool(key) and hmac.compare_digest(signature.encode(errors="replace"), expected)


def _signature(document: str, key: str) -> str:
    return hmac.new(key.encode(), document.encode(errors="replace"), _DIGEST).hexdigest()
