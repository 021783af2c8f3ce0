"""One client of the protocol: what it is offered, and what its messages start."""

from __future__ import annotations

import uuid
from collections.abc import Callable
from dataclasses import field
from functools import partial
from typing import TYPE_CHECKING, Any

from starlette.websockets import WebSocket

from composer.base.fast_dataclass import dataclass
from composer.dashboard.context import Dashboard
from composer.dashboard.foxglove.catalog import Catalog, CatalogFeed, Contents, changes
from composer.dashboard.foxglove.encoding import (
    CDR,
    WARNING,
    ClientMessage,
    Schemas,
    ServiceCall,
    message_data,
    parse_binary,
    parse_text,
    service_response,
    time_frame,
)
from composer.dashboard.foxglove.messages import (
    ClockFeed,
    Link,
    Publications,
    Subscriptions,
    error_text,
)
from composer.dashboard.protocol.messages import BadRequestError, RequestError, Values, unknown
from composer.dashboard.protocol.outbox import Delivery, Outbox, Update, Waiting
from composer.dashboard.web.client import End

if TYPE_CHECKING:
    from composer.client.session import Deadline
    from composer.dashboard.observing.ros_graph import RosGraph

_CALL_S = 10.0
#: Messages of a topic that wait for a client.
_MAX_WAITING = 256
#: The time, among the subscriptions, whose numbers are not negative.
_TIME = -1
_CHANGING = ("clientPublish", "services")


@dataclass(frozen=True)
class FoxgloveServer:
    """What all clients of the protocol share."""

    dashboard: Dashboard
    catalog: Catalog
    session_id: str = field(default_factory=lambda: uuid.uuid4().hex)

    @classmethod
    def of(cls, dashboard: Dashboard) -> FoxgloveServer:
        """Return the server of a dashboard."""
        return cls(dashboard, Catalog(Schemas(dashboard.interfaces)))


class FoxgloveConnection(Link):
    """The connection of one client."""

    def __init__(self, server: FoxgloveServer, socket: WebSocket) -> None:
        super().__init__(server.dashboard, socket, Outbox(_compose, _MAX_WAITING))
        self._server = server
        self._known = Contents()
        self._end_catalog: End | None = None
        self._end_clock: End | None = None
        self._unknown: set[str] = set()
        self._subscriptions = Subscriptions(self)
        self._publications = Publications(self)
        self._operations: dict[str, Callable[[Values], None]] = {
            "subscribe": lambda values: self._subscriptions.subscribe(values, self._known.channels),
            "unsubscribe": self._subscriptions.unsubscribe,
            "advertise": self._publications.advertise,
            "unadvertise": self._publications.unadvertise,
        }

    def _begin(self) -> None:
        self._send_info()
        catalog = CatalogFeed(self._server.catalog)
        self._end_catalog = self.follow("catalog", catalog, self._on_catalog)

    def _end(self) -> None:
        for end in filter(None, (self._end_catalog, self._end_clock)):
            end()
        self._subscriptions.end()
        self._publications.end()

    def _take(self, message: str | bytes) -> bool:
        is_valid = False
        try:
            if isinstance(message, bytes):
                frame = parse_binary(message)
                is_valid = True
                if isinstance(frame, ClientMessage):
                    self._publications.publish(frame)
                else:
                    self._call_service(frame)
                return True
            op, values = parse_text(message)
            operation = self._operations.get(op)
            if operation is None:
                raise unknown("operation", op, self._operations)
            is_valid = True
            operation(values)
        except RequestError as error:
            self._log_refused(error)
            self.refuse(error)
        return is_valid

    def _call_service(self, call: ServiceCall) -> None:
        """Call a service; the client gets the response, or why there is none."""

        def fail(error: RequestError) -> None:
            content = {"serviceId": call.service, "callId": call.call, "message": error_text(error)}
            self.post({"op": "serviceCallFailure", **content})

        def run(ros: RosGraph, deadline: Deadline) -> bytes:
            from composer.client.messages.topics import call_serialized

            return call_serialized(ros.session, deadline, service.name, service.type, call.data)

        try:
            self.check_may_change("calling services")
            found = self._known.services.get(call.service)
            if found is None:
                raise BadRequestError(f"there is no service {call.service}")
            if call.encoding != CDR:
                raise BadRequestError(f"the encoding must be {CDR}, not '{call.encoding:.20}'")
            service = found
            self.request(run, _CALL_S, lambda data: self.post(service_response(call, data)), fail)
        except RequestError as error:
            fail(error)

    def _send_info(self) -> None:
        """Say what is possible; sent again, with the same session, it only replaces that."""
        self.post(
            {
                "op": "serverInfo",
                "name": f"ros2-composer: {self._dashboard.title}",
                "capabilities": [
                    *(() if self.is_read_only else _CHANGING),
                    *(("time",) if self._known.has_clock else ()),
                ],
                "supportedEncodings": [CDR],
                "metadata": {"ROS_DISTRO": "jazzy"},
                "sessionId": self._server.session_id,
            }
        )

    def _on_catalog(self, _: Update) -> None:
        before, self._known = self._known, self._server.catalog.current
        self._offer_channels(before)
        if not self.is_read_only:
            self._offer_services(before)
        if self._known.has_clock and self._end_clock is None:
            self._send_info()
            self._outbox.open(_TIME, "", Delivery.LATEST)
            send = partial(self._outbox.put, _TIME)
            self._end_clock = self.follow("clock", ClockFeed(), send)

    def _offer_channels(self, before: Contents) -> None:
        gone, new = changes(before.channels, self._known.channels)
        self._subscriptions.end(gone)
        self._post_some("unadvertise", "channelIds", gone)
        self._post_some("advertise", "channels", [item.as_data() for item in new])
        self._unknown &= self._known.unknown.keys()
        for type_name, user in self._known.unknown.items():
            if type_name not in self._unknown:
                self._unknown.add(type_name)
                self.say(WARNING, f"'{user}' is left out: its type {type_name} is not installed")

    def _offer_services(self, before: Contents) -> None:
        gone, new = changes(before.services, self._known.services)
        self._post_some("unadvertiseServices", "serviceIds", gone)
        self._post_some("advertiseServices", "services", [item.as_data() for item in new])

    def _post_some(self, op: str, key: str, items: list[Any]) -> None:
        if items:
            self.post({"op": op, key: items})


def _compose(subscription: int, _: Waiting, update: Update) -> bytes:
    """Return an update as it is sent."""
    assert isinstance(update.data, bytes)  # noqa: S101 - text is sent as a reply
    if subscription == _TIME:
        return time_frame(update.at_ns)
    return message_data(subscription, update.at_ns, update.data)
