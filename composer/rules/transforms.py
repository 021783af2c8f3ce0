"""Transforms that nodes declare, broadcast and look up."""

from __future__ import annotations

import math
from collections.abc import Iterator

from composer.base.diagnostics import Diagnostic, Label, error, suggestion
from composer.base.source import Located, Span
from composer.language.templates import Constant, Items, Record, Template, Text
from composer.model import (
    POSE_TYPES,
    DynamicTransform,
    ImplementationKind,
    Node,
    PortKind,
    StaticTransform,
    Transforms,
)
from composer.model.transforms import is_unit, normalized
from composer.python_code.problems import Family
from composer.rules.analysis.context import Context, is_unresolved
from composer.rules.analysis.expressions import message_templates
from composer.rules.analysis.formatting import number
from composer.rules.analysis.frames import BROADCAST, FrameUse, place, uses_of_behaviors
from composer.rules.analysis.subjects import earlier_errors
from composer.rules.timing import UNLIKELY_UNIT

FRAME_ID_SLASH = Family.FRAME.value
TRANSFORM_SOURCE = error("RC515", "transform-source")
INVALID_QUATERNION = error("RC516", "invalid-quaternion")
UNDECLARED_TRANSFORM = error("RC517", "undeclared-transform")

_SUBSCRIPTION = PortKind.SUBSCRIPTION
_WITH_SUBSCRIPTIONS = (ImplementationKind.DECLARATIVE, ImplementationKind.BEHAVIOR)
_FULL_TURN = 2.0 * math.pi
_TOLERANCE = 1.001
_FIELDS = frozenset({"frame_id", "child_frame_id"})


def check_transform_source(context: Context) -> Iterator[Diagnostic]:
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
                yield from _from_subscription(node, dynamic, dynamic.source.value)


def _by_code(
    node: Node, declared: StaticTransform | DynamicTransform, hint: str
) -> Iterator[Diagnostic]:
    if node.implementation is ImplementationKind.DECLARATIVE:
        child = declared.child
        message = f"nothing broadcasts the frame '{child}': node '{node.name}' has no code"
        keys = ("from", "from_code", "translation_m", "rotation_deg", "rotation_rad", "quaternion")
        given = tuple(("key", key) for key in keys)
        yield Diagnostic(TRANSFORM_SOURCE, message, child.span, hint=hint, relies_on=given)


def _from_subscription(node: Node, declared: DynamicTransform, source: str) -> Iterator[Diagnostic]:
    span = declared.source.span if declared.source is not None else declared.child.span
    subscriptions = node.ports_of(_SUBSCRIPTION)
    port = next((item for item in subscriptions if item.name.value == source), None)
    if node.implementation not in _WITH_SUBSCRIPTIONS:
        message = f"'from' is for nodes of the composer; node '{node.name}' has its own code"
        yield Diagnostic(
            TRANSFORM_SOURCE, message, span, hint="remove it; the declared frame is enough"
        )
    elif port is None:
        names = [item.name.value for item in subscriptions if item.interface.value in POSE_TYPES]
        message = f"'from' names '{source}', which is not a subscription of the node"
        yield Diagnostic(TRANSFORM_SOURCE, message, span, hint=suggestion(source, names))
    elif not is_unresolved(port.interface.value) and port.interface.value not in POSE_TYPES:
        message = f"messages of type {port.interface} have no pose with a time"
        label = Label(port.interface.span, "the type of the subscription")
        yield Diagnostic(
            TRANSFORM_SOURCE, message, span, (label,), f"types: {', '.join(POSE_TYPES)}"
        )


def check_undeclared_transform(context: Context) -> Iterator[Diagnostic]:
    """Compare the calls of ``self.transforms`` with what the node declares."""
    errors = context.once(earlier_errors)
    for node, use in context.once(uses_of_behaviors):
        if not node.complete or errors.may_declare(node.name.value, "transforms"):
            continue
        if use.method != BROADCAST:
            yield from _lookup(node, use)
            continue
        for frame in use.frames:
            yield from _broadcast(node, frame)


def _lookup(node: Node, use: FrameUse) -> Iterator[Diagnostic]:
    if node.transforms is not None and node.transforms.lookup is not None:
        return
    message = f"'{use.method}' needs 'transforms' with 'lookup', which node '{node.name}' lacks"
    names = ", ".join(dict.fromkeys(frame.value for frame in use.frames))
    span, labels = place(node, Located(use.method, use.span))
    yield Diagnostic(
        UNDECLARED_TRANSFORM, message, span, labels, f"add 'transforms: {{lookup: [{names}]}}'"
    )


