"""Managers that answer for nodes without services of their own, as a command meets them.

The other end of :mod:`composer.runtime.manager.proxy_services`.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TypeAlias

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.subscription import Subscription

from composer.remote.session import Deadline, Session
from composer.runtime.ros.manager_protocol import CHANGE_STATE, NAME, STATE_QOS, STATE_TOPIC

LIFECYCLE, PARAMETERS = "lifecycle", "parameters"
_SERVICE = f"/{NAME}/{CHANGE_STATE}"
_SERVICE_TYPE = "lifecycle_msgs/srv/ChangeState"
#: Managers tell at once what they told last, and again each second.
_TOLD_WITHIN_S = 2.0
_PRIMARY_STATES = frozenset(("unconfigured", "inactive", "active", "finalized"))

#: What a manager said last: for each node without ``parameters`` or ``lifecycle`` its values.
_Told: TypeAlias = dict[str, Mapping[str, str]]


class Deputies:
    """What managers tell of the nodes that they answer for."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._told: dict[str, _Told] = {}  # by the manager's full name
        self._times: dict[str, int] = {}
        self._subscriptions: dict[str, Subscription] = {}

    def meet(self, deadline: Deadline) -> None:
        """Listen to every such manager that is known by now, until each has said something."""
        known = {
            name.removesuffix(f"/{CHANGE_STATE}")
            for name, types in self._session.node.get_service_names_and_types()
            if name.endswith(_SERVICE) and _SERVICE_TYPE in types
        }
        new = known - self._subscriptions.keys()  # nobody is waited for twice
        for manager in new:
            self._listen(manager)
        patience = Deadline(min(_TOLD_WITHIN_S, deadline.left_s))
        self._session.wait_for(lambda: new <= self._told.keys() or None, patience)

    def close(self) -> None:
        """Listen no more."""
        for subscription in self._subscriptions.values():
            self._session.node.destroy_subscription(subscription)
        self._subscriptions.clear()

    def nodes(self, what: str) -> dict[str, str]:
        """Return the nodes whose ``what`` is left to their manager, with its full name."""
        return {
            node: manager
            for manager, told in self._told.items()
            for node, values in told.items()
            if what in values["left_to_manager"].split()
        }

    def state(self, node: str) -> str:
        """Return the label of the lifecycle state of a node of :meth:`nodes`."""
        return next(told[node]["state"] for told in self._told.values() if node in told)

    def state_after(self, node: str, before: str | None, deadline: Deadline) -> str:
        """Return the primary state that the manager tells of from now on, but not ``before``."""
        manager = self.nodes(LIFECYCLE)[node]
        heard = self._times[manager]

        def arrived() -> bool | None:
            state = self.state(node)
            at_rest = state in _PRIMARY_STATES and state != before
            return (self._times[manager] > heard and at_rest) or None

        self._session.wait_for(arrived, deadline)
        return self.state(node)

    def _listen(self, manager: str) -> None:
        self._subscriptions[manager] = self._session.node.create_subscription(
            DiagnosticArray, f"{manager}/{STATE_TOPIC}", partial(self._take, manager), STATE_QOS
        )

    def _take(self, manager: str, message: DiagnosticArray) -> None:
        self._times[manager] = self._times.get(manager, 0) + 1
        self._told[manager] = {
            str(status.name).partition(": ")[2]: values
            for status in message.status
            if (values := {item.key: str(item.value) for item in status.values}).get(
                "left_to_manager"
            )
        }
