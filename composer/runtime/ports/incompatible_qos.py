"""Ends of a topic that do not meet because their types or their QoS do not go together."""

from __future__ import annotations

from collections.abc import Iterator

from composer.model import Port, PortKind
from composer.qos import incompatibilities
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.ros.endpoints import End, topic_info

_LOOK_EVERY_S = 0.1
_LOOKS = 20


class Misfits:
    """Tells of each node at the other end of a port that the port does not meet, once."""

    def __init__(self, core: NodeContext, port: Port) -> None:
        self._core = core
        self._port = port
        self._told: set[str] = set()
        self._looks_left = 0
        self._closed = False

    def look(self) -> None:
        """Look for them now. The middleware may know of an end before it knows whose it is."""
        is_looking = self._looks_left > 0
        self._looks_left = _LOOKS
        if not is_looking:
            self._look()

    def close(self) -> None:
        """Look no more."""
        self._closed = True

    def _look(self) -> None:
        if self._closed:
            return
        self._looks_left -= 1
        others = self._others()
        if self._looks_left and (not others or any(other.is_nameless for other in others)):
            self._core.loop.call_later(_LOOK_EVERY_S, self._look)
            return
        self._looks_left = 0
        for text in (text for other in others for text in self._objections(other)):
            if text not in self._told:
                self._told.add(text)
                self._core.log.warn(f"{self._port.kind} '{self._port.name}' {text}")

    def _others(self) -> tuple[End, ...]:
        info = topic_info(self._core.node, self._port.full_name, ())
        found = info.subscriptions if self._is_publisher else info.publishers
        return tuple(other for other in found if any(self._objections(other)))

    @property
    def _is_publisher(self) -> bool:
        return self._port.kind is PortKind.PUBLISHER

    def _objections(self, other: End) -> Iterator[str]:
        port = self._port
        meets = "reaches nothing of" if self._is_publisher else "hears nothing of"
        topic = f"{meets} {other.name} on {port.full_name}"
        if other.type != port.interface.value:
            yield f"{topic}: the type there is {other.type}, here {port.interface.value}"
            return
        own = port.qos.profile
        ends = (own, other.qos) if self._is_publisher else (other.qos, own)
        for found in incompatibilities(*ends):
            offered, requested = found.offered, found.requested
            here, there = (offered, requested) if self._is_publisher else (requested, offered)
            yield f"{topic}: {found.policy} is {there} there, {here} here; {found.reason}"
