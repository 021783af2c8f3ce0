"""Nodes whose services are provided by the manager node of their system, as clients see them.

See :mod:`composer.runtime.manager.proxy_services` for the server side.
"""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from typing import TypeAlias

from rclpy.subscription import Subscription
from std_msgs.msg import String

from composer.client.session import Deadline, Session
from composer.client.systems.system_reports import parse_state
from composer.runtime.protocol.codec import ProtocolError
from composer.runtime.protocol.reports import NodeReport
from composer.runtime.protocol.requests import CHANGE_STATE, NAME, STATE_TOPIC
from composer.runtime.ros.manager_interface import STATE_QOS
from composer.runtime.ros_graph.graph import is_valid_name

LIFECYCLE, PARAMETERS = "lifecycle", "parameters"
_SERVICE = f"/{NAME}/{CHANGE_STATE}"
_SERVICE_TYPE = "lifecycle_msgs/srv/ChangeState"
#: Managers publish their last report to each new subscription, and again every second.
_REPORT_WITHIN_S = 2.0
_PRIMARY_STATES = frozenset(("unconfigured", "inactive", "active", "finalized"))

#: The last report of a manager: the nodes without services of their own.
_Report: TypeAlias = dict[str, NodeReport]


class Proxies:
    """The nodes for which managers provide services, as the managers report them."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._reports: dict[str, _Report] = {}  # by the full name of the manager
        self._report_counts: dict[str, int] = {}
        self._subscriptions: dict[str, Subscription] = {}

    def discover(self, deadline: Deadline) -> None:
        """Subscribe to every manager discovered so far, and wait for its first report."""
        known = {
            name.removesuffix(f"/{CHANGE_STATE}")
            for name, types in self._session.graph.services()
            if name.endswith(_SERVICE) and _SERVICE_TYPE in types
        }
        new = known - self._subscriptions.keys()  # wait for each manager only once
        for manager in new:
            self._subscribe(manager)
        limit = Deadline(min(_REPORT_WITHIN_S, deadline.left_s))
        self._session.wait_for(lambda: new <= self._reports.keys() or None, limit)

    def close(self) -> None:
        """Destroy the subscriptions."""
        for subscription in self._subscriptions.values():
            self._session.unsubscribe(subscription)
        self._subscriptions.clear()

    def nodes(self, service: str) -> dict[str, str]:
        """Return the nodes with a proxy for ``service``, with the full names of their managers."""
        return {
            node: manager
            for manager, report in self._reports.items()
            for node, reported in report.items()
            if service in reported.left_to_manager
        }

    def state(self, node: str) -> str:
        """Return the label of the lifecycle state of a node of :meth:`nodes`."""
        return next(report[node].state for report in self._reports.values() if node in report)

    def wait_for_state(self, node: str, before: str | None, deadline: Deadline) -> str:
        """Return the next primary state other than ``before`` that the manager reports."""
        manager = self.nodes(LIFECYCLE)[node]
        count = self._report_counts[manager]

        def is_reported() -> bool | None:
            state = self.state(node)
            is_settled = state in _PRIMARY_STATES and state != before
            return (self._report_counts[manager] > count and is_settled) or None

        self._session.wait_for(is_reported, deadline)
        return self.state(node)

    def _subscribe(self, manager: str) -> None:
        self._subscriptions[manager] = self._session.subscribe(
            String,
            f"{manager}/{STATE_TOPIC}",
            partial(self._on_report, manager),
            STATE_QOS,
        )

    def _on_report(self, manager: str, message: String) -> None:
        self._report_counts[manager] = self._report_counts.get(manager, 0) + 1
        with suppress(ProtocolError):
            nodes = parse_state(manager, message.data).nodes
            self._reports[manager] = {
                node.node: node
                for node in nodes
                if node.left_to_manager and is_valid_name(node.node)
            }
