"""Different types on one topic, service or action."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.formatting import port_name
from composer.diagnostics import Diagnostic, Label, Rule, Severity, register
from composer.model import Channel, PortOfNode

RULE = register(
    Rule(
        code="RC303",
        name="type-mismatch",
        severity=Severity.ERROR,
        summary="The endpoints of a topic, service or action have different types.",
        why=(
            "DDS does not match endpoints of different types: no data arrives, and no error is "
            "reported."
        ),
        bad="""\
system: types
nodes:
  talker:
    publishers: {speed: {type: std_msgs/msg/Float64, qos: command}}
  listener:
    subscriptions: {speed: {type: std_msgs/msg/Float32, qos: command}}
""",
        good="""\
system: types
nodes:
  talker:
    publishers: {speed: {type: std_msgs/msg/Float64, qos: command}}
  listener:
    subscriptions: {speed: {type: std_msgs/msg/Float64, qos: command}}
""",
    )
)

#: Maximum number of further endpoints with the same wrong type to show.
_SHOWN = 3


def check(context: Context) -> Iterator[Diagnostic]:
    """Compare the types on every channel; report each type other than the most common one."""
    for channel in context.channels:
        yield from _channel(context, channel)


def _channel(context: Context, channel: Channel) -> Iterator[Diagnostic]:
    by_type: dict[str, list[PortOfNode]] = defaultdict(list)
    for endpoint in channel.ends:
        if context.interface(endpoint.port) is not None:
            by_type[endpoint.port.interface.value].append(endpoint)
    if len(by_type) < 2:
        return
    common = max(by_type, key=lambda name: len(by_type[name]))  # the first one in case of a tie
    usual = by_type.pop(common)[0]
    for name, endpoints in by_type.items():
        different = endpoints[0]
        labels = [
            Label(usual.port.interface.span, f"{usual.port.kind} '{port_name(usual)}': {common}")
        ]
        labels += [
            Label(
                endpoint.port.interface.span,
                f"{endpoint.port.kind} '{port_name(endpoint)}' too: {name}",
            )
            for endpoint in endpoints[1 : 1 + _SHOWN]
        ]
        yield Diagnostic(
            RULE,
            f"{different.port.kind} '{port_name(different)}' has type '{name}', "
            f"but {channel.kind} '{channel.name}' has '{common}'",
            different.port.interface.span,
            tuple(labels),
        )
