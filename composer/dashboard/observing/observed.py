"""What the feeds observe together: nodes and endpoints, states, reports of systems, and rates."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Mapping, Set
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Self

from composer.dashboard.observing.log_lines import LogLines
from composer.dashboard.observing.meters import TopicMeters
from composer.drift import ObservedEndpoint, ObservedNode, Snapshot
from composer.model import PortKind
from composer.names import is_hidden
from composer.remote.lifecycle import LifecycleClient
from composer.remote.session import Deadline
from composer.remote.snapshot import endpoints
from composer.remote.system_reports import SystemReport
from composer.remote.systems import Systems
from composer.runtime.process.instance_lock import local_systems
from composer.runtime.ros.graph import SETTLE_S

if TYPE_CHECKING:
    from composer.dashboard.ros_side import Work
    from composer.remote.shared_session import SharedSession

_PERIOD_S = 1.0
#: Nodes are discovered one after the other at first.
_NEW_PERIOD_S = 0.2
_NEW_S = 4.0
_FIRST_WITHIN_S = 1.0
_FIRST_REPORTS_WITHIN_S = 1.5
_FIRST_POLL_S = 0.03
#: Endpoints are queried when names have changed, else less often: they take at most this share of
#: a processor.
_ENDPOINTS_PERIOD_S = 3.0
_SHARE = 0.03
_STATES_PERIOD_S = 2.0
_SYSTEMS_PERIOD_S = 3.0
#: Managers report every second.
_SILENT_S = 5.0
_STATES_WITHIN_S = 2.0
_GET_STATE = "lifecycle_msgs/srv/GetState"


@dataclass(frozen=True)
class Topology:
    """The nodes of the ROS graph with all of their endpoints. ``revision`` counts changes.

    ``counts`` has the number of nodes of each name. Nodes of commands are left out.
    """

    revision: int
    nodes: Mapping[str, tuple[ObservedEndpoint, ...]]
    counts: Mapping[str, int]

    @cached_property
    def visible(self) -> list[str]:
        """The names of nodes that are not hidden, sorted."""
        return [name for name in self.nodes if not is_hidden(name)]

    @cached_property
    def lifecycle_nodes(self) -> frozenset[str]:
        """The nodes that report their lifecycle state on request."""
        return frozenset(
            node
            for node, ends in self.nodes.items()
            if any((end.name, end.type) == (f"{node}/get_state", _GET_STATE) for end in ends)
        )

    def snapshot(self, states: Mapping[str, str | None]) -> Snapshot:
        """Return the nodes as :mod:`composer.graph` and :mod:`composer.drift` read them."""
        return Snapshot(
            tuple(
                ObservedNode(
                    full_name=name,
                    endpoints=tuple(end for end in ends if not end.is_for_tools),
                    state=states.get(name, ""),
                    count=self.counts.get(name, 1),
                )
                for name, ends in self.nodes.items()
            )
        )

    @cached_property
    def of_topics(self) -> Mapping[str, list[tuple[str, ObservedEndpoint]]]:
        """The endpoints of each topic with the names of their nodes."""
        found: dict[str, list[tuple[str, ObservedEndpoint]]] = {}
        for name in self.visible:
            for end in self.nodes[name]:
                if end.kind in (PortKind.PUBLISHER, PortKind.SUBSCRIPTION):
                    found.setdefault(end.name, []).append((name, end))
        return found


class Observed:
    """Observes the ROS graph on request. Use it on the thread of feeds, in a ``with`` block."""

    def __init__(self, session: SharedSession, work: Work) -> None:
        self._session = session
        self.meters = TopicMeters(session)
        self.reports = SystemReports(session)
        self.log = LogLines(session)
        self._states = _States(session, work)
        self._topology = Topology(0, {}, {})
        #: The last diagrams, by what they depend on.
        self.pictures: dict[object, str] = {}
        self._names: object = None
        self._names_due_s = 0.0
        self._endpoints_due_s = 0.0
        self._joined_s = time.monotonic()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.meters.close()
        self.log.close()
        self.reports.close()

    def topology(self) -> Topology:
        """Return the nodes and endpoints, at most about a second old.

        The first call waits a moment, so that the first view is complete.
        """
        now_s = time.monotonic()
        if now_s < self._names_due_s:
            return self._topology
        if not self._names_due_s:
            self._wait_for_nodes()
        is_new = self.is_new
        self._names_due_s = now_s + (_NEW_PERIOD_S if is_new else _PERIOD_S)
        graph = self._session.graph
        names = (graph.nodes(), graph.topics(), graph.services())
        if names == self._names and now_s < self._endpoints_due_s:
            return self._topology
        self._names = names
        used_s = time.thread_time()
        nodes, counts = self._query()
        if nodes != self._topology.nodes or counts != self._topology.counts:
            self._topology = Topology(self._topology.revision + 1, nodes, counts)
        used_s = time.thread_time() - used_s
        period_s = _NEW_PERIOD_S if is_new else _ENDPOINTS_PERIOD_S
        self._endpoints_due_s = time.monotonic() + max(period_s, used_s / _SHARE)
        return self._topology

    @property
    def is_new(self) -> bool:
        """Whether the session has just begun, so that nodes are still being discovered."""
        return time.monotonic() < self._joined_s + _NEW_S

    @property
    def waits_for_reports(self) -> bool:
        """Whether systems have not reported the states of their nodes yet, but soon may."""
        is_early = time.monotonic() < self._joined_s + _FIRST_REPORTS_WITHIN_S
        return is_early and any(report is None for report in self.reports.current().values())

    def _wait_for_nodes(self) -> None:
        """Wait until the nodes of this computer are known, and their topics change no more."""
        end_s = self._joined_s + _FIRST_WITHIN_S
        last, since_s = -1, 0.0
        while (now_s := time.monotonic()) < end_s:
            count = len(self._session.graph.topics())
            if count != last:
                last, since_s = count, now_s
            if now_s >= since_s + SETTLE_S and self._session.is_local_discovered():
                return
            time.sleep(_FIRST_POLL_S)

    def known(self) -> Topology:
        """Return the nodes and endpoints, on any thread."""
        known = self._topology
        if known.revision and time.monotonic() < self._endpoints_due_s + _ENDPOINTS_PERIOD_S:
            return known
        return Topology(known.revision, *self._query())

    def _query(self) -> tuple[dict[str, tuple[ObservedEndpoint, ...]], Counter[str]]:
        """Return the endpoints by node, and the number of nodes of each name."""
        graph = self._session.graph
        found = dict(endpoints(graph))
        counts = Counter(f"{namespace.rstrip('/')}/{name}" for name, namespace in graph.others())
        return {name: found[name] for name in sorted(found) if name in counts}, counts

    def states(self) -> dict[str, str | None]:
        """Return the states of all lifecycle nodes: those of systems, and of others as they answer.

        None for nodes that have not responded.
        """
        managed = {
            node.node: node.state
            for report in self.reports.current().values()
            if report is not None
            for node in report.nodes
        }
        others = self.topology().lifecycle_nodes - managed.keys()
        return self._states.of(others) | managed


class SystemReports:
    """The reports of running systems, while anything acquires them."""

    def __init__(self, session: SharedSession) -> None:
        self._session = session
        self._systems: Systems | None = None
        self._users = 0
        self._callback_users = 0
        self._with_callbacks = False
        self._due_s = 0.0
        #: The last report of each system, and when it was seen first.
        self._seen: dict[str, tuple[SystemReport | None, float]] = {}

    def acquire(self, *, callbacks: bool = False) -> None:
        """Subscribe to the reports, with timings of callbacks on request."""
        self._users += 1
        self._callback_users += callbacks

    def release(self, *, callbacks: bool = False) -> None:
        """Unsubscribe once every user has released them."""
        self._users -= 1
        self._callback_users -= callbacks
        if not self._users:
            self.close()

    def current(self) -> dict[str, SystemReport | None]:
        """Return the last report of each system, None for systems that do not report."""
        if not self._users:
            return {}
        with_callbacks = self._callback_users > 0
        if self._systems is None or with_callbacks is not self._with_callbacks:
            self.close()
            self._with_callbacks, self._due_s = with_callbacks, 0.0
            self._systems = Systems(self._session, Deadline(math.inf), callbacks=with_callbacks)
        systems = self._systems
        now_s = time.monotonic()
        if now_s >= self._due_s:
            self._due_s = now_s + _SYSTEMS_PERIOD_S
            local = local_systems()
            known = {*systems.discover(), *local}
            systems.subscribe(local)
            systems.forget([name for name in systems.current() if name not in known])
        return {name: self._fresh(name, report) for name, report in systems.current().items()}

    def _fresh(self, name: str, report: SystemReport | None) -> SystemReport | None:
        """Return the last report of a system, None if that is too old."""
        now_s = time.monotonic()
        last, seen_s = self._seen.get(name, (None, now_s))
        if report is not None and report is not last:
            self._seen[name] = (report, now_s)
            return report
        return last if now_s < seen_s + _SILENT_S else None

    def close(self) -> None:
        """Unsubscribe."""
        if self._systems is not None:
            self._systems.close()
            self._systems = None


class _States:
    """The states of lifecycle nodes without a manager, asked every two seconds."""

    def __init__(self, session: SharedSession, work: Work) -> None:
        self._session = session
        self._work = work
        self._known: dict[str, str | None] = {}
        self._due_s = 0.0
        self._is_asking = False

    def of(self, nodes: Set[str]) -> dict[str, str | None]:
        """Return the states that are known, and ask for new ones if it is time."""
        now_s = time.monotonic()
        if nodes and now_s >= self._due_s and not self._is_asking:
            self._is_asking = True
            self._work(lambda: self._ask(sorted(nodes)))
        return {node: self._known.get(node) for node in nodes}

    def _ask(self, nodes: list[str]) -> None:
        try:
            client = LifecycleClient(self._session, Deadline(_STATES_WITHIN_S))
            self._known = client.states(nodes)
        finally:
            self._due_s = time.monotonic() + _STATES_PERIOD_S
            self._is_asking = False
