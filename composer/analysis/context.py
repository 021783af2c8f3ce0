"""What a check may look at, each question worked out once for all checks of a run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeVar

from composer.interfaces import Action, Interfaces, Message, Service
from composer.model import Channel, ChannelKind, Port, System, channels
from composer.node_types import NodeTypes
from composer.source import Span

T = TypeVar("T")

_DEFINITIONS = {
    ChannelKind.TOPIC: Message,
    ChannelKind.SERVICE: Service,
    ChannelKind.ACTION: Action,
}


@dataclass(frozen=True, slots=True)
class Context:
    """A system, and what there is to hold it against.

    ``refused`` are the places of the errors that earlier stages found: what they stand in came into
    the model in part or not at all. With ``is_partial`` that may be whole nodes, profiles and
    executors, so that no name is known to be wrong.
    """

    system: System
    interfaces: Interfaces
    node_types: NodeTypes
    refused: tuple[Span, ...] = ()
    is_partial: bool = False
    _answers: dict[Callable[[Context], Any], Any] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    def once(self, question: Callable[[Context], T]) -> T:
        """Return ``question(self)``, worked out by whichever check asks first."""
        if question not in self._answers:
            self._answers[question] = question(self)
        answer: T = self._answers[question]
        return answer

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Every topic, service and action whose name is known, with its ends."""
        return self.once(_channels)

    def interface(self, port: Port) -> Message | Service | Action | None:
        """Return the definition of a port's type; None when it is unknown or of another kind."""
        found = self.interfaces.find(port.interface.value)
        return found if isinstance(found, _DEFINITIONS[port.kind.channel]) else None


def is_opaque(text: str) -> bool:
    """Say whether ``text`` holds a variable that has no value yet, so that nobody may judge it."""
    return "${" in text


def place(span: Span) -> tuple[str, int, int]:
    """Return what tells one place from another, across files."""
    return (span.file.path, span.line, span.column)


def _channels(context: Context) -> tuple[Channel, ...]:
    found = channels(context.system.nodes)
    return tuple(channel for channel in found if not is_opaque(channel.name))
