"""Different types on one topic, service or action."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.endpoints.type_mismatches import (
    TypeMismatch,
    misnamed_connection,
    misnamed_port,
    type_mismatches,
    wrong_connection,
)
from composer.analysis.formatting import port_name
from composer.diagnostics import Diagnostic, Label, error
from composer.model import Endpoint, PortOfNode

RULE = error(
    code="RC303",
    name="type-mismatch",
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

#: Maximum number of further endpoints with the same wrong type to show.
_SHOWN = 3


def check(context: Context) -> Iterator[Diagnostic]:
    """Compare the types on every channel; report each type other than the most common one."""
    for mismatch in context.once(type_mismatches):
        misnamed = misnamed_port(context, mismatch)
        if misnamed is not None:
            yield _of_wrong_port(mismatch, *misnamed)
            continue
        for name, endpoints in mismatch.others.items():
            yield _diagnostic(context, mismatch, name, endpoints)


def _of_wrong_port(mismatch: TypeMismatch, end: Endpoint, meant: str) -> Diagnostic:
    """Report a connection that names the wrong port of a node."""
    channel = mismatch.channel
    wrong = next(
        item
        for item in channel.ends
        if (item.node.name.value, item.port.name.value) == (end.node, end.port)
    )
    own = wrong.port.interface.value
    other = next(item for item in channel.ends if item.port.interface.value != own)
    return Diagnostic(
        RULE,
        f"{wrong.port.kind} '{end.text}' has type '{own}', "
        f"but {channel.kind} '{channel.name}' has '{other.port.interface}'",
        end.text.span,
        (Label(other.port.interface.span, f"the type of {other.port.kind} '{port_name(other)}'"),),
        f"did you mean '{meant}'?",
    )


def _diagnostic(
    context: Context, mismatch: TypeMismatch, name: str, endpoints: list[PortOfNode]
) -> Diagnostic:
    channel, usual, different = mismatch.channel, mismatch.usual, endpoints[0]
    common = usual.port.interface.value
    labels = [Label(usual.port.interface.span, f"{usual.port.kind} '{port_name(usual)}': {common}")]
    labels += [
        Label(
            endpoint.port.interface.span,
            f"{endpoint.port.kind} '{port_name(endpoint)}' too: {name}",
        )
        for endpoint in endpoints[1 : 1 + _SHOWN]
    ]
    primary = different.port.interface.span
    named_twice = misnamed_connection(context, mismatch)
    connected = wrong_connection(context, different, mismatch)
    hint = None
    if named_twice is not None:
        labels.append(Label(primary, f"its type: {name}"))
        primary = named_twice.name.span
        hint = "another connection has the same name"
    elif connected is not None:
        labels.append(Label(primary, f"its type, which fits its node: {name}"))
        primary = connected.text.span
    return Diagnostic(
        RULE,
        f"{different.port.kind} '{port_name(different)}' has type '{name}', "
        f"but {channel.kind} '{channel.name}' has '{common}'",
        primary,
        tuple(labels),
        hint,
    )
