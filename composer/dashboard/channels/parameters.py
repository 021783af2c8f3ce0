"""``parameters``: the parameters of a node, with their types, ranges and declarations."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import closing
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from composer.dashboard.declared import Declared
from composer.dashboard.feeds import Feed
from composer.dashboard.protocol.messages import RequestError, Values, from_ros, json_safe, to_json
from composer.dashboard.protocol.outbox import Update
from composer.model.qos import QosProfile

if TYPE_CHECKING:
    from composer.client.shared_session import SampledTopic

_EVENTS = "/parameter_events"
_EVENTS_TYPE = "rcl_interfaces/msg/ParameterEvent"
#: Events that may wait.
_MAX_EVENTS = 1000
_READ_PERIOD_S = 2.0
_READ_WITHIN_S = 3.0


class ParametersFeed(Feed):
    """All parameters of a node, again when one has changed.

    They are read on a worker thread, every two seconds and when the node announces a change.
    """

    period_s = 0.1

    def __init__(self, values: Values, declared: Declared | None) -> None:
        self._node = values.text("node")
        self._declared = {} if declared is None else declared.parameters.get(self._node, {})
        self._events: SampledTopic
        self._lock = threading.Lock()
        self._due_s = 0.0
        self._is_reading = False
        self._found: str | RequestError | None = None
        self._last = ""

    def start(self) -> None:
        """Subscribe to announcements of changes."""
        profile = QosProfile(depth=_MAX_EVENTS)
        self._events = self.ros.session.sample(_EVENTS, _EVENTS_TYPE, profile)
        self.resources.callback(self._events.close)

    def poll(self) -> Iterator[Update]:
        """Yield all parameters if any has changed."""
        events = self._events.take(_MAX_EVENTS)
        now_s = time.monotonic()
        if any(event.content.node == self._node for event in events):
            self._due_s = now_s
        if now_s >= self._due_s and not self._is_reading:
            self._due_s = now_s + _READ_PERIOD_S
            self._is_reading = True
            self.ros.work(self._read)
        with self._lock:
            found, self._found = self._found, None
        if isinstance(found, RequestError):
            raise found
        if found is not None and found != self._last:
            self._last = found
            yield Update(found)

    def _read(self) -> None:
        from composer.client.parameters import ParameterClient
        from composer.client.session import Deadline, RosError

        found: str | RequestError
        try:
            deadline = Deadline(_READ_WITHIN_S)
            with closing(ParameterClient(self.ros.session, deadline, self._node)) as client:
                names = client.names()
                descriptions, values = client.describe(names), client.values(names)
            parameters = [self._parameter(asdict(item), values[item.name]) for item in descriptions]
            found = to_json({"node": client.node, "parameters": parameters})
        except RosError as error:
            found = from_ros(error)
        finally:
            self._is_reading = False
        with self._lock:
            self._found = found

    def _parameter(self, described: dict[str, Any], value: Any) -> dict[str, Any]:
        declared = self._declared.get(described["name"])
        found = {**described, "value": json_safe(value), "unit": ""}
        if declared is None:
            return {**found, "declared": None, "declared_at": None, "choices": None}
        return {
            **found,
            "unit": declared.unit,
            "declared": None if declared.value is None else json_safe(declared.value.value),
            "declared_at": str(declared.span),
            "choices": None if declared.choices is None else json_safe(declared.choices.value),
        }
