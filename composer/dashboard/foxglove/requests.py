"""The services that a client calls, and the parameters that it reads and sets."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING

from composer.dashboard.foxglove.catalog import OfferedService
from composer.dashboard.foxglove.frames import CDR, ERROR, ServiceCall, service_response
from composer.dashboard.foxglove.link import Link, Running, error_text
from composer.dashboard.foxglove.parameters import (
    Found,
    ParameterEvents,
    read_all,
    read_setting,
    set_all,
)
from composer.dashboard.protocol.messages import BadRequestError, RequestError, Values
from composer.dashboard.protocol.outbox import Update

if TYPE_CHECKING:
    from composer.client.session import Deadline
    from composer.dashboard.ros_side import RosGraphSide

_CALL_S = 10.0
_PARAMETERS_S = 5.0
_MAX_ITEMS = 10_000


def call_service(link: Link, call: ServiceCall, services: Mapping[int, OfferedService]) -> None:
    """Call a service; the client gets the response, or why there is none."""

    def fail(error: RequestError) -> None:
        content = {"serviceId": call.service, "callId": call.call, "message": error_text(error)}
        link.post({"op": "serviceCallFailure", **content})

    def run(ros: RosGraphSide, deadline: Deadline) -> bytes:
        from composer.client.messages.serialized import call_serialized

        return call_serialized(ros.session, deadline, service.name, service.type, call.data)

    try:
        link.check_may_change("calling services")
        found = services.get(call.service)
        if found is None:
            raise BadRequestError(f"there is no service {call.service}")
        if call.encoding != CDR:
            raise BadRequestError(f"the encoding must be {CDR}, not '{call.encoding:.20}'")
        service = found
        link.request(run, _CALL_S, lambda data: link.post(service_response(call, data)), fail)
    except RequestError as error:
        fail(error)


def _size(names: Iterable[str]) -> int:
    return sum(map(len, names))


class Parameters:
    """The parameters of all nodes, for one client."""

    def __init__(self, link: Link) -> None:
        self._link = link
        self._names: set[str] = set()
        self._has_all = False
        self._events: Running | None = None

    def read(self, values: Values) -> None:
        """Send the parameters that a message requests. Raises RequestError."""
        names = values.texts("parameterNames", _MAX_ITEMS)
        self._request(values.optional_text("id"), lambda ros, limit: read_all(ros, limit, names))

    def set(self, values: Values) -> None:
        """Set parameters as a message requests. Raises RequestError."""
        self._link.check_may_change("setting parameters")
        settings = [read_setting(item) for item in values.items("parameters", _MAX_ITEMS)]
        identifier = values.optional_text("id")
        self._request(
            identifier,
            lambda ros, limit: set_all(ros, limit, settings),
            is_answered=identifier is not None,
        )

    def subscribe(self, values: Values) -> None:
        """Send parameters whenever they change, all without names. Raises RequestError."""
        names = values.texts("parameterNames", _MAX_ITEMS)
        if len(self._names) + len(names) > _MAX_ITEMS:
            raise RequestError("too_many", f"{_MAX_ITEMS} parameters are the limit")
        new = set(names) - self._names
        self._link.outbox.budget.take(_size(new))
        self._names |= new
        self._has_all |= not names
        if self._events is None:
            self._events = self._link.start("parameters", ParameterEvents(), self._on_change)

    def unsubscribe(self, values: Values) -> None:
        """Send parameters no longer, none at all without names. Raises RequestError."""
        names = values.texts("parameterNames", _MAX_ITEMS)
        gone = self._names & set(names) if names else self._names
        self._link.outbox.budget.give(_size(gone))
        self._names -= gone
        self._has_all &= bool(names)
        if not self._names and not self._has_all:
            self.end()

    def end(self) -> None:
        """Receive changes no longer."""
        if self._events is not None:
            self._link.stop(self._events)
            self._events = None

    def _request(
        self,
        identifier: str | None,
        run: Callable[[RosGraphSide, Deadline], Found],
        *,
        is_answered: bool = True,
    ) -> None:
        def done(found: Found) -> None:
            for problem in found.problems:
                self._link.say(ERROR, problem)
            content = {"op": "parameterValues", "parameters": found.parameters}
            if is_answered:
                self._link.post(content if identifier is None else content | {"id": identifier})

        def fail(error: RequestError) -> None:
            self._link.say(ERROR, error_text(error))

        self._link.request(run, _PARAMETERS_S, done, fail)

    def _on_change(self, update: Update) -> None:
        if update.is_error:
            self._link.say_error(update)
            return
        changed = [
            item for item in json.loads(update.data) if self._has_all or item["name"] in self._names
        ]
        if changed:
            self._link.post({"op": "parameterValues", "parameters": changed})
