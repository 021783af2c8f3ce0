"""One client of the protocol: what it is offered, and what its messages start."""

from __future__ import annotations

import uuid
from collections.abc import Callable
from dataclasses import field

from starlette.websockets import WebSocket

from composer.base.diagnostics import nearest
from composer.base.fast_dataclass import dataclass
from composer.dashboard.context import Dashboard
from composer.dashboard.foxglove.catalog import (
    Catalog,
    CatalogFeed,
    Contents,
    changes,
    graph_update,
)
from composer.dashboard.foxglove.frames import (
    CDR,
    WARNING,
    ClientMessage,
    message_data,
    parse_binary,
    parse_text,
    time_frame,
)
from composer.dashboard.foxglove.link import Link, Running
from composer.dashboard.foxglove.messages import Publications, Subscriptions
from composer.dashboard.foxglove.requests import Parameters, call_service
from composer.dashboard.foxglove.schemas import Schemas
from composer.dashboard.foxglove.topics import ClockFeed
from composer.dashboard.protocol.messages import BadRequestError, RequestError, Values
from composer.dashboard.protocol.outbox import Delivery, Outbox, Update, Waiting

#: Messages of a topic that wait for a client.
_MAX_WAITING = 256
#: The time, among the subscriptions, whose numbers are not negative.
_TIME = -1
_CAPABILITIES = ("parameters", "parametersSubscribe", "connectionGraph")
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
        self._catalog: Running | None = None
        self._clock: Running | None = None
        self._unknown: set[str] = set()
        self._has_graph = False
        self._subscriptions = Subscriptions(self)
        self._publications = Publications(self)
        self._parameters = Parameters(self)
        self._operations: dict[str, Callable[[Values], None]] = {
            "subscribe": lambda values: self._subscriptions.subscribe(values, self._known.channels),
            "unsubscribe": self._subscriptions.unsubscribe,
            "advertise": self._publications.advertise,
            "unadvertise": self._publications.unadvertise,
            "getParameters": self._parameters.read,
            "setParameters": self._parameters.set,
            "subscribeParameterUpdates": self._parameters.subscribe,
            "unsubscribeParameterUpdates": self._parameters.unsubscribe,
            "subscribeConnectionGraph": self._subscribe_graph,
            "unsubscribeConnectionGraph": self._unsubscribe_graph,
        }

    def _begin(self) -> None:
        self._send_info()
        self._catalog = self.start("catalog", CatalogFeed(self._server.catalog), self._on_catalog)

    def _end(self) -> None:
        for running in (self._catalog, self._clock):
            if running is not None:
                self.stop(running)
        self._subscriptions.end()
        self._publications.end()
        self._parameters.end()

    def _take(self, message: str | bytes) -> bool:
        is_valid = False
        try:
            if isinstance(message, bytes):
                frame = parse_binary(message)
                is_valid = True
                if isinstance(frame, ClientMessage):
                    self._publications.publish(frame)
                else:
                    call_service(self, frame, self._known.services)
                return True
            op, values = parse_text(message)
            operation = self._operations.get(op)
            if operation is None:
                close = nearest(op, self._operations)
                hint = f"did you mean '{close}'?" if close else None
                raise BadRequestError(f"there is no operation '{op:.80}'", hint)
            is_valid = True
            operation(values)
        except RequestError as error:
            self._log_refused(error)
            self._refuse(error)
        return is_valid

    def _send_info(self) -> None:
        """Say what is possible; sent again, with the same session, it only replaces that."""
        self.post(
            {
                "op": "serverInfo",
                "name": f"ros2-composer: {self._dashboard.hello.get('title', '')}",
                "capabilities": [
                    *_CAPABILITIES,
                    *(() if self.is_read_only else _CHANGING),
                    *(("time",) if self._known.has_clock else ()),
                ],
                "supportedEncodings": [CDR],
                "metadata": {"ROS_DISTRO": "jazzy"},
                "sessionId": self._server.session_id,
            }
        )

    def _on_catalog(self, update: Update) -> None:
        if update.is_error:
            self.say_error(update)
            return
        before, self._known = self._known, self._server.catalog.current
        self._offer_channels(before)
        if not self.is_read_only:
            self._offer_services(before)
        if self._has_graph:
            self._send_graph(before)
        if self._known.has_clock and self._clock is None:
            self._send_info()
            self._outbox.open(_TIME, "", Delivery.LATEST)
            self._clock = self.start("clock", ClockFeed(), self._on_time)

    def _offer_channels(self, before: Contents) -> None:
        gone, new = changes(before.channels, self._known.channels)
        self._subscriptions.end(gone)
        if gone:
            self.post({"op": "unadvertise", "channelIds": gone})
        if new:
            self.post({"op": "advertise", "channels": [item.as_data() for item in new]})
        self._unknown &= self._known.unknown.keys()
        for type_name, user in self._known.unknown.items():
            if type_name not in self._unknown:
                self._unknown.add(type_name)
                self.say(WARNING, f"'{user}' is left out: its type {type_name} is not installed")

    def _offer_services(self, before: Contents) -> None:
        gone, new = changes(before.services, self._known.services)
        if gone:
            self.post({"op": "unadvertiseServices", "serviceIds": gone})
        if new:
            self.post({"op": "advertiseServices", "services": [item.as_data() for item in new]})

    def _on_time(self, update: Update) -> None:
        if update.is_error:
            self.say_error(update)
        else:
            self._outbox.put(_TIME, update)

    def _subscribe_graph(self, _: Values) -> None:
        if not self._has_graph:
            self._has_graph = True
            self._send_graph(Contents())

    def _unsubscribe_graph(self, _: Values) -> None:
        self._has_graph = False

    def _send_graph(self, before: Contents) -> None:
        update = graph_update(before, self._known)
        if update is not None:
            self.post(update)


def _compose(subscription: int, _: Waiting, update: Update) -> bytes:
    """Return an update as it is sent."""
    assert isinstance(update.data, bytes)  # noqa: S101 - text is sent as a reply
    if subscription == _TIME:
        return time_frame(update.at_ns)
    return message_data(subscription, update.at_ns, update.data)
