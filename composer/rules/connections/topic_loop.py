"""Subscriptions that republish each other's messages."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context, is_unresolved
from composer.analysis.endpoints.unconnected import diagnostic_location
from composer.analysis.formatting import port_name
from composer.diagnostics import Diagnostic, Label, warning
from composer.model import Event, Port, PortKind, PortOfNode

RULE = warning(
    code="RC326",
    name="topic-loop",
    summary="Subscriptions republish messages in a cycle without a timer or condition.",
    why=(
        "One message circulates forever, as fast as the processor allows, and each further "
        "message adds to the load."
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

#: For each topic, the topics to which its messages are republished, with the subscription.
_Steps = dict[str, dict[str, PortOfNode]]


def check(context: Context) -> Iterator[Diagnostic]:
    """Follow messages from topic to topic; report every cycle once."""
    steps = _steps(context)
    done: set[str] = set()
    for start in steps:
        cycle = _cycle(steps, start, done)
        if cycle:
            yield _diagnostic(cycle)


def _steps(context: Context) -> _Steps:
    steps: _Steps = {}
    for node in context.system.nodes:
        for port in node.ports_of(PortKind.SUBSCRIPTION):
            for target in _republished(node.ports_of(PortKind.PUBLISHER), port):
                if not is_unresolved(port.full_name) and not is_unresolved(target):
                    steps.setdefault(port.full_name, {})[target] = PortOfNode(node, port)
    return steps


def _republished(publishers: tuple[Port, ...], port: Port) -> Iterator[str]:
    reaction = port.reaction(Event.MESSAGE)
    if reaction is None or reaction.when is not None:
        return
    names = {send.port.value for send in reaction.publish}
    yield from (item.full_name for item in publishers if item.name.value in names)


def _cycle(steps: _Steps, start: str, done: set[str]) -> list[tuple[str, PortOfNode]]:
    """Return the first cycle that can be reached from ``start`` through topics not ``done``.

    Each item is a topic and the subscription that republishes to it.
    """
    path: list[str] = []
    steps_taken: list[tuple[str, PortOfNode]] = []
    rest = {start: iter(steps.get(start, {}).items())}
    if start not in done:
        path.append(start)
    while path:
        target, endpoint = next(rest[path[-1]], (None, None))
        if target is None or endpoint is None:
            done.add(path.pop())
            steps_taken = steps_taken[: max(len(path) - 1, 0)]
        elif target in path:
            done.update(path)
            return [*steps_taken[path.index(target) :], (target, endpoint)]
        elif target not in done:
            steps_taken.append((target, endpoint))
            path.append(target)
            rest[target] = iter(steps.get(target, {}).items())
    return []


def _diagnostic(cycle: list[tuple[str, PortOfNode]]) -> Diagnostic:
    names = [topic for topic, _ in cycle]
    path = " -> ".join((names[-1], *names))
    first, *others = [(endpoint, diagnostic_location(endpoint)[0]) for _, endpoint in cycle]
    return Diagnostic(
        RULE,
        f"messages circulate forever: {path}",
        first[1],
        tuple(
            Label(place, f"'{port_name(endpoint)}' republishes them") for endpoint, place in others
        ),
        "publish from a timer, or add a 'when' condition that breaks the cycle",
    )
