"""The ROS graph as feeds and operations see it: nodes and endpoints, states, reports and rates."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Set
from contextlib import closing, contextmanager
from typing import TYPE_CHECKING, Self

from composer.client.lifecycle import LifecycleClient
from composer.client.session import Deadline
from composer.client.systems.local_queries import local_report
from composer.client.systems.managers import DISCOVERY_S, Systems
from composer.dashboard.observing.diagrams import Diagrams
from composer.dashboard.observing.log_lines import LogLines
from composer.dashboard.observing.topics import TopicMeters, TopicReader, Topology
from composer.plan.drift import ObservedEndpoint
from composer.runtime.process.instance_lock import local_systems
from composer.runtime.protocol.reports import SystemReport
from composer.runtime.ros.endpoints import endpoints
from composer.runtime.ros.graph import SETTLE_S

if TYPE_CHECKING:
    from composer.client.shared_session import SharedSession
    from composer.dashboard.forms import Forms


_PERIOD_S = 1.0
#: Nodes are discovered one after the other at first.
_NEW_PERIOD_S = 0.2
_NEW_S = 4.0
_FIRST_WITHIN_S = 1.0
_FIRST_REPORTS_WITHIN_S = 1.5
_FIRST_POLL_S = 0.03
#: After a change of the graph, endpoints are queried at once if names have changed, and soon
#: again, as the endpoints of a new node follow its name; else less often: they take at most this
#: share of a processor.
_ENDPOINTS_PERIOD_S = 5.0
_ENDPOINTS_SOON_S = 1.0
_SHARE = 0.03
#: What no feed has looked at for this time is queried again.
_CERTAIN_S = 10.0
_STATES_PERIOD_S = 2.0
_STATES_WITHIN_S = 2.0


#: Runs a function on a worker thread; an exception is only logged.
Work = Callable[[Callable[[], None]], None]
_SYSTEMS_PERIOD_S = 3.0
#: Managers report every second.
_SILENT_S = 5.0


class RosGraph:
    """What feeds and operations use while the dashboard is in the ROS graph.

    Use it on the thread of feeds, in a ``with`` block; other threads may use ``session``,
    ``forms``, ``work``, :meth:`known` and :meth:`learn_states`.

    ``first`` is what a system on this computer knows: discovery takes a second or more.
    ``on_report`` is called on another thread when a system has reported.
    """

    def __init__(
        self,
        session: SharedSession,
        forms: Forms,
        work: Work,
        first: Topology | None,
        on_report: Callable[[], None],
    ) -> None:
        self.session = session
        self.forms = forms
        self.work = work
        self.meters = TopicMeters(session, self.topology)
        self.reports = SystemReports(session, on_report)
        self.log = LogLines(session)
        self.diagrams = Diagrams()
        self._on_report = on_report
        self._states = _States(session, work)
        self._discovery = _Discovery(session)
        self._topology = first or Topology(0, {}, {})
        self._names: object = None
        self._names_due_s = 0.0
        self._endpoints_due_s = 0.0
        self._change = -1
        self._certain_s = 0.0
        self._joined_s = time.monotonic()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.meters.close()
        self.log.close()
        self.reports.close()

    def reader(self, topic: str, type_name: str | None, depth: int) -> TopicReader:
        """Return a reader of a topic, which subscribes when it first takes messages."""
        return TopicReader(self.session, self.topology, topic, type_name, depth)

    def topology(self) -> Topology:
        """Return the nodes and endpoints, at most about a second old.

        Without the answer of a system, the first call waits, so that the first view is complete.
        """
        now_s = time.monotonic()
        if now_s < self._names_due_s:
            return self._topology
        is_new = self.is_new
        self._names_due_s = now_s + (_NEW_PERIOD_S if is_new else _PERIOD_S)
        if not self._discovery.is_complete():
            if self._topology.revision:
                return self._topology
            self._discovery.wait(self._joined_s + _FIRST_WITHIN_S)
        change = self.session.changes.number()
        if change == self._change:
            self._certain_s = now_s
            return self._topology
        graph = self.session.graph
        names = (graph.nodes(), graph.topics(), graph.services())
        if names == self._names and now_s < self._endpoints_due_s:
            return self._topology
        has_new_names = names != self._names
        self._names, self._change, self._certain_s = names, change, now_s
        used_s = time.thread_time()
        nodes, counts = self._query()
        if nodes != self._topology.nodes or counts != self._topology.counts:
            self._topology = Topology(self._topology.revision + 1, nodes, counts)
        used_s = time.thread_time() - used_s
        period_s = _ENDPOINTS_SOON_S if has_new_names else _ENDPOINTS_PERIOD_S
        if is_new:
            period_s = _NEW_PERIOD_S
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

    def known(self) -> Topology:
        """Return the nodes and endpoints, on any thread."""
        known = self._topology
        if known.revision and not self._discovery.was_complete:
            return known
        if known.revision and time.monotonic() < self._certain_s + _CERTAIN_S:
            return known
        return Topology(known.revision, *self._query())

    def _query(self) -> tuple[dict[str, tuple[ObservedEndpoint, ...]], Counter[str]]:
        """Return the endpoints by node, and the number of nodes of each name."""
        graph = self.session.graph
        found = dict(endpoints(graph))
        counts = Counter(name for name, _ in graph.names("node"))
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

    def learn_states(self, states: Mapping[str, str]) -> None:
        """Take over states that nodes have just reached, so that they are shown at once."""
        self._states.learn(states)
        self._on_report()


class _Discovery:
    """Whether the nodes of this computer are discovered, after joining the ROS graph."""

    def __init__(self, session: SharedSession) -> None:
        self._session = session
        self._end_s = time.monotonic() + DISCOVERY_S
        self._count, self._since_s = -1, 0.0
        #: Whether it was complete at the last look.
        self.was_complete = False

    def is_complete(self) -> bool:
        """Return whether all nodes are known and their topics change no more."""
        if self.was_complete:
            return True
        now_s = time.monotonic()
        count = len(self._session.graph.topics())
        if count != self._count:
            self._count, self._since_s = count, now_s
        is_settled = now_s >= self._since_s + SETTLE_S and self._session.is_local_discovered()
        self.was_complete = is_settled or now_s >= self._end_s
        return self.was_complete

    def wait(self, end_s: float) -> None:
        """Wait until it is complete, but no longer than until ``end_s`` (time.monotonic)."""
        while not self.is_complete() and time.monotonic() < end_s:
            time.sleep(_FIRST_POLL_S)
        self.was_complete = True


class _States:
    """The states of lifecycle nodes without a manager, asked every two seconds."""

    def __init__(self, session: SharedSession, work: Work) -> None:
        self._session = session
        self._work = work
        self._known: dict[str, str | None] = {}
        self._learned = 0
        self._due_s = 0.0
        self._is_asking = False

    def learn(self, states: Mapping[str, str]) -> None:
        """Take over states that are newer than the last answers, on any thread."""
        self._learned += 1
        self._known = {**self._known, **states}

    def of(self, nodes: Set[str]) -> dict[str, str | None]:
        """Return the last states of nodes (None: not received yet), and ask for new ones if due."""
        now_s = time.monotonic()
        if nodes and now_s >= self._due_s and not self._is_asking:
            self._is_asking = True
            self._work(lambda: self._ask(sorted(nodes)))
        return {node: self._known.get(node) for node in nodes}

    def _ask(self, nodes: list[str]) -> None:
        learned = self._learned
        period_s = _STATES_PERIOD_S
        try:
            with closing(LifecycleClient(self._session, Deadline(_STATES_WITHIN_S))) as client:
                answers = client.states(nodes)
            if learned == self._learned:
                self._known = answers
            else:
                period_s = 0.0  # some of the answers may be older than what was learned
        finally:
            self._due_s = time.monotonic() + period_s
            self._is_asking = False


class SystemReports:
    """The reports of running systems, while anything uses them."""

    def __init__(self, session: SharedSession, on_report: Callable[[], None]) -> None:
        self._session = session
        self._on_report = on_report
        self._systems: Systems | None = None
        self._discovered: tuple[str, ...] = ()
        self._change = -1
        self._users = 0
        self._callback_users = 0
        self._with_callbacks = False
        self._due_s = 0.0
        #: The last report of each system, and when it was seen first.
        self._seen: dict[str, tuple[SystemReport | None, float]] = {}

    @contextmanager
    def used(self, *, callbacks: bool = False) -> Iterator[None]:
        """Subscribe to the reports in a ``with`` block, with timings of callbacks on request."""
        self._users += 1
        self._callback_users += callbacks
        try:
            yield
        finally:
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
            self._systems = Systems(
                self._session,
                Deadline(math.inf),
                callbacks=with_callbacks,
                on_report=self._on_report,
            )
        systems = self._systems
        now_s = time.monotonic()
        if now_s >= self._due_s:
            self._due_s = now_s + _SYSTEMS_PERIOD_S
            local = local_systems()
            change = self._session.changes.number()
            if change != self._change:
                self._change, self._discovered = change, systems.discover()
            known = {*self._discovered, *local}
            systems.subscribe(known)
            self._ask(local)
            systems.forget([name for name in systems.current() if name not in known])
        return {name: self._fresh(name, report) for name, report in systems.current().items()}

    def _ask(self, local: Iterable[str]) -> None:
        """Ask systems on this computer for their first report: a topic takes a second."""
        for name in local:
            if name not in self._seen:
                report = local_report(name, _FIRST_WITHIN_S, callbacks=self._with_callbacks)
                self._seen[name] = (report, time.monotonic())

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
