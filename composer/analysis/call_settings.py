"""Settings of callbacks and calls, which some kinds of nodes cannot have."""

from __future__ import annotations

from collections.abc import Iterator

from composer.model import Node, Port
from composer.source import Span


def callback_settings(node: Node) -> Iterator[tuple[str, Span]]:
    """Yield what a node or its type declares that only callbacks of a behavior use."""
    for timer in node.timers:
        yield f"timer '{timer.name}'", timer.span
    for name, _ in node.state:
        yield f"state '{name}'", name.span
    for event, reaction in node.reactions:
        yield f"'on_{event}'", reaction.span
    for port in node.ports:
        for event, reaction in port.reactions:
            yield f"the reaction of {port.kind} '{port.name}' to its {event}", reaction.span
        if port.result is not None or port.feedback is not None or port.accept is not None:
            yield f"the reaction of {port.kind} '{port.name}'", port.span
        yield from _call_limits(port)


def _call_limits(port: Port) -> Iterator[tuple[str, Span]]:
    """Yield the limits that a client port sets, as text and place."""
    limits = (("timeout_ms", port.timeout_ms), ("result_timeout_ms", port.result_timeout_ms))
    for name, located in limits:
        if located is not None and located.span != port.span:  # that of the default
            yield f"'{name}' of {port.kind} '{port.name}'", located.span
