"""Publishing rates that follow from declarations."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping

from composer.graph.facts import timer_rate_hz
from composer.model import Node, PortKind, Timer
from composer.python_code.lookup import find_behavior
from composer.python_code.nodes import published_port
from composer.python_code.syntax import Method

#: Statements that may leave a method early.
_EXITS = (ast.Return, ast.Raise, ast.Yield, ast.YieldFrom, ast.Assert)


def publishing_rates_hz(node: Node) -> dict[str, float]:
    """Return, by port, the rate of the one timer that publishes to it each time it fires.

    What a behavior does is read from its text. Ports are left out where it depends on a
    condition, or where several timers or anything else publish to them.
    """
    handlers = _handlers(node)
    rates: dict[str, float] = {}
    for port in node.ports_of(PortKind.PUBLISHER):
        name = port.name.value
        timers = [timer for timer in node.timers if _always_publishes(timer, name, handlers)]
        elsewhere = sum(f"self.publishers.{name}" in _names(method) for method in handlers.values())
        by_handler = sum(timer.reaction is None for timer in timers)
        if len(timers) != 1 or elsewhere != by_handler or _is_answered_with(node, name):
            continue
        hertz = timer_rate_hz(node, timers[0])
        if hertz is not None:
            rates[name] = hertz
    return rates


def _is_answered_with(node: Node, port: str) -> bool:
    """Return whether a reaction to incoming data publishes to the port."""
    return any(
        send.port.value == port
        for other in node.ports
        for _, reaction in other.reactions
        for send in reaction.publish
    )


def _handlers(node: Node) -> dict[str, Method]:
    if node.behavior is None:
        return {}
    return {method.name: method for method in find_behavior(node.behavior).methods}


def _always_publishes(timer: Timer, port: str, handlers: Mapping[str, Method]) -> bool:
    if timer.reaction is not None:
        return timer.reaction.when is None and any(
            send.port.value == port for send in timer.reaction.publish
        )
    handler = handlers.get(f"on_{timer.name.value}")
    return handler is not None and [*_unconditional(handler)].count(port) == 1


def _names(method: Method) -> frozenset[str]:
    """Return the first three parts of the names in a method: ``self.publishers.status``."""
    names = (*(call.name for call in method.calls), *method.mentioned)
    return frozenset(".".join(name.split(".")[:3]) for name in names)


def _unconditional(method: Method) -> Iterator[str]:
    """Yield the ports that unconditional statements publish to, up to the first possible exit."""
    names: dict[ast.expr, str] = {call.node: call.name for call in method.calls}
    for statement in method.node.body if method.node is not None else ():
        if isinstance(statement, ast.Expr):
            port = published_port(names.get(statement.value, ""))
            if port is not None:
                yield port
        elif any(isinstance(inner, _EXITS) for inner in ast.walk(statement)):
            return
