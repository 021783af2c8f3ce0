"""The input of the rules, with a cache for what several rules compute."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import field
from typing import Any, TypeVar

from composer.base.fast_dataclass import dataclass
from composer.base.source import Span
from composer.interfaces import Action, Interfaces, Message, Service
from composer.model import Channel, ChannelKind, Port, System, channels
from composer.project.node_types import NodeTypes

T = TypeVar("T")

_DEFINITIONS = {
    ChannelKind.TOPIC: Message,
    ChannelKind.SERVICE: Service,
    ChannelKind.ACTION: Action,
}


@dataclass(frozen=True, slots=True)
class Context:
    """A system, and the interfaces and node types it can refer to.

    ``refused`` are the spans of the errors that earlier stages reported. What contains them is
    missing from the model, entirely or in part. If ``is_partial``, whole nodes, profiles and
    executors may be missing, so an unknown name may not be an error.
    """

    system: System
    interfaces: Interfaces
    node_types: NodeTypes
    refused: tuple[Span, ...] = ()
    is_partial: bool = False
    _cache: dict[Callable[[Context], Any], Any] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    def once(self, compute: Callable[[Context], T]) -> T:
        """Return ``compute(self)``, computed once per context."""
        if compute not in self._cache:
            self._cache[compute] = compute(self)
        result: T = self._cache[compute]
        return result

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Every topic, service and action whose name is known, with its endpoints."""
        return self.once(_channels)

    @property
    def all_channels(self) -> tuple[Channel, ...]:
        """The same, with the endpoints on /tf and /tf_static that follow from ``transforms``."""
        return self.once(_all_channels)

    def interface(self, port: Port) -> Message | Service | Action | None:
        """Return the definition of a port's type; None if it is unknown or of another kind."""
        found = self.interfaces.find(port.interface.value)
        return found if isinstance(found, _DEFINITIONS[port.kind.channel]) else None


def is_unresolved(text: str) -> bool:
    """Return whether ``text`` contains a variable without a value, so it cannot be checked."""
    return "${" in text


def location(span: Span) -> tuple[str, int, int]:
    """Return the file, line and column of ``span``."""
    return (span.file.path, span.line, span.column)


def _channels(context: Context) -> tuple[Channel, ...]:
    return _known(channels(context.system.nodes))


def _all_channels(context: Context) -> tuple[Channel, ...]:
    return _known(channels(context.system.nodes, with_transforms=True))


def _known(found: Iterable[Channel]) -> tuple[Channel, ...]:
    return tuple(channel for channel in found if not is_unresolved(channel.name))
