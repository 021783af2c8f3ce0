"""Different types on one topic, service or action."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.formatting import port_name
from composer.analysis.type_mismatches import TypeMismatch, type_mismatches
from composer.diagnostics import Diagnostic, Label, Rule, Severity, register

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
    for mismatch in context.once(type_mismatches):
        yield from _diagnostics(mismatch)


def _diagnostics(mismatch: TypeMismatch) -> Iterator[Diagnostic]:
    channel, usual = mismatch.channel, mismatch.usual
    common = usual.port.interface.value
    for name, endpoints in mismatch.others.items():
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
