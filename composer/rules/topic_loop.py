"""Messages that make messages for ever."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context, is_opaque
from composer.analysis.wiring import place_of
from composer.analysis.words import end_name
from composer.diagnostics import Diagnostic, Label, Rule, Severity, register
from composer.model import Event, Port, PortKind, PortOfNode

RULE = register(
    Rule(
        code="RC326",
        name="topic-loop",
        severity=Severity.WARNING,
        summary="Subscriptions republish in a circle, with neither timer nor condition in it.",
        why=(
            "The first message goes round as fast as the processor can, for ever, and every "
            "further one besides: a message storm."
        ),
        bad="""\
system: loop
nodes:
  ping:
    subscriptions:
      in: {type: std_msgs/msg/String, qos: command, topic: pong, publish: {out: "{message}"}}
    publishers: {out: {type: std_msgs/msg/String, qos: command, topic: ping}}
  pong:
    subscriptions:
      in: {type: std_msgs/msg/String, qos: command, topic: ping, publish: {out: "{message}"}}
    publishers: {out: {type: std_msgs/msg/String, qos: command, topic: pong}}
""",
        good="""\
system: loop
nodes:
  ping:
    state: {seen: false}
    subscriptions:
      in: {type: std_msgs/msg/String, qos: command, topic: pong, set: {seen: true}}
    publishers: {out: {type: std_msgs/msg/String, qos: command, topic: ping}}
    timers: {tick: {period_ms: 100, when: state.seen, publish: {out: {data: ping}}}}
  pong:
    subscriptions:
      in: {type: std_msgs/msg/String, qos: command, topic: ping, publish: {out: "{message}"}}
    publishers: {out: {type: std_msgs/msg/String, qos: command, topic: pong}}
""",
    )
)

#: For each topic, where its messages are passed on to at once, and by which subscription.
_Steps = dict[str, dict[str, PortOfNode]]


def check(context: Context) -> Iterator[Diagnostic]:
    """Follow messages from topic to topic; every circle is reported once."""
    steps = _steps(context)
    done: set[str] = set()
    for start in steps:
        circle = _circle(steps, start, done)
        if circle:
            yield _finding(circle)


def _steps(context: Context) -> _Steps:
    steps: _Steps = {}
    for node in context.system.nodes:
        for port in node.ports_of(PortKind.SUBSCRIPTION):
            for target in _passes_on(node.ports_of(PortKind.PUBLISHER), port):
                if not is_opaque(port.full_name) and not is_opaque(target):
                    steps.setdefault(port.full_name, {})[target] = PortOfNode(node, port)
    return steps


def _passes_on(publishers: tuple[Port, ...], port: Port) -> Iterator[str]:
    reaction = port.reaction(Event.MESSAGE)
    if reaction is None or reaction.when is not None:
        return
    names = {send.port.value for send in reaction.publish}
    yield from (item.full_name for item in publishers if item.name.value in names)


def _circle(steps: _Steps, start: str, done: set[str]) -> list[tuple[str, PortOfNode]]:
    """Return the first circle that is reached from ``start`` over topics not yet ``done``.

    Each item is a topic and the subscription that passes messages on to it.
    """
    way: list[str] = []
    taken: list[tuple[str, PortOfNode]] = []
    rest = {start: iter(steps.get(start, {}).items())}
    if start not in done:
        way.append(start)
    while way:
        target, end = next(rest[way[-1]], (None, None))
        if target is None or end is None:
            done.add(way.pop())
            taken = taken[: max(len(way) - 1, 0)]
        elif target in way:
            done.update(way)
            return [*taken[way.index(target) :], (target, end)]
        elif target not in done:
            taken.append((target, end))
            way.append(target)
            rest[target] = iter(steps.get(target, {}).items())
    return []


def _finding(circle: list[tuple[str, PortOfNode]]) -> Diagnostic:
    names = [topic for topic, _ in circle]
    way = " -> ".join((names[-1], *names))
    first, *others = [(end, place_of(end)[0]) for _, end in circle]
    return Diagnostic(
        RULE,
        f"messages go round for ever: {way}",
        first[1],
        tuple(Label(place, f"'{end_name(end)}' passes them on") for end, place in others),
        "let a timer publish, or add a 'when' that ends it",
    )