def _broadcast(node: Node, frame: Located[str]) -> Iterator[Diagnostic]:
    declared = node.transforms.broadcasts if node.transforms is not None else ()
    known = {item.child.value: item for item in declared}
    span, labels = place(node, frame)
    found = known.get(frame.value)
    if found is None:
        message = f"node '{node.name}' does not declare the frame '{frame}'"
        hint = suggestion(frame.value, known) or "declare it under 'transforms: {dynamic: ...}'"
        yield Diagnostic(UNDECLARED_TRANSFORM, message, span, labels, hint)
    elif not _is_from_code(found):
        message = f"the declaration broadcasts the frame '{frame}' already"
        label = Label(found.child.span, "declared here")
        change = "remove 'from'"
        if isinstance(found, StaticTransform):
            values = " instead of the values" if found.values is not None else ""
            change = f"write 'from_code: true'{values}"
        hint = f"{change} there, or do not broadcast it here"
        yield Diagnostic(UNDECLARED_TRANSFORM, message, span, (*labels, label), hint)


def _is_from_code(declared: StaticTransform | DynamicTransform) -> bool:
    if isinstance(declared, DynamicTransform):
        return declared.source is None
    return declared.from_code


def check_invalid_quaternion(context: Context) -> Iterator[Diagnostic]:
    """Check the rotations of static transforms."""
    for node in context.system.nodes:
        for static in node.transforms.static if node.transforms is not None else ():
            if static.values is None or is_unit(static.values.value.rotation):
                continue
            rotation = static.values.value.rotation
            message = f"the quaternion of frame '{static.child}' is not of length 1"
            hint = "use 'rotation_deg' or 'rotation_rad'"
            if any(rotation):
                names = ("x", "y", "z", "w")
                unit = zip(names, normalized(rotation), strict=True)
                hint = f"write {{{', '.join(f'{name}: {value:.5g}' for name, value in unit)}}}"
            yield Diagnostic(INVALID_QUATERNION, message, static.values.span, hint=hint)


def check_rotation_unit(context: Context) -> Iterator[Diagnostic]:
    """Check the angles of static transforms, once for each node type."""
    for node in context.system.nodes:
        for static in node.transforms.static if node.transforms is not None else ():
            for angle in static.angles_rad:
                if abs(angle.value) > _FULL_TURN * _TOLERANCE:
                    yield Diagnostic(
                        UNLIKELY_UNIT,
                        f"{number(angle.value)} rad is more than a full turn",
                        angle.span,
                        hint="write degrees in 'rotation_deg'",
                    )


def check_frame_id_slash(context: Context) -> Iterator[Diagnostic]:
    """Check the frame IDs in messages, transforms and behaviors, and in parameters for them."""
    for template, _ in context.once(message_templates):
        yield from _slashes_in_template(template)
    for node in context.system.nodes:
        for parameter in node.parameters:
            value = parameter.value
            if value is not None and parameter.name.value.endswith(tuple(_FIELDS)):
                yield from _slash(value.value, value.span)
        if node.transforms is not None:
            for frame in _declared_frames(node.transforms):
                yield from _slash(frame.value, frame.span)
    for _, use in context.once(uses_of_behaviors):
        for frame in use.frames:
            yield from _slash(frame.value, frame.span)


def _declared_frames(transforms: Transforms) -> Iterator[Located[str]]:
    for item in transforms.broadcasts:
        yield item.child
        yield item.parent
    if transforms.lookup is not None:
        yield from transforms.lookup.value


def _slashes_in_template(template: Template) -> Iterator[Diagnostic]:
    match template:
        case Record(fields=fields):
            for name, content in fields:
                if name.value in _FIELDS:
                    yield from _slash_in_field(content)
                yield from _slashes_in_template(content)
        case Items(items=items):
            for item in items:
                yield from _slashes_in_template(item)
        case _:
            return


def _slash_in_field(content: Template) -> Iterator[Diagnostic]:
    match content:
        case Constant(value=value, span=span):
            yield from _slash(value, span)
        case Text(parts=[str() as first, *_], span=span):
            yield from _slash(first, span)
        case _:
            return


def _slash(value: object, span: Span) -> Iterator[Diagnostic]:
    if isinstance(value, str) and value.startswith("/"):
        yield Diagnostic(
            FRAME_ID_SLASH, f"frame ID '{value}' begins with a slash", span, hint="remove the slash"
        )
