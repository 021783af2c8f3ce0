"""A transform that nothing broadcasts."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context, is_unresolved
from composer.analysis.earlier_errors import earlier_errors
from composer.diagnostics import Diagnostic, Label, error, suggestion
from composer.model import (
    POSE_TYPES,
    DynamicTransform,
    ImplementationKind,
    Node,
    PortKind,
    StaticTransform,
)

RULE = error(
    code="RC515",
    name="transform-source",
    summary="Nothing broadcasts a declared transform.",
    why=(
        "A dynamic transform comes from a subscription with poses. Without it, or for a static "
        "transform with 'from_code', the node needs code that broadcasts it."
    ),
    bad="""\
system: rover
nodes:
  localization:
    subscriptions: {odometry: {type: nav_msgs/msg/Odometry, qos: sensor_data, external: true}}
    transforms:
      dynamic: {base_link: {parent: odom, from: odometri}}
""",
    good="""\
system: rover
nodes:
  localization:
    subscriptions: {odometry: {type: nav_msgs/msg/Odometry, qos: sensor_data, external: true}}
    transforms:
      dynamic: {base_link: {parent: odom, from: odometry}}
""",
)


_SUBSCRIPTION = PortKind.SUBSCRIPTION


def check(context: Context) -> Iterator[Diagnostic]:
    """Check where the transforms of each node come from."""
    errors = context.once(earlier_errors)
    for node in context.system.nodes:
        if node.transforms is None or not node.complete:
            continue
        if errors.may_declare(node.name.value, _SUBSCRIPTION.section):
            continue
        for static in node.transforms.static:
            if static.from_code:
                yield from _by_code(node, static, "remove 'from_code'")
        for dynamic in node.transforms.dynamic:
            if dynamic.source is None:
                yield from _by_code(node, dynamic, "add 'from' with a subscription")
            elif not is_unresolved(dynamic.source.value):
                yield from _from(node, dynamic, dynamic.source.value)


def _by_code(
    node: Node, declared: StaticTransform | DynamicTransform, hint: str
) -> Iterator[Diagnostic]:
    if node.implementation is ImplementationKind.DECLARATIVE:
        child = declared.child
        message = f"nothing broadcasts the frame '{child}': node '{node.name}' has no code"
        yield Diagnostic(RULE, message, child.span, hint=hint)


def _from(node: Node, declared: DynamicTransform, source: str) -> Iterator[Diagnostic]:
    span = declared.source.span if declared.source is not None else declared.child.span
    subscriptions = node.ports_of(_SUBSCRIPTION)
    port = next((item for item in subscriptions if item.name.value == source), None)
    if node.implementation not in _WITH_SUBSCRIPTIONS:
        message = f"'from' is for nodes of the composer; node '{node.name}' has its own code"
        yield Diagnostic(RULE, message, span, hint="remove it; the declared frame is enough")
    elif port is None:
        names = [item.name.value for item in subscriptions if item.interface.value in POSE_TYPES]
        message = f"'from' names '{source}', which is not a subscription of the node"
        yield Diagnostic(RULE, message, span, hint=suggestion(source, names))
    elif not is_unresolved(port.interface.value) and port.interface.value not in POSE_TYPES:
        message = f"messages of type {port.interface} have no pose with a time"
        label = Label(port.interface.span, "the type of the subscription")
        yield Diagnostic(RULE, message, span, (label,), f"types: {', '.join(POSE_TYPES)}")


_WITH_SUBSCRIPTIONS = (ImplementationKind.DECLARATIVE, ImplementationKind.BEHAVIOR)
