"""Reports endpoints that do not match a port because of their type or QoS."""

from __future__ import annotations

from collections.abc import Iterator

from composer.model import Port, PortKind
from composer.qos import incompatibilities
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.ros_graph.endpoints import EndpointInfo, topic_info

_CHECK_PERIOD_S = 0.1
_CHECKS = 20
_MAX_REPORTED = 100  # other nodes can be started without end


class IncompatibleQos:
    """Warns once of each node whose endpoint does not match a port."""

    def __init__(self, context: NodeContext, port: Port) -> None:
        self._context = context
        self._port = port
        self._reported: set[str] = set()
        self._checks_left = 0
        self._closed = False

    def check(self) -> None:
        """Check now, and again until the middleware knows the endpoint and its node."""
        is_checking = self._checks_left > 0
        self._checks_left = _CHECKS
        if not is_checking:
            self._check()

    def close(self) -> None:
        """Stop checking."""
        self._closed = True

    def _check(self) -> None:
        if self._closed:
            return
        self._checks_left -= 1
        others = self._incompatible()
        if self._checks_left and (not others or any(other.is_nameless for other in others)):
            self._context.loop.call_later(_CHECK_PERIOD_S, self._check)
            return
        self._checks_left = 0
        for text in (text for other in others for text in self._reasons(other)):
            if text not in self._reported and len(self._reported) < _MAX_REPORTED:
                self._reported.add(text)
                self._context.log.warn(f"{self._port.kind} '{self._port.name}' {text}")

    def _incompatible(self) -> tuple[EndpointInfo, ...]:
        info = topic_info(self._context.node, self._port.full_name, ())
        others = info.subscriptions if self._is_publisher else info.publishers
        return tuple(other for other in others if any(self._reasons(other)))

    @property
    def _is_publisher(self) -> bool:
        return self._port.kind is PortKind.PUBLISHER

    def _reasons(self, other: EndpointInfo) -> Iterator[str]:
        port = self._port
        topic = f"is incompatible with {other.name} on {port.full_name}"
        if other.type != port.interface.value:
            yield f"{topic}: its type is {other.type}, not {port.interface.value}"
            return
        own = port.qos.profile
        profiles = (own, other.qos) if self._is_publisher else (other.qos, own)
        for incompatibility in incompatibilities(*profiles):
            offered, requested = incompatibility.offered, incompatibility.requested
            here, there = (offered, requested) if self._is_publisher else (requested, offered)
            policy, reason = incompatibility.policy, incompatibility.reason
            yield f"{topic}: {policy} is {there} there, {here} here; {reason}"
